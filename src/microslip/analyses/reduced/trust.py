"""How far a reduced model's answer can be trusted, without the truth.

The refined model's equation in the sliding coordinate (`refined.py`),

    R(Q) = (omega_sl² (1 + i omega beta) - omega² + i omega alpha) Q
           + omega_sl² kappa(|A|, omega) A - Phi^T p M = 0,        A = Q + c M

measures any answer: one Newton step, ``delta = -J^-1 R`` with J the real two by two derivative of R,
tells by how much ``Q`` misses. For the refined model itself R vanishes, and what it does not know
takes its place: the error of interpolating its table, the harmonics it left out, and a share of the
upper harmonics it keeps, which are linearised,

    |R| <= omega_sl² |A| (uncertainty + LEFT_OUT |kappa| + SHARE |kappa_upper|).

The indicator is ``|delta| / |Q|``, largest over the phase of R. Near a fold J is nearly singular and
the indicator grows without bound, as the error does.
"""

from __future__ import annotations

import numpy as np

from microslip.analyses.reduced.curve import TableCurve, table_curve
from microslip.analyses.reduced.response import Response
from microslip.analyses.reduced.sweep import OUTSIDE, contact_coefficient
from microslip.analyses.reduced.table import EquivalentTable
from microslip.analyses.reduced.two_mode import TwoModeModel
from microslip.errors import MicroslipError
from microslip.typing import Array

LEFT_OUT = 3e-4
"""Of the force, what the harmonics that are left out may change."""

SHARE = 0.2
"""Of the upper harmonics' force, what linearising them may miss."""

DIFFERENCE = 1e-5
"""Relative step of amplitude in the derivative of kappa."""


def error_indicator(response: Response, model: TwoModeModel, table: EquivalentTable) -> Array:
    """Estimated relative error of the modal amplitude at every point of a response.

    Parameters
    ----------
    response : Response
        Of any variant, under the same joint and kind of load.
    model : TwoModeModel
        The refined model.
    table : EquivalentTable
        The refined table.

    Returns
    -------
    (n,) array
        ``|delta|/|Q|``; infinite where the answer lies above the table or did not converge.

    Raises
    ------
    MicroslipError
        Where `table` is not that of a refined model.
    """
    if table.uncertainty is None:
        raise MicroslipError("the error indicator needs the table of the refined model")
    curve = table_curve(table)
    Q = np.asarray(response.amplitude)
    offset = model.offset[0] * response.load
    out = np.full(len(Q), np.inf)
    for i, (f, q) in enumerate(zip(response.frequency, Q, strict=True)):
        size = abs(q + offset)
        if response.flag[i] == OUTSIDE or not 0 < size <= table.amplitude[-1]:
            continue
        out[i] = _indicator(model, table, curve, 2 * np.pi * f, q, response, size)
    return out


def _indicator(
    model: TwoModeModel,
    table: EquivalentTable,
    curve: TableCurve,
    omega: float,
    q: complex,
    response: Response,
    size: float,
) -> float:
    def kappa(a: float) -> tuple[complex, complex]:
        return contact_coefficient(model, curve, table.preload, a, omega)

    w2 = model.omega**2
    load = response.load
    A = q + model.offset[0] * load
    linear = complex(model.linear_stiffness(omega))
    whole, upper = kappa(size)
    h = DIFFERENCE * size
    slope = (kappa(size + h)[0] - kappa(size - h)[0]) / (2 * h)
    # dR = (linear + w2 kappa) dQ + w2 slope A d|A|,  d|A| = Re(conj(A) dQ)/|A|
    straight, bent = linear + w2 * whole, w2 * slope * A * np.conj(A) / size
    bent_other = w2 * slope * A * A / size
    real = straight + 0.5 * (bent + bent_other)
    imag = 1j * straight + 0.5j * (bent - bent_other)
    J = np.array([[real.real, imag.real], [real.imag, imag.imag]])
    if response.variant != "refined":
        R = linear * q + w2 * whole * A - model.force[0] * load
        delta = np.linalg.lstsq(J, [R.real, R.imag], rcond=None)[0]
        return float(np.linalg.norm(delta) / abs(q))
    assert table.uncertainty is not None
    unknown = np.interp(np.log(size), np.log(table.amplitude), table.uncertainty)
    unknown += LEFT_OUT * abs(whole) + SHARE * abs(upper)
    smallest = np.linalg.svd(J, compute_uv=False)[-1]
    return float(w2 * size * unknown / max(smallest, 1e-300) / abs(q))
