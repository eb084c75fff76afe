"""Where bodies that walk past each other come to rest.

Where the whole interface slips in every cycle the bodies move past each other as rigid ones, a little in
each, until soft supports hold them: after a thousand cycles or after a hundred thousand. All else follows
within some tens of cycles. So the motion is one of the offset u between the bodies, with

    du/dn = g(u)    per cycle,

and comes to rest where g has fallen to zero. Beyond, they either walk back, so that u is a fixed point like
any other but for its patience, or pairs that stick hold the bodies, wherever they are put. So that offset is
sought from the side on which they walk: the state is moved along the walk, what this has stirred goes, and
the motion there is looked at; the next move is that of the secant. A state is moved along the line through
the two nearest that were looked at: what a motion changes by in a cycle is a walk while that is fast, and
beside rest what is left of all else. Pairs that slip in every cycle keep nothing of how they were moved. The
last offset at which the bodies walk and the first at which they do not bound the amplitude where they come to
rest; where they walk back there, the speeds on both sides tell where between.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from microslip.typing import Array

RIGID = 0.05
"""What pairs move on by in a cycle may differ by so much of its mean where the bodies walk, and of the first
such mean beside rest."""

QUIET = 0.01
"""Share of that mean by which they may differ where nothing that a move has stirred is left."""

FIRST, FARTHER = 600.0, 8.0
"""Cycles of the first move, and times the last one that the next is at most."""

AT_MOST = 0.05
"""Relative change of the amplitude that a move may be expected to make, at first and between moves."""

BEYOND, CLOSE = 0.2, 3.0
"""Share by which a move is made longer than the secant says, until one has led to rest, and times that it is
where that is so close that the amplitude hardly changes any more: a speed may fall as a square does."""

NARROW = 1e-3
"""Relative change of the amplitude, where it is steepest, from where the bodies walk to where they rest, at
which it is known."""

STILL = 1e-9
"""Share of the first speed at which the bodies rest."""

SHORT, WITHIN = 0.95, np.array([0.1, 0.8])
"""Share of the way to where motions beside it rest that is made at first, and of that to where the bodies
rest that a move is at least and at most."""

SURELY, BESIDE = 2.0, 0.2
"""How many times as far as the speeds say the offset of rest may be from the nearer of two, and the share of
the way between them within which that one is close: the next look is then as far on the other side."""

NEARLY = 10.0
"""Times `NARROW` that the amplitude may change between two offsets whose speeds tell where between it is."""

SHORTER = 0.5
"""Share of a move that is made instead where it has led to another branch."""

LOOKS = 20
"""Offsets at most."""

HORIZON = 4000.0
"""Cycles after which a motion counts, where its bodies have not come to rest by then: that may take hours,
and lead farther than small displacements mean."""

TIMES = np.array([0.5, 0.6, 0.7, 0.8, 0.9, 1.1, 1.2, 1.3, 1.4, 1.5])
"""Of a number of cycles, after which bodies that walk faster or slower are as far."""

BRANCH = 0.3
"""Amplitudes that differ by more, in logarithm, are those of another branch."""


class Looked(NamedTuple):
    """A motion at an offset.

    Attributes
    ----------
    offset : (m, d - 1) array
        Tangential displacements at phase 0, mean of a window, as all of these are.
    rate : (m, d - 1) array
        By how much they change in a cycle.
    amplitude : complex
    vector, way : arrays
        The state, and its change per cycle.
    """

    offset: Array
    rate: Array
    amplitude: complex
    vector: Array
    way: Array

    @property
    def uneven(self) -> float:
        """By how much the rates of pairs differ from their mean."""
        return float(np.abs(self.rate - self.rate.mean(axis=0)).max())

    @property
    def along(self) -> Array:
        """Unit vector, (d - 1,), of the walk."""
        mean = self.rate.mean(axis=0)
        return np.asarray(mean / np.linalg.norm(mean))

    def at(self, along: Array) -> float:
        """Mean offset along a walk."""
        return float(self.offset.mean(axis=0) @ along)

    def speed(self, along: Array) -> float:
        """Mean rate along a walk."""
        return float(self.rate.mean(axis=0) @ along)


class Rest(NamedTuple):
    """Where the bodies come to rest.

    Attributes
    ----------
    amplitude : complex
    apart : float
        By how much its size may change, relative, from where they still walk to where they rest.
    vector : array
        The state there, or the last one in which they walk where they stick beyond.
    offset : (d - 1,) array
        Mean of the pairs there.
    cycles : float
        That the walk takes there, by the secants.
    looked : tuple of Looked
        The motions that walk, in their order.
    speed : float
        Zero; at which they walk on where they do not rest there: it is as far as was looked (`as_far`).
    """

    amplitude: complex
    apart: float
    vector: Array
    offset: Array
    cycles: float
    looked: tuple[Looked, ...]
    speed: float = 0.0

    def knowing(self, *more: Looked) -> Rest:
        """With more looks at the walk."""
        along = self.looked[0].along
        looked = sorted((*self.looked, *more), key=lambda one: one.at(along))
        return self._replace(looked=tuple(looked))

    def widest(self, until: Looked) -> Array:
        """State half-way between the two looks before one on the way that are farthest apart."""
        along = self.looked[0].along
        walk = [*(one for one in self.looked if one.at(along) < until.at(along)), until]
        if len(walk) < 2:
            return until.vector
        i = int(np.argmax(np.diff([one.at(along) for one in walk])))
        return 0.5 * (walk[i].vector + walk[i + 1].vector)

    def on_the_way(self, cycles: float = HORIZON) -> tuple[Array, complex] | None:
        """State and amplitude after so many cycles from the first look; None where the bodies rest by then.

        The speed is linear between two offsets. They rest where the amplitude is within `NARROW` of that.
        """
        along = self.looked[0].along
        u = [*(one.at(along) for one in self.looked), float(self.offset @ along)]
        g = [*(one.speed(along) for one in self.looked), self.speed]
        vectors = [*(one.vector for one in self.looked), self.vector]
        sizes = [*(one.amplitude for one in self.looked), self.amplitude]
        for i in range(len(self.looked)):
            way = u[i + 1] - u[i]
            if way <= 0:
                return None
            slope = (g[i] - g[i + 1]) / way
            lasts = _lasting(way, g[i], g[i + 1])
            if cycles < lasts:
                there = -g[i] * np.expm1(-slope * cycles) / slope if slope else g[i] * cycles
                share = there / way
                amplitude = (1 - share) * sizes[i] + share * sizes[i + 1]
                if not self.speed and abs(abs(amplitude) / abs(self.amplitude) - 1) <= NARROW:
                    return None
                return (1 - share) * vectors[i] + share * vectors[i + 1], amplitude
            cycles -= lasts
        return None

    def around(self, cycles: float = HORIZON, before: float = 0.0) -> float:
        """By how much the size differs after other numbers of cycles, per share that they differ by.

        The largest of ``|A(t n)/A(n) - 1|/|t - 1|`` for t in `TIMES`, n the cycles; linear between looks.

        Parameters
        ----------
        cycles : float
            Of the walk.
        before : float
            How many of them before the first look.

        Returns
        -------
        float
            Relative; nan where that is not known.
        """
        if TIMES[0] * cycles < before:
            return float("nan")
        sizes = list[float]()
        for times in (1.0, *TIMES):
            there = self.on_the_way(times * cycles - before)
            if there is None and self.speed:
                return float("nan")
            sizes.append(abs(self.amplitude if there is None else there[1]))
        differ = np.abs(np.array(sizes[1:]) / sizes[0] - 1)
        return float((differ / np.abs(TIMES - 1)).max())


def walks(rate: Array) -> bool:
    """Whether all pairs move on alike.

    Examples
    --------
    >>> walks(np.array([[1.0], [1.01], [0.99]])), walks(np.array([[1.0], [0.0], [0.5]]))
    (True, False)
    """
    mean = rate.mean(axis=0)
    return bool(np.abs(rate - mean).max() <= RIGID * np.linalg.norm(mean))


def elsewhere(size: float, sizes: tuple[float, float]) -> bool:
    """Whether a size is that of another branch than one with these, the least and the largest, if any.

    Examples
    --------
    >>> elsewhere(0.7, (0.5, 1.0)), elsewhere(0.7, (1.0, 1.0)), elsewhere(0.7, (0.0, 0.0))
    (False, True, False)
    """
    least, most = sizes
    return least > 0 and not least * np.exp(-BRANCH) <= size <= most * np.exp(BRANCH)


def come_to_rest(
    look: Callable[[Array], Looked],
    begin: Looked,
    guess: Array | None = None,
    narrow: float = NARROW,
) -> Rest | None:
    """Where a walk ends.

    Parameters
    ----------
    look : callable
        From a state to the motion after it has settled there.
    begin : Looked
        A motion that walks.
    guess : (d - 1,) array, optional
        Offset at which motions beside it have come to rest.
    narrow : float
        Relative error of the amplitude at which it is known.

    Returns
    -------
    Rest or None
        None where the bodies do not come to rest within `LOOKS` offsets, some of them beyond the end of the
        branch, or what moves is no longer a walk.
    """
    along = begin.along

    def at(one: Looked) -> float:
        return one.at(along)

    def speed(one: Looked) -> float:
        return one.speed(along)

    first = speed(begin)
    walking, resting, back = [begin], None, False
    move, cycles, end = FIRST * first, 0.0, np.inf
    if guess is not None and guess @ along > at(begin):
        move = SHORT * (float(guess @ along) - at(begin))
    for _ in range(LOOKS):
        last = walking[-1]
        known = [*walking, resting] if back and resting is not None else walking
        to = at(last) + move
        one = look(_moved(known[-2:], to, at, first))
        if _of_another_branch(one, last):  # that of the walk may go on less far, and no farther
            end = to
            if resting is not None and at(resting) >= end:
                resting, back = None, False
            move = SHORTER * (end - at(last))
            continue
        if one.uneven > RIGID * first:
            return None
        if _walks_on(one, along, first):
            cycles += max(move, 0.0) / max(speed(last), speed(one))
            walking.append(one)
        else:
            resting, back = one, speed(one) < 0 and walks(one.rate)
        last = walking[-1]
        if resting is not None:
            left = at(resting) - at(last)
            if left <= 0:  # bodies that rest behind those that walk rest at some other place
                return None
            # two amplitudes may agree by chance, beside the largest one of all offsets
            steepest = max(_turn(one, next_, at) for one, next_ in pairwise([*walking, resting]))
            if back:
                on = left * speed(last) / (speed(last) - speed(resting))
                apart = steepest * SURELY * min(on, left - on)
                if apart <= narrow and steepest * left <= NEARLY * NARROW:
                    return _between(walking, resting, on / left, apart, cycles, back=True)
                move = _crossing(on, left)
                continue
            if steepest * left <= narrow:
                return _between(walking, resting, 0.5, steepest * left, cycles, back=False)
        move = _secant(walking, at, speed)
        if resting is None:
            turn = _turn(walking[-2], walking[-1], at)
            if turn * (end - at(last)) <= narrow:  # before they rest their branch ends
                return None
            move *= 1 + BEYOND if move * turn > narrow / CLOSE else CLOSE
            move = min(move, FARTHER * (at(last) - at(walking[-2])), AT_MOST / turn)
            move = min(move, SHORTER * (end - at(last)))
        else:
            inside = move <= left * (1 + STILL)
            move = float(np.clip(move, *(left * WITHIN))) if inside else 0.5 * left
    return None


def as_far(looked: Sequence[Looked]) -> Rest | None:
    """What looks at a walk, in their order, say of it where its end is not known: as far as they go.

    None where that is not farther than the first. After one that does not walk on, or that is of another
    branch, those beyond it do not count.
    """
    first = looked[0]
    along, walking, end = first.along, [first], np.inf
    for one in looked[1:]:
        last, here = walking[-1], one.at(along)
        farther = here > last.at(along) and _walks_on(one, along, first.speed(along))
        if not farther or _of_another_branch(one, last):
            end = min(end, here)
        elif here < end:
            walking.append(one)
    *before, last = walking
    if not before:
        return None
    place = last.offset.mean(axis=0)
    speed = last.speed(along)
    return Rest(last.amplitude, 0.0, last.vector, place, np.inf, tuple(before), speed)


def _moved(known: list[Looked], to: float, at: Callable[[Looked], float], first: float) -> Array:
    """The state at an offset, on the line through two, or along the walk from one."""
    if len(known) == 1:
        return known[0].vector + (to - at(known[0])) / first * known[0].way
    one, other = known
    share = (to - at(one)) / (at(other) - at(one))
    return np.asarray((1 - share) * one.vector + share * other.vector)


def _crossing(on: float, left: float) -> float:
    """How far the next look is from the last at which they walk, where they come to rest so far on."""
    near = min(on, left - on)
    if near < BESIDE * left:
        on += SURELY * near if near == on else -SURELY * near
    return on


def _between(
    walking: list[Looked],
    resting: Looked,
    share: float,
    apart: float,
    cycles: float,
    back: bool,
) -> Rest:
    """Where bodies come to rest between two offsets; in the state before where they stick beyond."""
    on, last = share if back else 0.0, walking[-1]
    return Rest(
        (1 - share) * last.amplitude + share * resting.amplitude,
        apart,
        (1 - on) * last.vector + on * resting.vector,
        ((1 - on) * last.offset + on * resting.offset).mean(axis=0),
        cycles,
        tuple(walking),
    )


def _lasting(way: float, first: float, last: float) -> float:
    """Cycles of a way along which the speed changes linearly; endless where it falls to zero on it.

    Examples
    --------
    >>> round(_lasting(1.0, 0.2, 0.1), 3), _lasting(1.0, 0.2, 0.0), _lasting(1.0, 0.2, -0.1)
    (6.931, inf, inf)
    """
    if first * last <= 0:
        return np.inf
    return way / first if first == last else way * float(np.log(first / last)) / (first - last)


def _walks_on(one: Looked, along: Array, first: float) -> bool:
    """Whether bodies still move on along a walk that was so fast at first."""
    return one.speed(along) > STILL * first and walks(one.rate)


def _of_another_branch(one: Looked, last: Looked) -> bool:
    size = abs(last.amplitude)
    return elsewhere(abs(one.amplitude), (size, size))


def _times(one: Looked, other: Looked) -> float:
    """Size over another."""
    return abs(one.amplitude) / abs(other.amplitude)


def _secant(
    walking: list[Looked], at: Callable[[Looked], float], speed: Callable[[Looked], float]
) -> float:
    """How far it still is to where the last two speeds lead to rest; infinite where they do not."""
    if len(walking) < 2:
        return np.inf
    before, last = walking[-2:]
    slope = (speed(last) - speed(before)) / (at(last) - at(before))
    return -speed(last) / slope if slope < 0 else np.inf


def _turn(before: Looked, last: Looked, at: Callable[[Looked], float]) -> float:
    """Relative change of the amplitude over a move, per offset."""
    return max(abs(_times(last, before) - 1), 1e-12) / (at(last) - at(before))
