"""The refined model held to the truth at some points of a response.

On a branch, which has one answer at a frequency, what the table misses at anchors
(`microslip.analyses.reduced.anchors`) is interpolated over the frequency (monotone cubics), so that the model
passes through every anchor and is right in between. Where the response jumps from one answer of the table to
another between two anchors farther apart, nothing is said between them.

How right is measured by leaving anchors out: the correction of each is predicted from the others, at
the ends of a branch by a straight line. That spans twice the distance; those close by on the other side are
left out as well. The most that it misses at the two
anchors around bounds the error in between, in the shape ``4 t (1 - t)``; to it comes the median of what is
missed at the nearest of them, as resonances of upper modes may lie between two anchors that agree. Tractions
that are locked in make steady states scatter: they depend on what was before. So an anchor is not known
better than it differs from that of another past, nor than most of those about it do from theirs; but no worse
than what lies between it and the next to either side, which is laid through it. What the
others miss says nothing of the anchor itself: amplitudes may rise in steps, each of which is what it is.

An error ``dk`` of kappa moves the size by ``Re(omega_sl² dk/Z)`` over the slope ``d log M/d log a`` of the
surface, and the rest of it the phase; near a fold the slope vanishes and the bound says so.

Far above the table, and close to a fold, the table is no help. There kappa itself is interpolated, and
bounded in the same way. Close to where a branch ends at resonance the phase turns quickly and scatters with
whatever the past has locked in, a hundred times as much as the size, and kappa with it. There the logarithm
of Q is interpolated, and what is missed of the size alone bounds it: of one number instead of two, so that it
may be small by chance. The most at this stretch and the next ones counts, and twice what is usual about it.
At every frequency that of the three whose bound is smallest is the answer. No bound is one of the phase.

What the table misses may change with the size, and be the same at two sizes. Where those of two anchors
differ by more than half, the table is believed no more than one of the other two curves says: their
difference, and the bound of that.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from microslip.analyses.reduced.anchors import JUMP, Anchor, branches, step_of, vary_between
from microslip.analyses.reduced.missed import (
    FEWEST,
    arched,
    correction,
    missed_across,
    missed_by_others,
    most_beside,
    nearly_most,
    place,
    usually_missed,
)
from microslip.analyses.reduced.surface import LoadSurface, contours, stiffness
from microslip.analyses.reduced.two_mode import TwoModeModel
from microslip.brief import Brief
from microslip.typing import Array, Complex, Indices, Mask

PARTS = ("doubt", "scatter", "varies")
"""What bounds the error of an anchor itself, and what of the first is no error of its mean."""

WIDER = 2.0
"""Times what one in nine scatters by more than: where pasts scatter as a normal distribution does, a third
differs from the first by more at one in forty. And times what is usually missed of a size alone."""

SETTLED = 1e-5
"""Change over a cycle above which a motion may be on its way: where it is not known how that scatters, what
the others miss of it is its doubt."""

STEP = 1e-4
"""Relative step of a size over which the slope of the load is taken."""

FAR = 0.4
"""Anchors whose sizes differ by more, in logarithm, do not tell what the table misses of sizes between."""

STRAY = 0.25
"""Answers of the surface farther, in logarithm, from the size between two anchors are others than theirs."""


@dataclass(frozen=True, repr=False)
class Held(Brief):
    """A response held to anchors, at the frequencies of a surface.

    Attributes
    ----------
    amplitude : (n,) complex array
        Q; nan where the surface has no answer near those of the anchors.
    error : (n,) array
        Bound of the relative error of ``|Q|``; infinite where nothing bounds it.
    varies : (n,) array or None
        What the size is known to stray by from its mean from cycle to cycle, and for good, relative: part of
        the error, and no error of the mean. None where none does.
    """

    amplitude: Complex
    error: Array
    varies: Array | None = None

    @property
    def of_mean(self) -> Array:
        """Bound of the relative error of the mean size."""
        return self.error if self.varies is None else self.error - self.varies


def jumped_across(run: Indices, size: Array, folded: Mask) -> Indices:
    """Frequencies between two anchors between which the response jumps, by index.

    Two branches that the table has may agree with the full joint where they were seen, but on which of them a
    motion between is, and whether there it still exists, neither anchor tells.

    Parameters
    ----------
    run : (k,) int array
        Indices of the anchors of a branch, ascending.
    size : (n,) array
        Of the response through them; nan where there is none.
    folded : (n,) bool array
        Where the table has several answers. A resonance without these is steep, and all of it is one branch.

    Examples
    --------
    >>> size = np.array([1.0, 1.05, 1.1, 1.1, 1.5, 1.5])
    >>> folded = np.array([False, False, True, True, True, False])
    >>> jumped_across(np.array([0, 2, 5]), size, folded)
    array([3, 4])
    >>> jumped_across(np.array([0, 2, 5]), size, np.zeros(6, bool))
    array([], dtype=int64)
    """
    with np.errstate(divide="ignore"):
        broken = ~(np.abs(np.diff(np.log(size))) <= JUMP)
    stretches = [
        np.arange(i + 1, k)
        for i, k in pairwise(run)
        if broken[i:k].any() and folded[i : k + 1].any()
    ]
    return np.concatenate([*stretches, run[:0]])


def held(
    surface: LoadSurface,
    load: float,
    anchors: Mapping[int, Anchor],
    lost: Iterable[int] = (),
    accuracy: float | Array = 0.0,
) -> Held:
    """A response that passes through anchors.

    Parameters
    ----------
    surface : LoadSurface
    load : float
    anchors : mapping of int to Anchor
        Steady states under that load, by index of the frequency.
    lost : iterable of int
        Indices at which no steady state was found.
    accuracy : float or (n,) array
        Relative error of the anchors' own amplitudes, part of the bound.
    """
    n, lost = len(surface.frequency), set(lost)
    accuracy = np.broadcast_to(accuracy, n)
    amplitude, error, folded = np.full(n, np.nan, complex), np.full(n, np.inf), np.zeros(n, bool)
    varies = np.zeros(n)
    for run in branches(anchors, lost):
        inside = np.arange(run[0], run[-1] + 1)
        known = [anchors[int(k)] for k in run]
        part, x = surface.between(run[0], run[-1]), surface.frequency[run]
        over, folded[inside] = _over_table(part, load, x, known)
        found = (over, _alone(part, load, x, known), _of_its_size(part, x, known))
        share = np.array([one.error for one in found])
        better = np.argmin(share, axis=0)
        share[0] = np.maximum(share[0], _unless_others_agree(found, _too_far(known, run, inside)))
        columns = np.arange(len(inside))
        amplitude[inside] = np.array([one.amplitude for one in found])[better, columns]
        left, right = _around(run, inside)
        doubt, scatter, vary = (np.array([getattr(one, of) for one in known]) for of in PARTS)
        doubt -= vary
        told = np.isfinite(scatter)
        most = _most_around(np.nan_to_num(scatter), left, right)
        # it is in what the others miss already
        bound = np.maximum(share[better, columns], most)
        error[inside] = bound + np.maximum(doubt[left], doubt[right]) + accuracy[inside]
        error[inside] += np.maximum(vary[left], vary[right])
        varies[inside] = vary_between(vary[left], vary[right])
        varies[run] = vary
        amplitude[run] = [one.amplitude for one in known]
        jumped = jumped_across(run, np.abs(amplitude), folded)
        beside = bound.copy()
        beside[jumped - run[0]] = np.inf
        usual = np.minimum(_nearly_most(scatter), _most_beside_anchors(beside, run - run[0]))
        own = np.maximum(np.nan_to_num(scatter), usual)
        other = bound[run - run[0]]
        unsettled = np.array([one.change for one in known]) > SETTLED
        if unsettled.any():
            other = np.where(unsettled, _missed_of(part, load, x, known), other)
        error[run] = np.where(told, own, np.maximum(other, own)) + doubt + accuracy[run]
        error[run] += vary
        error[jumped] = np.inf
    return Held(amplitude, np.where(np.isfinite(amplitude), error, np.inf), varies)


def _too_far(known: Sequence[Anchor], run: Indices, inside: Indices) -> Array:
    """Between anchors whose sizes are `FAR` apart by how much they are, in logarithm; zero elsewhere."""
    steps = np.array([step_of(*pair) for pair in pairwise(known)])
    far = np.zeros(len(inside))
    for i in np.flatnonzero(steps > FAR):
        far[run[i] - run[0] + 1 : run[i + 1] - run[0]] = steps[i]
    return far


def _unless_others_agree(found: Sequence[Held], far: Array) -> Array:
    """What the first curve may be off by, as much as `far` or as it is off another and that by its bound."""
    size = np.abs([one.amplitude for one in found])
    with np.errstate(invalid="ignore", divide="ignore"):
        said = [
            one.error + np.abs(np.log(own / size[0]))
            for one, own in zip(found[1:], size[1:], strict=True)
        ]
    return np.minimum(far, np.nan_to_num(np.min(said, axis=0), nan=np.inf))


def _over_table(
    surface: LoadSurface, load: float, x: Array, known: Sequence[Anchor]
) -> tuple[Held, Mask]:
    """A branch as the table has it, with what that misses interpolated, and where it has others too."""
    f = surface.frequency
    y = np.array([one.correction for one in known])
    A, Z = _motion(surface.model, load, x, known)
    size = np.interp(f, x, np.log(np.maximum(np.abs(A), 1e-300)))
    found = contours(surface, load, correction(x, y, f))
    apart = np.abs(np.log(found.size) - size[found.point])
    order = np.lexsort((-apart, found.point))
    closest = order[np.diff(found.point[order], append=-1) != 0]
    closest = closest[apart[closest] < STRAY]
    amplitude, error = np.full(len(f), np.nan, complex), np.full(len(f), np.inf)
    at, slope = found.point[closest], found.slope[closest]
    amplitude[at] = found.amplitude[closest]
    there = np.full(len(f), np.nan, complex)
    there[at] = found.stiffness[closest] / surface.model.omega**2
    bound = _bound(x, y, Z / surface.model.omega**2, f, there)[at]
    with np.errstate(divide="ignore"):
        grown = found.size[closest] / np.abs(amplitude[at]) / np.minimum(np.abs(slope), 1.0)
    error[at] = np.where(slope > 0, bound * grown, np.inf)
    return Held(amplitude, error), np.bincount(found.point, minlength=len(f)) > 1


def _alone(surface: LoadSurface, load: float, x: Array, known: Sequence[Anchor]) -> Held:
    """A branch without the table: kappa itself interpolated, as above the table and beside folds."""
    f, model = surface.frequency, surface.model
    _, Z = _motion(model, load, x, known)
    kappa = (Z - model.linear_stiffness(2 * np.pi * x)) / model.omega**2
    there = model.linear_stiffness(2 * np.pi * f) / model.omega**2 + correction(x, kappa, f)
    A = surface.push * load / (model.omega**2 * there)
    Q = A - model.offset[0] * load
    return Held(Q, _bound(x, kappa, Z / model.omega**2, f, there) * np.abs(A / Q))


def _of_its_size(surface: LoadSurface, x: Array, known: Sequence[Anchor]) -> Held:
    """A branch without the model: the logarithm of the motion itself interpolated."""
    f, y = surface.frequency, _logarithm(known)
    return Held(np.exp(correction(x, y, f)), _bound_of_size(x, y, f))


def _logarithm(known: Sequence[Anchor]) -> Complex:
    """Of the first harmonics of a branch, the phase without jumps."""
    Q = np.array([one.amplitude for one in known])
    return np.asarray(np.log(np.abs(Q)) + 1j * np.unwrap(np.angle(Q)))


def _bound_of_size(x: Array, y: Complex, at: Array) -> Array:
    """Relative error of the size, from an anchor to another, where its logarithm y is interpolated."""
    if len(x) < FEWEST:
        return np.full(np.shape(at), np.inf)
    missed = missed_by_others(x, y)
    begin, end = (np.abs(one.real) for one in missed_across(x, y, missed))
    left, t = place(x, at)
    most = most_beside(np.diff(x), np.maximum(begin, end))[left]
    usual = WIDER * np.interp(at, x, usually_missed(np.abs(missed.real)))
    return np.asarray(np.expm1(arched(most, t) + usual))


def _motion(
    model: TwoModeModel, load: float, x: Array, known: Sequence[Anchor]
) -> tuple[Complex, Complex]:
    """A and Z of anchors."""
    A = np.array([one.amplitude for one in known]) + model.offset[0] * load
    push = model.force[0] + model.linear_stiffness(2 * np.pi * x) * model.offset[0]
    return A, push * load / A


def _around(run: Indices, inside: Indices) -> tuple[Indices, Indices]:
    """Numbers of the anchors to either side."""
    right = np.clip(np.searchsorted(run, inside), 0, len(run) - 1)
    return np.maximum(right - 1, 0), right


def _most_around(values: Array, left: Indices, right: Indices) -> Array:
    """Largest value of the two anchors to either side.

    A difference of two pasts is one draw, and may be small by chance.
    """
    last = len(values) - 1
    around = (np.maximum(left - 1, 0), left, right, np.minimum(right + 1, last))
    return np.asarray(np.max([values[i] for i in around], axis=0))


def _most_beside_anchors(bound: Array, run: Indices) -> Array:
    """The most that bounds what lies beside each anchor, up to the next to either side; infinite of nothing.

    Examples
    --------
    >>> bound = np.array([0.0, 0.02, 0.0, 0.03, 0.04, 0.0, 0.0])
    >>> _most_beside_anchors(bound, np.array([0, 2, 5, 6]))
    array([0.02, 0.04, 0.04,  inf])
    """
    nothing = -np.inf
    between = [bound[i + 1 : k].max(initial=nothing) for i, k in pairwise(run)]
    most = np.maximum([nothing, *between], [*between, nothing])
    return np.where(most > nothing, most, np.inf)


def _bound(x: Array, y: Complex, z: Complex, at: Array, there: Complex) -> Array:
    """Relative error of the size, for a slope of one, at frequencies from an anchor to another.

    Parameters
    ----------
    x, y, z : arrays
        Frequency, correction and ``Z/omega_sl²`` of the anchors, ascending.
    at, there : arrays
        Frequency and ``Z/omega_sl²`` of the answers.
    """
    if len(x) < FEWEST:
        return np.full(np.shape(at), np.inf)
    missed = missed_by_others(x, y)
    left, t = place(x, at)
    with np.errstate(invalid="ignore"):  # nan where there is no answer
        begin, end = missed_across(x, y, missed)
        most = np.maximum(_grown(begin[left] / there), _grown(end[left] / there))
    usual = usually_missed(np.abs((missed / z).real) * np.abs(z))
    return arched(most, t) + np.interp(at, x, usual) / np.abs(there)


def _missed_of(surface: LoadSurface, load: float, x: Array, known: Sequence[Anchor]) -> Array:
    """Relative error of the size that all others would make of each anchor; infinite of too few."""
    if len(x) < FEWEST:
        return np.full(len(x), np.inf)
    model, omega = surface.model, 2 * np.pi * x
    A, Z = _motion(model, load, x, known)
    missed = missed_by_others(x, np.array([one.correction for one in known]))
    table, larger = (
        stiffness(model, surface.curve, surface.preload, size, omega)
        for size in (np.abs(A), (1 + STEP) * np.abs(A))
    )
    slope = 1 + ((larger - table) / (STEP * Z)).real
    with np.errstate(divide="ignore"):
        grown = _grown(missed * model.omega**2 / Z) / np.clip(slope, 0.0, 1.0)
    of_size = np.abs(missed_by_others(x, _logarithm(known)).real)
    # of one number, which may be small by chance
    return np.minimum(grown, np.expm1(np.maximum(of_size, WIDER * usually_missed(of_size))))


def _nearly_most(scatter: Array) -> Array:
    """`nearly_most` of what anchors scatter by, `WIDER`.

    A difference of two pasts is one draw, and may be small by chance. Only where there is one (else nan) it
    counts.
    """
    told = np.flatnonzero(np.isfinite(scatter))
    if not len(told):
        return np.zeros(len(scatter))
    most = WIDER * nearly_most(scatter[told])
    after = np.searchsorted(told, np.arange(len(scatter)))
    sides = (np.maximum(after - 1, 0), np.minimum(after, len(told) - 1))
    own = np.isin(np.arange(len(scatter)), told)
    return np.where(own, most[sides[1]], np.maximum(*(most[side] for side in sides)))


def _grown(step: Complex) -> Array:
    """Relative change of ``1/|Z|`` where Z changes by a share, to second order."""
    return np.asarray(np.abs(step.real) + 0.5 * np.abs(step) ** 2)
