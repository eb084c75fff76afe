"""The unknowns of harmonic balance for one joint and one driven port, and the half turn.

See `microslip.analyses.harmonic.equations` for the equations.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from microslip.analyses.harmonic.symmetries import half_turn_of, placed_modes, slides_last
from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.prepared.prestress import Prestress
from microslip.brief import Brief
from microslip.contact.law import ContactLaw
from microslip.contact.pairs import components, normal, tangential_vectors
from microslip.contact.samples import SampleTable, sample_table
from microslip.errors import MicroslipError
from microslip.model.joint import JointModel
from microslip.numerics.fourier import parity
from microslip.typing import Array, Indices

SAMPLES_PER_HARMONIC = 24
LEAST_SAMPLES = 128

WALK = 1e-3
"""First guess of a walk: augmented force per cycle, N (per metre of width in the plane)."""


@dataclass(frozen=True, repr=False)
class HarmonicProblem(Brief):
    """Equations of harmonic balance for one joint and one driven port.

    A joint that is its own image under a half turn (`half_turn`), driven by a load that the half turn
    reverses, moves so that what happens at ``x`` happens at ``-x`` half a period later. Even harmonics
    are then symmetric in x and odd ones antisymmetric, and half of the pairs suffice. Planar pairs alone
    have it: the image does not say how tangential directions in space are turned. Arrays with a leading
    axis of length 2 belong to even and odd harmonics; without the symmetry both are the same.

    Attributes
    ----------
    model : JointModel
    prestress : Prestress
        Its preload is held.
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
    compliance : (d m,) array
        Of an elastic contact, m/N; zero where it is exact.
    residual : (2, d p, d p) array
        Residual flexibility, with the compliance of an elastic contact on its diagonal.
    spread, gather : (2, d p, k) arrays
        Relative displacement of the modes; reactions of the pairs and their images to modal forces.
    stiffness : (d p,) array
        Augmentation eps of each component, N/m (per metre of width in the plane); one for the tangential
        directions of a pair.
    held : (p, d - 1) array
        Tangential displacement at which a pair sticks that never slips, of prestress or of a motion, m.
    rigid_modes : (e, f) array
        Mean amplitudes of the e nearly rigid modes per unknown (of one newton): all of them, or the
        combinations that the half turn leaves as they are; without those of a free joint as a whole, whose
        mean is zero (`symmetries.placed_modes`).
    slides : int
        How many of the last of them slide the bodies past each other.
    walks : bool
        Whether those unknowns are the changes of these motions per cycle, and not their means.
    offset : (f,) array
        Where the bodies then stand: mean amplitudes less those at prestress, in unknowns; zero in the others.
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
    slides: int
    offset: Array
    walks: bool = False

    @property
    def harmonics(self) -> int:
        """Number of harmonics H beside the mean."""
        return self.table.harmonics

    @property
    def dimension(self) -> int:
        """Components d of a contact pair."""
        return self.model.dimension

    @property
    def shape(self) -> tuple[int, int]:
        """Of the reactions solved for: components by real coefficients, (d p, 2 H + 1)."""
        return self.dimension * len(self.pairs), self.table.coefficients

    @cached_property
    def rows(self) -> Indices:
        """Components of v and r that belong to `pairs`."""
        return components(self.pairs, self.dimension)

    @property
    def along(self) -> Array:
        """Augmentation of the tangential directions, (p, d - 1); a view."""
        return tangential_vectors(self.stiffness, self.dimension)

    @cached_property
    def force_scale(self) -> float:
        """Largest reaction of the prestress: the unit of residuals."""
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
            weight[np.repeat(self.image == self.pairs, self.dimension)] = 0.5
        return weight

    @cached_property
    def rigid_spread(self) -> Array:
        """Relative displacement per unknown of the nearly rigid modes, (d p, f)."""
        return self.spread[0][:, : len(self.rigid_modes)] @ self.rigid_modes

    @cached_property
    def rigid_gather(self) -> Array:
        """Mean reactions to forces on the nearly rigid modes, (d p, f)."""
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
        """Coefficients of the reactions (d p, c), a view, and q, from the unknowns."""
        cut = self.shape[0] * self.shape[1]
        return w[:cut].reshape(self.shape), self.rigid_modes @ self.place(w[cut:])

    @cached_property
    def rest_place(self) -> Array:
        """Mean amplitudes of the nearly rigid modes at prestress, in unknowns."""
        return np.asarray(
            np.linalg.lstsq(self.rigid_modes, self.prestress.solution.q, rcond=None)[0]
        )

    @property
    def walking(self) -> slice:
        """Those of the last unknowns that are changes per cycle."""
        f = self.rigid_modes.shape[1]
        return slice(f - self.slides if self.walks else f, f)

    def means(self, p: Array) -> Array:
        """The last unknowns with zeros for those that are changes per cycle."""
        if not self.walks:
            return p
        out = p.copy()
        out[self.walking] = 0.0
        return out

    def place(self, p: Array) -> Array:
        """Mean amplitudes of the nearly rigid modes from the last unknowns."""
        if not self.walks:
            return p
        out = p.copy()
        out[self.walking] = self.rest_place[self.walking] + self.offset[self.walking]
        return out

    def drift(self, p: Array) -> Array:
        """Change of every v_t per cycle, m, (p, d - 1), from the last unknowns; zero unless it walks."""
        own = self.walking
        return tangential_vectors(self.rigid_spread[:, own] @ p[own], self.dimension)

    def mean_drift(self, p: Array) -> float:
        """Mean of `drift` over the pairs, m per cycle: with its sign in the plane, its size in space."""
        mean = self.drift(p).mean(axis=0)
        return float(mean[0]) if len(mean) == 1 else float(np.linalg.norm(mean))

    def unfold(self, u: Array) -> Array:
        """Coefficients of all pairs, (d m, c), from those solved for."""
        if not self.half_turn:
            return u
        out = np.empty((self.dimension * self.model.pairs, u.shape[1]))
        out[components(self.image, self.dimension)] = u * parity(u.shape[1])
        out[self.rows] = u
        return out

    def rest(self) -> Array:
        """Unknowns at prestress."""
        u = np.zeros(self.shape)
        u[:, 0] = self.prestress.solution.r[self.rows]
        return np.concatenate([u.ravel(), self.means(self.rest_place)])


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
        Planar or spatial. It may be free to move as a whole.
    harmonics : int
        H >= 1, beside the mean; even ones are included.
    samples : int, optional
        Samples per cycle; at least 128 and 24 per harmonic by default.
    port : str, optional
        Driven port; the joint's own by default.
    stiffness : float or (d m,) array, optional
        Augmentation, by default the inverse of the diagonal of the residual flexibility, its mean over the
        tangential directions of a pair.
    half_turn : bool, optional
        Use the half-turn symmetry; by default where the joint has it.

    Raises
    ------
    MicroslipError
        Where the preload pushes a joint that is free to move as a whole, the residual
        flexibility of some component is zero and no `stiffness` is given, the `stiffness` differs
        between the tangential directions of a pair, or the symmetry is asked for and not there.
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
    residual = model.residual + np.diag(law.compliance)
    eps = _augmentation(model.dimension, residual, stiffness)
    turns = half_turn_of(model, residual, law.friction, prestress, port)
    if half_turn and not turns:
        raise MicroslipError("the joint is not its own image under a half turn")
    folded = turns if half_turn is None else half_turn
    pairs = np.arange(m)
    if folded:
        assert model.image is not None
        pairs = np.flatnonzero(pairs >= model.image)
    rows = components(pairs, model.dimension)
    kept = residual[np.ix_(rows, rows)]
    psi = model.mode_v[rows]
    blocks, spread, gather = [kept, kept], [psi, psi], [psi, psi]
    if folded:
        assert model.image is not None
        image = components(model.image[pairs], model.dimension)
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
    placed = placed_modes(model, prestress)
    nearly_rigid = gather[0][:, : model.equilibrium_modes] @ placed
    combinations, slides = slides_last(nearly_rigid, model.dimension, folded)
    combinations = placed @ combinations
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
        held=_clamped(prestress, model.dimension)[pairs],
        rigid_modes=combinations / moved.max(axis=0, initial=1e-300),
        slides=slides,
        offset=np.zeros(combinations.shape[1]),
    )


