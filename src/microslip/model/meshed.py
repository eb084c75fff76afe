"""The structure of a joint from a mesh: matrices, interfaces, loads, supports and ties.

A description of a mesh needs to call `structure_from_mesh` alone; what goes into it comes from
`microslip.model.mesh` (materials, loads) and `microslip.model.mortar.coupling` (interfaces).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp

from microslip.brief import Brief
from microslip.errors import Caution, ModelError
from microslip.model.bolts import NO_BOLTS, Bolts
from microslip.model.elasticity import Material
from microslip.model.interface import Interface
from microslip.model.mesh.assembly import assemble
from microslip.model.mesh.bolts import MeshBolt, shortened, spring_of
from microslip.model.mesh.constraints import (
    Rotations,
    carried,
    constraints_of,
    free_displacements,
    rotations_of,
    spins,
    stacked,
)
from microslip.model.mesh.finite_elements import FiniteElementMesh, bending_cautions, said_too
from microslip.model.mesh.naming import named_bodies
from microslip.model.mesh.thermal import thermal_load
from microslip.model.mortar.bonded import bonded_pairs
from microslip.model.mortar.coupling import MortarCoupling
from microslip.model.mortar.ties import tied
from microslip.model.structure import Reaction, Structure
from microslip.typing import Array, Indices, Mask

STOPPED = 1e-9
"""Of the largest: a rigid motion that constraints move less is free."""

PARTLY = 0.98
"""A caution says how much of two surfaces meets where it is less of the smaller one."""


@dataclass(frozen=True, repr=False)
class MeshedStructure(Brief):
    """A structure and where it came from.

    Attributes
    ----------
    structure : Structure
    mesh : FiniteElementMesh
    couplings : tuple of MortarCoupling
        In the order of the pairs.
    basis : (N, n) sparse
        Displacements of all points, and rotations of reference nodes, from those of the structure.
    rotations : Rotations
    bolts : Bolts
        Those that keep their length.
    cautions : tuple of Caution
    held_motions : mapping of str to (N,) array
        Unit motions of the supports whose reactions are outputs.
    bonded : tuple of int
        Pairs of each coupling that constraints hold together.
    """

    structure: Structure
    mesh: FiniteElementMesh
    couplings: tuple[MortarCoupling, ...]
    basis: sp.csc_matrix
    rotations: Rotations
    bolts: Bolts = NO_BOLTS
    cautions: tuple[Caution, ...] = ()
    held_motions: Mapping[str, Array] = field(default_factory=dict)
    bonded: tuple[int, ...] = ()

    @property
    def gap(self) -> Array:
        """(m,) initial gaps of all pairs, m."""
        return np.concatenate([coupling.gap for coupling in self.couplings])

    def displacement(self, x: Array) -> Array:
        """(points, d) displacements of the points of the mesh."""
        return np.asarray((self.basis @ x)[: self.mesh.points.size].reshape(self.mesh.points.shape))


def structure_from_mesh(
    mesh: FiniteElementMesh,
    couplings: Sequence[MortarCoupling],
    *,
    held: Mapping[str, Sequence[int]],
    loads: Mapping[str, Array],
    materials: Mapping[str, Material] | Material | None = None,
    springs: sp.csc_matrix | None = None,
    bolts: Sequence[MeshBolt] = (),
    temperatures: Mapping[str, Array] | None = None,
    reactions: Mapping[str, Array] | None = None,
) -> MeshedStructure:
    """Matrices, interface and loads of a mesh, with its ties, equations and couplings condensed.

    Parameters
    ----------
    mesh : FiniteElementMesh
    couplings : sequence of MortarCoupling
        Contact interfaces.
    held : mapping of str to sequence of int
        Node sets and their components that do not move; components of rotations, from the dimension on, are
        those of reference nodes.
    loads : mapping of str to (d n,) array, or (N,) with rotations
        Of `microslip.model.mesh.loads`.
    materials : optional
        See `microslip.model.mesh.assembly.assemble`.
    springs : (d n, d n) sparse, optional
        To the ground.
    bolts : sequence of MeshBolt
        Of this mesh; each becomes a load of its name, see `microslip.model.bolts`.
    temperatures : mapping of str to (e,) array, optional
        Changes of the temperature of every element; each becomes a load of its name.
    reactions : mapping of str to (N,) array, optional
        Unit motions of points and reference nodes; what supports hold with against them becomes an output of
        its name, of what is held among them.

    Returns
    -------
    MeshedStructure
        Its ``structure.free`` are the degrees of freedom ``d k + i`` of component i at point k.

    Raises
    ------
    ModelError
        Where matrices cannot be assembled, constraints contradict each other, or some of the bodies are held
        by neither supports, springs nor contact.
    """
    rotations = rotations_of(mesh)
    parts = []
    for tie in mesh.ties:
        mesh, tying = tied(mesh, tie)
        parts.append(tying)
    constraints = stacked([*parts, constraints_of(mesh, rotations)], rotations.dofs)
    stiffness, mass = assemble(mesh, materials)
    extra = rotations.dofs - stiffness.shape[0]
    supports = sp.csc_matrix(stiffness.shape) if springs is None else springs
    K, M, S = (_padded(matrix, extra) for matrix in (stiffness + supports, mass, supports))
    coordinates = np.array([mesh.dimension * bolt.point for bolt in bolts], dtype=np.int64)
    K = K + spring_of(bolts, mesh.dimension, rotations.dofs)
    idle = np.setdiff1d(_idle(mesh, constraints.rows, rotations), coordinates)
    supported = held_dofs(mesh, held, rotations)
    fixed = np.union1d(supported, idle)
    basis, kept = free_displacements(constraints, fixed)
    relative = sp.vstack([coupling.relative() for coupling in couplings]).tocsr()
    motions = _motions(mesh, rotations, coordinates, idle)
    stops = _stopped(mesh, bolts, coordinates, constraints.rows)
    motions = _left_free(motions, fixed, stops)
    aside = any(bolt.stiffness is not None for bolt in bolts) and not len(supported)
    widest = max((float(np.abs(c.gap).max(initial=0.0)) for c in couplings), default=0.0)
    _check_held(mesh, motions, _wide(relative, extra), S, widest, aside)
    thermal = {
        name: thermal_load(mesh, change, materials) for name, change in (temperatures or {}).items()
    }
    every = {**loads, **thermal}
    full = {name: np.pad(load, (0, rotations.dofs - len(load))) for name, load in every.items()}
    vectors = {name: basis.T @ load for name, load in full.items()}
    whole = _symmetric(basis.T @ K @ basis)
    ours, pulls, found = _bolted(whole, kept, bolts, coordinates, vectors)
    apart = _wide(relative, extra)
    moved = {
        name: carried(constraints, fixed, kept, _of_supports(name, motion, supported))
        for name, motion in (reactions or {}).items()
    }
    lengths = coordinates[[bolt.keeps_length for bolt in bolts]] if bolts else coordinates
    full |= _pulled(K, basis[:, np.searchsorted(kept, lengths)], found)
    basis, kept = basis[:, ours], kept[ours]
    own = {name: basis.T @ (K @ e) for name, e in moved.items()}
    structure = Structure(
        stiffness=whole[ours][:, ours].tocsc(),
        mass=_symmetric(basis.T @ M @ basis),
        interface=_interface(couplings, (apart @ basis).tocsr()),
        loads={name: vector[ours] for name, vector in vectors.items()} | pulls | own,
        free=kept,
        motions=motions[kept],
        supports=None if springs is None else _symmetric(basis.T @ S @ basis),
        reactions={
            name: Reaction(
                mass=basis.T @ (M @ e),
                pairs=apart @ e,
                loads={load: float(e @ vector) for load, vector in full.items()},
            )
            for name, e in moved.items()
        },
    )
    cautions = (*mesh.cautions, *bending_cautions(mesh), *_coverage(couplings))
    still = bonded_pairs(couplings, apart, structure.interface.relative, fixed)
    return MeshedStructure(
        structure, mesh, tuple(couplings), basis, rotations, found, cautions, moved, still
    )


def _of_supports(name: str, motion: Array, supported: Indices) -> Array:
    """The part of a motion that supports hold.

    Raises
    ------
    ModelError
        Where they hold nothing of it.
    """
    held = np.zeros(len(motion))
    held[supported] = motion[supported]
    if not held.any():
        raise ModelError(
            f"{name}: no support holds what it is on in this direction: a reaction is of nodes that "
            "[[support]] or the mesh holds"
        )
    return held


def held_dofs(
    mesh: FiniteElementMesh, held: Mapping[str, Sequence[int]], rotations: Rotations
) -> Indices:
    """Degrees of freedom that supports hold.

    Raises
    ------
    ModelError
        Where a node set is missing or empty, or has no such component.
    """
    d = mesh.dimension
    out = [_held_by_mesh(mesh, rotations)]
    for name, components in held.items():
        nodes = mesh.nodes_of_set(name)
        for component in components:
            if component < d:
                out.append(d * nodes + component)
                continue
            turning = [node for node in nodes if node in rotations.nodes]
            if not turning or component >= d + rotations.each:
                raise ModelError(
                    f"support of node set {name!r}: its nodes have no component {component + 1}; solid "
                    "elements have displacements alone, and rotations belong to reference nodes of couplings"
                )
            out += [rotations.of(node)[[component - d]] for node in turning]
    return np.unique(np.concatenate(out))


def _held_by_mesh(mesh: FiniteElementMesh, rotations: Rotations) -> Indices:
    """Degrees of freedom that the mesh itself holds; rotations of nodes without any are held anyway."""
    d = mesh.dimension
    moving = mesh.held[mesh.held[:, 1] < d]
    out = [d * moving[:, 0] + moving[:, 1]]
    for node, component in mesh.held[mesh.held[:, 1] >= 3]:
        turn = component - 3 if d == 3 else component - 5
        if node in rotations.nodes and turn >= 0:
            out.append(rotations.of(int(node))[[turn]])
    return np.concatenate(out)


def _idle(mesh: FiniteElementMesh, constraints: sp.csr_matrix, rotations: Rotations) -> Indices:
    """Degrees of freedom of points that belong to no element and no constraint."""
    used = np.zeros(len(mesh.points), dtype=bool)
    for block in mesh.blocks:
        used[block.nodes] = True
    active = np.zeros(rotations.dofs, dtype=bool)
    active[: mesh.points.size] = np.repeat(used, mesh.dimension)
    active[np.unique(constraints.indices)] = True
    return np.flatnonzero(~active)


def _padded(matrix: sp.csc_matrix, extra: int) -> sp.csc_matrix:
    return sp.block_diag([matrix, sp.csc_matrix((extra, extra))], format="csc") if extra else matrix


def _wide(matrix: sp.csr_matrix, extra: int) -> sp.csr_matrix:
    return sp.hstack([matrix, sp.csr_matrix((matrix.shape[0], extra))]).tocsr() if extra else matrix


def _symmetric(matrix: sp.spmatrix) -> sp.csc_matrix:
    return (0.5 * (matrix + matrix.T)).tocsc()


def _interface(couplings: Sequence[MortarCoupling], relative: sp.csr_matrix) -> Interface:
    if not couplings:
        raise ModelError("a joint needs an interface: name two surfaces that touch")
    parts = [coupling.interface() for coupling in couplings]
    return Interface(
        np.concatenate([part.position for part in parts]),
        np.concatenate([part.area for part in parts]),
        relative,
        parts[0].dimension,
    )


def _bolted(
    stiffness: sp.csc_matrix,
    kept: Indices,
    bolts: Sequence[MeshBolt],
    coordinates: Indices,
    loads: Mapping[str, Array],
) -> tuple[Mask, dict[str, Array], Bolts]:
    """Which degrees of freedom are left when bolts keep their length, their load vectors, and the bolts.

    Raises
    ------
    ModelError
        Where supports or other constraints hold a bolt's own degree of freedom.
    """
    at = np.searchsorted(kept, coordinates)
    for bolt, place, own in zip(bolts, at, coordinates, strict=True):
        if place == len(kept) or kept[place] != own:
            raise ModelError(
                f"bolt {bolt.name!r} cannot be shortened: supports, ties or another bolt hold all that it "
                "acts on"
            )
    keeping = np.array([bolt.keeps_length for bolt in bolts], dtype=bool)
    ours = np.ones(len(kept), dtype=bool)
    ours[at[keeping]] = False
    pulls = {}
    for bolt, place in zip(bolts, at, strict=True):
        if not bolt.keeps_length:
            pulls[bolt.name] = (np.arange(len(kept)) == place).astype(float)[ours]
    among = [bolt for bolt in bolts if bolt.keeps_length]
    own = stiffness[at[keeping]][:, at[keeping]].toarray()
    k = own.diagonal().copy()
    for bolt, place, size in zip(among, at[keeping], k, strict=True):
        pulls[bolt.name] = -stiffness[:, [place]].toarray().ravel()[ours] / size
    direct = {name: load[at[keeping]] for name, load in loads.items() if load[at[keeping]].any()}
    return ours, pulls, Bolts(tuple(bolt.name for bolt in among), k, own / k, direct)


def _pulled(stiffness: sp.csc_matrix, lengths: sp.csc_matrix, found: Bolts) -> dict[str, Array]:
    """(N,) forces of bolts that keep their length per unit amplitude, on held degrees of freedom too.

    ``f = -K T_s / K_ss``, T_s (columns of `lengths`) the displacements of a unit shortening.
    """
    forces = -(stiffness @ lengths).toarray() / found.stiffness
    return dict(zip(found.names, forces.T, strict=True))


def _stopped(
    mesh: FiniteElementMesh, bolts: Sequence[MeshBolt], coordinates: Indices, rows: sp.csr_matrix
) -> sp.csr_matrix:
    """Rows of what no motion changes: constraints, and lengths of bolts that keep them."""
    n = rows.shape[1]
    lengths = [
        sp.csr_matrix(([1.0], ([0], [own])), shape=(1, n))
        for bolt, own in zip(bolts, coordinates, strict=True)
        if bolt.keeps_length
    ]
    springs = [
        sp.csr_matrix(shortened(bolt, mesh.dimension, n))
        for bolt in bolts
        if bolt.stiffness is not None
    ]
    return sp.vstack([rows, *lengths, *springs]).tocsr()


def _motions(
    mesh: FiniteElementMesh, rotations: Rotations, coordinates: Indices, idle: Indices
) -> Array:
    """(N, e) rigid motions of all bodies and reference nodes, turns about their mean and of unit size; and
    further coordinates. Rotations that are not coupled, among `idle`, do not turn with a body."""
    d = mesh.dimension
    groups = [*mesh.bodies, *(np.array([node]) for node in rotations.nodes)]
    each = d + (1 if d == 2 else 3)
    out = np.zeros((rotations.dofs, each * len(groups)))
    for k, nodes in enumerate(groups):
        arms = mesh.points[nodes] - mesh.points[nodes].mean(axis=0)
        size = np.linalg.norm(arms, axis=1).max() or 1.0
        rigid = np.concatenate([np.tile(np.eye(d), (len(nodes), 1, 1)), spins(arms / size)], axis=2)
        rows = (d * nodes[:, None] + np.arange(d)).ravel()
        out[rows, each * k : each * (k + 1)] = rigid.reshape(-1, each)
        for node in nodes[np.isin(nodes, rotations.nodes)]:
            turns, at = each * k + d + np.arange(rotations.each), rotations.of(int(node))
            along = ~np.isin(at, idle) | (len(nodes) == 1)
            out[at[along], turns[along]] = 1.0 / size
    alone = np.zeros((len(out), len(coordinates)))
    alone[coordinates, np.arange(len(coordinates))] = 1.0
    return np.hstack([out, alone])


def _left_free(motions: Array, fixed: Indices, constraints: sp.csr_matrix) -> Array:
    """Combinations of rigid motions that supports and constraints do not stop."""
    stopped = np.vstack([motions[fixed], constraints @ motions])
    if not len(stopped):
        return motions
    few = max(0, motions.shape[1] - len(stopped))
    _, size, directions = np.linalg.svd(np.pad(stopped, ((0, few), (0, 0))), full_matrices=False)
    rank = int(np.sum(size > STOPPED * size.max(initial=1e-300)))
    return np.asarray(motions @ directions[rank:].T)


def _check_held(
    mesh: FiniteElementMesh,
    motions: Array,
    relative: sp.csr_matrix,
    springs: sp.csc_matrix,
    gap: float = 0.0,
    aside: bool = False,
) -> None:
    """Raise `ModelError` where rigid motions of some bodies meet no support, no spring and no other body.

    All bodies may be held by nothing together: `microslip.model.loose` keeps them in their place. Sides of a
    pair that are a gap g apart move past each other by the turn times g where all turn together; that holds
    nothing. With `aside` bolts between two places keep their length, and nothing is supported: one that
    pulls beside the line through its two places would hold such a turn.
    """
    if not motions.shape[1]:
        return
    scale = float(np.abs(springs.data).max(initial=0.0)) or 1.0
    felt = np.vstack([relative @ motions, springs @ motions / scale])
    few = max(0, motions.shape[1] - len(felt))
    _, size, directions = np.linalg.svd(np.pad(felt, ((0, few), (0, 0))), full_matrices=False)
    still = STOPPED * max(size.max(initial=0.0), 1.0)
    loose = motions @ directions[size <= still].T
    if not loose.shape[1]:
        return
    d, largest = mesh.dimension, np.abs(loose).max()
    names = []
    for name, nodes in named_bodies(mesh):
        rows = (d * nodes[:, None] + np.arange(d)).ravel()
        if np.abs(loose[rows]).max() > 1e-6 * largest:
            names.append(f"{name} (node {mesh.node_labels[nodes[0]]})")
    all_of_them, together = len(names) == len(mesh.bodies), d * (d + 1) // 2
    turned = 4 * gap * np.sqrt(len(felt)) / float(np.ptp(mesh.points, axis=0).max())
    if all_of_them and together in (loose.shape[1], int((size <= max(still, turned)).sum())):
        return
    if aside and all_of_them and not springs.nnz and loose.shape[1] < together:
        raise ModelError(
            "nothing holds the bodies, and a bolt that keeps its length does not pull along the line through "
            "the middles of its two places, so that it resists a turn of all bodies together: let its "
            "direction be that of the line, or hold the bodies, if only by soft springs"
            + said_too(mesh)
        )
    raise ModelError(
        f"{loose.shape[1]} rigid motions meet no support, no spring and no other body; the bodies that "
        f"move are {', '.join(names)}: hold them, tie them, or give them springs" + said_too(mesh)
    )


def _coverage(couplings: Sequence[MortarCoupling]) -> tuple[Caution, ...]:
    return tuple(
        Caution(
            "mesh",
            f"surfaces {c.slave!r} and {c.master!r}",
            f"only {c.met:.0%} of the smaller one face the other side",
            "is that meant? reach couples surfaces that are farther apart",
        )
        for c in couplings
        if c.met < PARTLY
    )
