"""Reduced models of the forced response: the paper's as printed, the consistent and the refined.

Two coordinates, ``x = T y`` with ``T = [Phi_sl Phi_st]``. At each frequency

    [-omega² m + (1 + i omega beta) k + i omega alpha m] y + f_f(y) = T^T F

with the friction force replaced by its first harmonic from a table of equivalent stiffness and
damping against amplitude:

``printed``      f_f = (k_eq + i gamma_eq)(|y_sl|) omega_sl² I y on the coordinates of T (the paper's
                 eqs. (15), (16); the misprints of its eqs. (6), (7), (10), (13), (14) corrected).
``consistent``   basis M-orthonormalised, the force itself projected: on the sliding mode
                 ``omega_sl² (k_eq + i gamma_eq)(|q|) q`` and on the second coordinate its measured
                 cross part, both functions of ``q = Phi_sl^T M x``.
``refined``      one coordinate; the force tabulated with q prescribed, at the amplitude of
                 ``q + c M``, with upper harmonics (`refined.py`).

Each is a fixed-point problem for one amplitude ``a``: solve the linear system with the table at
``a``, get a new amplitude ``g(a)``. Plain iteration runs from the neighbouring frequency's answer;
where it does not contract it is safeguarded by regula falsi (Illinois) on ``g(a) - a``, which has a
root between 0 and the largest response. ``|g'|`` at the answer, the contraction factor, is kept:
where it exceeds 1 plain iteration would fail.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numba as nb
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import Akima1DInterpolator, PchipInterpolator
from scipy.optimize import brentq, minimize_scalar

from microslip.analyses.reduced.table import EquivalentTable
from microslip.analyses.statics.linear_states import LinearStates
from microslip.errors import MicroslipError
from microslip.typing import Array

VARIANTS = ("printed", "consistent", "refined")

CONVERGED, NOT_CONVERGED, OUTSIDE = 0, 1, 2
"""Flags of a point: converged; iteration did not end; amplitude above the table."""


@dataclass(frozen=True)
class TwoModeModel:
    """Linear part of the reduced model and where the table enters it.

    ``[-omega² m + (1 + i omega beta) k + i omega alpha m] y + omega_sl² (E kappa + X chi)
    (y + offset) = force``, with ``kappa = k_eq (1 + i omega beta lossy) + i gamma_eq`` and ``chi``
    the cross coefficient at ``a = |argument . (y + offset)|``; the modal amplitude reported is
    ``sliding . y``.

    Attributes
    ----------
    m, k, E, X : (2, 2) arrays
    argument, sliding, offset : (2,) arrays
        `offset` per unit load.
    lossy : float
        1 where the elastic part of the force has the material's loss, else 0.
    force : (2,) array
        Projection of a unit load.
    rayleigh : tuple of float
    omega : float
        omega_sl, rad/s.
    """

    m: Array
    k: Array
    E: Array
    X: Array
    argument: Array
    sliding: Array
    force: Array
    rayleigh: tuple[float, float]
    omega: float
    offset: Array = field(default_factory=lambda: np.zeros(2))
    lossy: float = 0.0


def two_mode_model(
    states: LinearStates,
    load: str,
    rayleigh: tuple[float, float],
    variant: str,
    offset: float = 0.0,
) -> TwoModeModel:
    """Reduced model of the sliding and the stuck mode.

    Parameters
    ----------
    states : LinearStates
    load : str
        Driving load of the structure.
    rayleigh : tuple of float
        alpha (1/s), beta (s).
    variant : str
        One of `VARIANTS`.
    offset : float
        Of the refined model, see `refined.moment_offset`.
    """
    c = states.overlap
    sl2, st2 = states.sliding_omega**2, states.stuck_omega**2
    f_sl, f_st = states.load_on_sliding[load], states.load_on_stuck[load]
    if variant == "printed":
        return TwoModeModel(
            m=np.array([[1.0, c], [c, 1.0]]),
            k=np.array([[sl2, c * sl2], [c * sl2, st2]]),
            E=np.eye(2),
            X=np.zeros((2, 2)),
            argument=np.array([1.0, 0.0]),
            sliding=np.array([1.0, c]),
            force=np.array([f_sl, f_st]),
            rayleigh=rayleigh,
            omega=states.sliding_omega,
        )
    if variant == "refined":
        return TwoModeModel(
            m=np.eye(2),
            k=np.diag([sl2, st2]),
            E=np.array([[1.0, 0.0], [0.0, 0.0]]),
            X=np.zeros((2, 2)),
            argument=np.array([1.0, 0.0]),
            sliding=np.array([1.0, 0.0]),
            force=np.array([f_sl, 0.0]),
            rayleigh=rayleigh,
            omega=states.sliding_omega,
            offset=np.array([offset, 0.0]),
            lossy=1.0,
        )
    if variant != "consistent":
        raise MicroslipError(f"no variant {variant!r}: choose one of {', '.join(VARIANTS)}")
    s = np.sqrt(1 - c**2)
    return TwoModeModel(
        m=np.eye(2),
        k=np.diag([sl2, (st2 - c**2 * sl2) / s**2]),
        E=np.array([[1.0, 0.0], [0.0, 0.0]]),
        X=np.array([[0.0, 0.0], [1.0, 0.0]]),
        argument=np.array([1.0, 0.0]),
        sliding=np.array([1.0, 0.0]),
        force=np.array([f_sl, (f_st - c * f_sl) / s]),
        rayleigh=rayleigh,
        omega=states.sliding_omega,
    )


@dataclass(frozen=True)
class Response:
    """Forced response of a reduced model over frequency.

    Attributes
    ----------
    variant, drive : str
        Of the reduced model and of its table (empty for the frictionless joint).
    rho : float
        As the input gave it; nan where it gave a moment.
    load : float
        Amplitude of the driving load.
    friction : float
    frequency : (n,) array
        Hz.
    amplitude : (n,) complex array
        First harmonic of ``Phi_sl^T M (x - x_prestress)``, phase against the load's sine.
    iterations : (n,) int array
    contraction : (n,) array
        ``|g'|`` at the answer.
    flag : (n,) int array
        0 converged, 1 not converged, 2 amplitude above the table.
    error_indicator : (n,) array, optional
        Estimated relative error of the amplitude, see `trust.py`.
    """

    variant: str
    drive: str
    rho: float
    load: float
    friction: float
    frequency: Array
    amplitude: NDArray[np.complex128]
    iterations: NDArray[np.int64]
    contraction: Array
    flag: NDArray[np.int64]
    error_indicator: Array | None = None

    @property
    def peak(self) -> int:
        """Index of the largest converged amplitude."""
        return int(np.argmax(np.where(self.flag == CONVERGED, np.abs(self.amplitude), -1.0)))

    @property
    def peak_frequency(self) -> float:
        """Hz, parabola through the largest point and its neighbours."""
        return self._vertex()[0]

    @property
    def peak_amplitude(self) -> float:
        """Same parabola."""
        return self._vertex()[1]

    @property
    def unconverged(self) -> Array:
        """Frequencies of the points that are not answers, Hz."""
        return self.frequency[self.flag != CONVERGED]

    def _vertex(self) -> tuple[float, float]:
        i, size = self.peak, np.abs(self.amplitude)
        if 0 < i < len(size) - 1 and (self.flag[i - 1 : i + 2] == CONVERGED).all():
            left, top, right = size[i - 1 : i + 2]
            bend = left - 2 * top + right
            if bend < 0 and max(left, right) > 0.5 * top:
                shift = 0.5 * (left - right) / bend
                step = self.frequency[i + 1] - self.frequency[i]
                return (
                    float(self.frequency[i] + shift * step),
                    float(top - 0.25 * (left - right) * shift),
                )
        return float(self.frequency[i]), float(size[i])


@dataclass(frozen=True)
class TableCurve:
    """Piecewise cubic interpolation of a table in ``log(amplitude / clamp)``.

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
        of s upper harmonics, each as real and imaginary part.
    upper : (s, 2) array
        Order and circular frequency of the upper harmonics.
    reference : float
        omega_0².
    """

    knots: Array
    coefficients: Array
    upper: Array
    reference: float


def table_curve(table: EquivalentTable) -> TableCurve:
    """Coefficients for the compiled evaluation of a table."""
    if len(table.amplitude) < 2:
        raise MicroslipError("a table of equivalent stiffness needs at least two amplitudes")
    x = np.log(table.amplitude / table.clamp)
    if not (np.diff(x) > 0).all():
        raise MicroslipError("amplitudes of the table do not grow with the load: drive it further")
    columns = [table.k_eq, table.gamma_eq, table.cross.real, table.cross.imag]
    upper, reference = np.zeros((0, 2)), 0.0
    if table.upper is not None:
        u = table.upper
        upper, reference = np.column_stack([u.order, u.omega]), u.reference_omega**2
        for values in zip(u.motion.T, u.compliance.T, u.in_phase.T, u.quadrature.T, strict=True):
            columns += [part for y in values for part in (y.real, y.imag)]
    interpolate = PchipInterpolator if table.uncertainty is None else Akima1DInterpolator
    c = np.stack([interpolate(x, y).c for y in columns])
    return TableCurve(x, np.ascontiguousarray(np.moveaxis(c, 0, -1)), upper, reference)


_NO_ANSWER = 1e3

_jit = nb.njit(cache=True, error_model="numpy")


@_jit
def evaluate_curve(knots, coefficients, x, out):
    """Table at ``x = log(a / clamp)`` into ``out``: the columns of `TableCurve`."""
    n = knots.shape[0]
    i = min(max(np.searchsorted(knots, x) - 1, 0), n - 2)
    t = min(max(x, knots[0]), knots[n - 1]) - knots[i]
    for j in range(out.shape[0]):
        out[j] = (
            (coefficients[0, i, j] * t + coefficients[1, i, j]) * t + coefficients[2, i, j]
        ) * t + coefficients[3, i, j]
    if x < knots[0]:
        out[1] *= np.exp(x - knots[0])
        out[4:] = 0.0


@_jit
def _upper_force(out, upper, reference, w, alpha, beta):
    """Change of the modal contact force over the amplitude by the upper harmonics, see `refined.py`."""
    total = 0.0 + 0.0j
    for s in range(upper.shape[0]):
        hw, own = upper[s, 0] * w, upper[s, 1]
        D = hw * hw - reference - 1j * hw * (alpha + beta * own * own)
        o = out[4 + 8 * s : 12 + 8 * s]
        load = D * (o[0] + 1j * o[1]) / (1.0 - D * (o[2] + 1j * o[3]))
        total += (o[4] + 1j * o[5]) * load.real + (o[6] + 1j * o[7]) * load.imag
    return total


@_jit
def _respond(a, w, system, out, y):
    """One pass of the fixed-point map at amplitude `a`: the response into `y`, its amplitude back."""
    (clamp, knots, coefficients, upper, reference, m, k, E, X, argument, offset, lossy, force) = (
        system[:13]
    )
    alpha, beta, w2 = system[13:]
    kappa = 0.0 + 0.0j
    chi = 0.0 + 0.0j
    if knots.shape[0] > 0:
        evaluate_curve(knots, coefficients, np.log(max(a, 1e-300) / clamp), out)
        kappa = w2 * (out[0] * (1.0 + 1j * w * beta * lossy) + 1j * out[1])
        kappa += _upper_force(out, upper, reference, w, alpha, beta)
        chi = w2 * (out[2] + 1j * out[3])
    stiff = 1.0 + 1j * w * beta
    inert = -w * w + 1j * w * alpha
    c00 = kappa * E[0, 0] + chi * X[0, 0]
    c01 = kappa * E[0, 1] + chi * X[0, 1]
    c10 = kappa * E[1, 0] + chi * X[1, 0]
    c11 = kappa * E[1, 1] + chi * X[1, 1]
    z00 = inert * m[0, 0] + stiff * k[0, 0] + c00
    z01 = inert * m[0, 1] + stiff * k[0, 1] + c01
    z10 = inert * m[1, 0] + stiff * k[1, 0] + c10
    z11 = inert * m[1, 1] + stiff * k[1, 1] + c11
    f0 = force[0] - c00 * offset[0] - c01 * offset[1]
    f1 = force[1] - c10 * offset[0] - c11 * offset[1]
    det = z00 * z11 - z01 * z10
    y[0] = (z11 * f0 - z01 * f1) / det
    y[1] = (z00 * f1 - z10 * f0) / det
    return abs(argument[0] * (y[0] + offset[0]) + argument[1] * (y[1] + offset[1]))


@_jit
def _iterate(a, w, system, out, y, tolerance, most):
    """Plain fixed-point iteration until it converges or no longer contracts.

    Returns (amplitude, evaluations, converged).
    """
    previous = np.inf
    for count in range(1, most + 1):
        new = _respond(a, w, system, out, y)
        change = abs(new - a)
        if change <= tolerance * new:
            return new, count, True
        if change > 0.7 * previous:
            return a, count, False
        previous = change
        a = new
    return a, most, False


@_jit
def _bracketed(base, w, system, out, y, tolerance, most):
    """Root of ``g(a) - a`` nearest to `base`: grow an interval around it, then regula falsi.

    Returns (amplitude, evaluations, converged).
    """
    count = 1
    if base <= 0.0:
        base = _respond(0.0, w, system, out, y)
        count += 1
    lower, upper = base, base
    f_lower = _respond(base, w, system, out, y) - base
    f_upper = f_lower
    downward = f_lower < 0.0
    factor = 1.01
    while f_lower * f_upper > 0.0:
        if count >= most:
            return base, count, False
        if downward:
            upper, f_upper = lower, f_lower
            lower /= factor
            f_lower = _respond(lower, w, system, out, y) - lower
        else:
            lower, f_lower = upper, f_upper
            upper *= factor
            f_upper = _respond(upper, w, system, out, y) - upper
        factor *= 1.2
        count += 1
    side = 0
    a = base
    while count < most:
        if upper - lower <= tolerance * upper:
            return a, count, True
        a = (lower * f_upper - upper * f_lower) / (f_upper - f_lower)
        f_a = _respond(a, w, system, out, y) - a
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


@_jit
def sweep(omegas, system, sliding, tolerance, most, amplitude, iterations, contraction, flag):
    """Fixed-point answers at every frequency in turn, each starting from the last one's."""
    clamp, knots = system[0], system[1]
    out = np.zeros(system[2].shape[2])
    y = np.zeros(2, np.complex128)
    top = clamp * np.exp(knots[-1]) if knots.shape[0] > 0 else np.inf
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
            slope = _respond(a + h, w, system, out, y) - _respond(a - h, w, system, out, y)
            contraction[i] = abs(slope) / (2.0 * h)
        _respond(a, w, system, out, y)
        amplitude[i] = sliding[0] * y[0] + sliding[1] * y[1]
        iterations[i] = count
        flag[i] = CONVERGED if good else NOT_CONVERGED
        if good and a > top:
            flag[i] = OUTSIDE


