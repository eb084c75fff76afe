"""Compiled fixed point of a reduced model, frequency after frequency.

A reduced model is a fixed-point problem for one amplitude ``a``: solve the linear system with the table at
``a``, get a new amplitude ``g(a)``. Plain iteration runs from the neighbouring frequency's answer;
where it does not contract it is safeguarded by regula falsi (Illinois) on ``g(a) - a``, which has a
root between 0 and the largest response. ``|g'|`` at the answer, the contraction factor, is kept:
where it exceeds 1 plain iteration would fail.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from microslip.analyses.reduced.curve import TableCurve, evaluate_curve, no_curve, upper_force
from microslip.analyses.reduced.two_mode import TwoModeModel
from microslip.contact.compiled import strict_jit
from microslip.typing import Array, Complex, Indices

CONVERGED, NOT_CONVERGED, OUTSIDE = 0, 1, 2
"""Flags of a point: converged; iteration did not end; amplitude above the table."""


class FixedPoint(NamedTuple):
    """A reduced model under an amplitude of the load, as the compiled functions take it.

    Attributes
    ----------
    preload : float
        Clamp force, N/m; the curve is read at amplitudes divided by it.
    curve : TableCurve
        Without knots for the frictionless joint.
    m, k, E, X, argument, lossy
        As in `TwoModeModel`.
    offset, force : (2,) arrays
        Those of the model times the load.
    alpha, beta : float
        Rayleigh damping, 1/s and s.
    omega2 : float
        omega_sl².
    damping : (2, 2) array
        As in `TwoModeModel`.
    """

    preload: float
    curve: TableCurve
    m: Array
    k: Array
    E: Array
    X: Array
    argument: Array
    offset: Array
    lossy: float
    force: Array
    alpha: float
    beta: float
    omega2: float
    damping: Array


class Answers(NamedTuple):
    """What a sweep over n frequencies writes.

    Attributes
    ----------
    amplitude : (n,) complex array
        First harmonic of the sliding coordinate.
    iterations : (n,) int array
        Evaluations of the map.
    contraction : (n,) array
        ``|g'|`` at the answer.
    flag : (n,) int array
    """

    amplitude: Complex
    iterations: Indices
    contraction: Array
    flag: Indices


def fixed_point(
    model: TwoModeModel, curve: TableCurve | None, preload: float, load: float
) -> FixedPoint:
    """Fixed-point problem of a reduced model under an amplitude of the load.

    Parameters
    ----------
    model : TwoModeModel
    curve : TableCurve or None
        None is the frictionless joint.
    preload : float
        Clamp force, N/m; amplitudes scale with it.
    load : float
    """
    alpha, beta = model.rayleigh
    return FixedPoint(
        preload=float(preload),
        curve=no_curve() if curve is None else curve,
        m=model.m,
        k=model.k,
        E=model.E,
        X=model.X,
        argument=model.argument,
        offset=load * model.offset,
        lossy=float(model.lossy),
        force=load * model.force,
        alpha=float(alpha),
        beta=float(beta),
        omega2=float(model.omega**2),
        damping=model.damping,
    )


@strict_jit
def next_amplitude(a, w, system, out, y):
    """One pass of the fixed-point map at amplitude `a`: the response into `y`, its amplitude back."""
    preload, curve, w2 = system.preload, system.curve, system.omega2
    m, k, E, X = system.m, system.k, system.E, system.X
    argument, offset, force = system.argument, system.offset, system.force
    lossy, alpha, beta = system.lossy, system.alpha, system.beta
    kappa = 0.0 + 0.0j
    chi = 0.0 + 0.0j
    if curve.knots.shape[0] > 0:
        evaluate_curve(curve, np.log(max(a, 1e-300) / preload), out)
        kappa = w2 * (out[0] * (1.0 + 1j * w * beta * lossy) + 1j * out[1])
        kappa += upper_force(curve, out, w, alpha, beta)
        if curve.damped:
            kappa += 1j * w * out[out.shape[0] - 1]
        chi = w2 * (out[2] + 1j * out[3])
    stiff = 1.0 + 1j * w * beta
    inert, turn, d = -w * w + 1j * w * alpha, 1j * w, system.damping
    c00 = kappa * E[0, 0] + chi * X[0, 0]
    c01 = kappa * E[0, 1] + chi * X[0, 1]
    c10 = kappa * E[1, 0] + chi * X[1, 0]
    c11 = kappa * E[1, 1] + chi * X[1, 1]
    z00 = inert * m[0, 0] + stiff * k[0, 0] + c00 + turn * d[0, 0]
    z01 = inert * m[0, 1] + stiff * k[0, 1] + c01 + turn * d[0, 1]
    z10 = inert * m[1, 0] + stiff * k[1, 0] + c10 + turn * d[1, 0]
    z11 = inert * m[1, 1] + stiff * k[1, 1] + c11 + turn * d[1, 1]
    f0 = force[0] - c00 * offset[0] - c01 * offset[1]
    f1 = force[1] - c10 * offset[0] - c11 * offset[1]
    det = z00 * z11 - z01 * z10
    y[0] = (z11 * f0 - z01 * f1) / det
    y[1] = (z00 * f1 - z10 * f0) / det
    return abs(argument[0] * (y[0] + offset[0]) + argument[1] * (y[1] + offset[1]))


@strict_jit
def _iterate(a, w, system, out, y, tolerance, most):
    """Plain fixed-point iteration until it converges or no longer contracts.

    Returns (amplitude, evaluations, converged).
    """
    previous = np.inf
    for count in range(1, most + 1):
        new = next_amplitude(a, w, system, out, y)
        change = abs(new - a)
        if change <= tolerance * new:
            return new, count, True
        if change > 0.7 * previous:
            return a, count, False
        previous = change
        a = new
    return a, most, False


@strict_jit
def _bracketed(base, w, system, out, y, tolerance, most):
    """Root of ``g(a) - a`` nearest to `base`: grow an interval around it, then regula falsi.

    Returns (amplitude, evaluations, converged).
    """
    count = 1
    if base <= 0.0:
        base = next_amplitude(0.0, w, system, out, y)
        count += 1
    lower, upper = base, base
    f_lower = next_amplitude(base, w, system, out, y) - base
    f_upper = f_lower
    downward = f_lower < 0.0
    factor = 1.01
    while f_lower * f_upper > 0.0:
        if count >= most:
            return base, count, False
        if downward:
            upper, f_upper = lower, f_lower
            lower /= factor
            f_lower = next_amplitude(lower, w, system, out, y) - lower
        else:
            lower, f_lower = upper, f_upper
            upper *= factor
            f_upper = next_amplitude(upper, w, system, out, y) - upper
        factor *= 1.2
        count += 1
    side = 0
    a = base
    while count < most:
        if upper - lower <= tolerance * upper:
            return a, count, True
        a = (lower * f_upper - upper * f_lower) / (f_upper - f_lower)
        f_a = next_amplitude(a, w, system, out, y) - a
        count += 1
        if abs(f_a) <= tolerance * a:
            return a, count, True
        if f_a * f_upper > 0.0:
            upper, f_upper = a, f_a
            if side == 1:
                f_lower *= 0.5
            side = 1
        else:
            lower, f_lower = a, f_a
            if side == 2:
                f_upper *= 0.5
            side = 2
    return a, count, False


@strict_jit
def sweep(omegas, system, sliding, tolerance, most, answers):
    """Fixed-point answers at every frequency in turn, each starting from the last one's."""
    preload, knots = system.preload, system.curve.knots
    amplitude, iterations = answers.amplitude, answers.iterations
    contraction, flag = answers.contraction, answers.flag
    out = np.zeros(system.curve.coefficients.shape[2])
    y = np.zeros(2, np.complex128)
    top = preload * np.exp(knots[-1]) if knots.shape[0] > 0 else np.inf
    a = 0.0
    for i in range(omegas.shape[0]):
        w = omegas[i]
        a, count, good = _iterate(a, w, system, out, y, tolerance, most)
        if not good:
            a, more, good = _bracketed(a, w, system, out, y, tolerance, most - count)
            count += more
        contraction[i] = 0.0
        if knots.shape[0] > 0 and good:
            h = 1e-5 * a
            slope = next_amplitude(a + h, w, system, out, y) - next_amplitude(
                a - h, w, system, out, y
            )
            contraction[i] = abs(slope) / (2.0 * h)
        next_amplitude(a, w, system, out, y)
        amplitude[i] = sliding[0] * y[0] + sliding[1] * y[1]
        iterations[i] = count
        flag[i] = CONVERGED if good else NOT_CONVERGED
        if not np.isfinite(abs(amplitude[i])):
            flag[i] = NOT_CONVERGED
            a = 0.0
        elif good and a > top:
            flag[i] = OUTSIDE


def contact_coefficient(
    model: TwoModeModel, curve: TableCurve, preload: float, amplitude: float, omega: float
) -> tuple[complex, complex]:
    """kappa of the refined model at one amplitude and circular frequency, and the share in it of
    the upper harmonics."""
    out = np.zeros(curve.coefficients.shape[2])
    evaluate_curve(curve, np.log(amplitude / preload), out)
    alpha, beta = model.rayleigh
    upper = upper_force(curve, out, omega, alpha, beta) / model.omega**2
    elastic = out[0] * (1 + 1j * omega * beta * model.lossy)
    if curve.damped:
        elastic += 1j * omega * out[-1] / model.omega**2
    return complex(elastic + 1j * out[1] + upper), complex(upper)
