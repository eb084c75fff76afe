"""Time integration beside harmonic balance: where no branch leads, and what an amplitude is off by.

A response of harmonic balance is a state to integrate from. Where the motion stays, the two methods have
the same response, and their difference says what the harmonics left out do to its amplitude:

    e = distance(A_H, A_s) + max(distance(A_s, A_{s/2}), distance(A_{s/2}, A_{s/4}) / 2) / (sqrt(2) - 1),

A_s the amplitude of time integration with s steps per cycle, whose error falls with the root of the step or
faster; steps are doubled until it is small. With more steps a motion may lock in other tractions, which
changes its amplitude as well: where the error is still large with all of them, it is told by half as many
that start from the finer motion and stay with it. Motions from one and the same state with another number of
steps may lock in other tractions too: what a good response is off by has the difference of two of these in
the place of the second term, where that is larger (`OverTime.with_pasts`). Where the motion leaves (the
response is not stable) or does not settle there is no such estimate.

Differences of amplitudes are measured by `points.distance`: near a resonance the phase turns by a radian over
the width of the peak, and what moves that by a hundredth of its width changes the complex amplitude by a
hundredth and the size by next to nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from microslip.analyses.harmonic.operator import linear_operator
from microslip.analyses.harmonic.points import PULL, HarmonicPoint, distance
from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.time.resting import CLOSE, NARROW, rested
from microslip.analyses.time.scheme import (
    State,
    TimeScheme,
    contact_memory,
    prestressed_state,
    time_scheme,
)
from microslip.analyses.time.starts import Start, end_of
from microslip.analyses.time.steady import RAISED, SteadyState, raised_state, steady_state
from microslip.brief import Brief
from microslip.contact.pairs import mean_slip
from microslip.errors import ContactError
from microslip.numerics.fourier import to_complex
from microslip.typing import Array, Complex

STEPS = 300
"""Steps per cycle from rest."""

FEWEST, MOST_STEPS = 150, 2400
"""Steps per cycle beside a response, at first and at most."""

LOOKED_FOR = 1200
"""Steps per cycle at most where none with fewer has found the motion."""

SLOWEST = 0.5
"""Power of the step that errors of an amplitude fall with at least. They fall with the first to second where
they are large; where they are as small as what the pasts of two searches leave, next to not at all."""

OWN = 3e-4
"""Relative error of time integration at which its steps are enough."""

CYCLES, SETTLED = 150, 1e-4
"""Cycles at most of a steady cycle from rest; change per cycle at which it is steady enough for a start."""

CYCLES_BESIDE, SETTLED_BESIDE = 80, 1e-5
"""The same of a motion that starts from a response."""

CYCLES_MORE = 320
"""Cycles more for a motion that has neither settled nor left by then, until one has not settled in these."""

LEFT = 0.1
"""Relative difference of amplitudes from which on a motion has left the response that it started from."""


@dataclass(frozen=True, repr=False)
class MotionBeside(Brief):
    """The steady motion that time integration makes of a response.

    Attributes
    ----------
    steady : SteadyState
    own : float
        Relative error of its amplitude: `own_error` of the differences from half as many steps per cycle.
    walked : float
        How far the bodies have been brought on: until they rest, or after `offset.HORIZON` cycles, m.
    changed : float
        Relative change of the amplitude on that way, as far as it is known: less `resting.NARROW`.
    pasts : float
        Relative change of the amplitude with the tractions that another past locks in, as far as that has
        been asked.
    """

    steady: SteadyState
    own: float
    walked: float = 0.0
    changed: float = 0.0
    pasts: float = 0.0

    @property
    def leaves_open(self) -> float:
        """Relative error of its amplitude, with what other pasts make of it."""
        return max(self.own, self.pasts)

    def error_of(self, point: HarmonicPoint) -> float:
        """Relative error of the amplitude of a response, with what standing elsewhere makes of it."""
        apart = distance(point.amplitude, self.steady.amplitude)
        return apart + self.leaves_open + self.elsewhere(point)

    def elsewhere(self, point: HarmonicPoint) -> float:
        """What the amplitude changes by between where the bodies stand in a response, and in the motion."""
        if self.walked == 0:
            return 0.0
        away = mean_slip(point.v[:, 0] - _mean(self.steady), point.problem.dimension)
        return self.changed * float(np.linalg.norm(away)) / self.walked

    def same_as(self, other: MotionBeside) -> bool:
        """Whether another is this one found twice, as far as their errors tell."""
        one, two = self.steady, other.steady
        apart = distance(one.amplitude, two.amplitude)
        return one.frequency == two.frequency and apart <= max(self.leaves_open, other.leaves_open)

    def tells(self, amplitude: complex) -> bool:
        """Whether an amplitude is farther off than the error of the motion itself."""
        return distance(amplitude, self.steady.amplitude) > self.leaves_open


class OverTime:
    """Steady cycles of time integration under one load.

    Parameters
    ----------
    joint : PreparedJoint
    load : float
        Amplitude of the driven port.
    port : str, optional
        The joint's own by default.
    """

    def __init__(self, joint: PreparedJoint, load: float, port: str | None = None) -> None:
        self.joint, self.load, self.port = joint, float(load), port

    def from_rest(self, frequency: float) -> SteadyState:
        """Cycle from rest, the load raised slowly.

        It need not have settled: where Newton's method gets to from there is a response all the same.
        """
        scheme = self._scheme(frequency, STEPS)
        start = raised_state(scheme, frequency, self.load, RAISED)
        return steady_state(
            scheme, frequency, self.load, start=start, tolerance=SETTLED, max_cycles=CYCLES
        )

    def beside(self, point: HarmonicPoint) -> MotionBeside | None:
        """The motion from the state of a response; None where it leaves that, or does not settle.

        First from rest where the response walks or only the supports hold it in place: these would take it
        back for a long time. From rest there may be another motion; then from its own state.
        """
        scheme = self._scheme(point.frequency, FEWEST)
        if supported(point):
            with suppress(ContactError):
                state = raised_state(scheme, point.frequency, self.load, RAISED)
                found = self._refined(point, end_of(state, 0.0, scheme, point.frequency))
                if found is not None:
                    return found
        state = state_from_point(scheme, point)
        with suppress(ContactError):
            return self._refined(point, end_of(state, 0.0, scheme, point.frequency))
        return None

    def again(self, point: HarmonicPoint, known: MotionBeside) -> MotionBeside:
        """The motion from the state of a response, where that of one with other harmonics is known.

        With as many steps per cycle as the known one, which is kept where this one leaves or does not settle,
        and where it is one from rest. Bodies that slide sideways by little per cycle count as settled where
        their start has put them: from its own state, where the response has them.

        Where the known one has not enough steps, or other tractions are locked in with more of them, it has
        `MOST_STEPS`, and its own error is its difference from the one with half as many that stays with it.
        """
        if supported(point):
            return known
        found = self._from_own_state(point, known.steady.steps if known.own <= OWN else MOST_STEPS)
        if found is None:
            return known
        return replace(known, steady=found, own=self._own_error(found, known.own))

    def with_pasts(self, point: HarmonicPoint, known: MotionBeside) -> MotionBeside:
        """The motion from the state of a response, with what other pasts make of its amplitude.

        That is its difference from the motion from the same state with half as many steps: where many
        tractions may lock in, that has others, though each is as steady as the other.
        """
        if supported(point):
            return known
        other = self._from_own_state(point, known.steady.steps // 2)
        if other is None:
            return known
        apart = distance(other.amplitude, known.steady.amplitude)
        return replace(known, pasts=max(known.pasts, apart))

    def _from_own_state(self, point: HarmonicPoint, steps: int) -> SteadyState | None:
        """The steady motion from the state of a response; None where there is none next to it."""
        scheme = self._scheme(point.frequency, steps)
        start = end_of(state_from_point(scheme, point), 0.0, scheme, point.frequency)
        found, _ = self._settled(point.frequency, point.amplitude, steps, start, CYCLES_MORE)
        return found

    def _own_error(self, finer: SteadyState, known: float) -> float:
        """Relative error of the amplitude of a motion, from what is known of it.

        Where that is not small, by one with half as many steps that stays with it, if that is less: one with
        more steps that starts from another may lock in other tractions, and differ by more.
        """
        if known <= OWN:
            return known
        frequency, near, steps = finer.frequency, finer.amplitude, finer.steps // 2
        coarse, _ = self._settled(frequency, near, steps, finer.end, CYCLES_MORE)
        return (
            known if coarse is None else min(known, own_error([distance(coarse.amplitude, near)]))
        )

    def _refined(self, point: HarmonicPoint, start: Start) -> MotionBeside | None:
        """The motion next to a response, from a start, with as many steps as it needs.

        A coarse one that leaves the response does not say that finer ones do. Where its bodies walk it is
        brought on to where they rest, or are after `offset.HORIZON` cycles, and finer ones stay there.
        """
        walking = supported(point)
        found: SteadyState | None = None
        finer: SteadyState | None
        brought: MotionBeside | None = None
        near, steps, changes, more = point.amplitude, FEWEST, [np.inf], CYCLES_MORE
        while steps <= MOST_STEPS and own_error(changes) > OWN:
            if walking and found is None:
                brought = self._brought_on(point, start, steps)
            if brought is not None and found is None:
                finer, lingers, near = brought.steady, False, brought.steady.amplitude
            else:
                finer, lingers = self._settled(point.frequency, near, steps, start, more)
            more = 0 if lingers else more
            steps *= 2
            if finer is None and (found is not None or steps > LOOKED_FOR):
                break
            if finer is None:
                continue
            if found is not None:
                changes.append(distance(finer.amplitude, found.amplitude))
            found, start = finer, finer.end
        if found is None or len(changes) == 1:
            return None
        own = self._own_error(found, own_error(changes))
        if brought is None:
            return MotionBeside(found, own)
        return replace(brought, steady=found, own=own + brought.own)

    def _brought_on(self, point: HarmonicPoint, start: Start, steps: int) -> MotionBeside | None:
        """The motion from a start with its bodies where they rest, or are after `offset.HORIZON` cycles.

        Its own error is that of the place. None where they do not walk, or the motion leaves the response
        before they have.

        Raises
        ------
        WalksOnError
            Where that is not found.
        """
        scheme, dimension = self._scheme(point.frequency, steps), self.joint.model.dimension
        memory = contact_memory(scheme)
        try:
            steady = steady_state(
                scheme,
                point.frequency,
                self.load,
                start=start,
                tolerance=CLOSE,
                max_cycles=CYCLES_BESIDE,
                memory=memory,
            )
        except ContactError:
            return None
        if distance(steady.amplitude, point.amplitude) > LEFT:
            return None
        rest = rested(scheme, steady, SETTLED_BESIDE, memory, start)
        if rest is None:
            return None
        way = mean_slip(_mean(rest.steady) - _mean(steady), dimension)
        changed = distance(rest.steady.amplitude, steady.amplitude) - NARROW
        return MotionBeside(rest.steady, rest.apart, float(np.linalg.norm(way)), max(changed, 0.0))

    def _settled(
        self, frequency: float, near: complex, steps: int, start: Start, more: int
    ) -> tuple[SteadyState | None, bool]:
        """The steady motion from a start; None where there is none, or its amplitude is not `near`.

        One that is still near that after `CYCLES_BESIDE` has `more` cycles to settle in; with it goes
        whether it has not settled in these either.
        """
        found: SteadyState | None = None
        for cycles in (CYCLES_BESIDE, more):
            if cycles == 0 or (found is not None and found.converged):
                break
            try:
                found = steady_state(
                    self._scheme(frequency, steps),
                    frequency,
                    self.load,
                    start=start if found is None else found.end,
                    tolerance=SETTLED_BESIDE,
                    max_cycles=cycles,
                    halves=found is None,
                )
            except ContactError:
                return None, False
            if distance(found.amplitude, near) > LEFT:
                return None, False
        assert found is not None
        return (found, False) if found.converged else (None, more > 0)

    def _scheme(self, frequency: float, steps: int) -> TimeScheme:
        return time_scheme(self.joint, 1 / (frequency * steps), port=self.port, frequency=frequency)


def _mean(steady: SteadyState) -> Array:
    """Relative displacements of a motion, (d m,), mean over its cycle, m."""
    return np.asarray(steady.cycle.v[:-1].mean(axis=0))


def supported(point: HarmonicPoint) -> bool:
    """Whether soft supports alone hold the bodies of a response, or nothing does.

    From another place they would take them back for a long time.
    """
    return point.pull > PULL or point.problem.walks


def own_error(changes: Sequence[float]) -> float:
    """Relative error of the last of some amplitudes with doubled steps.

    What is left after a change is ``change / (2^p - 1)`` where errors fall with the power p of the step;
    that is taken as `SLOWEST`.

    Parameters
    ----------
    changes : sequence of float
        Infinity of the first, then the distance of each from the one before.
    """
    last = max(changes[-1], 0.5 * changes[-2]) if len(changes) > 2 else changes[-1]
    return last / (2**SLOWEST - 1)


def state_from_point(scheme: TimeScheme, point: HarmonicPoint) -> State:
    """State of a response at phase 0 of the load, to integrate over time from.

    Parameters
    ----------
    scheme : TimeScheme
        Of the same joint; modes that it does not follow are in its residual part.
    point : HarmonicPoint
    """
    rest, model = prestressed_state(scheme), scheme.joint.model
    operator = linear_operator(point.problem, 2 * np.pi * point.frequency)
    followed = len(model.omega)
    eta = operator.modes(*point.problem.split(point.w), point.load)[:, :followed]
    i_omega = 1j * operator.omega * np.arange(len(eta))[:, None]
    own = scheme.dt / scheme.kernel.mode_step
    r, v, position = (_at_zero(Y) for Y in (to_complex(point.r), to_complex(point.v), eta))
    return replace(
        rest,
        eta=position,
        rate=_at_zero(i_omega * eta) * own,
        acceleration=_at_zero(i_omega**2 * eta) * own**2,
        residual_v=v - model.mode_v @ position,
        residual_before=v - model.mode_v @ position,
        r=r,
        v=v,
        status=point.status[:, 0].copy(),
    )


def _at_zero(Y: Complex) -> Array:
    """Value at phase 0 of harmonics (H + 1, n)."""
    return np.asarray(Y[0].real + Y[1:].imag.sum(axis=0))
