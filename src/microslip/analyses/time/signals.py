"""Load signals in time: sines, stepped and swept, and measured ones from a file.

Every function returns ``(time, load)``, equally spaced by ``dt`` from 0, in SI units. All sines
start at zero and keep a continuous phase

    load(t) = A sin(phase(t)),     phase' = 2 pi f(t)
"""

from __future__ import annotations

import csv
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from microslip.brief import Brief
from microslip.describe.excitation import is_universal
from microslip.describe.units import LINE_MOMENT, TIME, Kind
from microslip.errors import InputError
from microslip.typing import Array

LONGEST_GAP = 10.0
"""An interval of more than so many median intervals is a gap."""

MOST_STEPS = 5_000_000
"""Longer signals are a slip of the pen."""

_HEADER = re.compile(r"\s*(?P<name>[^\[\]]+?)\s*\[\s*(?P<unit>[^\[\]]+?)\s*\]\s*")


def silence(duration: float, dt: float) -> tuple[Array, Array]:
    """No load for so many seconds."""
    _positive(duration=duration, dt=dt)
    time = _times(duration, dt)
    return time, np.zeros_like(time)


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


def read_signal(
    path: str | Path,
    dt: float,
    kind: Kind = LINE_MOMENT,
    *,
    column: str | None = None,
    dataset: int | None = None,
    unit: str | None = None,
) -> tuple[Array, Array]:
    """Read a measured load and resample it linearly to the step.

    Either CSV with one header line that names quantities and their units, time first,

        time [ms], moment [N*m/m]

    or a universal file with real, evenly spaced functions of time (dataset 58, text or binary).

    Parameters
    ----------
    path : str or Path
    dt : float
        Step of the result, s. Time starts at the first sample, which becomes 0.
    kind : Kind
        What the signal measures.
    column : str, optional
        Name of the column to take, as in the header without its unit; needed where a CSV file has
        more than two.
    dataset : int, optional
        Which of the datasets 58 of a universal file to take, from 1; needed where it has more.
    unit : str, optional
        Unit of the signal, where the file does not say it; it outranks the file.

    Returns
    -------
    time, load : arrays
        SI units.

    Raises
    ------
    InputError
        Where the file is missing or not of its format, has no such column or dataset, a unit of
        something else, fewer than two samples, a value that is not a finite number, times that do
        not increase, or a gap of more than ten median intervals. Names the file and the place.
    """
    _positive(dt=dt)
    file = Path(path)
    if is_universal(file):
        samples = _read_universal(file, kind, dataset, unit)
    else:
        samples = _read_csv(file, kind, column, unit)
    return _resample(file, samples, dt)


@dataclass(frozen=True, repr=False)
class _Samples(Brief):
    """Samples as the file has them, in SI units, and what to call the place of each."""

    time: Array
    load: Array
    places: Sequence[str]


def _read_csv(file: Path, kind: Kind, column: str | None, unit: str | None) -> _Samples:
    try:
        with file.open(newline="", encoding="utf-8-sig") as stream:
            rows = [
                (n, row) for n, row in enumerate(csv.reader(stream), 1) if any(map(str.strip, row))
            ]
    except OSError as error:
        raise InputError(f"signal {file}: cannot be read ({error.strerror or error})") from error
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"signal {file}: is not a CSV text file in UTF-8") from error
    if not rows:
        raise InputError(f"signal {file}: is empty")
    line, header = rows[0]
    chosen = _chosen_column(file, line, header, kind, column)
    factors = [
        _factor(file, line, header[0], TIME, None, kind),
        _factor(file, line, header[chosen], kind, unit, kind),
    ]
    if len(rows) < 3:
        raise InputError(f"signal {file}: has {len(rows) - 1} rows of data, at least 2 are needed")
    values = np.array(
        [_numbers(file, n, row, len(header), chosen) for n, row in rows[1:]]
    ) * np.array(factors)
    return _Samples(values[:, 0], values[:, 1], [f"line {n}" for n, _ in rows[1:]])


