"""Steady states to seek along a response, and what became of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from microslip.analyses.time.starts import Start
from microslip.analyses.time.steady import SteadyState
from microslip.typing import Array

STEPS, REFINEMENT = 150, 4
"""Time steps per cycle, unless a response needs more; what settles is sought on with so many times as many.

Fewer than for a point over time (`microslip.analyses.time.step_refinement`): what they leave is stated, and
a response has a hundred states.
"""

TOLERANCE = 1e-5
"""Relative change over a cycle at which a state is steady."""

LEFT = "the periodic motion is unstable, and motions leave it"
"""Why there is no steady state where there is a periodic motion."""


@dataclass(frozen=True)
class Target:
    """A steady state to seek.

    Attributes
    ----------
    point : int
        Index of its frequency.
    frequency, load : float
    guess : complex
        First harmonic of the modal coordinate to start from rest with.
    starts : tuple of ((Start, float), ...)
        Ends of others at phase 0 of the load and their shares, one mixture after another.
    origin : int
        Index of the frequency that the first start is of; -1 where it is none.
    cold : bool
        Start from rest first; to be marched, after the load was raised.
    expected, most : float
        Size below which a motion from rest may be on a smaller branch than the states beside; of a motion to
        be marched, the least and the largest size of its branch about it, zero where none is known.
    offset : (d - 1,) array or None
        At which bodies that walk come to rest in motions beside it.
    steps : int
        Time steps per cycle.
    """

    point: int
    frequency: float
    load: float
    guess: complex
    starts: tuple[tuple[tuple[Start, float], ...], ...] = ()
    origin: int = -1
    cold: bool = True
    expected: float = 0.0
    most: float = 0.0
    offset: Array | None = None
    steps: int = STEPS

    @property
    def sizes(self) -> tuple[float, float]:
        """Least and largest on its branch; zero where none is known."""
        return self.expected, self.most


class Stepped(NamedTuple):
    """A steady state to be sought on with more steps.

    Attributes
    ----------
    frequency : float
        Hz.
    amplitude : complex
    state : Start
    steps : int
        That it has, per cycle.
    marched : bool
        Where it does not settle with more steps it is marched with these.
    varies : bool
        It does not repeat, but varies from cycle to cycle for good, and the amplitude is its mean; or it is
        to be marched as one that does.
    walks : bool
        It is one of bodies that are on their way to where they rest, after
        `microslip.analyses.time.offset.HORIZON` cycles.
    around, began : float, Start or None
        See `microslip.analyses.time.resting.Rested`.
    """

    frequency: float
    amplitude: complex
    state: Start
    steps: int
    marched: bool = False
    varies: bool = False
    walks: bool = False
    around: float = float("nan")
    began: Start | None = None


class More(NamedTuple):
    """What a steady state has become with more steps.

    Attributes
    ----------
    amplitude : complex or None
        First harmonic; None where it does not settle, or motions leave it.
    cycles : int
        That it took, of the fewer steps: each of k times as many counts for as many.
    strays : float
        How far the size of motions beside it strays from that, relative: zero of a stable one, infinite where
        they leave it.
    drifts : float
        Of what does not settle, and stays where it is marched, how far off that is and may drift, relative;
        of what varies for good, how far its mean may.
    varies : float
        See `microslip.analyses.time.staying.Stay`.
    watched : int
        Cycles in which what it does was seen, where it was marched alone: that it varies for good, repeats or
        creeps; else zero.
    """

    amplitude: complex | None
    cycles: int
    strays: float = 0.0
    drifts: float = 0.0
    varies: float = 0.0
    watched: int = 0


@dataclass(frozen=True)
class Found:
    """A steady state.

    Attributes
    ----------
    amplitude : complex
    change, doubt : float
        See `microslip.analyses.reduced.anchors.Anchor`.
    state : Start
        At phase 0 of the load.
    cycles : int
        Spent.
    fell : bool
        A larger motion was sought first, and is not steady.
    opens : bool
        At some instant of that no pair touches.
    scatter, past : float
        See `microslip.analyses.reduced.anchors.Anchor`; nan where they are not known.
    rest : (d - 1,) array or None
        Offset at which bodies that walked past each other have come to rest in it.
    lasts, ahead : float
        Cycles until they do, about; the relative change of the amplitude until then, where they have not
        within `microslip.analyses.time.offset.HORIZON` cycles: this is the motion after so many. Infinite and
        nan where it is not found where they do; `rest` is where they are then.
    around, began : float, Start or None
        See `microslip.analyses.time.resting.Rested`.
    own : bool
        Marched from the motion that was known there, as raising the load leads to another branch; where that
        has left its branch too, this is the motion after the load was raised.
    varies : float
        See `microslip.analyses.reduced.anchors.Anchor`.
    rings : float
        Of the doubt, how far cycles stray where bodies rest, which may end: with more steps that is known.
    more : More or None
        What this very state has become with more steps; None where it was not sought on.
    """

    amplitude: complex
    change: float
    doubt: float
    state: Start
    cycles: int
    fell: bool = False
    opens: bool = False
    scatter: float = float("nan")
    past: float = float("nan")
    rest: Array | None = None
    lasts: float = 0.0
    ahead: float = 0.0
    around: float = float("nan")
    began: Start | None = None
    own: bool = False
    varies: float = 0.0
    rings: float = 0.0
    more: More | None = None


def known_rest(rest: Array | None, ahead: float) -> Array | None:
    """Where bodies come to rest, if that is known, from `Found.rest` and `Found.ahead`."""
    return None if np.isnan(ahead) else rest


@dataclass(frozen=True)
class Lost:
    """No steady state.

    Attributes
    ----------
    reason : str
    cycles : int
        Spent.
    steady : SteadyState or None
        The motion that the search ended in.
    opens : bool
        At some instant of it no pair touches.
    left : bool
        There is a periodic motion, and motions leave it, or vary about its size by too much to be it.
    """

    reason: str
    cycles: int
    steady: SteadyState | None = None
    opens: bool = False
    left: bool = False


def stepped(frequency: float, found: Found, steps: int) -> Stepped:
    """A steady state of so many steps per cycle, to be sought on with more."""
    rests, varies = found.rest is not None, found.varies > 0
    walks = found.ahead != 0 and not varies
    return Stepped(
        frequency=frequency,
        amplitude=found.amplitude,
        state=found.state,
        steps=steps,
        marched=rests,
        varies=varies,
        walks=walks,
        around=found.around,
        began=found.began,
    )
