"""Every answer of the refined model at once: the load over amplitude and frequency.

The equation of the refined model in ``A = Q + c M``,

    Z(a, omega) A = (Phi^T p + D(omega) c) M,      Z = D + omega_sl² kappa(a, omega),      a = |A|,
    D = omega_sl² (1 + i omega beta) - omega² + i omega alpha,

gives for any amplitude and frequency the load that holds it. A response under a load is a contour of
this surface, folds and all: no iteration, no branch that a sweep can miss.

Where on its resonance curve an answer lies is told by its detuning ``u = asinh(-Re Z/Im Z)``: 0 at
resonance, where load and motion are a quarter of a period apart, -0.88 and 0.88 at half power.

Above the table kappa goes on with the slope that it ends with: a guess, to be put right by whoever
reads it.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from microslip.analyses.reduced.curve import TableCurve, table_curve
from microslip.analyses.reduced.table import EquivalentTable
from microslip.analyses.reduced.two_mode import TwoModeModel
from microslip.brief import Brief
from microslip.errors import MicroslipError
from microslip.typing import Array, Complex, Indices

BELOW = 1e-2
"""Smallest amplitude of a surface over that of its table, or less under a small load ..."""

ROOM = 0.3
"""... where it is this share of the smallest answer: below the table the joint sticks and is linear."""

REACH = 2.0
"""Largest amplitude of a surface over that of its table."""

AMPLITUDES = 700
"""Amplitudes of a surface, in geometric progression."""


@dataclass(frozen=True, repr=False)
class LoadSurface(Brief):
    """The refined model over amplitudes and frequencies.

    Attributes
    ----------
    model : TwoModeModel
        The refined one.
    curve : TableCurve
    preload : float
        That the table's amplitudes belong to.
    frequency : (n,) array
        Hz.
    amplitude : (m,) array
        Of A, ascending.
    stiffness : (m, n) complex array
        Z.
    detuning : (m, n) array
        u.
    push : (n,) complex array
        ``Phi^T p + D c``.
    """

    model: TwoModeModel
    curve: TableCurve
    preload: float
    frequency: Array
    amplitude: Array
    stiffness: Complex
    detuning: Array
    push: Complex

    def between(self, first: int, last: int) -> LoadSurface:
        """The surface at the frequencies from one index to another, both included."""
        part = slice(first, last + 1)
        return replace(
            self,
            frequency=self.frequency[part],
            stiffness=self.stiffness[:, part],
            detuning=self.detuning[:, part],
            push=self.push[part],
        )


@dataclass(frozen=True, repr=False)
class Contours(Brief):
    """Answers under one load, by frequency and then by amplitude.

    Attributes
    ----------
    point : (k,) int array
        Index of the frequency of each.
    size : (k,) array
        ``|A|``.
    amplitude : (k,) complex array
        Q.
    detuning : (k,) array
        Of the model without the shift.
    slope : (k,) array
        ``d log M/d log a``; negative between two folds.
    stiffness : (k,) complex array
        Z there.
    """

    point: Indices
    size: Array
    amplitude: Complex
    detuning: Array
    slope: Array
    stiffness: Complex


def load_surface(
    model: TwoModeModel, table: EquivalentTable, frequency: Array, load: float | None = None
) -> LoadSurface:
    """The surface of a refined model over its amplitudes.

    Parameters
    ----------
    model : TwoModeModel
    table : EquivalentTable
        Of the refined model.
    frequency : (n,) array
        Hz.
    load : float, optional
        The smallest whose answers must be on it.

    Raises
    ------
    MicroslipError
        Where `table` is not that of a refined model.
    """
    if table.uncertainty is None:
        raise MicroslipError("a load surface needs the table of the refined model")
    curve, f = table_curve(table), np.asarray(frequency, dtype=float)
    omega = 2 * np.pi * f
    push = model.force[0] + model.linear_stiffness(omega) * model.offset[0]
    least = BELOW * table.amplitude[0]
    if load:
        stuck = np.abs(stiffness(model, curve, table.preload, np.array(least), omega))
        least = min(least, ROOM * float((np.abs(push * load) / stuck).min()))
    a = np.geomspace(least, REACH * table.amplitude[-1], AMPLITUDES)
    Z = stiffness(model, curve, table.preload, a[:, None], omega)
    return LoadSurface(model, curve, table.preload, f, a, Z, detuning(Z, model), push)


def contours(surface: LoadSurface, load: float, shift: Complex | None = None) -> Contours:
    """Every answer under a load at the frequencies of a surface.

    Parameters
    ----------
    surface : LoadSurface
    load : float
    shift : (n,) complex array, optional
        Added to kappa at every frequency.
    """
    model = surface.model
    Z = surface.stiffness if shift is None else surface.stiffness + model.omega**2 * shift
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
    u = (1 - t) * surface.detuning[i, point] + t * surface.detuning[i + 1, point]
    return Contours(point, size, Q, u, rise / step, z)


def largest(answers: Contours) -> Contours:
    """The largest answer at every frequency that has any, in the order of the frequencies."""
    order = np.lexsort((answers.size, answers.point))
    last = order[np.diff(answers.point[order], append=-1) != 0]
    return replace(answers, **{name: getattr(answers, name)[last] for name in vars(answers)})


def stiffness(
    model: TwoModeModel, curve: TableCurve, preload: float, amplitude: Array, omega: Array
) -> Complex:
    """Z at amplitudes and circular frequencies (rad/s) that broadcast."""
    a, w = np.broadcast_arrays(np.asarray(amplitude, float), np.asarray(omega, float))
    columns = _columns(curve, np.log(np.maximum(amplitude, 1e-300) / preload))
    alpha, beta = model.rayleigh
    kappa = columns[0] * (1 + 1j * w * beta * model.lossy) + 1j * columns[1]
    upper = np.zeros(a.shape, complex)
    for s, (order, own, beyond) in enumerate(curve.upper):
        loss = alpha + beta * own**2 + beyond
        D = (order * w) ** 2 - curve.reference - 1j * order * w * loss
        parts = columns[4 + 8 * s : 12 + 8 * s].reshape(4, 2, *columns.shape[1:])
        motion, compliance, in_phase, quadrature = parts[:, 0] + 1j * parts[:, 1]
        load = D * motion / (1 - D * compliance)
        upper += in_phase * load.real + quadrature * load.imag
    if curve.damped:
        upper += 1j * w * columns[-1]
    return np.asarray(model.linear_stiffness(w) + model.omega**2 * kappa + upper)


def detuning(Z: Complex, model: TwoModeModel) -> Array:
    """``asinh(-Re Z/Im Z)``."""
    return np.asarray(np.arcsinh(-Z.real / np.maximum(Z.imag, 1e-12 * model.omega**2)))


def _columns(curve: TableCurve, x: Array) -> Array:
    """Columns of a table at ``x = log(a/preload)``, first axis; see `curve.evaluate_curve`."""
    knots, c = curve.knots, curve.coefficients
    i = np.clip(np.searchsorted(knots, x) - 1, 0, len(knots) - 2)
    t = (np.clip(x, knots[0], knots[-1]) - knots[i])[..., None]
    out = np.moveaxis(((c[0, i] * t + c[1, i]) * t + c[2, i]) * t + c[3, i], -1, 0)
    below, beyond = x < knots[0], np.maximum(x - knots[-1], 0.0)
    out[1] *= np.where(below, np.exp(np.minimum(x - knots[0], 0.0)), 1.0)
    upper = slice(4, 4 + 8 * len(curve.upper))
    out[upper] = np.where(below, 0.0, out[upper])
    last = knots[-1] - knots[-2]
    slope = (3 * c[0, -1, :2] * last + 2 * c[1, -1, :2]) * last + c[2, -1, :2]
    out[0] += slope[0] * beyond
    out[1] = np.maximum(out[1] + slope[1] * beyond, 0.0)
    return np.asarray(out)