def contact_coefficient(
    model: TwoModeModel, curve: TableCurve, clamp: float, amplitude: float, omega: float
) -> tuple[complex, complex]:
    """kappa of the refined model at one amplitude and circular frequency, and the share in it of
    the upper harmonics."""
    out = np.zeros(curve.coefficients.shape[2])
    evaluate_curve(curve.knots, curve.coefficients, np.log(amplitude / clamp), out)
    alpha, beta = model.rayleigh
    upper = _upper_force(out, curve.upper, curve.reference, omega, alpha, beta) / model.omega**2
    elastic = out[0] * (1 + 1j * omega * beta * model.lossy)
    return complex(elastic + 1j * out[1] + upper), complex(upper)


def _system(
    model: TwoModeModel, curve: TableCurve | None, clamp: float, load: float
) -> tuple[object, ...]:
    """What the compiled functions need, in the order that they unpack it."""
    knots = np.zeros(0) if curve is None else curve.knots
    coefficients = np.zeros((4, 0, 4)) if curve is None else curve.coefficients
    upper = np.zeros((0, 2)) if curve is None else curve.upper
    alpha, beta = model.rayleigh
    return (
        float(clamp),
        knots,
        coefficients,
        upper,
        0.0 if curve is None else float(curve.reference),
        model.m,
        model.k,
        model.E,
        model.X,
        model.argument,
        load * model.offset,
        float(model.lossy),
        load * model.force,
        float(alpha),
        float(beta),
        float(model.omega**2),
    )


