"""Multi-harmonic balance of the joint model with exact contact, condensed to the contact pairs.

With ``y(t) = Y_0 + sum_h Im(Y_h e^{i h omega t})`` the joint model is one linear relation per harmonic,

    v_h = v_free,h - W_h r_h
    W_h = W_res / (1 + i h omega tau) + Psi diag(1 / (omega_n² - h² omega² + i h omega c_n)) Psi^T

(tau: the residual flexibility follows behind its share of the stiffness damping, as in
`contact/timestep.py`), and the contact laws in time close it. In the mean the nearly rigid modes would
swamp W with their flexibility; their mean amplitudes q are unknowns of equilibrium, as in statics:

    v_0 = v_free,0 + R q - W_0 r_0,      K_q q + R^T r_0 = f_q

A joint that slips everywhere may *walk*: both halves of a cycle push the bodies past each other the same
way, against weak supports alone, which would stop the walk only after an offset without meaning. Then the
change of v_t per cycle is the unknown in place of the mean amplitude of that sliding motion, which stays
at its prestress value (`walking`).

Unknowns are the coefficients of all reactions and q, and the equations of the reactions are

    F(r) = r - C(r + eps v(r)) = 0

with ``C`` the compiled contact cycle of `contact/aft.py` (dynamic Lagrangian; Nacivet, Pierre, Thouverez
& Jezequel, J. Sound Vib. 265 (2003) 201). ``1/eps`` is the flexibility that harmonics beyond the last
one see; it vanishes from the answer as harmonics grow. An elastic contact is a compliance on the
diagonal of ``W_res``.

`HarmonicProblem` states the equations; `microslip.analyses.harmonic.linear` solves them at one frequency;
`microslip.response` walks over frequencies and loads.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from microslip.analyses.statics.cycle import Prestress
from microslip.contact.aft import ContactCycle, contact_cycle, times_derivative
from microslip.contact.samples import SampleTable, sample_table
from microslip.errors import MicroslipError
from microslip.model.flexibility import harmonic_compliance
from microslip.model.joint import JointModel
from microslip.typing import Array, Complex

SAMPLES_PER_HARMONIC = 24
LEAST_SAMPLES = 128

WALK = 1e-3
"""First guess of a walk: augmented force per cycle, N per metre of width."""


@dataclass(frozen=True)
class HarmonicProblem:
    """Equations of harmonic balance for one joint and one driven port.

    A joint that is its own image under a half turn (`half_turn`), driven by a load that the half turn
    reverses, moves so that what happens at ``x`` happens at ``-x`` half a period later. Even harmonics
    are then symmetric in x and odd ones antisymmetric, and half of the pairs suffice. Arrays with a
    leading axis of length 2 belong to even and odd harmonics; without the symmetry both are the same.

    Attributes
    ----------
    model : JointModel
    prestress : Prestress
        Its clamp force is held; its frictionless displacements are where stuck pairs stay.
    port : str
        Driven port, ``load sin(omega t)``.
    table : SampleTable
        Harmonics and samples.
    half_turn : bool
        Whether the symmetry is used.
    pairs : (p,) int array
        The pairs solved for: all, or those from the middle on.
    friction : (p,) array
    compliance : (2 m,) array
        Of an elastic contact, m/N; zero where it is exact.
    residual : (2, 2 p, 2 p) array
        Residual flexibility, with the compliance of an elastic contact on its diagonal.
    spread, gather : (2, 2 p, k) arrays
        Relative displacement of the modes; reactions of the pairs and their images to modal forces.
    stiffness : (2 p,) array
        Augmentation eps of each component, N/m per metre of width.
    held : (p,) array
        Tangential displacement at which a pair sticks that never slips, m.
    rigid_modes : (e, f) array
        Mean amplitudes of the e nearly rigid modes per unknown (of one newton): all of them, or the
        combinations that the half turn leaves as they are.
    slides : bool
        Whether the last of them slides the bodies past each other.
    walks : bool
        Whether the last unknown is the change of that motion per cycle, and not its mean.
    """

    model: JointModel
    prestress: Prestress
    port: str
    table: SampleTable
    half_turn: bool
    pairs: NDArray[np.int64]
    friction: Array
    compliance: Array
    residual: Array
    spread: Array
    gather: Array
    stiffness: Array
    held: Array
    rigid_modes: Array
    slides: bool
    walks: bool = False

    @property
    def harmonics(self) -> int:
        """Number of harmonics H beside the mean."""
        return self.table.harmonics

    @property
    def shape(self) -> tuple[int, int]:
        """Of the reactions solved for: components by real coefficients, (2 p, 2 H + 1)."""
        return 2 * len(self.pairs), self.table.coefficients

    @cached_property
    def rows(self) -> NDArray[np.int64]:
        """Components of v and r that belong to `pairs`."""
        return _components(self.pairs)

    @cached_property
    def force_scale(self) -> float:
        """Largest reaction of the prestress, N per metre of width: the unit of residuals."""
        return self.prestress.largest_reaction

    @cached_property
    def spring(self) -> float:
        """Mean augmentation, N/m: turns imbalance per unknown into a force."""
        return float(self.stiffness.mean())

    @cached_property
    def once(self) -> Array:
        """Weight of each component in the sums over all pairs, relative to the others."""
        weight = np.ones(len(self.rows))
        if self.half_turn:
            weight[:2] = 0.5
        return weight

    @cached_property
    def rigid_spread(self) -> Array:
        """Relative displacement per unknown of the nearly rigid modes, (2 p, f)."""
        return self.spread[0][:, : len(self.rigid_modes)] @ self.rigid_modes

    @cached_property
    def rigid_gather(self) -> Array:
        """Mean reactions to forces on the nearly rigid modes, (2 p, f)."""
        return self.gather[0][:, : len(self.rigid_modes)] @ self.rigid_modes

    @cached_property
    def rigid_stiffness(self) -> Array:
        """Stiffness of the supports against the unknowns of the nearly rigid modes, (f, f)."""
        own = self.model.omega[: len(self.rigid_modes)] ** 2
        return (self.rigid_modes.T * own) @ self.rigid_modes

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.shape[0] * self.shape[1] + self.rigid_modes.shape[1]

    def split(self, w: Array) -> tuple[Array, Array]:
        """Coefficients of the reactions (2 p, c), a view, and q, from the unknowns."""
        cut = self.shape[0] * self.shape[1]
        return w[:cut].reshape(self.shape), self.rigid_modes @ self.place(w[cut:])

    @cached_property
    def rest_place(self) -> Array:
        """Mean amplitudes of the nearly rigid modes at prestress, in unknowns."""
        return np.asarray(np.linalg.lstsq(self.rigid_modes, self.prestress.solution.q)[0])

    def place(self, p: Array) -> Array:
        """Mean amplitudes of the nearly rigid modes from the last unknowns."""
        if not self.walks:
            return p
        return np.append(p[:-1], self.rest_place[-1])

    def drift(self, p: Array) -> Array:
        """Change of every v_t per cycle, m, from the last unknowns; zero unless the joint walks."""
        if not self.walks:
            return np.zeros(len(self.pairs))
        return self.rigid_spread[1::2, -1] * p[-1]

    def unfold(self, u: Array) -> Array:
        """Coefficients of all pairs, (2 m, c), from those solved for."""
        if not self.half_turn:
            return u
        out = np.empty((2 * self.model.pairs, u.shape[1]))
        out[_components(self.model.pairs - 1 - self.pairs)] = u * parity(u.shape[1])
        out[self.rows] = u
        return out

    def rest(self) -> Array:
        """Unknowns at prestress."""
        u = np.zeros(self.shape)
        u[:, 0] = self.prestress.solution.r[self.rows]
        p = self.rest_place.copy()
        if self.walks:
            p[-1] = 0.0
        return np.concatenate([u.ravel(), p])


def parity(coefficients: int) -> Array:
    """+1 for coefficients of even harmonics, -1 for odd ones."""
    h = (np.arange(coefficients) + 1) // 2
    return np.where(h % 2 == 0, 1.0, -1.0)


def _components(pairs: NDArray[np.int64]) -> NDArray[np.int64]:
    return (2 * pairs[:, None] + np.arange(2)).ravel()


def harmonic_problem(
    model: JointModel,
    prestress: Prestress,
    friction: float | Array,
    *,
    harmonics: int = 5,
    samples: int | None = None,
    port: str = "moment",
    compliance: Array | None = None,
    stiffness: float | Array | None = None,
    half_turn: bool | None = None,
) -> HarmonicProblem:
    """State the equations.

    Parameters
    ----------
    model : JointModel
        With ports ``clamp`` and `port`; each of its modes with some stiffness.
    prestress : Prestress
    friction : float or (m,) array
    harmonics : int
        H >= 1, beside the mean; even ones are included.
    samples : int, optional
        Samples per cycle; at least 128 and 24 per harmonic by default.
    port : str
        Driven port.
    compliance : (2 m,) array, optional
        Contact compliance, m/N (elastic contact).
    stiffness : float or (2 m,) array, optional
        Augmentation, by default the inverse of the diagonal of the residual flexibility.
    half_turn : bool, optional
        Use the half-turn symmetry; by default where the joint has it.

    Raises
    ------
    MicroslipError
        Where a mode has no stiffness (its mean position would be undetermined), the residual
        flexibility of some component is zero and no `stiffness` is given, or the symmetry is
        asked for and not there.
    ContactError
        Where the samples do not resolve the harmonics.
    """
    model.port(port)
    m = model.pairs
    table = sample_table(harmonics, samples if samples is not None else _samples(harmonics))
    mu = np.broadcast_to(np.asarray(friction, dtype=float), (m,)).copy()
    if not (np.isfinite(mu).all() and (mu >= 0).all()):
        raise MicroslipError("coefficient of friction must be finite and not negative")
    if not model.omega.min() > 1e-9 * model.omega.max():
        free = int(np.argmin(model.omega))
        raise MicroslipError(
            f"mode {free} has no stiffness ({model.omega[free] / (2 * np.pi):.3g} Hz): harmonic "
            "balance cannot find its mean position; support the joint with a weak spring"
        )
    own_compliance = np.zeros(2 * m) if compliance is None else np.asarray(compliance, dtype=float)
    residual = model.residual + np.diag(own_compliance)
    if stiffness is None:
        own = np.diag(residual)
        if not own.min() > 0:
            raise MicroslipError(
                f"component {int(np.argmin(own))} of the contact pairs has no residual flexibility "
                "of its own: give the augmentation `stiffness`, or keep fewer modes dynamic"
            )
        stiffness = 1 / own
    eps = np.broadcast_to(np.asarray(stiffness, dtype=float), (2 * m,)).copy()
    turns = has_half_turn(model, residual, mu, prestress, port)
    if half_turn and not turns:
        raise MicroslipError("the joint is not its own image under a half turn")
    folded = turns if half_turn is None else half_turn
    pairs = np.arange(m // 2, m) if folded else np.arange(m)
    rows = _components(pairs)
    kept = residual[np.ix_(rows, rows)]
    psi = model.mode_v[rows]
    blocks, spread, gather = [kept, kept], [psi, psi], [psi, psi]
    if folded:
        image = _components(m - 1 - pairs)
        turned, psi_turned = residual[np.ix_(rows, image)], model.mode_v[image]
        blocks, gather = [kept + turned, kept - turned], [psi + psi_turned, psi - psi_turned]
        spread = [psi, psi.copy()]
        # The middle pair is its own image: counted once, and its odd harmonics vanish.
        blocks[0][:, :2] /= 2
        gather[0][:2] /= 2
        for array in (spread[1], gather[1], blocks[1], blocks[1].T):
            array[:2] = 0.0
        blocks[1][:2, :2] = np.diag(1 / eps[rows[:2]])
    combinations, slides = _rigid_combinations(gather[0][:, : model.equilibrium_modes], folded)
    moved = np.abs(eps[rows][:, None] * (gather[0][:, : len(combinations)] @ combinations))
    return HarmonicProblem(
        model=model,
        prestress=prestress,
        port=port,
        table=table,
        half_turn=folded,
        pairs=pairs,
        friction=mu[pairs],
        compliance=own_compliance,
        residual=np.stack(blocks),
        spread=np.stack(spread),
        gather=np.stack(gather),
        stiffness=eps[rows],
        held=prestress.solution.v[1::2][pairs],
        rigid_modes=combinations / moved.max(axis=0, initial=1e-300),
        slides=slides,
    )


def _rigid_combinations(rigid: Array, folded: bool) -> tuple[Array, bool]:
    """Combinations of the nearly rigid modes, the one that only slides last; whether there is one.

    Where the half turn is used, those it reverses do not move and are left out.
    """
    count = rigid.shape[1]
    if count == 0:
        return np.zeros((0, 0)), False
    basis = np.eye(count)
    if folded:
        _, size, directions = np.linalg.svd(rigid, full_matrices=False)
        basis = directions[size > 1e-6 * size.max(initial=1e-300)].T
    # sideways motion of the pairs in the space of combinations that do not open or close them
    _, size, directions = np.linalg.svd(rigid[0::2] @ basis)
    closing = int(np.sum(size > 1e-3 * np.abs(rigid[1::2] @ basis).max() * np.sqrt(len(rigid))))
    still = directions[closing:].T
    if still.shape[1] == 0:
        return basis, False
    _, size, sideways = np.linalg.svd(rigid[1::2] @ basis @ still)
    order = np.hstack([directions[:closing].T, still @ sideways[::-1].T])
    return basis @ order, bool(size[0] > 0)


def walking(problem: HarmonicProblem, w: Array) -> tuple[HarmonicProblem, Array]:
    """The same equations free to walk, and a guess: the walk that the supports have stopped."""
    p = w[-problem.rigid_modes.shape[1] :]
    guess = w.copy()
    guess[-1] = np.sign(p[-1] - problem.rest_place[-1]) * WALK
    return replace(problem, walks=True), guess


def pull(problem: HarmonicProblem, w: Array) -> float:
    """Mean force of the supports against sliding over the largest friction: zero at prestress.

    Zero also without friction: nothing then drives a walk, and the supports alone say where to be.
    """
    if not problem.slides or problem.walks or not problem.friction.any():
        return 0.0
    u, _ = problem.split(w)
    p = w[u.size :] - problem.rest_place
    shear = problem.rigid_stiffness[-1] @ p / np.abs(problem.rigid_gather[1::2, -1]).max()
    friction = problem.friction @ (problem.once[0::2] * u[0::2, 0])
    return float(abs(shear) / max(friction, 1e-300))


def has_half_turn(
    model: JointModel, residual: Array, friction: Array, prestress: Prestress, port: str
) -> bool:
    """Whether the pairs, read backwards, are the same joint under the reversed load."""
    m = model.pairs
    if m % 2 == 0:
        return False
    turned = _components(np.arange(m)[::-1])
    stiff = slice(model.equilibrium_modes, None)
    soft = model.mode_v[:, stiff] / model.omega[stiff] ** 2
    W = residual + soft @ model.mode_v[:, stiff].T
    v = model.port_v + soft @ model.port_modes[stiff]
    pairs = [
        (W, W[np.ix_(turned, turned)]),
        (v[:, model.port("clamp")], v[turned, model.port("clamp")]),
        (v[:, model.port(port)], -v[turned, model.port(port)]),
        (prestress.solution.r, prestress.solution.r[turned]),
        (friction, friction[::-1]),
    ]
    return all(np.abs(a - b).max() <= 1e-6 * np.abs(a).max() for a, b in pairs)


def _samples(harmonics: int) -> int:
    return max(LEAST_SAMPLES, SAMPLES_PER_HARMONIC * harmonics)


def with_harmonics(problem: HarmonicProblem, harmonics: int) -> HarmonicProblem:
    """The same equations with another number of harmonics and the samples that go with it."""
    samples = max(_samples(harmonics), problem.table.samples)
    return replace(problem, table=sample_table(harmonics, samples))


def padded(old: HarmonicProblem, new: HarmonicProblem, w: Array) -> Array:
    """Unknowns of `old` as unknowns of `new`: harmonics appended (zero) or cut off."""
    u, _ = old.split(w)
    out = np.zeros(new.shape)
    keep = min(u.shape[1], out.shape[1])
    out[:, :keep] = u[:, :keep]
    return np.concatenate([out.ravel(), w[u.size :]])


def to_complex(u: Array) -> Complex:
    """Coefficients ``Y_h``, (H + 1, n), of real ones (n, 2 H + 1); the mean is real."""
    Y = np.empty((u.shape[1] // 2 + 1, len(u)), dtype=complex)
    Y[0] = u[:, 0]
    Y[1:] = (u[:, 1::2] + 1j * u[:, 2::2]).T
    return Y


def to_real(Y: Complex) -> Array:
    """Inverse of `to_complex`."""
    u = np.empty((Y.shape[1], 2 * len(Y) - 1))
    u[:, 0] = Y[0].real
    u[:, 1::2], u[:, 2::2] = Y[1:].real.T, Y[1:].imag.T
    return u


@dataclass(frozen=True)
class LinearOperator:
    """The linear side at one frequency: ``v = v_free + R q - W r``, every harmonic at once.

    In the mean the nearly rigid modes are left out of W and of the modal compliance.

    Attributes
    ----------
    problem : HarmonicProblem
    omega : float
        rad/s.
    modal : (H + 1, k) complex array
        Compliance of every mode at every harmonic.
    lag : (H + 1,) complex array
        ``1 / (1 + i h omega tau)``.
    """

    problem: HarmonicProblem
    omega: float
    modal: Complex
    lag: Complex

    def flexibility(self, u: Array) -> Array:
        """``W r`` of coefficients (2 m, c)."""
        p = self.problem
        own = to_complex(_by_parity(p.residual, u)) * self.lag[:, None]
        return to_real(own) + self.of_modes(self.on_modes(u) * self.modal)

    def on_modes(self, u: Array) -> Complex:
        """Forces on the modes, (H + 1, k), to reactions, (2 m, c), along the displacements."""
        return to_complex(_by_parity(self.problem.gather.transpose(0, 2, 1), u))

    def of_modes(self, eta: Complex) -> Array:
        """Relative displacement, (2 m, c), under modal amplitudes (H + 1, k)."""
        return _by_parity(self.problem.spread, to_real(eta))

    def dense(self, h: int) -> Complex:
        """``W_h`` as a matrix."""
        p, odd = self.problem, h % 2
        return p.residual[odd] * self.lag[h] + (p.spread[odd] * self.modal[h]) @ p.gather[odd].T

    def free(self, load: float) -> Array:
        """Displacement without reactions under the clamp and ``load sin(omega t)``."""
        return self.response("clamp", 0, self.problem.prestress.clamp) + self.response(
            self.problem.port, 1, load
        )

    def response(self, port: str, h: int, amplitude: float) -> Array:
        """Relative displacement under a port's amplitude at harmonic h."""
        problem, model = self.problem, self.problem.model
        p = model.port(port)
        Y: Complex = np.zeros((problem.harmonics + 1, len(problem.rows)), dtype=complex)
        Y[h] = model.port_v[problem.rows, p] * self.lag[h]
        Y[h] += problem.spread[h % 2] @ (self.modal[h] * model.port_modes[:, p])
        Y *= amplitude
        return to_real(Y)

    def modes(self, u: Array, q: Array, load: float) -> Complex:
        """Modal amplitudes (H + 1, k) under clamp, load and reactions, total."""
        problem, model = self.problem, self.problem.model
        force = -to_complex(_by_parity(problem.gather.transpose(0, 2, 1), u))
        force[0] += model.port_modes[:, model.port("clamp")] * problem.prestress.clamp
        force[1] += model.port_modes[:, model.port(problem.port)] * load
        modes = force * self.modal
        modes[0, : len(q)] = q
        return modes

    def outputs(self, u: Array, q: Array, load: float) -> Complex:
        """Outputs of all ports, (H + 1, p), total."""
        problem, model = self.problem, self.problem.model
        residual = -to_complex(model.port_v.T @ problem.unfold(u))
        residual[0] += model.port_port[model.port("clamp")] * problem.prestress.clamp
        residual[1] += model.port_port[model.port(problem.port)] * load
        return residual * self.lag[:, None] + self.modes(u, q, load) @ model.port_modes

    def frequency_derivative(self, u: Array, load: float) -> Array:
        """Derivative of the relative displacement by omega at constant reactions."""
        problem, model = self.problem, self.problem.model
        h = np.arange(problem.harmonics + 1)[:, None]
        slope: Complex = 2 * h**2 * self.omega - 1j * h * model.modal_damping()
        modes: Complex = (
            slope * self.modal * self.modes(u, np.zeros(len(problem.rigid_modes)), load)
        )
        own = -to_complex(_by_parity(problem.residual, u))
        own[1] += model.port_v[problem.rows, model.port(problem.port)] * load
        own = own * (-1j * h * model.rayleigh[1] * self.lag[:, None] ** 2)
        return to_real(own) + _by_parity(problem.spread, to_real(modes))


