"""Steady states of the full joint that a response is held to, and the branches that they lie on.

A steady state under the load M at omega, with first harmonic Q of the sliding coordinate, tells what the
contact coefficient there is, exactly:

    kappa = [(Phi^T p + D c) M/A - D]/omega_sl²,      A = Q + c M.

What the table misses of it, ``correction = kappa - kappa_table(|A|, omega)``, is small along a branch of
the response. A branch ends where the search found no steady state, and where the size jumps from one
frequency of the response to the next. What is between anchors: `microslip.analyses.reduced.through_anchors`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from microslip.analyses.reduced.surface import LoadSurface, stiffness
from microslip.errors import MicroslipError
from microslip.typing import Array, Indices

JUMP = 0.1
"""Neighbouring frequencies whose sizes differ by more, in logarithm, lie on different branches or so far
apart that neither tells of the other."""

BEGINS = 3.0
"""Times that of two motions one may vary as much as the other for those between to vary as well."""


@dataclass(frozen=True)
class Anchor:
    """A steady state of the full joint.

    Attributes
    ----------
    frequency : float
        Hz.
    amplitude : complex
        Q.
    correction : complex
        What the table misses, over omega_sl².
    change : float
        Relative change of the state over its last cycle.
    doubt : float
        Relative error of the amplitude that is left: of transients not yet gone, of a motion that wanders.
    past : float
        Relative difference to the amplitude after another past than the load raised from rest; zero where
        none ended in this motion.
    scatter : float
        Relative difference of amplitudes after the load was raised in different ways; nan where that is not
        known, and what its neighbours usually miss, or of a motion that has not settled what they miss of it,
        stands for it.
    varies : float
        How far the size is known to stray from its mean from cycle to cycle, and for good, relative: how the
        motion is, and part of `doubt`.
    """

    frequency: float
    amplitude: complex
    correction: complex
    change: float
    doubt: float = 0.0
    past: float = 0.0
    scatter: float = 0.0
    varies: float = 0.0


def anchor_at(
    surface: LoadSurface,
    frequency: float,
    load: float,
    Q: complex,
    change: float = 0.0,
    doubt: float = 0.0,
    past: float = 0.0,
) -> Anchor:
    """What a steady state says of the model.

    Parameters
    ----------
    surface : LoadSurface
        Of the model; its frequencies do not matter.
    frequency, load : float
        Hz, and amplitude of the driven port.
    Q : complex
        First harmonic of the sliding coordinate, phase against the load's sine.
    change, doubt, past : float
        Kept.

    Raises
    ------
    MicroslipError
        Where the joint does not move, so that nothing can be said of its contact.
    """
    model, omega = surface.model, 2 * np.pi * frequency
    D = complex(model.linear_stiffness(omega))
    A = Q + model.offset[0] * load
    if A == 0:
        raise MicroslipError(f"the steady state at {frequency:.6g} Hz does not move")
    true = (model.force[0] + D * model.offset[0]) * load / A
    table = stiffness(model, surface.curve, surface.preload, np.array(abs(A)), np.array(omega))
    return Anchor(frequency, Q, complex(true - table) / model.omega**2, change, doubt, past)


def vary_between(left: Array, right: Array) -> Array:
    """What motions between two are known to vary by for good, from what those do, relative.

    As much as the larger; but where the other hardly does it is not known where that begins.

    Examples
    --------
    >>> vary_between(np.array([0.08, 0.08, 0.08]), np.array([0.05, 0.01, 0.0]))
    array([0.08, 0.03, 0.  ])
    """
    return np.minimum(np.maximum(left, right), BEGINS * np.minimum(left, right))


def branches(anchors: Mapping[int, Anchor], lost: Iterable[int]) -> Iterator[Indices]:
    """Runs of anchors, by ascending index of frequency, that lie on one branch.

    Parameters
    ----------
    anchors : mapping of int to Anchor
        By index of the frequency.
    lost : iterable of int
        Indices at which no steady state was found.
    """
    gone = np.array(sorted(lost), dtype=int)
    run: list[int] = []
    for k in sorted(anchors):
        if run:
            last = run[-1]
            apart = np.searchsorted(gone, last) != np.searchsorted(gone, k)
            if apart or (k == last + 1 and step_of(anchors[last], anchors[k]) > JUMP):
                yield np.array(run)
                run = []
        run.append(k)
    if run:
        yield np.array(run)


def step_of(one: Anchor, other: Anchor) -> float:
    """Difference of the logarithms of two sizes."""
    return abs(float(np.log(abs(one.amplitude) / abs(other.amplitude))))
