"""Outputs of a response held to the truth at some of its points, as its amplitude is.

A reduced model has what moves besides its mode from a table at one frequency and from the linear joint
(`microslip.analyses.reduced.outputs`): it knows slip of single pairs and upper modes less well, and about the
resonance of an upper mode of the joint, which lies where it sticks, it has none of it. What an output is over
the amplitude, less what a model makes of that, is a smooth function along a branch. It is known at steady
states, interpolated over the frequency between them (monotone cubics), and bounded by leaving each out
(`microslip.analyses.reduced.missed`). Midway between two no more than three quarters of how much it changes
from one to the other are trusted, whatever the others miss.

There are two models: what the load moves besides the mode as the joint slides, and as it sticks. At every
frequency the one with the smaller bound is the answer. Where they differ by more than both bounds allow, one
of the bounds is wrong, as about a resonance that lies between two steady states: there the answer may be off
by what the bound of the other leaves of the difference.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from microslip.analyses.reduced.missed import (
    FEWEST,
    arched,
    correction,
    missed_across,
    missed_by_others,
    most_beside,
    nearly_most,
    place,
)
from microslip.brief import Brief
from microslip.typing import Array, Complex, Indices

SMALL = 0.01
"""Share of the largest size of an output that errors are relative to where its own size is smaller."""

NO_SIZE = 0.5
"""What may be off by as much as this share of itself says nothing of how large an output becomes."""

TINY = 1e-300
"""Instead of a size of zero."""

UNSURE = 0.25
"""Share of the change from a steady state to the next that may be wrong midway, whatever the others miss."""


@dataclass(frozen=True, repr=False)
class HeldOutput(Brief):
    """An output of a response that is held to steady states.

    Attributes
    ----------
    value : (n,) complex array
        First harmonic.
    error : (n,) array
        Bound of the error of its size beside that of the amplitude, relative to it or to `SMALL` of the
        largest; infinite where nothing bounds it.
    """

    value: Complex
    error: Array


def held_output(
    frequency: Array,
    amplitude: Complex,
    models: Sequence[Complex],
    true: Mapping[int, complex],
    runs: Iterable[Indices],
    least: Array | float = 0.0,
) -> HeldOutput:
    """An output that at steady states is what these have over their amplitude.

    Parameters
    ----------
    frequency : (n,) array
    amplitude : (n,) complex array
        Of the mode, Q; zero where there is no answer.
    models : two (n,) complex arrays
        What models make of the output.
    true : mapping of int to complex
        The output over Q in steady states, by index of the frequency.
    runs : iterable of int arrays
        Ascending indices between which the response is one branch.
    least : (n,) array or float
        Size below which an output is nothing but rounding.

    Examples
    --------
    What is missed is a number, and the second model has a resonance that the first does not:

    >>> f = np.linspace(1.0, 2.0, 11)
    >>> flat, resonance = np.ones(11, complex), 1 / (1.55 - f)
    >>> true = {k: 1.1 + resonance[k] for k in (0, 2, 3, 5, 7, 10)}
    >>> found = held_output(f, flat, (flat, flat + resonance), true, [np.arange(11)])
    >>> bool(np.allclose(found.value, 1.1 + resonance)), bool(found.error.max() < 1e-9)
    (True, True)
    """
    value, error = np.array(models[0], complex), np.full(len(frequency), np.inf)
    for run in runs:
        known = {k: true[k] for k in run.tolist() if k in true}
        if known:
            inside = np.arange(run[0], run[-1] + 1)
            inside = inside[np.abs(amplitude[inside]) > 0]
            value[inside], error[inside] = _of_branch(frequency, amplitude, models, known, inside)
    size = np.abs(value)
    error[~np.isfinite(size)] = np.inf
    largest = size[error < NO_SIZE].max(initial=0.0)
    floor = np.maximum(least, SMALL * largest)
    bounded = np.isfinite(error)
    error[bounded] *= (size / np.maximum(np.maximum(size, floor), TINY))[bounded]
    return HeldOutput(value, error)


def _of_branch(
    frequency: Array,
    amplitude: Complex,
    models: Sequence[Complex],
    true: Mapping[int, complex],
    inside: Indices,
) -> tuple[Complex, Array]:
    """Value and relative error at the frequencies of a branch, by index."""
    marks, f, Q = np.array(list(true)), frequency[inside], amplitude[inside]
    x, wanted = frequency[marks], np.array(list(true.values()))
    values, errors = [], []
    for model in models:
        missed = wanted - model[marks] / amplitude[marks]
        added = correction(x, missed, f)
        with np.errstate(invalid="ignore"):  # a model may have no answer at a pole
            values.append(model[inside] / Q + added)
        errors.append(_missed_between(x, missed, f))
    sizes, bounds = np.abs(values), np.array(errors)
    bounds[~np.isfinite(sizes)] = np.inf
    columns, best = np.arange(len(inside)), np.argmin(bounds, axis=0)
    own, other = bounds[best, columns], bounds[1 - best, columns]
    with np.errstate(invalid="ignore"):
        apart = np.abs(sizes[0] - sizes[1]) - other
    error = np.where(np.isinf(other), own, np.maximum(own, apart))
    value = np.array(values)[best, columns]
    size = np.where(np.isfinite(value), np.maximum(np.abs(value), TINY), 1.0)
    return value * Q, error / size


def _missed_between(x: Array, missed: Complex, at: Array) -> Array:
    """What others make of it, less what it is, from a steady state to another; infinite beyond them."""
    if len(x) < FEWEST:
        return np.full(len(at), np.inf)
    by_others = missed_by_others(x, missed)
    begin, end = (np.abs(one) for one in missed_across(x, missed, by_others))
    most = most_beside(np.diff(x), np.maximum(begin, end))
    unsure = UNSURE * np.abs(np.diff(missed))
    left, t = place(x, at)
    usual = np.interp(at, x, nearly_most(np.abs(by_others)))
    bound = arched((most + unsure)[left], t) + usual
    return np.where((at < x[0]) | (at > x[-1]), np.inf, bound)
