"""A table of equivalent stiffness and damping as a curve that compiled functions evaluate."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.interpolate import Akima1DInterpolator, PchipInterpolator

from microslip.analyses.reduced.table import EquivalentTable
from microslip.contact.compiled import strict_jit
from microslip.errors import MicroslipError
from microslip.typing import Array


class TableCurve(NamedTuple):
    """Piecewise cubic interpolation of a table in ``log(amplitude / preload)``.

    Monotone (PCHIP); Akima's for the table of the refined model, whose points are close enough, as
    a monotone curve is flat about the greatest damping.
    Below the table k_eq and cross keep their first value and gamma_eq falls in proportion to
    amplitude (partial slip: dissipation grows as amplitude cubed), upper harmonics vanish. Above it
    there is no answer.

    Attributes
    ----------
    knots : (n,) array
    coefficients : (4, n - 1, 4 + 8 s) array
        Powers, intervals; k_eq, gamma_eq, cross, then motion, compliance, in_phase and quadrature
        of s upper harmonics, each as real and imaginary part; where `damped` what damps the shape, 1/s, last.
    upper : (s, 3) array
        Order, circular frequency and damping beyond alpha and beta of the upper harmonics.
    reference : float
        omega_0².
    damped : bool
    """

    knots: Array
    coefficients: Array
    upper: Array
    reference: float
    damped: bool


def table_curve(table: EquivalentTable) -> TableCurve:
    """Coefficients for the compiled evaluation of a table."""
    if len(table.amplitude) < 2:
        raise MicroslipError("a table of equivalent stiffness needs at least two amplitudes")
    x = np.log(table.amplitude / table.preload)
    if not (np.diff(x) > 0).all():
        raise MicroslipError("amplitudes of the table do not grow with the load: drive it further")
    columns = [table.k_eq, table.gamma_eq, table.cross.real, table.cross.imag]
    upper, reference = np.zeros((0, 3)), 0.0
    if table.upper is not None:
        u = table.upper
        upper, reference = np.column_stack([u.order, u.omega, u.damping]), u.reference_omega**2
        for values in zip(u.motion.T, u.compliance.T, u.in_phase.T, u.quadrature.T, strict=True):
            columns += [part for y in values for part in (y.real, y.imag)]
    damped = table.damping is not None
    if table.damping is not None:
        columns.append(table.damping)
    if not all(np.isfinite(y).all() for y in columns):
        raise MicroslipError("the table of equivalent stiffness holds numbers that are not finite")
    interpolate = PchipInterpolator if table.uncertainty is None else Akima1DInterpolator
    c = np.stack([interpolate(x, y).c for y in columns])
    coefficients = np.ascontiguousarray(np.moveaxis(c, 0, -1))
    return TableCurve(x, coefficients, upper, float(reference), damped)


def no_curve() -> TableCurve:
    """Curve without a table: of the frictionless joint."""
    return TableCurve(np.zeros(0), np.zeros((4, 0, 4)), np.zeros((0, 3)), 0.0, False)


@strict_jit
def evaluate_curve(curve, x, out):
    """Table at ``x = log(a / preload)`` into ``out``: the columns of `TableCurve`."""
    knots, coefficients = curve.knots, curve.coefficients
    n = knots.shape[0]
    i = min(max(np.searchsorted(knots, x) - 1, 0), n - 2)
    t = min(max(x, knots[0]), knots[n - 1]) - knots[i]
    for j in range(out.shape[0]):
        out[j] = (
            (coefficients[0, i, j] * t + coefficients[1, i, j]) * t + coefficients[2, i, j]
        ) * t + coefficients[3, i, j]
    if x < knots[0]:
        out[1] *= np.exp(x - knots[0])
        out[4 : 4 + 8 * curve.upper.shape[0]] = 0.0


@strict_jit
def upper_force(curve, out, w, alpha, beta):
    """Change of the modal contact force over the amplitude by the upper harmonics, see `refined.py`.

    `out` is from `evaluate_curve`.
    """
    upper, reference = curve.upper, curve.reference
    total = 0.0 + 0.0j
    for s in range(upper.shape[0]):
        hw, own = upper[s, 0] * w, upper[s, 1]
        D = hw * hw - reference - 1j * hw * (alpha + beta * own * own + upper[s, 2])
        o = out[4 + 8 * s : 12 + 8 * s]
        load = D * (o[0] + 1j * o[1]) / (1.0 - D * (o[2] + 1j * o[3]))
        total += (o[4] + 1j * o[5]) * load.real + (o[6] + 1j * o[7]) * load.imag
    return total
