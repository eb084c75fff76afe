"""Motions that wander about a mean: means over blocks of cycles scatter, and go nowhere.

Where contact beats against a vibration that hardly decays the size varies from cycle to cycle for good, and
not evenly: the mean over a window differs from the next by a part in a thousand, now up and now down. What
one window differs by from that before is no drift then. A straight line through the means of many tells what
is: its slope, and what that is not known by for their scatter.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from microslip.pipeline.ringing import GROWS
from microslip.typing import Array, Complex

FEWEST = 12
"""Blocks through which the line is laid, at least."""

CROSSES = 0.25
"""Share of the blocks after which the line is crossed, at least: what bends crosses it twice, what scatters
without memory after every other one."""

SURE = 2.0
"""Standard errors of the slope that it may be off by."""

LATEST, BEYOND = 3, 4.0
"""Last blocks that may not be off the line through those before, and by how many times the standard error
that one has there: what has begun to leave shows in them first."""

MOST = 0.8
"""Correlation of neighbours about the line, at most: what has more in common crosses it less often."""

SMOOTHED = 2
"""Times that means are smoothed by their neighbours at most, where that has the slope known better: what
beats from one to the next is no drift."""

WEIGHTS = (0.25, 0.5, 0.25)
"""Of neighbours and what they smooth."""


class Block(NamedTuple):
    """A block of cycles: how many had passed at its end, its mean amplitude, and sizes of its last ones."""

    reached: float
    mean: complex
    sizes: Array


class Wander(NamedTuple):
    """A motion that wanders about a mean.

    Attributes
    ----------
    amplitude : complex
        Mean.
    drift : float
        Relative change of its size per cycle, at most.
    doubt : float
        By how much its size may change until as many cycles have passed as are asked for, relative.
    strays : float
        How far cycles stray from it where it was then, relative.
    varies : float
        The same, where that neither grows nor decays; else zero.
    """

    amplitude: complex
    drift: float
    doubt: float
    strays: float
    varies: float


def wander_of(blocks: Sequence[Block], until: float) -> Wander | None:
    """What a motion wanders about, by the last two thirds of its blocks; None where it is not seen to.

    Parameters
    ----------
    blocks : sequence of Block
        In their order.
    until : float
        Cycles after which the mean counts.

    Notes
    -----
    With means at n cycles, the slope b of the line through them by least squares, and its standard error s,
    the mean may change by ``(|b| + 2 s)`` for each cycle from the middle of the blocks. For what neighbours
    have in common s counts ``sqrt((1 + r)/(1 - r))`` times, r >= 0 their correlation; about a line through N
    that is seen too small by about ``(2 + 4 r)/N``. The same is asked of means smoothed once and twice by
    their neighbours, with weights 1, 2, 1, as a beat leaves less of itself in those.

    It bounds an even drift. What leaves a motion ever faster, and has not come out of the scatter yet, no
    line tells; once it has, the last blocks are off the line through those before.

    Examples
    --------
    Means that scatter by a thousandth about one that does not drift, while cycles stray by a hundredth:

    >>> scatter = 1e-3 * np.random.default_rng(1).standard_normal(30)
    >>> cycles = 1 + 0.01 * np.cos(np.arange(20.0))
    >>> blocks = [Block(60.0 * (i + 1), 1 + e, (1 + e) * cycles) for i, e in enumerate(scatter)]
    >>> found = wander_of(blocks, 4000.0)
    >>> abs(found.amplitude - 1) < 5e-4, found.doubt < 0.01, 0.01 < found.varies < 0.013
    (True, True, True)

    What bends does not wander:

    >>> bends = [Block(60.0 * i, 1 + np.exp(-i / 9), np.ones(1)) for i in range(30)]
    >>> wander_of(bends, 4000.0) is None
    True
    """
    last = list(blocks[len(blocks) // 3 :])
    if len(last) < FEWEST:
        return None
    means: Complex = np.array([one.mean for one in last])
    line = _line(np.array([one.reached for one in last]), np.abs(means))
    crossed = np.count_nonzero(np.diff(np.sign(line.off)))
    if crossed < CROSSES * len(last) or _leaves(line):
        return None
    lasts, strays = _beats(last, line)
    lines = [line]
    for _ in range(SMOOTHED):
        n, size = (np.convolve(one, WEIGHTS, "valid") for one in (lines[-1].n, lines[-1].size))
        lines.append(_line(n, size))
    best = min(lines, key=lambda one: one.changes(until))
    return Wander(
        best.mean * complex(np.exp(1j * np.angle(means.mean()))),
        best.drift / best.mean,
        best.changes(until) / best.mean,
        strays,
        strays if lasts else 0.0,
    )


class _Line(NamedTuple):
    """A line through sizes after n cycles: their mean, its slope and the error of that, and what is off."""

    n: Array
    size: Array
    mean: float
    slope: float
    error: float
    off: Array

    @property
    def middle(self) -> float:
        """Cycles after which the mean is that of the line."""
        return float(self.n.mean())

    @property
    def drift(self) -> float:
        """By how much the mean may change in a cycle, at most."""
        return abs(self.slope) + SURE * self.error

    def at(self, n: Array) -> Array:
        """Sizes on the line."""
        return self.mean + self.slope * (n - self.middle)

    def changes(self, until: float) -> float:
        """By how much the mean may change from the middle until so many cycles have passed."""
        return self.drift * (until - self.middle)


def _line(n: Array, size: Array) -> _Line:
    """By least squares."""
    away, mean, count = n - n.mean(), float(size.mean()), len(n)
    spread = float(away @ away)
    slope = float(away @ (size - mean)) / spread
    off = size - mean - slope * away
    squares = float(off @ off)
    common = float(off[1:] @ off[:-1]) / max(squares, 1e-300)
    common = float(np.clip(common + (2 + 4 * common) / count, 0.0, MOST))
    error = float(np.sqrt(squares / (count - 2) / spread * (1 + common) / (1 - common)))
    return _Line(n, size, mean, slope, error, off)


def _leaves(line: _Line) -> bool:
    """Whether one of the last means is off the line through those before by more than these scatter."""
    for left_out in range(1, LATEST + 1):
        before = _line(line.n[:-left_out], line.size[:-left_out])
        count, away = len(before.n), before.n - before.middle
        scatter = float(before.off @ before.off) / (count - 2)
        n, size = line.n[-left_out:], line.size[-left_out:]
        there = (n - before.middle) ** 2 / float(away @ away)
        allowed = BEYOND * np.sqrt(scatter * (1 + 1 / count + there))
        if (np.abs(size - before.at(n)) > allowed).any():
            return True
    return False


def _beats(blocks: Sequence[Block], line: _Line) -> tuple[bool, float]:
    """Whether cycles stray from a line in the last half of the blocks as in the first, but for what that
    scatters by from block to block; how far, relative."""
    about = zip(blocks, line.at(line.n), strict=True)
    strays = np.array([np.abs(one.sizes / size - 1).max() for one, size in about])
    halves = np.array_split(strays, 2)
    before, after = (float(one.mean()) for one in halves)
    scatter = SURE * float(np.sqrt(sum(one.var(ddof=1) / len(one) for one in halves)))
    apart = max((GROWS - 1) * min(before, after), scatter)
    return abs(after - before) <= apart, float(strays.max())
