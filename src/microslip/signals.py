"""Load signals in time: sines, stepped and swept, and measured ones from a file.

Every function returns ``(time, load)``, equally spaced by ``dt`` from 0, in SI units. All sines
start at zero and keep a continuous phase

    load(t) = A sin(phase(t)),     phase' = 2 pi f(t)
"""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from microslip.errors import InputError
from microslip.units import LINE_MOMENT, TIME, Kind

Array = NDArray[np.float64]

LONGEST_GAP = 10.0
"""An interval of more than so many median intervals is a gap."""

_HEADER = re.compile(r"\s*(?P<name>[^\[\]]+?)\s*\[\s*(?P<unit>[^\[\]]+?)\s*\]\s*")


def harmonic(amplitude: float, frequency: float, cycles: float, dt: float) -> tuple[Array, Array]:
    """Sine of constant frequency.

    Parameters
    ----------
    amplitude : float
        A, in the unit of the load.
    frequency : float
        Hz, > 0.
    cycles : float
        How many periods, > 0; the signal ends at the last multiple of `dt` in them.
    dt : float
        Step, s.

    Examples
    --------
    >>> time, load = harmonic(2.0, 1.0, 1.0, 0.25)
    >>> np.round(load, 12).tolist()
    [0.0, 2.0, 0.0, -2.0, -0.0]
    """
    _positive(frequency=frequency, cycles=cycles, dt=dt)
    time = _times(cycles / frequency, dt)
    return time, amplitude * np.sin(2 * np.pi * frequency * time)


def stepped_sine(
    amplitude: float, frequencies: Sequence[float] | Array, cycles: float, dt: float
) -> tuple[Array, Array]:
    """Sine that dwells for `cycles` periods at each frequency in turn, without a jump of phase.

    Parameters
    ----------
    amplitude : float
    frequencies : sequence of float
        Hz, each > 0.
    cycles : float
        Periods at each frequency, > 0.
    dt : float
        Step, s.
    """
    f = np.atleast_1d(np.asarray(frequencies, dtype=float))
    if f.ndim != 1 or len(f) == 0:
        raise InputError("stepped sine needs at least one frequency")
    _positive(frequency=float(np.min(f)), cycles=cycles, dt=dt)
    if not np.isfinite(f).all():
        raise InputError("frequencies must be finite")
    switch = np.concatenate([[0.0], np.cumsum(cycles / f)])
    time = _times(float(switch[-1]), dt)
    # a sine of n periods each: the phase is linear between the switches
    phase = np.interp(time, switch, 2 * np.pi * cycles * np.arange(len(switch)))
    return time, amplitude * np.sin(phase)


def swept_sine(
    amplitude: float,
    start: float,
    stop: float,
    duration: float,
    dt: float,
    law: str = "linear",
) -> tuple[Array, Array]:
    """Sine whose frequency runs from `start` to `stop`.

    ``f = f_0 + (f_1 - f_0) t/T`` (linear) or ``f = f_0 (f_1/f_0)^{t/T}`` (log); the phase is the
    closed-form integral.

    Parameters
    ----------
    amplitude : float
    start, stop : float
        Hz, > 0; downward sweeps are allowed.
    duration : float
        T, s.
    dt : float
        Step, s.
    law : {"linear", "log"}
    """
    _positive(start=start, stop=stop, duration=duration, dt=dt)
    if law not in ("linear", "log"):
        raise InputError(f"sweep {law!r} is not known: use 'linear' or 'log'")
    time = _times(duration, dt)
    if law == "linear" or start == stop:
        turns = start * time + (stop - start) * time**2 / (2 * duration)
    else:
        rate = np.log(stop / start) / duration
        turns = start * np.expm1(rate * time) / rate
    return time, amplitude * np.sin(2 * np.pi * turns)


