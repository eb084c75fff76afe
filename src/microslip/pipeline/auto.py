"""The refined model put right by time integration where it is not sure of itself.

Steady states of the full joint are found where the response under a load is least known: first at its
resonance, half-power points and ends, then wherever the bound of `analyses.reduced.anchors` is largest,
two at a time and first far from all others, until it is below what the file asks for or the points are
used up. Where the search finds no steady state, the error up to the next one that it does find is not
bounded. Amplitudes above the table, where contact is lost for part of the cycle, are claimed as far as
steady states go.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from microslip.analyses.reduced.anchors import Anchor, Answers, anchor_at, corrected_answers
from microslip.analyses.reduced.response import Response
from microslip.analyses.reduced.surface import LoadSurface, load_surface
from microslip.analyses.reduced.sweep import CONVERGED, OUTSIDE
from microslip.analyses.time.points import Request, steady_states
from microslip.describe.requests import ResponseAnalysis
from microslip.errors import Failure
from microslip.pipeline.band import Curve
from microslip.pipeline.prepare import Assembly
from microslip.typing import Array, Indices, Mask

FIRST = ((0.0, -1.2), (1.2, -np.inf), (np.inf,))
"""Detunings of the first anchors, round by round: the resonance, below and above half power, the ends."""

UNKNOWN = 1e3
"""What counts as the error where there is no bound, more the farther from all anchors."""

STEPS = 150
"""Time steps per cycle."""

ACCURACY = 1e-3
"""Relative error of a time point with so many steps, at worst."""

CYCLES = 200
"""Cycles at most."""

SETTLED = 1e-4
"""Relative change over a cycle from which on a state is steady enough to learn from."""

MOST_LOST = 6
"""A search ends where as many steady states as this were not found, and no more were."""

SPREAD = 0.4
"""Least distance, in place, of two points that are sought at a time."""

NEAR = 0.03
"""No second anchor is sought so close to one, in place."""

CLAIMED = 1.05
"""Amplitudes above the table are claimed up to so many times that of the largest anchor."""

BELOW_LOST = 0.97
"""Amplitude, over one above the table at which no steady state was found, that is not exceeded."""


@dataclass
class _Search:
    """What is known while anchors are sought."""

    surface: LoadSurface
    load: float
    points: int
    anchors: list[Anchor] = field(default_factory=list)
    tried: list[int] = field(default_factory=list)
    lost: list[str] = field(default_factory=list)
    lost_at: list[float] = field(default_factory=list)
    ceiling: float = np.inf

    @property
    def hopeless(self) -> bool:
        """Whether hardly any of the motions sought is steady."""
        return len(self.lost) >= max(MOST_LOST, len(self.anchors))

    def answers(self) -> Answers:
        """All answers below the ceiling but those between two folds, which are unstable.

        Without a bound where the nearest point sought was lost.
        """
        found = corrected_answers(self.surface, self.load, self.anchors, ACCURACY)
        found = _those(found, (found.size < self.ceiling) & (found.slope > 0))
        if not self.lost_at:
            return found
        known = np.array([one.place for one in self.anchors] + [np.inf])
        s = found.place[:, None]
        nearer = np.abs(s - self.lost_at).min(axis=1) < np.abs(s - known).min(axis=1)
        return replace(found, error=np.where(nearer, np.inf, found.error))

    def claimed(self) -> Answers:
        """Answers within the table, and above it as far as there are steady states."""
        offset = self.surface.model.offset[0] * self.load
        sizes = [abs(one.amplitude + offset) for one in self.anchors]
        top = self.surface.preload * np.exp(self.surface.curve.knots[-1])
        found = self.answers()
        return _those(found, found.size <= max(top, CLAIMED * max(sizes, default=0.0)))

    def lose(self, place: float, size: float, reason: str) -> None:
        """No steady state was found at a place and amplitude."""
        self.lost.append(reason)
        self.lost_at.append(place)
        top = self.surface.preload * np.exp(self.surface.curve.knots[-1])
        if size > BELOW_LOST * top:
            self.ceiling = min(self.ceiling, max(top, BELOW_LOST * size) * (1 + 1e-9))


def anchored_response(
    assembly: Assembly,
    settings: ResponseAnalysis,
    case: Curve,
    base: Response,
    stop: threading.Event,
    advance: Callable[[int], None],
) -> tuple[Response, tuple[str, ...]]:
    """A response of the refined model held to steady states, and where none was found.

    Parameters
    ----------
    assembly : Assembly
    settings : ResponseAnalysis
    case : Curve
        The refined model under a load.
    base : Response
        What it says, at the frequencies wanted.
    stop : Event
        Set on Ctrl-C, which ends the search; what is known then is returned.
    advance : callable
        Told how many points have been sought.
    """
    assert case.table is not None
    surface = load_surface(case.model, case.table, base.frequency, base.load)
    search = _Search(surface, base.load, settings.points)
    try:
        for targets in FIRST:
            shown = _largest(search.answers())
            advance(_learn(assembly, search, base, shown, _nearest(search, shown, targets)))
        while not search.hopeless:
            shown = _largest(search.answers())
            picks = _least_known(search, shown, settings.error)
            if not picks:
                break
            advance(_learn(assembly, search, base, shown, picks))
    except KeyboardInterrupt:
        stop.set()
    return _response(base, search), tuple(search.lost)


def _learn(
    assembly: Assembly, search: _Search, base: Response, shown: Answers, picks: Iterable[int]
) -> int:
    """Steady states at answers by index; how many were sought."""
    picks = list(dict.fromkeys(picks))
    requests = [
        Request(
            rho=base.rho,
            frequency=float(base.frequency[shown.point[k]]),
            load=base.load,
            friction=None,
            guess=complex(shown.amplitude[k]),
            steps=STEPS,
            max_cycles=CYCLES,
            classify=False,
        )
        for k in picks
    ]
    for k, request, found in zip(
        picks, requests, steady_states(assembly.prepared, requests), strict=True
    ):
        search.tried.append(int(shown.point[k]))
        at = float(shown.place[k]), float(shown.size[k])
        if isinstance(found, Failure):
            search.lose(*at, f"{request.frequency:.6g} Hz: {found.reason}")
            continue
        steady = found.steady
        if not (steady.converged or steady.change < SETTLED):
            reason = f"not steady after {steady.cycles} cycles, last change {steady.change:.1e}"
            search.lose(*at, f"{request.frequency:.6g} Hz: {reason}")
            continue
        search.anchors.append(
            anchor_at(
                search.surface,
                request.frequency,
                base.load,
                steady.amplitude,
                steady.change,
            )
        )
    return len(picks)


def _nearest(search: _Search, shown: Answers, targets: Iterable[float]) -> list[int]:
    """Answers, by index, whose detunings are closest to some."""
    u = shown.detuning
    if not len(u):
        return []
    chosen = (int(np.argmin(np.abs(np.clip(t, u.min(), u.max()) - u))) for t in targets)
    return [k for k in chosen if shown.point[k] not in search.tried]


def _least_known(search: _Search, shown: Answers, wanted: float) -> list[int]:
    """One or two answers, by index, whose bound is largest and above what is wanted."""
    error, place = shown.error.copy(), shown.place
    for k in search.tried:
        error[np.abs(shown.point - k) <= 1] = 0.0
    for one in search.anchors:
        error[np.abs(place - one.place) < NEAR] = 0.0
    away = np.abs(place[:, None] - [one.place for one in search.anchors]).min(axis=1, initial=9.0)
    error = np.where(np.isinf(error), UNKNOWN * (1 + away), error)
    picks: list[int] = []
    while (
        len(picks) < min(2, search.points - len(search.tried)) and error.max(initial=0.0) > wanted
    ):
        picks.append(int(np.argmax(error)))
        error[np.abs(place - place[picks[-1]]) < SPREAD] = 0.0
    return picks


def _largest(answers: Answers) -> Answers:
    """The largest at every frequency that has any, in the order of the frequencies."""
    order = np.lexsort((answers.size, answers.point))
    last = np.diff(answers.point[order], append=-1) != 0
    return _those(answers, order[last])


def _those(answers: Answers, chosen: Mask | Indices) -> Answers:
    return replace(answers, **{name: getattr(answers, name)[chosen] for name in vars(answers)})


def _response(base: Response, search: _Search) -> Response:
    n = len(base.frequency)
    highest = _largest(corrected_answers(search.surface, search.load, search.anchors, ACCURACY))
    claimed = _largest(search.claimed())
    amplitude, error, size = np.zeros(n, complex), np.full(n, np.inf), np.zeros(n)
    amplitude[claimed.point], error[claimed.point] = claimed.amplitude, claimed.error
    size[highest.point] = highest.size
    known, larger = np.zeros(n, dtype=bool), np.zeros(n, dtype=bool)
    known[claimed.point] = True
    larger[claimed.point] = size[claimed.point] > claimed.size * (1 + 1e-9)
    # what the surface has above the table may be no branch of this response
    larger &= (base.flag == OUTSIDE) | (False if base.outgrown is None else base.outgrown)
    return replace(
        base,
        variant="auto",
        amplitude=amplitude,
        iterations=np.zeros(n, np.int64),
        contraction=np.zeros(n),
        flag=np.where(known, CONVERGED, OUTSIDE),
        error_indicator=error,
        outgrown=larger if larger.any() else None,
        anchors=tuple(sorted(search.anchors, key=lambda one: one.frequency)),
    )


def unsure(response: Response, wanted: float) -> Array:
    """Frequencies, Hz, whose stated error is above what is wanted."""
    assert response.error_indicator is not None
    answered = response.flag == CONVERGED
    return response.frequency[answered & ~(response.error_indicator <= wanted)]
