"""The refined model corrected by a few steady states: right on strongly coupled joints, in seconds.

What the refined table misses, ``correction = kappa - kappa_table(|A|, omega)``, is a smooth function along
a response (`analyses.reduced.through_anchors`). Here it is tabulated: steady states of the full joint by time
integration at the resonance, about half power, farther out and at the ends of the band, then in the middle
of those stretches of the response that the others predict worst, as many as the file allows and no more;
with four times the time steps where the first show that these err by more than is asked for. Each
begins at rest with the velocity of the motion that the corrected model has there, and is sought on until it
is at rest itself; what then is still open is marched for some hundred cycles; what stays so beside a motion
that is not steady is not bounded. What its past may do to it is not measured, as method
``"auto"`` does: only what of that scatters from one steady state to the next is in the bound.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from microslip.analyses.harmonic.points import WALKS
from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.reduced.anchors import Anchor, anchor_at
from microslip.analyses.reduced.response import NO_DIGIT, Response, held_to
from microslip.analyses.reduced.surface import (
    Contours,
    LoadSurface,
    contours,
    largest,
    load_surface,
)
from microslip.analyses.reduced.through_anchors import Held, held
from microslip.describe.requests import ResponseAnalysis
from microslip.errors import JointOpensError, MicroslipError
from microslip.numerics.execute import each, threads
from microslip.pipeline.band import Curve
from microslip.pipeline.brief_motion import OPEN, BriefMotion, patient_motion
from microslip.pipeline.choosing import AT_A_TIME
from microslip.pipeline.doubts import doubt_with, no_better
from microslip.pipeline.neighbours import beside_unsteady, far_between, leaving
from microslip.pipeline.outputs_held import OutputsHeld
from microslip.pipeline.prepare import Assembly
from microslip.pipeline.stepping import ACCURACY, Stepping, refined_anchors, taken
from microslip.pipeline.targets import Stepped
from microslip.pipeline.walk import DOUBTFUL, may_be_shown
from microslip.typing import Array

FIRST = (-0.9, 0.9, -1.8, 1.8, -2.9, 2.9, -4.0, 4.0, -5.1, 5.1)
"""Detunings of the first steady states after resonance and ends, as far as the band goes: half power, and
outward so that the distance from the resonance grows by no more than three from one to the next."""

GAP = 1 / 8
"""Share of the frequencies without a steady state among them that is filled, whatever the bound says."""

UNSEEN, RESONANT = 0.25, 4.0
"""What frequencies count for that are filled so, and those beside more than half of the largest amplitude."""

WIDER = 2.0
"""Times what a motion is seen to creep by that others may: one is one draw."""


@dataclass
class _Table:
    """Corrections known so far, by index of the frequency."""

    surface: LoadSurface
    load: float
    anchors: dict[int, Anchor] = field(default_factory=dict)
    lost: dict[int, float] = field(default_factory=dict)
    opens: bool = False
    ends: dict[int, Stepped] = field(default_factory=dict)
    settled: dict[int, Stepped] = field(default_factory=dict)
    accuracy: float | Array = ACCURACY
    stepping: Stepping = field(default_factory=Stepping)
    motions: dict[int, BriefMotion] = field(default_factory=dict)

    def refine(self, joint: PreparedJoint) -> None:
        """Seek settled states on with more steps that are not yet, and know what the steps do."""
        self.seek_on(joint)
        self.take_refined()

    def seek_on(self, joint: PreparedJoint) -> None:
        """Seek settled states on with more steps that are not yet."""
        self.stepping.seek_on(joint, self.load, self.settled)
        self._have_strays()

    def _have_strays(self) -> None:
        """Have how far motions stray from states in their doubt; those that motions leave are not steady."""
        for k, strays in self.stepping.strays.items():
            if k not in self.settled:
                continue
            varies = self.stepping.varies.get(k, 0.0)
            if not may_be_shown(strays, varies):
                del self.settled[k], self.anchors[k]
                self.lost[k] = strays
            else:
                doubt = doubt_with(self.stepping, k, self.anchors[k])
                self.anchors[k] = replace(self.anchors[k], doubt=doubt, varies=varies)

    def begun_anew(self) -> _Table:
        """The same with more steps, and nothing known but what those err by."""
        stepping = self.stepping.anew(self.settled)
        return _Table(self.surface, self.load, opens=self.opens, stepping=stepping)

    def take_refined(self) -> None:
        """Have the anchors with more steps, where they were sought on, and what is left of the error."""
        self._have_strays()
        self.anchors, self.accuracy = refined_anchors(
            self.surface, self.load, self.anchors, self.settled, self.stepping
        )

    @property
    def states(self) -> dict[int, Stepped]:
        """Steady states, settled or not, by index of the frequency."""
        return {k: end for k, end in self.ends.items() if k in self.anchors}

    @property
    def marks(self) -> list[int]:
        """Frequencies that were sought, by index."""
        return sorted({*self.anchors, *self.lost})

    def doubted(self) -> dict[int, Anchor]:
        """Steady states, with how far those that do not come to rest creep in their doubt.

        Each has gone one way for some time: others of another past may go as far as the next ones do. And
        bodies that walk on may change a motion by as much as any have on their way.
        """
        motions, found = self.motions, dict(self.anchors)
        crept = [k for k in sorted(found) if motions[k].crept >= 0]
        far = np.array([motions[k].crept for k in crept])
        for i, k in enumerate(crept):
            most = WIDER * float(far[max(i - 1, 0) : i + 2].max())
            found[k] = replace(found[k], doubt=found[k].doubt + most)
        moved = max((one.moved for one in motions.values()), default=0.0)
        walking = [k for k in found if motions[k].walk > WALKS]
        return found | {k: no_better(found[k], moved) for k in walking}

    def response(self) -> Held:
        """The corrected response so far.

        Beside a motion that is not steady the correction is that between its neighbours, and the bound no
        less than what its amplitude was seen to vary by.
        """
        across = held(self.surface, self.load, self.doubted(), (), self.accuracy)
        if not self.lost:
            return across
        marks = np.array(self.marks)
        wanders = np.array([self.lost.get(int(k), 0.0) for k in marks])
        every = np.arange(len(across.error))
        right = np.clip(np.searchsorted(marks, every), 0, len(marks) - 1)
        left = np.where(marks[right] == every, right, np.maximum(right - 1, 0))
        beside = np.maximum(wanders[left], wanders[right])
        assert across.varies is not None
        varies = np.where(beside > across.error, 0.0, across.varies)
        return Held(across.amplitude, np.maximum(across.error, beside), varies)


class Corrected(NamedTuple):
    """A response corrected at steady states.

    Attributes
    ----------
    response : Response
        With the bound of its error, ``error_indicator``, the steady states, ``anchors``, and the outputs.
    unsteady : (k,) array
        Frequencies at which the motion was not steady, Hz.
    opens : bool
        Whether at some of these no pair touched at some instant.
    motions : tuple of BriefMotion
        That the searches of its steady states have ended in.
    """

    response: Response
    unsteady: Array
    opens: bool
    motions: tuple[BriefMotion, ...]


def corrected_response(
    assembly: Assembly,
    settings: ResponseAnalysis,
    case: Curve,
    base: Response,
    stop: threading.Event,
    advance: Callable[[int], None],
) -> Corrected:
    """A response of the refined model corrected at steady states.

    Parameters
    ----------
    assembly : Assembly
    settings : ResponseAnalysis
        How many, and the error that is asked for.
    case : Curve
        The refined model under a load.
    base : Response
        What it says, at the frequencies wanted.
    stop : Event
        Set on Ctrl-C; what is known then is returned.
    advance : callable
        Told how many have been sought.
    """
    assert case.table is not None
    surface = load_surface(case.model, case.table, base.frequency, base.load)
    first = table = _Table(surface, base.load)
    outputs = OutputsHeld(assembly, case.model, case.table)

    def picked() -> list[int]:
        beside = outputs.error_of_first(_response(table, base), table.states)
        return _least_known(table, settings, beside)

    joint, guess = assembly.prepared, largest(contours(surface, base.load))
    picks = _first(guess, len(base.frequency))[: settings.corrections]

    try:
        _learn(joint, table, picks, guess)
        table.seek_on(joint)
        if table.stepping.err_by_more(table.settled, settings.error):
            table = first.begun_anew()
            _learn(joint, table, picks, guess)
        advance(len(picks))
        while picks := picked():
            _learn(joint, table, picks, guess)
            advance(len(picks))
        table.refine(joint)
        # with more steps there may be more to see than there was with fewer
        while picks := picked():
            _learn(joint, table, picks, guess)
            advance(len(picks))
            table.refine(joint)
    except KeyboardInterrupt:
        stop.set()
        table = max(first, table, key=lambda one: len(one.anchors))
        table.take_refined()
    unsteady = base.frequency[sorted(table.lost)]
    response = outputs.response(_response(table, base), table.states)
    motions = tuple(table.motions[k] for k in sorted(table.anchors))
    return Corrected(response, unsteady, table.opens, motions)


def _learn(joint: PreparedJoint, table: _Table, picks: list[int], guess: Contours) -> None:
    """Seek steady states at frequencies, by index, and keep what they say of the model."""
    now = table.response() if table.anchors else None
    tasks = [(float(table.surface.frequency[k]), _begin(k, now, guess)) for k in picks]

    def work(task: tuple[float, complex]) -> BriefMotion:
        try:
            return patient_motion(joint, table.load, *task, table.stepping.steps)
        except MicroslipError as error:
            return BriefMotion(0j, np.inf, np.inf, isinstance(error, JointOpensError))

    for k, found in zip(picks, each(work, tasks, threads()), strict=True):
        table.opens = table.opens or found.opens
        if not found.doubt <= DOUBTFUL:
            table.lost[k] = found.doubt
            continue
        f = float(table.surface.frequency[k])
        anchor = anchor_at(table.surface, f, table.load, *found[:3])
        table.anchors[k] = replace(anchor, scatter=np.nan)
        table.motions[k] = found
        if found.end is not None:
            steps = table.stepping.steps
            table.ends[k] = Stepped(f, found.amplitude, found.end, steps, marched=True)
        if found.settled:
            table.settled[k] = table.ends[k]


def _first(guess: Contours, count: int) -> list[int]:
    """Where the refined model has its resonance, the ends of the band and the first detunings."""
    chosen, u = [0, count - 1], guess.detuning
    if len(u):
        near = [int(np.argmin(np.abs(u - t))) for t in (0.0, *FIRST) if u.min() <= t <= u.max()]
        chosen = (
            [int(guess.point[j]) for j in near[:1]]
            + chosen
            + [int(guess.point[j]) for j in near[1:]]
        )
    return list(dict.fromkeys(chosen))


def _begin(k: int, now: Held | None, guess: Contours) -> complex:
    """Amplitude that a search begins with: of the corrected model where it has a digit, else of the table."""
    if now is not None and np.isfinite(now.amplitude[k]) and now.error[k] < NO_DIGIT:
        return complex(now.amplitude[k])
    own = guess.amplitude[guess.point == k]
    return complex(own[-1]) if len(own) else 0j


def _least_known(table: _Table, settings: ResponseAnalysis, beside: Array) -> list[int]:
    """Middles of the stretches with the most frequencies whose bound is too wide, the worst first.

    As many as may still be sought. The error of what is shown is that of the amplitude, and what the first
    output has `beside` it.
    """
    now, left = table.response(), max(settings.corrections - len(table.marks), 0)
    doubtful = ~(now.of_mean + beside <= settings.error)
    doubtful[table.marks] = False
    size = np.nan_to_num(np.abs(now.amplitude))
    resonant = size >= 0.5 * size.max()
    widest, weighed = max(GAP * len(doubtful), 1), []
    for low, high in pairwise(table.marks):
        unknown = int(doubtful[low + 1 : high].sum())
        if high - low > 1 and (unknown or high - low > widest):
            weight = RESONANT if resonant[[low, high]].any() else 1.0
            weighed.append((weight * max(unknown, UNSEEN * (high - low)), (low + high) // 2))
    return [k for _, k in sorted(weighed, reverse=True)][: min(AT_A_TIME, left)]


def _response(table: _Table, base: Response) -> Response:
    now, sought_on = table.response(), table.stepping.sought_on
    # with more steps a branch may end before it does with few
    settled = {*(taken(table.settled, sought_on) if sought_on else table.settled)}
    settled -= table.stepping.staying(table.settled)
    known = [k for k, one in table.anchors.items() if one.doubt <= OPEN or k in settled]
    unbounded = [
        *leaving(table.anchors, now.error, settled),
        *beside_unsteady(table.anchors, table.lost, known),
        # all may be spent before these are filled
        *far_between(table.marks, max(GAP * len(now.error), 1)),
    ]
    return held_to(base, "corrected", now, table.doubted(), unbounded)
