"""Steady states along a response, each with a past of its own.

Pairs that stick all the time keep the tractions that the past has left them, and a steady state depends on
them. A state that starts from its neighbour inherits that neighbour's, and with it whatever the motion at a
resonance has locked in, along the whole branch. So each begins at rest: at prestress, with the velocity
of the motion that is expected, and once more with the load raised from rest, the past that is meant where
none is given (`raised_state`). Where the two differ that of the raised load is the answer, and it is raised
over another number of cycles as well: by how much those two differ is how well the answer is known. By how
much it differs from the other past is another question, whose answer is kept beside it.

What a search finds is periodic, and motions may leave it all the same: that is asked of each
(`microslip.pipeline.more_steps`), and what they leave is none.

Where the start from rest ends in a smaller motion than is expected the search goes on from the states
beside, one or both: that follows the branch of a fold. Where rest with the velocity of what is found there
leads to the same motion, that is kept.

What the search ends with is worth what is left of its transients: the last change times the cycles
that they last. Where it cannot be made finer, as pairs on the verge of slip have the motion wander from
one nearly periodic state to the next, it is known no better than how far a longer search leads away. A motion
that still changes is looked at over `WATCHED` cycles more; if its amplitude stays the same to `DOUBTFUL`, its
mean counts, with how far it strays and drifts as its doubt.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.time.classify import motion_of
from microslip.analyses.time.offset import elsewhere
from microslip.analyses.time.readings import opening_of
from microslip.analyses.time.resting import Rested, WalksOnError, at_phase_0, may_walk
from microslip.analyses.time.scheme import State, TimeScheme, time_scheme
from microslip.analyses.time.starts import Start, end_of, mixed
from microslip.analyses.time.staying import LEAVES
from microslip.analyses.time.steady import RAISED, SteadyState, raised_state, steady_state
from microslip.analyses.time.watching import to_come, watched
from microslip.contact.pairs import mean_slip
from microslip.errors import JointOpensError, MicroslipError
from microslip.numerics.execute import each, threads
from microslip.pipeline.more_steps import FARTHEST, apart, with_more_steps
from microslip.pipeline.targets import LEFT, TOLERANCE, Found, Lost, More, Stepped, Target
from microslip.pipeline.walked import (
    SOUGHT,
    after_raising,
    counted_from,
    kicked,
    rested_soon,
    searched_from,
)

WARM, COLD = 50, 100
"""Cycles at most: from states beside; from rest, and after the load was raised if that leads to nothing."""

FINE, FINER = 1e-7, 30
"""Relative change over a cycle to which the search goes on from a steady state, for so many cycles at most:
where there is a fixed point it takes five, else the motion may go elsewhere."""

LASTS, LONGEST = 100.0, 1000.0
"""Cycles that transients are taken to last at least and at most; in between the search's estimate of the
slowest multiplier tells."""

WATCHED = 40
"""Cycles over which a motion that still changes is looked at."""

FALLING = 0.5
"""A motion whose amplitude is doubted by more is on its way to another."""

AGAIN = 5e-3
"""Doubt above which the search goes on, from where the motion then is; difference of the motions after two
pasts above which it is that of what more steps make of them."""

DOUBTFUL = 0.05
"""Doubt of the amplitude beyond which a motion is no steady state."""

WALKING = 1e-4
"""Change over a cycle that is said of a motion whose bodies walk to a place that is not found: it has not
settled, though its vibration repeats, and may fall from its branch on the way."""

OTHER = 0.1
"""Motions whose sizes differ by more, in logarithm, are not the same one with another past."""

VARIED = 1.05 * np.exp(0.05j)
"""Where the load raised from rest ends in another motion, the other past starts with so many times the
velocity."""

RAISED_AGAIN, SAME = 16, 5e-4
"""Cycles over which the load is raised once more where that ends in an amplitude that differs by more."""

TELLS = 3e-4
"""Change over a cycle below which a motion from another past tells of it, though it may not have settled."""


def sought(joint: PreparedJoint, targets: Sequence[Target]) -> Iterator[Found | Lost]:
    """Steady states in the order of the targets."""

    def work(target: Target) -> Found | Lost:
        try:
            return seek(joint, target)
        except MicroslipError as error:
            return Lost(str(error), 0)

    return each(work, targets, threads())


def seek(joint: PreparedJoint, target: Target) -> Found | Lost:
    """One steady state: from rest, then where that is smaller than expected from the starts in turn.

    Where none of these leads to one, after the load was raised.
    """
    f = target.frequency
    search = _Seeking(time_scheme(joint, 1 / (f * target.steps), frequency=f), target)
    found = search.attempt(None, target.guess, COLD) if target.cold else None
    if found is None or abs(found.amplitude) < np.exp(-OTHER) * target.expected:
        for mixture in target.starts:
            beside = search.attempt(mixed(mixture), 0.0, WARM)
            if beside is not None and (found is None or _apart(beside, found) > OTHER):
                again = search.motion(None, beside.amplitude, WARM)
                same = again is not None and abs(_apart(again, beside)) <= OTHER
                found = again if same else beside
                break
    if found is None and target.cold and not search.opened:
        found = search.from_raised()
    if found is None:
        return search.lost()
    fell = search.larger > np.exp(OTHER) * abs(found.amplitude)
    if found.doubt <= AGAIN:
        found = search.at_rest(search.meant(found))
    return replace(found, cycles=search.spent, fell=fell, opens=search.opened)


def may_be_shown(doubt: float, varies: float) -> bool:
    """Whether a motion may be shown by its mean, of whose doubt so much is what it varies by, relative."""
    return varies <= LEAVES and doubt - varies <= DOUBTFUL


def _apart(one: Found, other: Found) -> float:
    """By how much one is larger, in logarithm."""
    return float(np.log(abs(one.amplitude) / abs(other.amplitude)))


def _ratio(other: SteadyState | Found, found: SteadyState | Found) -> float:
    """Size over that of a motion that was found."""
    return abs(other.amplitude) / abs(found.amplitude)


def _tells(other: SteadyState, found: Found) -> bool:
    """Whether a motion is that found but for its past, and settled far enough to tell of it."""
    return other.change <= TELLS and abs(np.log(max(_ratio(other, found), 1e-300))) <= OTHER


class _Seeking:
    """The search for one steady state: what it has met and spent."""

    def __init__(self, scheme: TimeScheme, target: Target) -> None:
        self.scheme, self.target = scheme, target
        self.spent, self.reason = 0, ""
        self.ended: SteadyState | None = None
        self.larger, self.opened, self.left = 0.0, False, False
        self.after_raising: tuple[State, SteadyState] | None = None

    def attempt(self, start: Start | None, guess: complex, cycles: int) -> Found | None:
        """As `motion`, if motions stay beside it."""
        found = self.motion(start, guess, cycles)
        return found if found is None or found.change > TOLERANCE else self.stays(found)

    def stays(self, found: Found) -> Found | None:
        """The same, unless motions leave it."""
        more = self._sought_on(found.amplitude, found.state)
        if may_be_shown(more.strays, more.varies):
            doubt = max(found.doubt, more.strays - more.varies) + more.varies
            return replace(found, doubt=doubt, varies=more.varies, more=more)
        self.larger = max(self.larger, abs(found.amplitude))
        self.left, self.reason = True, LEFT
        return None

    def motion(self, start: Start | None, guess: complex, cycles: int) -> Found | None:
        """A motion from a start, or from rest with the velocity of a guess, if it is steady."""
        self.left = False
        try:
            steady = _searched(self.scheme, self.target, start, TOLERANCE, cycles, guess)
            self.spent += steady.cycles
            opens = opening_of(steady.cycle, self.scheme.joint.model.position)
            if opens:
                self.reason, self.opened = self.reason or opens, True
                self.ended, self.larger = steady, np.inf
                return None
            found = _weighed(self.scheme, self.target, steady)
            self.spent += found.cycles
        except MicroslipError as error:
            self.reason = self.reason or str(error)
            self.opened = self.opened or isinstance(error, JointOpensError)
            return None
        if found.doubt > AGAIN:
            found, more = _again(self.scheme, self.target, found)
            self.spent += more
        if found.doubt <= DOUBTFUL:
            return found
        self.ended = steady
        if found.doubt < FALLING:
            self.larger = max(self.larger, abs(found.amplitude))
        self.reason = (
            f"not steady after {self.spent} cycles, last change {found.change:.1e}, the "
            f"amplitude known to {found.doubt:.0%}"
        )
        return None

    def meant(self, found: Found) -> Found:
        """The motion after the load was raised from rest, where that differs from this by its past alone.

        That is the one that is meant by convention; raised over another number of cycles it tells how well it
        is known. Where raising the load leads to another branch, another velocity has to tell.
        """
        raised = self.raised(found, RAISED)
        past = np.nan if raised is None else self.apart(raised, found, found.more)
        if raised is None or np.isnan(past):
            return replace(found, scatter=self.varied(found))
        if past <= SAME:
            return replace(found, past=past, scatter=past)
        again = self.raised(found, RAISED_AGAIN)
        scatter = np.nan if again is None else self.apart(again, raised)
        # what cannot be told of another ramp is told by the other past
        scatter = past if np.isnan(scatter) else scatter
        try:
            answer = _weighed(self.scheme, self.target, raised)
        except MicroslipError:
            return replace(found, past=past, scatter=past)
        self.spent += answer.cycles
        if answer.change <= TOLERANCE:
            answer = self.stays(answer) or found
        return replace(answer, past=past, scatter=scatter)

    def at_rest(self, found: Found) -> Found:
        """The same where bodies that walk have come to rest, or are after `offset.HORIZON` cycles."""
        scheme, frequency = self.scheme, self.target.frequency
        try:
            there = self._walked(found)
            if there is None:
                return found
            self.spent += there.cycles
            end = end_of(at_phase_0(scheme, there.steady), 0.0, scheme, frequency)
            offset = there.offset
            if offset is None:  # where they are by then
                offset = mean_slip(there.steady.cycle.state.v, scheme.joint.model.dimension)
        except WalksOnError:
            # the vibration repeats, but where it has gone by then is not known: it has to be marched
            return replace(
                found, change=max(found.change, WALKING), doubt=max(found.doubt, DOUBTFUL)
            )
        except MicroslipError:
            return found
        return replace(
            found,
            amplitude=there.steady.amplitude,
            change=there.steady.change,
            doubt=there.apart + LASTS * there.steady.change,
            state=end,
            rest=offset,
            lasts=there.lasts,
            ahead=there.ahead,
            around=there.around,
            began=there.began,
            varies=0.0,
            more=None,
        )

    def _walked(self, found: Found) -> Rested | None:
        """Counted from the raised load where that leads to the same branch, else from rest with its velocity,
        else from where they are.

        None where they do not walk.
        """
        steady = _searched(self.scheme, self.target, found.state, TOLERANCE, SOUGHT)
        self.spent += steady.cycles
        if not may_walk(steady, self.scheme):
            return None
        size = abs(found.amplitude)
        begun = self.after_raising
        if begun is None or elsewhere(abs(begun[1].amplitude), (size, size)):
            begun = self._kicked(found.amplitude)
        if begun is not None and (own := counted_from(self.scheme, *begun, size)) is not None:
            return own
        return rested_soon(self.scheme, steady, found.state)

    def _kicked(self, amplitude: complex) -> tuple[State, SteadyState] | None:
        """What began at rest with the velocity of a motion, and what a search from there ends in."""
        load = self.target.load
        try:
            begun = searched_from(self.scheme, load, kicked(self.scheme, load, amplitude))
        except MicroslipError:
            return None
        self.spent += 1 + begun[1].cycles
        return begun

    def from_raised(self) -> Found | None:
        """The motion after the load was raised."""
        target = self.target
        try:
            state = raised_state(self.scheme, target.frequency, target.load, RAISED)
        except MicroslipError as error:
            self.reason = self.reason or str(error)
            return None
        self.spent += RAISED
        return self.attempt(end_of(state, 0.0, self.scheme, target.frequency), 0.0, COLD)

    def raised(self, found: Found, cycles: int) -> SteadyState | None:
        """The motion after the load was raised over so many cycles; None where that is another."""
        try:
            self.spent += cycles
            start, other = after_raising(self.scheme, self.target.load, cycles)
        except MicroslipError:
            return None
        self.spent += other.cycles
        self.after_raising = self.after_raising or (start, other)
        return other if _tells(other, found) else None

    def varied(self, found: Found) -> float:
        """Relative difference to the amplitude after another velocity; nan where that is another motion."""
        guess = VARIED * found.amplitude
        try:
            other = _searched(self.scheme, self.target, None, TOLERANCE, SOUGHT, guess)
        except MicroslipError:
            return float("nan")
        self.spent += other.cycles
        return self.apart(other, found, found.more) if _tells(other, found) else float("nan")

    def apart(
        self, other: SteadyState, found: SteadyState | Found, known: More | None = None
    ) -> float:
        """Relative difference of two sizes, where it is large of what more steps make of them.

        Few steps may have a periodic motion that more have elsewhere, or that motions leave: nan where that
        is so of the other. Where more do not say what becomes of both, few do.
        """
        differ = abs(_ratio(other, found) - 1)
        if differ <= AGAIN or other.change > TOLERANCE:
            return differ
        try:
            more = self.with_more_steps(other)
            if known is None and isinstance(found, SteadyState) and found.change <= TOLERANCE:
                known = self.with_more_steps(found)
        except MicroslipError:
            return differ
        moved = more.amplitude is not None and apart(other.amplitude, more.amplitude) > FARTHEST
        if moved or more.strays > DOUBTFUL:
            return float("nan")
        if more.amplitude is None or known is None or known.amplitude is None:
            return differ + more.strays
        return apart(known.amplitude, more.amplitude) + more.strays

    def with_more_steps(self, steady: SteadyState) -> More:
        """What a settled motion has become with more steps."""
        state = at_phase_0(self.scheme, steady)
        start = end_of(state, 0.0, self.scheme, self.target.frequency)
        return self._sought_on(steady.amplitude, start)

    def _sought_on(self, amplitude: complex, start: Start) -> More:
        target = self.target
        one = Stepped(target.frequency, amplitude, start, target.steps)
        more = with_more_steps(self.scheme.joint, target.load, one)
        self.spent += more.cycles
        return more

    def lost(self) -> Lost:
        """What is said where nothing is steady."""
        return Lost(self.reason, self.spent, self.ended, self.opened, self.left)


def what_it_is(joint: PreparedJoint, frequency: float, steady: SteadyState, steps: int) -> str:
    """The kind of a motion that is not steady, in so many steps per cycle, and its evidence."""
    try:
        scheme = time_scheme(joint, 1 / (frequency * steps), frequency=frequency)
        return motion_of(scheme, steady).said
    except MicroslipError as error:
        return str(error)


def _searched(
    scheme: TimeScheme,
    target: Target,
    start: Start | State | None,
    tolerance: float,
    cycles: int,
    guess: complex = 0.0,
    halves: bool = True,
) -> SteadyState:
    return steady_state(
        scheme,
        target.frequency,
        target.load,
        guess=guess,
        tolerance=tolerance,
        max_cycles=cycles,
        start=start,
        halves=halves,
    )


def _weighed(scheme: TimeScheme, target: Target, steady: SteadyState) -> Found:
    """What a search ended with and how well it is known; `cycles` are those spent here."""
    state, spent, moved = at_phase_0(scheme, steady), 0, 0.0
    slowest = float(np.abs(steady.multipliers).max(initial=0.0))
    if steady.converged:
        start = end_of(state, 0.0, scheme, target.frequency)
        finer = _searched(scheme, target, start, FINE, FINER, halves=steady.halved)
        spent += finer.cycles
        if finer.converged:
            steady, state = finer, finer.cycle.state
        else:
            moved = abs(abs(finer.amplitude) / abs(steady.amplitude) - 1)
    left = max(steady.change * lasting(slowest), moved)
    if steady.converged:
        end = end_of(state, 0.0, scheme, target.frequency)
        return Found(steady.amplitude, steady.change, left, end, spent)
    Q, states = watched(scheme, target.load, state, WATCHED)
    size, mean = np.abs(Q), complex(Q.mean())
    doubt = float(np.abs(size / abs(mean) - 1).max()) + to_come(size) / abs(mean)
    end = end_of(states[-1], 0.0, scheme, target.frequency)
    return Found(mean, steady.change, doubt, end, spent + len(Q))


def _again(scheme: TimeScheme, target: Target, found: Found) -> tuple[Found, int]:
    """The search taken up where a motion was left, if that is better, and the cycles that it took."""
    try:
        steady = _searched(scheme, target, found.state, TOLERANCE, WARM)
        if opening_of(steady.cycle, scheme.joint.model.position):
            return found, steady.cycles
        other = _weighed(scheme, target, steady)
    except MicroslipError:
        return found, 0
    better = other if other.doubt < found.doubt else found
    return better, steady.cycles + other.cycles


def lasting(slowest: float, least: float = LASTS) -> float:
    """Cycles in which the slowest transient falls to a third, as far as the search has met it."""
    return float(np.clip(1 / max(1 - slowest, 1e-9), least, LONGEST))