def _augmentation(dimension: int, residual: Array, stiffness: float | Array | None) -> Array:
    """Augmentation of every component: as given, or of the residual flexibility of the pair."""
    if stiffness is not None:
        eps = np.broadcast_to(np.asarray(stiffness, dtype=float), len(residual)).copy()
        if np.ptp(tangential_vectors(eps, dimension), axis=1).any():
            raise MicroslipError(
                "the augmentation `stiffness` must be one for the tangential directions of a pair"
            )
        return eps
    own = np.diag(residual).copy()
    if not own.min() > 0:
        raise MicroslipError(
            f"component {int(np.argmin(own))} of the contact pairs has no residual flexibility "
            "of its own: give the augmentation `stiffness`, or keep fewer modes dynamic"
        )
    along = tangential_vectors(own, dimension)
    along[:] = along.mean(axis=1, keepdims=True)
    return np.asarray(1 / own)


def walking(problem: HarmonicProblem, w: Array) -> tuple[HarmonicProblem, Array]:
    """The same equations free to walk, and a guess: the walk that the supports have stopped.

    The bodies stand, and pairs that never slip stick, where the clamp has put them.
    """
    away = w[-problem.slides :] - problem.rest_place[-problem.slides :]
    guess = w.copy()
    guess[-problem.slides :] = away / max(np.abs(away).max(), 1e-300) * WALK
    held = _clamped(problem.prestress, problem.dimension)[problem.pairs]
    return replace(problem, walks=True, held=held), guess


