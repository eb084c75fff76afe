"""Everything a user wants to know of one periodic response."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from microslip.analyses.harmonic.operator import LinearOperator
from microslip.analyses.harmonic.paths import EquationsAt
from microslip.analyses.harmonic.problem import HarmonicProblem, pull
from microslip.brief import Brief
from microslip.contact.pairs import mean_slip, normal, tangential_vectors
from microslip.numerics.fourier import to_complex
from microslip.typing import Array, Complex, Status

WALKS = 1e-4
"""Drift of the slip per cycle, over its range, from which on bodies count as walking past each other."""

PULL = 1e-4
"""`HarmonicPoint.pull` beyond which a joint is let go to walk."""


@dataclass(frozen=True, repr=False)
class HarmonicPoint(Brief):
    """A periodic response.

    Attributes
    ----------
    frequency, load : float
        Hz, and amplitude of the driven port.
    problem : HarmonicProblem
        The equations that it solves.
    w : (n,) array
        Their unknowns.
    output : (H + 1, p) complex array
        Harmonics of the outputs of all ports, change from prestress; the mean first.
    amplitude : complex
        First harmonic of the modal coordinate (`HarmonicProblem.coordinate`), against the load's
        sine.
    r, v : (d m, 2 H + 1) arrays
        Coefficients of reactions (N/m) and relative displacements (m), order of
        `microslip.contact.aft`.
    status : (m, N) int8 array
        Contact states over the cycle.
    friction_work : (m,) array
        Energy dissipated per cycle at each pair, J per metre of width.
    normal_work : float
        Work of the normal reactions per cycle: an error of truncation, tends to zero with H.
    external_work, material_work : float
        Work per cycle of the load, and of the material damping.
    strain, kinetic : float
        Mean energies of the vibration over a cycle (the static mean left out).
    walk : float
        Drift of the bodies past each other, m per cycle (mean over the pairs, in space its size).
    pull : float
        Mean force of the supports against sliding over the friction available; where it is large the
        supports have stopped a walk.
    residual : float
        Largest entry of the equations over the largest prestress reaction.
    tail : float
        Share of the last two harmonics in the vibrating reactions (root of sums of squares).
    error : float
        Estimated relative error of the amplitude (`levels.estimated_error`); nan with a number of
        harmonics that was given.
    iterations : int
        Newton steps.
    seconds : float
    modal : bool
        Whether contact was solved behind the flexibility that the harmonics left out have (`modal.py`).
    """

    frequency: float
    load: float
    problem: HarmonicProblem
    w: Array
    output: Complex
    amplitude: complex
    r: Array
    v: Array
    status: Status
    friction_work: Array
    normal_work: float
    external_work: float
    material_work: float
    strain: float
    kinetic: float
    walk: float
    pull: float
    residual: float
    tail: float
    error: float
    iterations: int
    seconds: float
    modal: bool = False

    @property
    def harmonics(self) -> int:
        """Number of harmonics beside the mean."""
        return self.problem.harmonics

    @property
    def phase(self) -> float:
        """Phase of the modal coordinate against the load, rad."""
        return float(np.angle(self.amplitude))

    @property
    def walked(self) -> float:
        """How far the bodies stand from where the clamp has put them, mean of the pairs, m."""
        problem = self.problem
        moved = self.v[:, 0] - problem.prestress.solution.v
        return float(np.linalg.norm(mean_slip(moved, problem.dimension)))

    @property
    def slip(self) -> float:
        """Range of the slip over a cycle, of its first harmonic, where that is largest, m."""
        slip = tangential_vectors(np.abs(to_complex(self.v)[1]), self.problem.dimension)
        return 2 * float(np.linalg.norm(slip, axis=-1).max())

    @property
    def walks(self) -> bool:
        """Whether the bodies move on past each other by more than `WALKS` of the slip in each cycle."""
        return abs(self.walk) > WALKS * self.slip

    @property
    def dissipated(self) -> float:
        """Friction work per cycle, J per metre of width."""
        return float(self.friction_work.sum())


TURN = 0.1
"""Weight of a phase, rad, in the distance of two amplitudes."""


def distance(one: complex, other: complex) -> float:
    """Relative difference of two complex amplitudes: of their sizes; a tenth of the whole where that is more.

    Examples
    --------
    >>> round(distance(1.001, 1.0), 6), round(distance(1j, 1.0), 3)
    (0.001, 0.141)
    """
    ratio = one / other
    return max(abs(abs(ratio) - 1), TURN * abs(ratio - 1))


def describe(equations: EquationsAt, iterations: int, seconds: float) -> HarmonicPoint:
    """Everything a user wants to know of a solution of the equations of all pairs."""
    point = equations.point
    described = described_by(
        equations.operator,
        (equations.frequency, equations.load),
        (point.w, point.v, point.cycle.status),
        float(np.abs(equations.F).max()),
    )
    return replace(described, iterations=iterations, seconds=seconds)


def described_by(
    operator: LinearOperator,
    at: tuple[float, float],
    solution: tuple[Array, Array, Status],
    residual: float,
) -> HarmonicPoint:
    """The same of unknowns w, displacements v and contact states, at a frequency under a load."""
    problem, (frequency, load), (w, moved, states) = operator.problem, at, solution
    model = problem.model
    u, q = problem.split(w)
    r, v = problem.unfold(u), problem.unfold(moved)
    output = operator.outputs(u, q, load)
    clamped, _ = problem.split(problem.rest())
    output[0] -= operator.outputs(clamped, problem.rigid_modes @ problem.rest_place, 0.0)[0]
    h = np.arange(1, problem.harmonics + 1)[:, None]
    R, V = to_complex(r)[1:], to_complex(v)[1:]
    eta = operator.modes(u, q, load)[1:]
    twice_static = _residual_energy(operator, R, load) * np.abs(operator.lag[1:]) ** 2
    damping = h[:, 0] * operator.omega * model.rayleigh[1]
    modal = h**2 * operator.omega * model.modal_damping() * np.abs(eta) ** 2
    if model.damping is not None:
        modal = modal + h**2 * operator.omega * (eta.conj() * (eta @ model.damping)).real
    status = states
    if problem.half_turn:
        half = np.roll(status, problem.table.samples // 2, axis=1)
        status = np.empty((model.pairs, problem.table.samples), dtype=half.dtype)
        status[problem.image] = half
        status[problem.pairs] = states
    work = np.pi * np.sum(h * (R * V.conj()).imag, axis=0)
    size = np.sum(np.abs(R) ** 2, axis=1)
    return HarmonicPoint(
        frequency=frequency,
        load=load,
        problem=problem,
        w=w,
        output=output,
        amplitude=complex(output[1, model.port(problem.coordinate)]),
        r=r,
        v=v,
        status=status,
        friction_work=tangential_vectors(work, model.dimension).sum(axis=1),
        normal_work=float(normal(work, model.dimension).sum()),
        external_work=float(np.pi * load * -output[1, model.port(problem.port)].imag),
        material_work=float(np.pi * (modal.sum() + (h[:, 0] * damping * twice_static).sum())),
        strain=float(0.25 * (np.sum(model.omega**2 * np.abs(eta) ** 2) + twice_static.sum())),
        kinetic=float(0.25 * np.sum((h * operator.omega * np.abs(eta)) ** 2)),
        walk=problem.mean_drift(w[u.size :]),
        pull=pull(problem, w),
        residual=residual,
        tail=float(np.sqrt(size[-2:].sum() / max(size.sum(), 1e-300))),
        error=float("nan"),
        iterations=0,
        seconds=0.0,
    )


def _residual_energy(operator: LinearOperator, R: Complex, load: float) -> Array:
    """Twice the static energy of the truncated modes per harmonic, were they not to lag."""
    problem, model = operator.problem, operator.problem.model
    p = model.port(problem.port)
    pairs = model.residual + np.diag(problem.compliance)
    energy = np.sum(R.conj() * (R @ pairs), axis=1).real
    energy[0] += load**2 * model.port_port[p, p] - 2 * load * (R[0] @ model.port_v[:, p]).real
    return energy