def _by_parity(matrices: Array, u: Array) -> Array:
    """First matrix times the coefficients of even harmonics, second times those of odd ones."""
    even = parity(u.shape[1]) > 0
    out = np.empty((matrices.shape[1], u.shape[1]))
    out[:, even] = matrices[0] @ u[:, even]
    out[:, ~even] = matrices[1] @ u[:, ~even]
    return out


def linear_operator(problem: HarmonicProblem, omega: float) -> LinearOperator:
    """Linear side at circular frequency `omega` (rad/s, > 0)."""
    if not (np.isfinite(omega) and omega > 0):
        raise MicroslipError(f"frequency {omega / (2 * np.pi):g} Hz must be positive")
    modal, lag = harmonic_compliance(problem.model, omega, problem.harmonics)
    modal[0, : len(problem.rigid_modes)] = 0.0
    return LinearOperator(problem, float(omega), modal, lag)


@dataclass(frozen=True)
class Evaluation:
    """Equations evaluated at one set of unknowns.

    Attributes
    ----------
    w : (n,) array
        Unknowns.
    v : (2 m, c) array
        Relative displacements.
    cycle : ContactCycle
    F : (n,) array
        ``r - C(r + eps v)``, and the imbalance of the nearly rigid modes; N per metre of width.
    """

    w: Array
    v: Array
    cycle: ContactCycle
    F: Array


