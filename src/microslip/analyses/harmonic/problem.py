"""The unknowns of harmonic balance for one joint and one driven port, and the half turn.

See `microslip.analyses.harmonic.equations` for the equations.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.prepared.prestress import Prestress
from microslip.brief import Brief
from microslip.contact.law import ContactLaw
from microslip.contact.pairs import (
    components,
    normal,
    normal_rows,
    tangential,
    tangential_rows,
)
from microslip.contact.samples import SampleTable, sample_table
from microslip.errors import MicroslipError
from microslip.model.joint import JointModel
from microslip.numerics.fourier import parity
from microslip.typing import Array, Indices

SAMPLES_PER_HARMONIC = 24
LEAST_SAMPLES = 128

WALK = 1e-3
"""First guess of a walk: augmented force per cycle, N per metre of width."""


@dataclass(frozen=True, repr=False)
class HarmonicProblem(Brief):
    """Equations of harmonic balance for one joint and one driven port.

    A joint that is its own image under a half turn (`half_turn`), driven by a load that the half turn
    reverses, moves so that what happens at ``x`` happens at ``-x`` half a period later. Even harmonics
    are then symmetric in x and odd ones antisymmetric, and half of the pairs suffice. Arrays with a
    leading axis of length 2 belong to even and odd harmonics; without the symmetry both are the same.

    Attributes
    ----------
    model : JointModel
    prestress : Prestress
        Its preload is held; its frictionless displacements are where stuck pairs stay.
    port : str
        Driven port, ``load sin(omega t)``.
    coordinate : str
        Port whose output is the amplitude of the vibration.
    table : SampleTable
        Harmonics and samples.
    half_turn : bool
        Whether the symmetry is used.
    pairs : (p,) int array
        The pairs solved for: all, or one of each and its image.
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
    coordinate: str
    table: SampleTable
    half_turn: bool
    pairs: Indices
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
    def rows(self) -> Indices:
        """Components of v and r that belong to `pairs`."""
        return components(self.pairs)

    @cached_property
    def force_scale(self) -> float:
        """Largest reaction of the prestress, N per metre of width: the unit of residuals."""
        return self.prestress.largest_reaction

    @cached_property
    def held_load(self) -> Array:
        """(p,) amplitudes of the preload on all ports."""
        return self.model.amplitudes(self.prestress.preload)

    def driven(self, load: float) -> Array:
        """(p,) amplitudes of all ports at the first harmonic under a load."""
        return self.model.amplitudes({self.port: load})

    @cached_property
    def image(self) -> Indices:
        """Images of `pairs` under the half turn; themselves where it is not used."""
        if not self.half_turn:
            return self.pairs
        assert self.model.image is not None
        return self.model.image[self.pairs]

    @cached_property
    def spring(self) -> float:
        """Mean augmentation, N/m: turns imbalance per unknown into a force."""
        return float(self.stiffness.mean())

    @cached_property
    def once(self) -> Array:
        """Weight of each component in the sums over all pairs, relative to the others."""
        weight = np.ones(len(self.rows))
        if self.half_turn:
            weight[np.repeat(self.image == self.pairs, 2)] = 0.5
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

    @cached_property
    def rigid_held(self) -> Array:
        """The preload on the unknowns of the nearly rigid modes, (f,)."""
        model, rigid = self.model, slice(0, self.model.equilibrium_modes)
        held = np.zeros(self.rigid_modes.shape[1])
        for name, amplitude in self.prestress.preload.items():
            held += self.rigid_modes.T @ model.port_modes[rigid, model.port(name)] * amplitude
        return held

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
        return np.asarray(
            np.linalg.lstsq(self.rigid_modes, self.prestress.solution.q, rcond=None)[0]
        )

    def place(self, p: Array) -> Array:
        """Mean amplitudes of the nearly rigid modes from the last unknowns."""
        if not self.walks:
            return p
        return np.append(p[:-1], self.rest_place[-1])

    def drift(self, p: Array) -> Array:
        """Change of every v_t per cycle, m, from the last unknowns; zero unless the joint walks."""
        if not self.walks:
            return np.zeros(len(self.pairs))
        return tangential(self.rigid_spread[:, -1]) * p[-1]

    def unfold(self, u: Array) -> Array:
        """Coefficients of all pairs, (2 m, c), from those solved for."""
        if not self.half_turn:
            return u
        out = np.empty((2 * self.model.pairs, u.shape[1]))
        out[components(self.image)] = u * parity(u.shape[1])
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


