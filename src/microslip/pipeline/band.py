"""The frequencies of the forced response: as the file gives them, else from the joint and its loads."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from microslip.analyses.reduced.band import Peak, band_around, farther, goes_on, refined, widened
from microslip.analyses.reduced.resonance import Resonance, linear_resonance, resonance_of
from microslip.analyses.reduced.response import Response
from microslip.analyses.reduced.sweep import CONVERGED
from microslip.analyses.reduced.table import EquivalentTable
from microslip.analyses.reduced.two_mode import TwoModeModel
from microslip.brief import Brief
from microslip.errors import MicroslipError
from microslip.pipeline.loads import Load
from microslip.pipeline.prepare import Assembly
from microslip.typing import Array

MOVES_IN_TIME = 3
"""So often an end is moved outward for curves that go through motions over time: each time takes a search."""

LOOKED_AT = 201
"""Frequencies at which the ends of a band are judged, at least."""


@dataclass(frozen=True, repr=False)
class Curve(Brief):
    """A response that is asked for.

    Attributes
    ----------
    load : Load
    model : TwoModeModel
    table : EquivalentTable or None
        None without friction.
    respond : callable
        The response over frequencies in Hz.
    """

    load: Load
    model: TwoModeModel
    table: EquivalentTable | None
    respond: Callable[[Array], Response]

    @cached_property
    def resonance(self) -> Resonance:
        """Where the model resonates at the amplitudes of its table; there must be one."""
        assert self.table is not None
        return resonance_of(self.model, self.table)


@dataclass(frozen=True, repr=False)
class Axis(Brief):
    """Frequencies of all responses of a run, and what they follow from.

    Attributes
    ----------
    frequency : (n,) array
        Hz, ascending.
    given : tuple of bool
        Whether the file gives the lower and the upper end.
    """

    frequency: Array
    given: tuple[bool, bool]

    @property
    def low(self) -> float:
        """Lower end, Hz."""
        return float(self.frequency[0])

    @property
    def high(self) -> float:
        """Upper end, Hz."""
        return float(self.frequency[-1])

    def cut_off(self, curves: Sequence[Response]) -> tuple[bool, bool]:
        """Whether the lower and the upper end are free and a curve is largest there."""
        down, up = (
            any(curve.flag[end] == CONVERGED and goes_on(curve, end) for curve in curves)
            for end in (0, -1)
        )
        return down and not self.given[0], up and not self.given[1]

    def wider(self, curves: Sequence[Response]) -> Axis:
        """The same with the ends moved outward that cut curves off."""
        return replace(self, frequency=farther(self.frequency, *self.cut_off(curves)))

    @property
    def origin(self) -> str:
        """What the band follows from, in a few words."""
        both = {(True, True): "as given", (False, False): "from the joint and its loads"}
        end = "from" if self.given[0] else "to"
        return both.get(self.given, f"{end!r} as given, the other end from the joint and its loads")

    def __str__(self) -> str:
        return f"band {self.low:.6g} to {self.high:.6g} Hz, {self.origin}"


def axis_of(assembly: Assembly, curves: Sequence[Curve]) -> Axis:
    """Frequencies at which all curves are computed.

    Raises
    ------
    MicroslipError
        Where the one end that the file gives leaves no band.
    """
    settings = assembly.joint.analysis.response
    assert settings is not None
    given = settings.from_ is not None, settings.to is not None
    if settings.from_ is not None and settings.to is not None:
        return Axis(np.linspace(settings.from_, settings.to, settings.count), given)

    def respond(frequency: Array) -> list[Response]:
        return [curve.respond(frequency) for curve in curves]

    low, high = band_around([p for curve in curves for p in _peaks(assembly, curve)])
    start, stop = settings.from_ or low, settings.to or high
    if start >= stop:
        key, value, end = ("from", start, "to") if given[0] else ("to", stop, "from")
        raise MicroslipError(
            f"analysis.response.{key} = {value:g} Hz leaves no band: the joint resonates between "
            f"{low:g} and {high:g} Hz; give analysis.response.{end} too, or neither"
        )
    free = not given[0], not given[1]
    start, stop = widened(respond, (start, stop), free, max(settings.count, LOOKED_AT))
    return Axis(refined(respond, np.linspace(start, stop, settings.count)), given)


def _peaks(assembly: Assembly, curve: Curve) -> Iterator[Peak]:
    """Resonances of a curve: sliding and stuck under small loads, and under its own."""
    frequency, _ = linear_resonance(curve.model)
    alpha, beta = curve.model.own_rayleigh
    mode = assembly.mode
    turn = 2 * np.pi
    yield Peak(frequency or mode.sliding_frequency, (alpha + beta * curve.model.omega**2) / turn)
    if curve.table is None:
        return
    stuck = alpha + beta * mode.stuck_omega**2
    if curve.table.damping is not None:
        stuck += float(curve.table.damping[0])
    yield Peak(mode.stuck_frequency, stuck / turn)
    found = curve.resonance
    top = found.reached(curve.load.amplitude)
    for k in {0, top}:
        yield Peak(float(found.omega[k]) / turn, float(found.width[k]) / turn)