def evaluate(operator: LinearOperator, load: float, w: Array) -> Evaluation:
    """Residual of the unknowns `w` under an amplitude of the load."""
    problem = operator.problem
    model = problem.model
    u, _ = problem.split(w)
    p = w[u.size :]
    place = problem.place(p)
    v = operator.free(load) - operator.flexibility(u)
    v[:, 0] += problem.rigid_spread @ place
    x = u + problem.stiffness[:, None] * v
    cycle = contact_cycle(
        problem.table,
        x.reshape(-1, 2, problem.table.coefficients),
        problem.friction,
        problem.stiffness[1::2] * problem.held,
        problem.stiffness[1::2] * problem.drift(p),
    )
    clamp = model.port_modes[: model.equilibrium_modes, model.port("clamp")]
    imbalance = problem.rigid_stiffness @ place + problem.rigid_gather.T @ u[:, 0]
    imbalance -= problem.rigid_modes.T @ clamp * problem.prestress.clamp
    F = np.concatenate([(u - cycle.r.reshape(u.shape)).ravel(), imbalance * problem.spring])
    return Evaluation(w, v, cycle, F)


def derivative_times(operator: LinearOperator, cycle: ContactCycle, z: Array) -> Array:
    """Derivative of the residual along `z`: ``J z``."""
    problem = operator.problem
    u, _ = problem.split(z)
    p = z[u.size :]
    place = np.append(p[:-1], 0.0) if problem.walks else p
    x = -operator.flexibility(u)
    x[:, 0] += problem.rigid_spread @ place
    x *= problem.stiffness[:, None]
    x += u
    out = np.empty_like(cycle.r)
    times_derivative(cycle.nn, cycle.tn, cycle.tt, x.reshape(out.shape), out)
    if problem.walks:
        out[:, 1] += cycle.td * (problem.stiffness[1::2] * problem.drift(p))[:, None]
    imbalance = problem.rigid_stiffness @ place + problem.rigid_gather.T @ u[:, 0]
    return np.concatenate([(u - out.reshape(u.shape)).ravel(), imbalance * problem.spring])


def frequency_derivative(operator: LinearOperator, point: Evaluation, load: float) -> Array:
    """Derivative of the residual by omega."""
    problem = operator.problem
    x = operator.frequency_derivative(problem.split(point.w)[0], load)
    return _through_contact(problem, point.cycle, x)


def load_derivative(operator: LinearOperator, point: Evaluation) -> Array:
    """Derivative of the residual by the amplitude of the load."""
    problem = operator.problem
    return _through_contact(problem, point.cycle, operator.response(problem.port, 1, 1.0))


def _through_contact(problem: HarmonicProblem, cycle: ContactCycle, v: Array) -> Array:
    out = np.empty_like(cycle.r)
    x = (problem.stiffness[:, None] * v).reshape(out.shape)
    times_derivative(cycle.nn, cycle.tn, cycle.tt, x, out)
    return np.concatenate([-out.ravel(), np.zeros(problem.rigid_modes.shape[1])])