def _clamped(prestress: Prestress, dimension: int) -> Array:
    """Tangential displacement of every pair where the clamp has put it, (m, d - 1), m."""
    return tangential_vectors(prestress.solution.v, dimension)


def pull(problem: HarmonicProblem, w: Array) -> float:
    """Mean force of the supports against sliding over the largest friction: zero at prestress.

    Of a turn it counts as the force at the pair farthest out. Zero also without friction: nothing then
    drives a walk, and the supports alone say where to be.
    """
    if not problem.slides or problem.walks or not problem.friction.any():
        return 0.0
    u, _ = problem.split(w)
    p = w[u.size :] - problem.rest_place
    own, d = slice(-problem.slides, None), problem.dimension
    arms = tangential_vectors(problem.rigid_gather[:, own].T, d)
    reach = np.linalg.norm(arms, axis=2).max(axis=1)
    shear = float(np.linalg.norm(problem.rigid_stiffness[own] @ p / reach))
    friction = problem.friction @ (normal(problem.once, d) * normal(u[:, 0], d))
    return shear / max(float(friction), 1e-300)


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
        own = np.flatnonzero(np.repeat(problem.image == problem.pairs, problem.dimension))
        residual[1][own, own] /= factor
    return replace(problem, stiffness=factor * problem.stiffness, residual=residual)


def padded(old: HarmonicProblem, new: HarmonicProblem, w: Array) -> Array:
    """Unknowns of `old` as unknowns of `new`: harmonics appended (zero) or cut off."""
    u, _ = old.split(w)
    out = np.zeros(new.shape)
    keep = min(u.shape[1], out.shape[1])
    out[:, :keep] = u[:, :keep]
    return np.concatenate([out.ravel(), w[u.size :]])
