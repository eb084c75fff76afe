"""The refined model held to the truth at some points of a response.

A steady state of the full joint under the load M at omega, with first harmonic Q of the sliding
coordinate, tells what the contact coefficient there is, exactly:

    kappa = [(Phi^T p + D c) M/A - D]/omega_sl²,      A = Q + c M.

What the table misses of it, ``correction = kappa - kappa_table(|A|, omega)``, is small and smooth
along the response. Interpolated over the place of `surface.py` (monotone cubics; constant beyond
the outermost anchors), it makes the model pass through every anchor and be right in between.

How right is measured by leaving anchors out: the correction of each is predicted from the others. That
spans twice the distance. The most that it misses at the two anchors around bounds the error in between,
in the shape ``4 t (1 - t)``; to it comes the median of what is missed anywhere, as resonances of upper
modes may lie between two anchors that agree. Of what lies between two anchors far apart nothing is said.
With the slope ``d log M/d log a`` of the surface an error ``dk`` of kappa moves the amplitude by
``|omega_sl² dk/Z|`` over the slope; near a fold that vanishes and the bound says so.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from microslip.analyses.reduced.surface import LoadSurface, along, detuning, stiffness
from microslip.brief import Brief
from microslip.errors import MicroslipError
from microslip.typing import Array, Complex, Indices

APART = 1e-3
"""Anchors closer than this in place count as one, the later."""

FEWEST = 4
"""Anchors below which nothing is said of the error."""

UNSETTLED = 100.0
"""An anchor that still changed over its last cycle is as uncertain as so many of those changes: what is
left where the slowest transient loses a hundredth per cycle."""

WIDEST = 1.2
"""Distance between two anchors beyond which nothing is said of what lies between them."""

BESIDE = 0.3
"""Beyond an outermost anchor by more than this its error counts in full."""


@dataclass(frozen=True)
class Anchor:
    """A steady state of the full joint.

    Attributes
    ----------
    frequency : float
        Hz.
    amplitude : complex
        Q.
    place : float
        s.
    correction : complex
        What the table misses, over omega_sl².
    change : float
        Relative change of the state over its last cycle.
    """

    frequency: float
    amplitude: complex
    place: float
    correction: complex
    change: float


@dataclass(frozen=True, repr=False)
class Answers(Brief):
    """Answers of a corrected model under one load, by frequency and then by amplitude.

    Attributes
    ----------
    point : (k,) int array
        Index of the frequency of each.
    size : (k,) array
        ``|A|``.
    amplitude : (k,) complex array
        Q.
    detuning, place : (k,) arrays
    slope : (k,) array
        ``d log M/d log a``; negative between two folds.
    error : (k,) array
        Bound of the relative error of ``|Q|``; infinite with fewer than `FEWEST` anchors.
    """

    point: Indices
    size: Array
    amplitude: Complex
    detuning: Array
    place: Array
    slope: Array
    error: Array


def anchor_at(
    surface: LoadSurface, frequency: float, load: float, Q: complex, change: float = 0.0
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
    change : float
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
    s = float(detuning(table, model) + along(surface.curve, model, frequency))
    return Anchor(frequency, Q, s, complex(true - table) / model.omega**2, change)


def correction(anchors: Sequence[Anchor], place: Array) -> Complex:
    """What the table misses at places, interpolated between anchors; zero without any."""
    x, y = _knots(anchors)
    if len(x) < 2:
        return np.full(np.shape(place), y[0] if len(x) else 0.0, complex)
    inside = np.clip(place, x[0], x[-1])
    return PchipInterpolator(x, y.real)(inside) + 1j * PchipInterpolator(x, y.imag)(inside)


def missed_by_others(anchors: Sequence[Anchor]) -> tuple[Array, Array]:
    """Places of the anchors, ascending, and by how much the others miss the correction of each."""
    x, y = _knots(anchors)
    kept = [Anchor(0.0, 0.0, a, b, 0.0) for a, b in zip(x, y, strict=True)]
    missed = [
        abs(complex(correction(kept[:i] + kept[i + 1 :], np.array(x[i]))) - y[i])
        for i in range(len(x))
    ]
    return x, np.array(missed)


def corrected_answers(
    surface: LoadSurface, load: float, anchors: Sequence[Anchor], accuracy: float = 0.0
) -> Answers:
    """Every answer under a load at the frequencies of a surface.

    Parameters
    ----------
    surface : LoadSurface
    load : float
    anchors : sequence of Anchor
        Steady states under that load.
    accuracy : float
        Relative error of the anchors' own amplitudes, part of the bound.
    """
    model = surface.model
    Z = surface.stiffness + model.omega**2 * correction(anchors, surface.place)
    x = np.log(surface.amplitude)
    gap = np.log(np.abs(Z)) + x[:, None] - np.log(np.abs(surface.push) * abs(load))[None]
    i, point = np.nonzero((gap[:-1] <= 0) != (gap[1:] <= 0))
    order = np.lexsort((i, point))
    i, point = i[order], point[order]
    low, rise = gap[i, point], gap[i + 1, point] - gap[i, point]
    t, step = -low / rise, x[i + 1] - x[i]
    size = np.exp(x[i] + t * step)
    z = (1 - t) * Z[i, point] + t * Z[i + 1, point]
    A = surface.push[point] * load / z
    A *= size / np.abs(A)
    Q = A - model.offset[0] * load
    u, s = ((1 - t) * y[i, point] + t * y[i + 1, point] for y in (surface.detuning, surface.place))
    slope = rise / step
    share = np.abs(model.omega**2 * _bound(anchors, s) / z) * size / np.abs(Q)
    share += accuracy + UNSETTLED * _change_beside(anchors, s)
    with np.errstate(divide="ignore"):
        error = share / np.minimum(np.abs(slope), 1.0)
    return Answers(point, size, Q, u, s, slope, error)


def _bound(anchors: Sequence[Anchor], place: Array) -> Array:
    """Error of the correction at places."""
    if len(anchors) < FEWEST:
        return np.full(np.shape(place), np.inf)
    x, missed = missed_by_others(anchors)
    unseen = float(np.median(missed))
    i = np.searchsorted(x, place)
    left, right = np.clip(i - 1, 0, len(x) - 1), np.clip(i, 0, len(x) - 1)
    width = np.where(right > left, x[right] - x[left], 1.0)
    t = np.where(right > left, (place - x[left]) / width, 0.0)
    between = np.maximum(missed[left], missed[right]) * 4 * t * (1 - t)
    end = np.where(i == 0, 0, len(x) - 1)
    beyond = missed[end] * np.minimum(np.abs(place - x[end]) / BESIDE, 1.0)
    known = np.where(right > left, width <= WIDEST, np.abs(place - x[end]) <= WIDEST)
    return np.where(known, np.where(right > left, between, beyond) + unseen, np.inf)


def _change_beside(anchors: Sequence[Anchor], place: Array) -> Array:
    """Larger change of the two anchors to either side."""
    if not anchors:
        return np.zeros(np.shape(place))
    ordered = sorted(anchors, key=lambda one: one.place)
    x, change = (np.array([getattr(a, k) for a in ordered]) for k in ("place", "change"))
    i = np.searchsorted(x, place)
    return np.maximum(change[np.clip(i - 1, 0, len(x) - 1)], change[np.clip(i, 0, len(x) - 1)])


def _knots(anchors: Sequence[Anchor]) -> tuple[Array, Complex]:
    """Places and corrections, ascending, those that are close merged into the later."""
    kept: list[Anchor] = []
    for one in anchors:
        kept = [other for other in kept if abs(other.place - one.place) > APART]
        kept.append(one)
    kept.sort(key=lambda one: one.place)
    return np.array([a.place for a in kept]), np.array([a.correction for a in kept], complex)
