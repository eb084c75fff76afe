"""From the description of an excitation to the load at every step.

One function per kind of signal, chosen by the class of the entry; the signals themselves are in
`microslip.analyses.time.signals`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import singledispatch

from microslip.analyses.time.signals import (
    harmonic,
    read_signal,
    silence,
    stepped_sine,
    swept_sine,
)
from microslip.describe.excitation import (
    Excitation,
    FreeDecay,
    MeasuredSignal,
    Sine,
    SteppedSine,
    SweptSine,
)
from microslip.describe.quantities import Rule
from microslip.describe.units import LINE_MOMENT, Kind
from microslip.errors import InputError
from microslip.typing import Array


@dataclass(frozen=True)
class Prepared:
    """An entry of the file with its load at every step.

    Attributes
    ----------
    entry : Excitation
    dt : float
        Time step, s.
    cycle_steps : int
        Steps per cycle of the highest frequency, of the signal or of the sliding mode.
    load : (n,) array
        Of unit amplitude where the entry has an amplitude, else the load itself.
    """

    entry: Excitation
    dt: float
    cycle_steps: int
    load: Array

    @property
    def blocks(self) -> int:
        """Into how many pieces the march is cut."""
        return max(1, -(-(len(self.load) - 1) // self.cycle_steps))


def prepare_histories(
    entries: Sequence[Excitation], sliding: float, kind: Kind = LINE_MOMENT
) -> list[Prepared]:
    """Read all signals, before anything that takes long.

    Parameters
    ----------
    entries : sequence of Excitation
    sliding : float
        Sliding frequency of the joint, Hz.
    kind : Kind
        What measured signals are, without a unit of another kind.

    Raises
    ------
    InputError
        Names the history and what is wrong with its signal or step.
    """
    prepared = []
    for entry in entries:
        try:
            dt = entry.resolution(sliding)
            cycle_steps = round(1 / (entry.resolved_frequency(sliding) * dt))
            prepared.append(Prepared(entry, dt, cycle_steps, sampled_load(entry, 1.0, dt, kind)))
        except Rule as error:
            key = f".{error.key}" if error.key else ""
            raise InputError(f"analysis.history {entry.label!r}{key}: {error}") from None
        except InputError as error:
            raise InputError(f"analysis.history {entry.label!r}: {error}") from None
    return prepared


@singledispatch
def sampled_load(entry: Excitation, amplitude: float, dt: float, kind: Kind = LINE_MOMENT) -> Array:
    """Load at every step from t = 0, in the unit of its amplitude.

    Parameters
    ----------
    entry : Excitation
    amplitude : float
        A measured signal has its own.
    dt : float
        Time step, s.
    kind : Kind
        What a measured signal is.

    Raises
    ------
    InputError
        Where a file cannot be read, or the signal has too many steps.

    Examples
    --------
    >>> entry = Sine(signal="sine", frequency=1, cycles=0.5, moment=1)
    >>> sampled_load(entry, 3.0, 0.25).round(12).tolist()
    [0.0, 3.0, 0.0]
    """
    raise NotImplementedError(f"no load is known of {type(entry).__name__}")


@sampled_load.register
def _sine(entry: Sine, amplitude: float, dt: float, kind: Kind = LINE_MOMENT) -> Array:
    return harmonic(amplitude, entry.frequency, entry.cycles, dt)[1]


@sampled_load.register
def _stepped(entry: SteppedSine, amplitude: float, dt: float, kind: Kind = LINE_MOMENT) -> Array:
    return stepped_sine(amplitude, entry.band(), entry.cycles, dt)[1]


@sampled_load.register
def _swept(entry: SweptSine, amplitude: float, dt: float, kind: Kind = LINE_MOMENT) -> Array:
    return swept_sine(amplitude, entry.from_, entry.to, entry.duration, dt, entry.sweep)[1]


@sampled_load.register
def _decay(entry: FreeDecay, amplitude: float, dt: float, kind: Kind = LINE_MOMENT) -> Array:
    """Nothing, but what was held before the first step."""
    load = silence(entry.duration, dt)[1]
    if entry.start == "static":
        load[0] = amplitude
    return load


@sampled_load.register
def _measured(
    entry: MeasuredSignal, amplitude: float, dt: float, kind: Kind = LINE_MOMENT
) -> Array:
    """As the file has it, times its scale, resampled to the step."""
    found = read_signal(
        entry.file, dt, kind=kind, column=entry.column, dataset=entry.dataset, unit=entry.unit
    )
    return entry.scale * found[1]