def read_signal(path: str | Path, dt: float, kind: Kind = LINE_MOMENT) -> tuple[Array, Array]:
    """Read a measured load and resample it linearly to the step.

    The file is CSV with one header line that names a quantity and its unit twice, time first:

        time [ms], moment [N*m/m]

    Parameters
    ----------
    path : str or Path
    dt : float
        Step of the result, s. Time starts at the first sample, which becomes 0.
    kind : Kind
        What the second column measures.

    Returns
    -------
    time, load : arrays
        SI units.

    Raises
    ------
    InputError
        Where the file is missing, has no such header or a unit of something else, has fewer than
        two rows, a value that is not a finite number, times that do not increase, or a gap of
        more than ten median intervals. Names the file and the line.
    """
    _positive(dt=dt)
    file = Path(path)
    try:
        with file.open(newline="", encoding="utf-8-sig") as stream:
            rows = [
                (n, row) for n, row in enumerate(csv.reader(stream), 1) if any(map(str.strip, row))
            ]
    except OSError as error:
        raise InputError(f"signal {file}: cannot be read ({error.strerror or error})") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"signal {file}: is not a CSV text file ({error})") from error
    if not rows:
        raise InputError(f"signal {file}: is empty")
    factors = _factors(file, *rows[0], kind)
    if len(rows) < 3:
        raise InputError(f"signal {file}: has {len(rows) - 1} rows of data, at least 2 are needed")
    lines = [line for line, _ in rows[1:]]
    values = np.array([_numbers(file, line, row) for line, row in rows[1:]]) * factors
    return _resample(file, lines, values[:, 0], values[:, 1], dt)


def _factors(file: Path, line: int, header: list[str], kind: Kind) -> Array:
    """Factor to SI of each column of the header."""
    example = f"'time [s], moment [{kind.unit}]'"
    if len(header) != 2:
        raise InputError(
            f"signal {file}, line {line}: has {len(header)} columns, expected two as in {example}"
        )
    factors = []
    for text, expected in zip(header, (TIME, kind), strict=True):
        found = _HEADER.fullmatch(text)
        if found is None:
            raise InputError(
                f"signal {file}, line {line}: {text.strip()!r} does not say its unit; "
                f"write the header as in {example}"
            )
        try:
            factors.append(expected.parse(f"1 {found['unit']}"))
        except ValueError as error:
            raise InputError(f"signal {file}, line {line}, {found['name']}: {error}") from error
    return np.array(factors)


def _numbers(file: Path, line: int, row: list[str]) -> list[float]:
    if len(row) != 2:
        raise InputError(f"signal {file}, line {line}: has {len(row)} columns instead of two")
    numbers = []
    for text in row:
        try:
            number = float(text)
        except ValueError:
            raise InputError(f"signal {file}, line {line}: {text!r} is not a number") from None
        if not np.isfinite(number):
            raise InputError(f"signal {file}, line {line}: {text.strip()!r} is not finite")
        numbers.append(number)
    return numbers


def _resample(
    file: Path, lines: list[int], time: Array, load: Array, dt: float
) -> tuple[Array, Array]:
    interval = np.diff(time)
    if not (interval > 0).all():
        k = int(np.argmin(interval > 0))
        raise InputError(
            f"signal {file}, line {lines[k + 1]}: time {time[k + 1]:.9g} s does not come after "
            f"{time[k]:.9g} s; sort the rows and remove repeated times"
        )
    usual = float(np.median(interval))
    if interval.max() > LONGEST_GAP * usual:
        k = int(np.argmax(interval))
        raise InputError(
            f"signal {file}, line {lines[k + 1]}: a gap of {interval[k]:.4g} s after "
            f"{time[k]:.9g} s, where {usual:.4g} s is usual; fill it or cut the signal there"
        )
    samples = _times(float(time[-1] - time[0]), dt)
    if len(samples) < 2:
        raise InputError(
            f"signal {file}: lasts {time[-1] - time[0]:.4g} s, shorter than one step of {dt:.4g} s"
        )
    return samples, np.interp(samples, time - time[0], load)


def _times(duration: float, dt: float) -> Array:
    """Multiples of dt up to the duration, rounding errors of the quotient forgiven."""
    count = int(np.floor(duration / dt * (1 + 1e-12) + 1e-9)) + 1
    return np.arange(count, dtype=float) * dt


def _positive(**values: float) -> None:
    for name, value in values.items():
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"{name} is {value:g}: it must be positive and finite")