def forced_response(
    model: TwoModeModel,
    table: EquivalentTable | None,
    frequency: Array,
    load: float,
    *,
    clamp: float | None = None,
    rho: float = np.nan,
    friction: float = np.nan,
    variant: str = "",
    tolerance: float = 1e-10,
    max_iterations: int = 500,
) -> Response:
    """Forced response over frequency; `table` None is the linear frictionless joint, eq. (18).

    The sweep starts at the end of the band farther from resonance.

    Parameters
    ----------
    model : TwoModeModel
    table : EquivalentTable or None
    frequency : (n,) array
        Hz, ascending.
    load : float
        Amplitude of the driving load.
    clamp : float, optional
        Clamp force, N/m; that of the table when left out. Amplitudes scale with it.
    rho, friction, variant
        Labels kept in the result.
    tolerance : float
        Relative change of amplitude at which a point is converged.
    max_iterations : int
        Evaluations of the fixed-point map per frequency.
    """
    frequency = np.ascontiguousarray(frequency, dtype=float)
    curve = None if table is None else table_curve(table)
    if clamp is None:
        clamp = 1.0 if table is None else table.clamp
    centre = model.omega / (2 * np.pi)
    backward = abs(frequency[-1] - centre) > abs(frequency[0] - centre)
    order = slice(None, None, -1 if backward else 1)
    n = len(frequency)
    amplitude = np.zeros(n, complex)
    iterations, flag = np.zeros(n, np.int64), np.zeros(n, np.int64)
    contraction = np.zeros(n)
    sweep(
        2 * np.pi * np.ascontiguousarray(frequency[order]),
        _system(model, curve, clamp, load),
        model.sliding,
        tolerance,
        max_iterations,
        amplitude,
        iterations,
        contraction,
        flag,
    )
    return Response(
        variant=variant,
        drive="" if table is None else table.drive,
        rho=rho,
        load=load,
        friction=friction,
        frequency=frequency,
        amplitude=amplitude[order],
        iterations=iterations[order],
        contraction=contraction[order],
        flag=flag[order],
    )


