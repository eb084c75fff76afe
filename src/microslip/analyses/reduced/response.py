"""Forced response of a reduced model: the sweep, every answer at a frequency, the greatest damping."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.optimize import brentq, minimize_scalar

from microslip.analyses.reduced.anchors import Anchor
from microslip.analyses.reduced.curve import table_curve
from microslip.analyses.reduced.sweep import (
    CONVERGED,
    OUTSIDE,
    Answers,
    fixed_point,
    next_amplitude,
    sweep,
)
from microslip.analyses.reduced.table import EquivalentTable
from microslip.analyses.reduced.through_anchors import Held
from microslip.analyses.reduced.two_mode import TwoModeModel
from microslip.brief import Brief
from microslip.errors import MicroslipError
from microslip.typing import Array, Complex, Indices, Mask

_NO_ANSWER = 1e3

NO_DIGIT = 1.0
"""An answer that may be off by as much as this share of itself is none."""

APART = 0.01
"""Answers at one frequency that differ by more than this share are two motions."""

MOST_UNEVEN = 4.5
"""Spacings between which a parabola is laid differ by this factor at most."""


@dataclass(frozen=True)
class Check:
    """A response of the refined model held against the motion of the full joint.

    Attributes
    ----------
    frequency : float
        Hz.
    modelled, amplitude : complex
        First harmonic of the modal coordinate by the model, and by time integration.
    doubt : float
        Relative error that transients leave in the latter; nan where the motion is not steady.

    Examples
    --------
    >>> round(Check(170.0, 1.02e-3j, 1e-3j, 1e-5).error, 3)
    0.02
    """

    frequency: float
    modelled: complex
    amplitude: complex
    doubt: float

    @property
    def error(self) -> float:
        """``|modelled| / |amplitude| - 1``; nan where the motion is not steady."""
        if not np.isfinite(self.doubt):
            return np.nan
        return abs(self.modelled) / abs(self.amplitude) - 1


@dataclass(frozen=True, repr=False)
class Response(Brief):
    """Forced response of a reduced model over frequency.

    Attributes
    ----------
    variant, drive : str
        Of the reduced model and of its table (empty for the frictionless joint); ``"corrected"`` and
        ``"auto"`` where steady states put the refined model right.
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
        Relative error of the amplitude: estimate of `trust.py`; the bound of `anchors.py` where steady states
        put it right.
    varies : (n,) array, optional
        What the amplitude is known to stray by from its mean from cycle to cycle, and for good, relative:
        part of the error where steady states put it right.
    outputs : mapping of str to (n,) complex array
        First harmonic of every output by name, change from prestress, phase against the load's sine;
        m, rad, m/s, ... (`microslip.describe.outputs`).
    output_errors : mapping of str to (n,) array
        Bound of the relative error of their sizes by name, that of the amplitude in it, where steady states
        put them right (`held_output.py`).
    opening_load : float
        From this load on the resonance opens the joint; nan where the response stays below.
    outgrown : (n,) bool array, optional
        Where the answer is the smaller of those that a fold has, as the larger left the table: see
        `swept_both_ways`.
    smaller : Response, optional
        Where a fold has two motions, the smaller of them; its other points have no answer.
    larger : Response, optional
        Where the larger of two motions does not repeat and the smaller is shown, the mean of the larger, as
        far as it has one; its other points have no answer.
    anchors : tuple of Anchor
        Steady states that the answers pass through, by frequency, where they put it right.
    checks : tuple of Check
        What it was held against where nothing puts it right.
    """

    variant: str
    drive: str
    rho: float
    load: float
    friction: float
    frequency: Array
    amplitude: Complex
    iterations: Indices
    contraction: Array
    flag: Indices
    error_indicator: Array | None = None
    varies: Array | None = None
    outgrown: Mask | None = None
    smaller: Response | None = None
    larger: Response | None = None
    opening_load: float = np.nan
    outputs: Mapping[str, Complex] = field(default_factory=dict)
    output_errors: Mapping[str, Array] = field(default_factory=dict)
    anchors: tuple[Anchor, ...] = ()
    checks: tuple[Check, ...] = ()

    @property
    def peak(self) -> int:
        """Index of the largest converged amplitude."""
        return int(np.argmax(np.where(self.flag == CONVERGED, np.abs(self.amplitude), -1.0)))

    @property
    def peak_at_edge(self) -> bool:
        """Whether the largest amplitude lies at an end of the band, where it is no peak."""
        return self.peak in (0, len(self.frequency) - 1)

    @property
    def peak_frequency(self) -> float:
        """Frequency of the peak, Hz: parabola through the largest point and its neighbours."""
        return self._vertex()[0]

    @property
    def peak_amplitude(self) -> float:
        """Modal amplitude at the peak, of the same parabola."""
        return self._vertex()[1]

    @property
    def folded(self) -> Indices:
        """Indices of the frequencies at which two motions are answers, by more than 1 % apart."""
        if self.smaller is None:
            return np.zeros(0, np.int64)
        return np.flatnonzero(self.smaller.flag == CONVERGED)

    @property
    def unconverged(self) -> Array:
        """Frequencies of the points that are not answers, Hz."""
        return self.frequency[self.flag != CONVERGED]

    def _vertex(self) -> tuple[float, float]:
        """Of the parabola through three points, which may be unevenly spaced.

        Beside a jump, where the spacing is far finer to one side, it is the largest point.
        """
        i, size, f = self.peak, np.abs(self.amplitude), self.frequency
        if 0 < i < len(size) - 1 and (self.flag[i - 1 : i + 2] == CONVERGED).all():
            left, right = size[i] - size[i - 1], size[i] - size[i + 1]
            before, after = f[i] - f[i - 1], f[i + 1] - f[i]
            bend = left / before + right / after
            alike = max(before, after) <= MOST_UNEVEN * min(before, after)
            if bend > 0 and alike and max(size[i - 1], size[i + 1]) > 0.5 * size[i]:
                slope = (left * after / before - right * before / after) / (before + after)
                curvature = bend / (before + after)
                shift = slope / (2 * curvature)
                return float(f[i] + shift), float(size[i] + 0.5 * slope * shift)
        return float(f[i]), float(size[i])


def held_to(
    base: Response,
    variant: str,
    now: Held,
    anchors: Mapping[int, Anchor],
    unbounded: Sequence[int] = (),
) -> Response:
    """A response put right by steady states.

    Parameters
    ----------
    base : Response
        Of the refined model.
    variant : str
        What the response is called.
    now : Held
        What the steady states make of it.
    anchors : mapping of int to Anchor
        These, by index of the frequency; there they are the answer whatever their bound.
    unbounded : sequence of int, optional
        Where nothing bounds the error, by index of the frequency; what they make of it still is the answer.
    """
    n = len(base.frequency)
    known = np.asarray(now.error <= NO_DIGIT)
    known[[*anchors]] = True
    bounded = known.copy()
    bounded[[*unbounded]] = False
    sizes = np.where(known, np.abs(now.amplitude), 0.0)
    return replace(
        base,
        variant=variant,
        amplitude=np.where(known, now.amplitude, 0.0),
        iterations=np.zeros(n, np.int64),
        contraction=np.zeros(n),
        flag=np.where(known, CONVERGED, OUTSIDE),
        error_indicator=np.where(bounded, now.error, np.inf),
        varies=None if now.varies is None else np.where(known, now.varies, 0.0),
        outgrown=None,
        smaller=_below(base.smaller, np.where(_nearer_the_larger(base, sizes), sizes, 0.0)),
        anchors=tuple(anchors[k] for k in sorted(anchors)),
    )


def forced_response(
    model: TwoModeModel,
    table: EquivalentTable | None,
    frequency: Array,
    load: float,
    *,
    preload: float | None = None,
    rho: float = np.nan,
    friction: float = np.nan,
    variant: str = "",
    tolerance: float = 1e-10,
    max_iterations: int = 500,
    downward: bool | None = None,
) -> Response:
    """Forced response over frequency; `table` None is the linear frictionless joint, eq. (18).

    Each point starts from its neighbour's answer, so that where a curve folds the direction of the
    sweep chooses the branch.

    Parameters
    ----------
    model : TwoModeModel
    table : EquivalentTable or None
    frequency : (n,) array
        Hz, ascending.
    load : float
        Amplitude of the driving load.
    preload : float, optional
        Size of the preload, N/m; that of the table when left out. Amplitudes scale with it.
    rho, friction, variant
        Labels kept in the result.
    tolerance : float
        Relative change of amplitude at which a point is converged.
    max_iterations : int
        Evaluations of the fixed-point map per frequency.
    downward : bool, optional
        Whether to sweep from the upper end, which on a softening joint follows the branch of the
        larger amplitudes; by default from the end of the band farther from the sliding frequency.
    """
    frequency = np.ascontiguousarray(frequency, dtype=float)
    curve = None if table is None else table_curve(table)
    if preload is None:
        preload = 1.0 if table is None else table.preload
    centre = model.omega / (2 * np.pi)
    backward = downward
    if downward is None:
        backward = abs(frequency[-1] - centre) > abs(frequency[0] - centre)
    order = slice(None, None, -1 if backward else 1)
    n = len(frequency)
    found = Answers(
        amplitude=np.zeros(n, complex),
        iterations=np.zeros(n, np.int64),
        contraction=np.zeros(n),
        flag=np.zeros(n, np.int64),
    )
    sweep(
        2 * np.pi * np.ascontiguousarray(frequency[order]),
        fixed_point(model, curve, preload, load),
        model.sliding,
        tolerance,
        max_iterations,
        found,
    )
    return Response(
        variant=variant,
        drive="" if table is None else table.drive,
        rho=rho,
        load=load,
        friction=friction,
        frequency=frequency,
        amplitude=found.amplitude[order],
        iterations=found.iterations[order],
        contraction=found.contraction[order],
        flag=found.flag[order],
    )


def swept_both_ways(respond: Callable[[bool], Response]) -> Response:
    """Response on the branch of the larger amplitudes, with the smaller ones where a fold has both.

    A softening joint shows the larger swept downward; from rest or swept upward it may show the smaller.
    Where the larger leave the table the smaller are given, as `outgrown`.

    Parameters
    ----------
    respond : callable
        The response swept downward (True) or upward (False) over the same frequencies.
    """
    down, up = respond(True), respond(False)
    both = (down.flag == CONVERGED) & (up.flag == CONVERGED)
    outgrown = (down.flag == OUTSIDE) & (up.flag == CONVERGED)
    taken = outgrown | (both & (np.abs(up.amplitude) > (1 + APART) * np.abs(down.amplitude)))
    found, other = _of(taken, up, down), _of(taken, down, up)
    return replace(
        found,
        outgrown=outgrown if outgrown.any() else None,
        smaller=_below(other, np.where(both, np.abs(found.amplitude), 0.0)),
    )


def _of(first: Mask, one: Response, two: Response) -> Response:
    """One response at some of the frequencies, another at the rest."""
    parts = ("amplitude", "iterations", "contraction", "flag")
    return replace(two, **{n: np.where(first, getattr(one, n), getattr(two, n)) for n in parts})


def _nearer_the_larger(base: Response, sizes: Array) -> Mask:
    """Where amplitudes are, by ratio, nearer the larger motion of a fold than the smaller."""
    if base.smaller is None:
        return np.zeros(len(sizes), dtype=bool)
    return sizes**2 > np.abs(base.amplitude) * np.abs(base.smaller.amplitude)


def _below(other: Response | None, sizes: Array) -> Response | None:
    """Where another response is clearly smaller than amplitudes; None where it nowhere is."""
    if other is None:
        return None
    return _answers_within(other, np.abs(other.amplitude) * (1 + APART) < sizes)


def _answers_within(other: Response, within: Mask) -> Response | None:
    """Another response without its answers elsewhere; None where it has none within."""
    kept = within & (other.flag == CONVERGED)
    return replace(other, flag=np.where(kept, CONVERGED, OUTSIDE)) if kept.any() else None


def larger_within(other: Response, amplitude: Complex, within: Mask) -> Response | None:
    """Where another response is clearly larger than amplitudes, within some frequencies; None where nowhere.

    Parameters
    ----------
    other : Response
    amplitude : (n,) complex array
    within : (n,) bool array
    """
    larger = np.abs(other.amplitude) > np.abs(amplitude) * (1 + APART)
    return _answers_within(other, within & larger)


def all_amplitudes(
    model: TwoModeModel, table: EquivalentTable, frequency: float, load: float, points: int = 400
) -> Array:
    """Every amplitude with ``g(a) = a`` inside the table at one frequency (folds have three)."""
    curve = table_curve(table)
    out, y = np.zeros(curve.coefficients.shape[2]), np.zeros(2, complex)
    system = fixed_point(model, curve, table.preload, load)

    def gap(a: float) -> float:
        return float(next_amplitude(a, 2 * np.pi * frequency, system, out, y) - a)

    grid = table.preload * np.exp(np.linspace(curve.knots[0] - 5, curve.knots[-1], points))
    values = np.array([gap(a) for a in grid])
    roots = []
    for i in np.flatnonzero(values[:-1] * values[1:] <= 0):
        roots.append(brentq(gap, grid[i], grid[i + 1], xtol=1e-14 * grid[i]))
    return np.array(roots)


def answers(model: TwoModeModel, table: EquivalentTable, frequency: float, load: float) -> Complex:
    """First harmonic of the sliding coordinate of every solution inside the table, ascending."""
    curve = table_curve(table)
    out, y = np.zeros(curve.coefficients.shape[2]), np.zeros(2, complex)
    system = fixed_point(model, curve, table.preload, load)
    found = []
    for a in all_amplitudes(model, table, frequency, load):
        next_amplitude(a, 2 * np.pi * frequency, system, out, y)
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