def _example(kind: Kind) -> str:
    return f"'time [s], moment [{kind.unit}]'"


def _chosen_column(file: Path, line: int, header: list[str], kind: Kind, column: str | None) -> int:
    """Place of the wanted column; the first one is time."""
    where = f"signal {file}, line {line}"
    if len(header) < 2:
        raise InputError(
            f"{where}: has {len(header)} columns, expected two or more as in {_example(kind)}"
        )
    names = [text.partition("[")[0].strip() for text in header]
    if column is None:
        if len(header) > 2:
            raise InputError(f"{where}: choose the column: one of {', '.join(names[1:])}")
        return 1
    if column not in names[1:]:
        raise InputError(f"{where}: has no column {column!r}; there are {', '.join(names[1:])}")
    return names.index(column, 1)


def _factor(
    file: Path, line: int, text: str, expected: Kind, unit: str | None, kind: Kind
) -> float:
    """Factor to SI of one column of the header."""
    found = _HEADER.fullmatch(text)
    if found is None and unit is None:
        raise InputError(
            f"signal {file}, line {line}: {text.strip()!r} does not say its unit; "
            f"write the header as in {_example(kind)}"
        )
    name = found["name"] if found is not None else text.strip()
    return _factor_of(
        unit or (found["unit"] if found else ""), expected, f"{file}, line {line}, {name}"
    )


def _factor_of(unit: str, expected: Kind, where: str) -> float:
    try:
        return expected.parse(f"1 {unit}")
    except ValueError as error:
        raise InputError(f"signal {where}: {error}") from error


def _numbers(file: Path, line: int, row: list[str], columns: int, chosen: int) -> list[float]:
    """Time and value of one row."""
    if len(row) != columns:
        count = "two" if columns == 2 else str(columns)
        raise InputError(f"signal {file}, line {line}: has {len(row)} columns instead of {count}")
    numbers: list[float] = []
    for text in (row[0], row[chosen]):
        at = f" (time {row[0].strip()})" if numbers else ""
        try:
            number = float(text)
        except ValueError:
            raise InputError(f"signal {file}, line {line}{at}: {text!r} is not a number") from None
        if not np.isfinite(number):
            raise InputError(f"signal {file}, line {line}{at}: {text.strip()!r} is not finite")
        numbers.append(number)
    return numbers


# Universal files: dataset 58 through pyuff.

_FUNCTION = 58
_GENERAL, _TIME_RESPONSE = (0, 1)
"""Function types of dataset 58 that are signals in time; others are spectra, responses ..."""
_TIME_AXIS = (0, 17)
"""Abscissa of unknown kind, or time."""
_COMPLEX = (5, 6)


def _read_universal(file: Path, kind: Kind, dataset: int | None, unit: str | None) -> _Samples:
    import pyuff

    if not file.is_file():
        raise InputError(f"signal {file}: cannot be read (no such file)")
    try:
        content = pyuff.UFF(str(file))
        content.refresh()
        types = [int(t) for t in content.get_set_types()] if content.get_n_sets() else []
        places = [k for k, t in enumerate(types) if t == _FUNCTION]
        chosen = _chosen_dataset(file, types, places, dataset)
        found = content.read_sets(places[chosen - 1])
    except InputError:
        raise
    except Exception as error:  # pyuff raises plain exceptions for whatever it cannot parse
        raise InputError(
            f"signal {file}: is not a universal file that can be read; dataset 58, text or binary, "
            "is expected"
        ) from error
    where = f"{file}, dataset 58 number {chosen}"
    _check_function(found, where)
    label = str(found["ordinate_axis_units_lab"]).strip()
    if unit is None and label.upper() in ("", "NONE", "UNITLESS"):
        raise InputError(
            f"signal {where}: does not say the unit of its values; give the unit of "
            f'the signal, for example unit = "{kind.unit}"'
        )
    factor = _factor_of(unit or label, kind, where)
    time, load = np.asarray(found["x"], float), np.asarray(found["data"], float) * factor
    bad = ~np.isfinite(load)
    if bad.any():
        k = int(np.argmax(bad))
        raise InputError(f"signal {where}, sample {k + 1} (time {time[k]:.9g} s): is not finite")
    return _Samples(
        time, load, [f"dataset 58 number {chosen}, sample {k + 1}" for k in range(len(time))]
    )