def harmonic_problem(
    joint: PreparedJoint,
    *,
    harmonics: int = 5,
    samples: int | None = None,
    port: str | None = None,
    stiffness: float | Array | None = None,
    half_turn: bool | None = None,
) -> HarmonicProblem:
    """State the equations.

    Parameters
    ----------
    joint : PreparedJoint
        Planar; each of its modes with some stiffness.
    harmonics : int
        H >= 1, beside the mean; even ones are included.
    samples : int, optional
        Samples per cycle; at least 128 and 24 per harmonic by default.
    port : str, optional
        Driven port; the joint's own by default.
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
    return state_equations(
        joint.model,
        joint.prestress,
        joint.law,
        port or joint.drive,
        joint.coordinate,
        harmonics=harmonics,
        samples=samples,
        stiffness=stiffness,
        half_turn=half_turn,
    )


def state_equations(
    model: JointModel,
    prestress: Prestress,
    law: ContactLaw,
    port: str,
    coordinate: str,
    *,
    harmonics: int,
    samples: int | None = None,
    stiffness: float | Array | None = None,
    half_turn: bool | None = None,
) -> HarmonicProblem:
    """State the equations of a model as it is, prestressed in whatever way; see `harmonic_problem`."""
    model.port(port)
    m = model.pairs
    table = sample_table(harmonics, samples if samples is not None else _samples(harmonics))
    if not model.omega.min() > 1e-9 * model.omega.max():
        free = int(np.argmin(model.omega))
        raise MicroslipError(
            f"mode {free} has no stiffness ({model.omega[free] / (2 * np.pi):.3g} Hz): harmonic "
            "balance cannot find its mean position; support the joint with a weak spring"
        )
    residual = model.residual + np.diag(law.compliance)
    if stiffness is None:
        own = np.diag(residual)
        if not own.min() > 0:
            raise MicroslipError(
                f"component {int(np.argmin(own))} of the contact pairs has no residual flexibility "
                "of its own: give the augmentation `stiffness`, or keep fewer modes dynamic"
            )
        stiffness = 1 / own
    eps = np.broadcast_to(np.asarray(stiffness, dtype=float), (2 * m,)).copy()
    turns = has_half_turn(model, residual, law.friction, prestress, port)
    if half_turn and not turns:
        raise MicroslipError("the joint is not its own image under a half turn")
    folded = turns if half_turn is None else half_turn
    pairs = np.arange(m)
    if folded:
        assert model.image is not None
        pairs = np.flatnonzero(pairs >= model.image)
    rows = components(pairs)
    kept = residual[np.ix_(rows, rows)]
    psi = model.mode_v[rows]
    blocks, spread, gather = [kept, kept], [psi, psi], [psi, psi]
    if folded:
        assert model.image is not None
        image = components(model.image[pairs])
        turned, psi_turned = residual[np.ix_(rows, image)], model.mode_v[image]
        blocks, gather = [kept + turned, kept - turned], [psi + psi_turned, psi - psi_turned]
        spread = [psi, psi.copy()]
        # A pair that is its own image is counted once, and its odd harmonics vanish.
        own = rows == image
        blocks[0][:, own] /= 2
        gather[0][own] /= 2
        for array in (spread[1], gather[1], blocks[1], blocks[1].T):
            array[own] = 0.0
        blocks[1][np.ix_(own, own)] = np.diag(1 / eps[rows[own]])
    combinations, slides = _rigid_combinations(gather[0][:, : model.equilibrium_modes], folded)
    moved = np.abs(eps[rows][:, None] * (gather[0][:, : len(combinations)] @ combinations))
    return HarmonicProblem(
        model=model,
        prestress=prestress,
        port=port,
        coordinate=coordinate,
        table=table,
        half_turn=folded,
        pairs=pairs,
        friction=law.friction[pairs],
        compliance=law.compliance,
        residual=np.stack(blocks),
        spread=np.stack(spread),
        gather=np.stack(gather),
        stiffness=eps[rows],
        held=tangential(prestress.solution.v)[pairs],
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
    sliding = rigid[tangential_rows()]
    # sideways motion of the pairs in the space of combinations that do not open or close them
    _, size, directions = np.linalg.svd(rigid[normal_rows()] @ basis)
    closing = int(np.sum(size > 1e-3 * np.abs(sliding @ basis).max() * np.sqrt(len(rigid))))
    still = directions[closing:].T
    if still.shape[1] == 0:
        return basis, False
    _, size, sideways = np.linalg.svd(sliding @ basis @ still)
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
    shear = problem.rigid_stiffness[-1] @ p / np.abs(tangential(problem.rigid_gather[:, -1])).max()
    friction = problem.friction @ (normal(problem.once) * normal(u[:, 0]))
    return float(abs(shear) / max(friction, 1e-300))


def has_half_turn(
    model: JointModel, residual: Array, friction: Array, prestress: Prestress, port: str
) -> bool:
    """Whether the half turn of the structure keeps contact and preload and reverses the load."""
    if model.image is None:
        return False
    turned = components(model.image)
    stiff = slice(model.equilibrium_modes, None)
    soft = model.mode_v[:, stiff] / model.omega[stiff] ** 2
    W = residual + soft @ model.mode_v[:, stiff].T
    v = model.port_v + soft @ model.port_modes[stiff]
    held, load = v @ model.amplitudes(prestress.preload), v[:, model.port(port)]
    pairs = [
        (W, W[np.ix_(turned, turned)]),
        (held, held[turned]),
        (load, -load[turned]),
        (prestress.solution.r, prestress.solution.r[turned]),
        (friction, friction[model.image]),
    ]
    return all(np.abs(a - b).max() <= 1e-6 * np.abs(a).max() for a, b in pairs)


def _samples(harmonics: int) -> int:
    return max(LEAST_SAMPLES, SAMPLES_PER_HARMONIC * harmonics)


def with_harmonics(problem: HarmonicProblem, harmonics: int) -> HarmonicProblem:
    """The same equations with another number of harmonics and the samples that go with it."""
    samples = max(_samples(harmonics), problem.table.samples)
    return replace(problem, table=sample_table(harmonics, samples))


def softened(problem: HarmonicProblem, factor: float) -> HarmonicProblem:
    """The same equations with another augmentation, over the one it has."""
    if factor == 1.0:
        return problem
    residual = problem.residual.copy()
    if problem.half_turn:
        own = np.flatnonzero(np.repeat(problem.image == problem.pairs, 2))
        residual[1][own, own] /= factor
    return replace(problem, stiffness=factor * problem.stiffness, residual=residual)


def padded(old: HarmonicProblem, new: HarmonicProblem, w: Array) -> Array:
    """Unknowns of `old` as unknowns of `new`: harmonics appended (zero) or cut off."""
    u, _ = old.split(w)
    out = np.zeros(new.shape)
    keep = min(u.shape[1], out.shape[1])
    out[:, :keep] = u[:, :keep]
    return np.concatenate([out.ravel(), w[u.size :]])