def all_amplitudes(
    model: TwoModeModel, table: EquivalentTable, frequency: float, load: float, points: int = 400
) -> Array:
    """Every amplitude with ``g(a) = a`` inside the table at one frequency (folds have three)."""
    curve = table_curve(table)
    out, y = np.zeros(curve.coefficients.shape[2]), np.zeros(2, complex)
    system = _system(model, curve, table.clamp, load)

    def gap(a: float) -> float:
        return float(_respond(a, 2 * np.pi * frequency, system, out, y) - a)

    grid = table.clamp * np.exp(np.linspace(curve.knots[0] - 5, curve.knots[-1], points))
    values = np.array([gap(a) for a in grid])
    roots = []
    for i in np.flatnonzero(values[:-1] * values[1:] <= 0):
        roots.append(brentq(gap, grid[i], grid[i + 1], xtol=1e-14 * grid[i]))
    return np.array(roots)


def answers(
    model: TwoModeModel, table: EquivalentTable, frequency: float, load: float
) -> NDArray[np.complex128]:
    """First harmonic of the sliding coordinate of every solution inside the table, ascending."""
    curve = table_curve(table)
    out, y = np.zeros(curve.coefficients.shape[2]), np.zeros(2, complex)
    system = _system(model, curve, table.clamp, load)
    found = []
    for a in all_amplitudes(model, table, frequency, load):
        _respond(a, 2 * np.pi * frequency, system, out, y)
        found.append(complex(model.sliding @ y))
    return np.array(found, complex)


