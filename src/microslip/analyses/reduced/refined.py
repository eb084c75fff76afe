"""The refined reduced model: one coordinate, everything nonlinear tabulated against its amplitude.

Projected on the sliding mode the equation of motion is exact,

    (omega_sl² - omega² + i omega c) Q + F = Phi^T p M,

whatever touches, slips or separates; only the modal contact force F has to be modelled. The paper
takes it from cycles driven by the end moment. Here, in order of what each is worth:

* F comes from cycles with q prescribed (`microslip.analyses.statics.prescribed`): near resonance
  inertia, not the moment, bends the joint, and q is nearly a pure sine because the inertia of the
  mode resists harmonics.
* The moment bends the overlap directly as well, and what the interface sees of that is the mode's
  own pattern: it offsets the amplitude, ``A = Q + c M``, ``F = omega_sl² kappa(|A|) A``.
* The other modes have their inertia at a reference frequency between the sliding and the stuck one.
* What is elastic in F has the material's loss, ``k_eq (1 + i omega beta)``.
* Damping that couples the modes is that of the shape which the joint has at the amplitude,
  ``eta^H D eta / eta^H eta`` of the cycle's first harmonic: ``i omega d Q`` of the sliding mode, and what it
  differs from that at the amplitude, ``i omega (d(|A|) - d) A``.
* An upper mode near a multiple of the first is in superharmonic resonance with the corners of the
  contact force. Its harmonic ``eta`` obeys ``eta = eta_0 + S P`` under a load P on its port, and
  the rest of its inertia is such a load, ``P = D eta``, ``D = h² omega² - omega_0² - i h omega c``;
  so ``P = D eta_0/(1 - D S)``, and F changes by ``T P`` (real-linear in P). The table holds eta_0,
  S and T of each chosen (mode, harmonic).

Everything scales with the preload: amplitude over preload is the only argument of the table.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from scipy.interpolate import Akima1DInterpolator, PchipInterpolator

from microslip.analyses.reduced.table import EquivalentTable, UpperHarmonics
from microslip.analyses.statics.cycle_tangent import upper_answers
from microslip.analyses.statics.held import HeldMode
from microslip.analyses.statics.prescribed import (
    PrescribedCycle,
    cycle_at,
    in_equilibrium,
    prescribed_cycle,
)
from microslip.errors import ContactError, Failure, MicroslipError
from microslip.model.shape_damping import damping_of_shape
from microslip.numerics.execute import Executor, each, threads
from microslip.typing import Array, Complex

HIGHEST = 13
"""Highest harmonic of the first mode that may excite an upper one."""

NOTICED = 0.13
"""An upper harmonic is kept where the load of its inertia exceeds this share of F in the band; it
changes F by a hundredth of that."""

SPARSE = 4
"""Every so-manieth amplitude of the first ones is begun from rest."""

DAMPED = 0.5
"""Upper modes are tested where gamma_eq is above this share of its greatest; constant outside."""


def refined_table(
    held: HeldMode,
    smallest: float,
    largest: float,
    count: int = 48,
    *,
    steps: int = 200,
    cycles: int = 4,
    closure: float = 1e-3,
    band: tuple[float, float] | None = None,
    knots: int = 6,
    executor: Executor | None = None,
    advance: Callable[[], None] = lambda: None,
) -> tuple[EquivalentTable, list[Failure]]:
    """Tabulate the modal contact force against the amplitude of the sliding mode.

    Parameters
    ----------
    held : HeldMode
        Its upper modes are candidates for superharmonic resonance.
    smallest, largest : float
        Amplitudes of the sliding coordinate between which to tabulate.
    count : int
        Amplitudes in the table. Half of them are in geometric progression, the others go where
        interpolation from the neighbours misses most.
    steps, cycles : int
        Load steps per cycle, and cycles at most.
    closure : float
        Change of the reactions between cycles that ends them, as `prescribed_cycle` has it.
    band : tuple of float, optional
        Circular frequencies in which upper harmonics matter; by default 0.93 to 1.1 times the
        reference frequency.
    knots : int
        Amplitudes at which upper modes are tested, with half the steps; interpolated in between.
    executor : Executor, optional
        Where cycles are computed; threads by default.
    advance : callable
        Called after every cycle.

    Returns
    -------
    table : EquivalentTable
        ``drive`` is ``"prescribed"``; ``load`` repeats the amplitude.
    failures : list of Failure
        Amplitudes that could not be solved; they are left out.
    """
    if not 0 < smallest < largest or count < 4:
        raise MicroslipError(
            f"a table from {smallest:g} to {largest:g} with {count} amplitudes: the first must be "
            "positive and below the second, and at least 4 are needed"
        )
    where = executor or threads()
    failures: list[Failure] = []

    def one(a: float) -> PrescribedCycle | Failure:
        below = [c for c in solved if abs(c.q) < a and in_equilibrium(held, c)]
        try:
            return cycle_at(
                held,
                a,
                steps=steps,
                cycles=cycles,
                closure=closure,
                harmonics=HIGHEST,
                start=below[-1].state if below else None,
            )
        except ContactError as error:
            return Failure("reduced", f"prescribed cycle at amplitude {a:.4g}", str(error))

    solved: list[PrescribedCycle] = []
    first = np.geomspace(smallest, largest, count - count // 2)
    # a few from rest, the others from the next below
    coarse = np.unique(np.append(np.arange(0, len(first), SPARSE), len(first) - 1))
    wanted, waiting = list(first[coarse]), list(np.delete(first, coarse))
    while wanted:
        found = []
        for outcome in each(one, wanted, where):
            if isinstance(outcome, Failure):
                failures.append(outcome)
            else:
                found.append(outcome)
            advance()
        solved += found
        solved.sort(key=lambda c: abs(c.q))
        missing = min(count - len(solved) - len(failures), -(-count // 4))
        wanted, waiting = waiting, []
        if not wanted and len(solved) > 4:
            wanted = _between(solved, missing)
    if len(solved) < 2:
        raise ContactError(
            "fewer than two prescribed cycles solved: " + "; ".join(map(str, failures))
        )
    Q, F = np.array([c.q for c in solved]), np.array([c.force for c in solved])
    w2 = held.sliding_omega**2
    kappa = F / Q / w2
    size = np.abs(Q)
    table = EquivalentTable(
        drive="prescribed",
        preload=held.prestress.force,
        omega=held.sliding_omega,
        load=size,
        amplitude=size,
        k_eq=kappa.real,
        gamma_eq=kappa.imag,
        cross=np.zeros(len(Q), complex),
        dissipated=np.array([c.dissipated for c in solved]),
        stored=0.5 * size**2 * kappa.real * w2,
        uncertainty=missed(np.log(size), kappa),
        upper=_upper_harmonics(held, solved, band, knots, max(steps // 2, 4 * HIGHEST), where),
        motion=np.array([c.output / c.q for c in solved]),
        damping=_beyond_sliding(held, solved),
    )
    return table, failures


def _beyond_sliding(held: HeldMode, solved: Sequence[PrescribedCycle]) -> Array | None:
    """`EquivalentTable.damping`."""
    model = held.model
    if model.damping is None:
        return None
    own = damping_of_shape(model, model.port_modes[:, model.port(held.port)])
    return np.array([c.damping for c in solved]) - own


def missed(x: Array, y: Complex) -> Array:
    """By how much interpolation from the other points misses each point, halved spacing allowed for.

    Interpolation over twice the spacing errs about eight times as much.
    """
    error = np.zeros(len(x))
    for i in range(1, len(x) - 1):
        others = np.arange(len(x)) != i
        real = Akima1DInterpolator(x[others], y[others].real)(x[i])
        imag = Akima1DInterpolator(x[others], y[others].imag)(x[i])
        error[i] = abs(real + 1j * imag - y[i]) / 8
    error[[0, -1]] = error[[1, -2]]
    return error


def _between(solved: Sequence[PrescribedCycle], count: int) -> list[float]:
    """Amplitudes half way between those whose neighbours predict them worst."""
    if count <= 0:
        return []
    size = np.array([abs(c.q) for c in solved])
    x = np.log(size)
    error = missed(x, np.array([c.force / c.q for c in solved]))
    score = np.maximum(error[:-1], error[1:]) * (np.diff(x) > 1e-3)
    chosen = np.argsort(-score)[:count]
    return [float(np.sqrt(size[i] * size[i + 1])) for i in chosen]


FELT = 0.1
"""Of what other modes feel of a load, at least, that which its size is chosen by."""


def load_offset(held: HeldMode, amplitude: float) -> float:
    """``c``: amplitude of the mode that bends the interface as a unit load does directly.

    From two cycles at an amplitude small enough to stick, without and with a load.
    """
    alone = prescribed_cycle(held, amplitude, steps=40, cycles=2)
    model, own = held.model, held.load_on_sliding
    give = np.minimum(held.sliding_omega / np.maximum(model.omega, held.sliding_omega), 1.0) ** 2
    others = np.abs(model.port_modes[:, model.port(held.drive)]) * give
    # a load that the mode hardly feels must not make the joint slip through the other modes
    felt = max(abs(own), FELT * float(others.max(initial=0.0)))
    load = float(np.copysign(0.5 * amplitude * held.sliding_omega**2 / felt, own))
    both = prescribed_cycle(held, amplitude, steps=40, cycles=2, load=load)
    coefficient = alone.force / alone.q
    return float(((both.force - coefficient * both.q) / (coefficient * load)).real)


def _upper_harmonics(
    held: HeldMode,
    solved: Sequence[PrescribedCycle],
    band: tuple[float, float] | None,
    knots: int,
    steps: int,
    executor: Executor,
) -> UpperHarmonics | None:
    gamma = np.array([(c.force / c.q).imag for c in solved])
    w0 = held.reference_omega
    omegas = np.linspace(*(band or (0.93 * w0, 1.1 * w0)), 60)
    kept = _resonant(held, solved[int(np.argmax(gamma))], omegas)
    if not kept:
        return None
    stiff = np.array([in_equilibrium(held, c) for c in solved])
    damped = np.flatnonzero((gamma > DAMPED * gamma.max()) & stiff)
    if not len(damped):
        return None
    chosen = damped[np.unique(np.linspace(0, len(damped) - 1, min(knots, len(damped))).astype(int))]
    rows = list(each(lambda i: upper_answers(held, solved[i], kept, steps=steps), chosen, executor))
    x = np.log([abs(c.q) for c in solved])
    at = x[chosen]

    def spread(values: list[Complex]) -> Complex:
        """From the tested amplitudes to all; constant outside."""
        v = np.array(values)
        if len(at) == 1:
            return np.tile(v, (len(x), 1))
        inside = np.clip(x, at[0], at[-1])
        return PchipInterpolator(at, v.real)(inside) + 1j * PchipInterpolator(at, v.imag)(inside)

    return UpperHarmonics(
        order=np.array([h for _, h in kept]),
        omega=held.upper_omega[[n for n, _ in kept]],
        reference_omega=w0,
        motion=np.array([[c.upper[n, h - 1] / abs(c.q) for n, h in kept] for c in solved]),
        compliance=spread([0.5 * (row.motion[:, 0] - 1j * row.motion[:, 1]) for row in rows]),
        in_phase=spread([row.force[:, 0] for row in rows]),
        quadrature=spread([row.force[:, 1] for row in rows]),
        damping=held.upper_damping[[n for n, _ in kept]],
    )


def _resonant(held: HeldMode, cycle: PrescribedCycle, omegas: Array) -> list[tuple[int, int]]:
    """The (mode, harmonic) whose inertia loads the mode noticeably somewhere in a band.

    ``P = D eta_0/(1 - D S)`` with the compliance S of the sliding state.
    """
    w0 = held.reference_omega
    alpha, beta = held.model.rayleigh
    found = []
    for mode, (own, beyond) in enumerate(zip(held.upper_omega, held.upper_damping, strict=True)):
        for order in range(2, HIGHEST + 1):
            loss = 1j * order * omegas * (alpha + beta * own**2 + beyond)
            D = order**2 * omegas**2 - w0**2 - loss
            load = D * cycle.upper[mode, order - 1] / (1 - D / (own**2 - w0**2))
            if np.abs(load).max() > NOTICED * abs(cycle.force):
                found.append((mode, order))
    return found