def _chosen_dataset(file: Path, types: list[int], places: list[int], dataset: int | None) -> int:
    """Number of the dataset 58 to take, from 1."""
    if not places:
        held = f"holds {', '.join(map(str, sorted(set(types))))}" if types else "holds none at all"
        raise InputError(f"signal {file}: has no dataset 58 (function of time); it {held}")
    if dataset is None:
        if len(places) > 1:
            raise InputError(
                f"signal {file}: has {len(places)} datasets 58; say which one, for example dataset = 1"
            )
        return 1
    if not 1 <= dataset <= len(places):
        raise InputError(f"signal {file}: has no dataset 58 number {dataset}, only {len(places)}")
    return dataset


def _check_function(found: Mapping[str, Any], where: str) -> None:
    """A real function of time at even steps."""
    if found["func_type"] not in (_GENERAL, _TIME_RESPONSE):
        raise InputError(
            f"signal {where}: is a function of type {found['func_type']}, not a time response "
            "(type 1)"
        )
    if found["abscissa_spec_data_type"] not in _TIME_AXIS:
        raise InputError(
            f"signal {where}: its abscissa is of type {found['abscissa_spec_data_type']}, not time "
            "(type 17)"
        )
    if found["ord_data_type"] in _COMPLEX:
        raise InputError(f"signal {where}: has complex values; a load in time is real")
    if found["abscissa_spacing"] != 1:
        raise InputError(
            f"signal {where}: has unevenly spaced samples; export it with an even step, or as CSV"
        )
    if not found["abscissa_inc"] > 0:
        raise InputError(f"signal {where}: has a step of {found['abscissa_inc']:g} s")
    if len(found["data"]) < 2 or len(found["data"]) != found["num_pts"]:
        raise InputError(
            f"signal {where}: has {len(found['data'])} values where its header says "
            f"{found['num_pts']}; at least 2 are needed"
        )


def _resample(file: Path, samples: _Samples, dt: float) -> tuple[Array, Array]:
    time, load = samples.time, samples.load
    interval = np.diff(time)
    if not (interval > 0).all():
        k = int(np.argmin(interval > 0))
        raise InputError(
            f"signal {file}, {samples.places[k + 1]}: time {time[k + 1]:.9g} s does not come after "
            f"{time[k]:.9g} s; sort the rows and remove repeated times"
        )
    usual = float(np.median(interval))
    if interval.max() > LONGEST_GAP * usual:
        k = int(np.argmax(interval))
        raise InputError(
            f"signal {file}, {samples.places[k + 1]}: a gap of {interval[k]:.4g} s after "
            f"{time[k]:.9g} s, where {usual:.4g} s is usual; fill it or cut the signal there"
        )
    steps = _times(float(time[-1] - time[0]), dt)
    if len(steps) < 2:
        raise InputError(
            f"signal {file}: lasts {time[-1] - time[0]:.4g} s, shorter than one step of {dt:.4g} s"
        )
    return steps, np.interp(steps, time - time[0], load)


def _times(duration: float, dt: float) -> Array:
    """Multiples of dt up to the duration, rounding errors of the quotient forgiven."""
    if duration / dt > MOST_STEPS:
        raise InputError(
            f"{duration:.4g} s are {duration / dt:.3g} steps of {dt:.3g} s; at most "
            f"{MOST_STEPS:,} are possible: shorten the signal or lengthen the step"
        )
    count = int(np.floor(duration / dt * (1 + 1e-12) + 1e-9)) + 1
    return np.arange(count, dtype=float) * dt


def _positive(**values: float) -> None:
    for name, value in values.items():
        if not (np.isfinite(value) and value > 0):
            raise InputError(f"{name} is {value:g}: it must be positive and finite")