def greatest_damping_load(
    model: TwoModeModel, table: EquivalentTable, frequency: Array, bounds: tuple[float, float]
) -> float:
    """Load amplitude at which the resonance peak per unit load is lowest.

    Parameters
    ----------
    model : TwoModeModel
    table : EquivalentTable
    frequency : (n,) array
        Band in which the peak is looked for, Hz.
    bounds : tuple of float
        Loads between which to look.
    """

    def gain(log_load: float) -> float:
        load = float(np.exp(log_load))
        response = forced_response(model, table, frequency, load)
        if (response.flag != CONVERGED).any():
            return _NO_ANSWER
        return float(np.log(response.peak_amplitude / load))

    grid = np.linspace(np.log(bounds[0]), np.log(bounds[1]), 60)
    values = [gain(x) for x in grid]
    i = int(np.argmin(values))
    if not 0 < i < len(grid) - 1 or max(values[i - 1], values[i + 1]) == _NO_ANSWER:
        raise MicroslipError(
            "the load of greatest damping is outside the amplitudes of the table: widen "
            "[analysis.cycle] smallest and largest"
        )
    found = minimize_scalar(
        gain, bounds=(grid[i - 1], grid[i + 1]), method="bounded", options={"xatol": 1e-4}
    )
    return float(np.exp(found.x))
