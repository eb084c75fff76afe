"""The structure of a joint from the matrices of another program.

The degrees of freedom keep the units of the file; only work and energy are converted. With the units l of
length and f of force of the file and the width w, for SI amplitudes of the loads,

    K -> f l K / w,   M -> f l M / w,   v = l B x,   p -> l p (force), p (moment), -f M e / w (base)

so that frequencies, relative displacements, reactions and outputs are in SI units, per metre of width,
whatever the degrees of freedom are: displacements of nodes, rotations or modal coordinates. e moves
everything with the base by one unit of length.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from microslip.brief import Brief
from microslip.describe.matrices import FORCES, LENGTHS, MatricesJoint, Vector, VectorOutput
from microslip.describe.profile import Profile
from microslip.describe.sources import split_source
from microslip.errors import Caution, InputError
from microslip.model.bolts import Tightening
from microslip.model.described import Described, Stamps, stamps
from microslip.model.interface import Interface
from microslip.model.meshed import MeshedStructure
from microslip.model.numbering import Numbering, numbering_of_table, with_coordinates
from microslip.model.pair_table import Pairs, pairs_of
from microslip.model.readers.files import read_matrix, read_table, read_vector
from microslip.model.readers.found import NAMES, Found, Label, ordered
from microslip.model.soundness import (
    check_matrices,
    check_motions,
    check_size_of_motions,
    zero_modes,
)
from microslip.model.spatial import check_spatial, width_said
from microslip.model.structure import Reaction, Structure
from microslip.typing import Array

LISTED = (".csv", ".txt")
"""Endings of vectors that are given by nodes."""

ASYMMETRIC = 1e-8
"""Of the largest entry of a damping matrix."""

GAP = "gap"
"""Port that holds the sides apart by the initial gaps."""


@dataclass(frozen=True, repr=False)
class Imported(Brief):
    """A joint as its files describe it.

    Attributes
    ----------
    structure : Structure
        SI but for its degrees of freedom, per metre of width.
    pairs : Pairs
        In SI units.
    numbering : Numbering or None
        Of the degrees of freedom, where the file has them.
    preload : mapping of str to float
        Amplitudes of the ports that are held.
    zero_modes : tuple of str
        What each motion without stiffness is.
    first_frequency : float
        Lowest natural frequency of the structure without contact, Hz.
    cautions : tuple of Caution
    points : (m, d) array, optional
        Of the pairs, where a mesh has them, m.
    facts : tuple of (str, str)
        What else is told of it by ``microslip check``.
    meshed : MeshedStructure, optional
        The mesh it came from, for pictures.
    damping : (n, n) sparse, optional
        A viscous damping matrix.
    tightening : Tightening, optional
        Bolts that keep their length, and the order in which all that presses is applied.
    """

    structure: Structure
    pairs: Pairs
    numbering: Numbering | None
    preload: Mapping[str, float]
    zero_modes: tuple[str, ...]
    first_frequency: float
    cautions: tuple[Caution, ...]
    points: Array | None = None
    facts: tuple[tuple[str, str], ...] = ()
    meshed: MeshedStructure | None = None
    damping: sp.csc_matrix | None = None
    tightening: Tightening | None = None

    def friction(self, given: float | Profile | None) -> Array:
        """(m,) coefficient of friction of each pair: as the joint file gives it, else the table.

        Raises
        ------
        InputError
            Where neither does.
        """
        if given is None:
            if self.pairs.friction is None:
                raise InputError(
                    "contact.friction is missing: give it, or a column friction of the pairs"
                )
            return self.pairs.friction
        if isinstance(given, Profile):
            return np.array([given.at(x) for x in self.pairs.position])
        return np.full(self.pairs.count, given)


def read_imported(joint: MatricesJoint) -> Imported:
    """Read all files of a description, and see whether they can be what they are meant to be.

    Raises
    ------
    InputError
        One message for the first thing that cannot be: file, what is there, what is allowed.
    """
    return _read(Described(joint), stamps(joint.files))


@lru_cache(maxsize=1)
def _read(described: Described[MatricesJoint], changed: Stamps) -> Imported:
    joint = described.joint
    m = joint.matrices
    length, force = LENGTHS[m.length_unit], FORCES[m.force_unit]
    energy = force * length / joint.width
    stiffness, mass, numbering = _matrices(joint)
    check_matrices(stiffness, mass, numbering, joint)
    n = stiffness.shape[0]
    pairs, relative = pairs_of(joint, n, numbering)
    dimension = relative.shape[0] // pairs.count
    if dimension == 3:
        check_spatial(joint)
    loads = {each.name: _vector(each, joint, n, numbering) for each in joint.preload}
    preload = {}
    for each in joint.preload:
        # an amplitude is the force that presses, however the vector is scaled
        size = 0.5 * float(np.abs(loads[each.name]).sum())
        preload[each.name] = each.force * size
        loads[each.name] = loads[each.name] * (length / size)
    for port in joint.port:
        if port.kind == "base":
            loads[port.name] = _base(port, joint, mass, numbering) * (force / joint.width)
            continue
        factor = length if port.kind == "force" else 1.0
        loads[port.name] = _vector(port, joint, n, numbering) * factor
    for output in (each for each in joint.measured if not each.reacts):
        loads[output.port] = _output(output, joint, relative, pairs, numbering) * length
        if output.measured.motion == "rotation":
            loads[output.port] /= length
    stiffness, mass = (energy * stiffness).tocsc(), (energy * mass).tocsc()
    modes = zero_modes(stiffness, mass, numbering)
    given = None if m.motions is None else read_matrix(m.motions).matrix.toarray()
    if given is not None and m.motions is not None:
        check_size_of_motions(given, m.motions, n)
    supports = None
    if m.supports is not None:
        supports = _whole(read_matrix(m.supports), joint, n, m.supports)
    reactions = {}
    for output in (each for each in joint.measured if each.reacts):
        size = force / joint.width * (length if output.quantity == "reaction moment" else 1.0)
        row, inertia = _held_by(output, joint, n, numbering, supports)
        loads[output.port] = size * row
        reactions[output.port] = Reaction(size * inertia, np.zeros(relative.shape[0]))
    structure = Structure(
        stiffness=stiffness,
        mass=mass,
        interface=Interface(pairs.position, pairs.area, (length * relative).tocsr(), dimension),
        loads=loads,
        free=np.arange(n),
        motions=modes.shapes if given is None else given,
        supports=None if supports is None else (energy * supports).tocsc(),
        reactions=reactions,
    )
    cautions = check_motions(structure, modes, numbering, pairs, joint)
    return Imported(
        structure,
        pairs,
        numbering,
        preload,
        modes.names,
        modes.first,
        tuple(cautions),
        facts=tuple(width_said(joint)) if dimension == 3 else (),
        damping=None if m.damping is None else (energy * _damping(joint, n)).tocsc(),
    )


def _held_by(
    output: VectorOutput,
    joint: MatricesJoint,
    dofs: int,
    numbering: Numbering | None,
    supports: sp.csc_matrix | None,
) -> tuple[Array, Array]:
    """Rows s and m of a reaction ``s^T x + m^T x''`` in units of the file: of what is held ``K e`` and
    ``M e``, of springs ``-K_s e``."""
    if output.stiffness_row is not None:
        row = _read_vector(output.stiffness_row, dofs, numbering)
        none = output.mass_row is None
        return row, np.zeros(dofs) if none else _read_vector(str(output.mass_row), dofs, numbering)
    assert supports is not None
    row = -np.asarray(supports @ _vector(output, joint, dofs, numbering))
    if not row.any():
        raise InputError(f"output {output.name!r}: no spring of matrices.supports holds it")
    return row, np.zeros(dofs)


def _damping(joint: MatricesJoint, dofs: int) -> sp.csc_matrix:
    """The damping matrix.

    Raises
    ------
    InputError
        Where it is of another size or not symmetric.
    """
    source = joint.matrices.damping
    assert source is not None
    where = f"matrices.damping: {source}"
    K, C = read_matrix(joint.matrices.stiffness), read_matrix(source)
    if C.labels is not None and K.labels is not None:
        C = ordered(C, K.labels)
    matrix = _whole(C, joint, dofs, where)
    off, largest = abs(matrix - matrix.T).max(), abs(matrix).max()
    if off > ASYMMETRIC * largest:
        raise InputError(
            f"{where}: is not symmetric by {off / largest:.2g} of its largest entry: gyroscopic and "
            "circulatory terms are not taken; is it the damping matrix?"
        )
    return matrix


def _matrices(joint: MatricesJoint) -> tuple[sp.csc_matrix, sp.csc_matrix, Numbering | None]:
    """Stiffness and mass in one order of the degrees of freedom, and that order."""
    m = joint.matrices
    K, M = read_matrix(m.stiffness), read_matrix(m.mass)
    if K.labels is not None and M.labels is not None:
        labels: tuple[Label, ...] = tuple(sorted({*K.labels, *M.labels}))
        K, M = ordered(K, labels), ordered(M, labels)
    n = K.matrix.shape[0]
    for what, found, source in (("stiffness", K, m.stiffness), ("mass", M, m.mass)):
        rows, columns = found.matrix.shape
        if rows != columns:
            raise InputError(f"matrices.{what}: {source} is {rows} by {columns}, and not square")
        if rows != n:
            raise InputError(
                f"matrices.mass: {source} is {rows} by {rows}, and the stiffness {n} by {n}: both "
                "must be of the same degrees of freedom"
            )
    stiffness = _whole(K, joint, n, f"matrices.stiffness: {m.stiffness}")
    mass = _whole(M, joint, n, f"matrices.mass: {m.mass}")
    numbering = None if K.labels is None else Numbering(K.labels)
    if m.dofs is not None:
        numbering = numbering_of(m.dofs, n)
    if m.nodes is not None:
        if numbering is None:
            raise InputError("matrices.nodes: nothing says which nodes the rows of K are: see dofs")
        numbering = with_coordinates(numbering, read_table(m.nodes), m.nodes)
    return stiffness, mass, numbering


def numbering_of(source: str, dofs: int) -> Numbering:
    """The degrees of freedom of a description's table; raises `InputError` where it does not fit."""
    return numbering_of_table(read_table(source), source, dofs)


def _whole(found: Found, joint: MatricesJoint, dofs: int, where: str) -> sp.csc_matrix:
    """Both triangles of a matrix.

    Raises
    ------
    InputError
        Where only one is there, and nothing says so; or it is of another size.
    """
    if found.matrix.shape != (dofs, dofs):
        rows, columns = found.matrix.shape
        raise InputError(f"{where}: is {rows} by {columns}, the stiffness {dofs} by {dofs}")
    matrix = found.matrix
    if found.stored is None and joint.matrices.stored == "full" and dofs > 1:
        upper, lower = sp.triu(matrix, 1).nnz, sp.tril(matrix, -1).nnz
        if bool(upper) != bool(lower):
            part = "upper" if upper else "lower"
            raise InputError(
                f"{where}: only the {part} triangle is there: write matrices.stored = "
                f'"{part}", or store the whole matrix'
            )
    return found.whole(joint.matrices.stored)


def _vector(entry: Vector, joint: MatricesJoint, dofs: int, numbering: Numbering | None) -> Array:
    """Unit loads on the degrees of freedom."""
    if entry.vector is not None:
        return _read_vector(entry.vector, dofs, numbering)
    name = getattr(entry, "name", "")
    if numbering is None:
        raise InputError(
            f"{name}: node {entry.node} is given, and nothing says which degree of freedom belongs to it: "
            "give matrices.dofs"
        )
    assert entry.node is not None
    assert entry.direction is not None
    unit = np.zeros(dofs)
    unit[numbering.row(entry.node, entry.direction, name)] = 1.0
    return unit


def _read_vector(source: str, dofs: int, numbering: Numbering | None) -> Array:
    """A vector by its entries, or from a table with columns node, direction and value."""
    if Path(split_source(source)[0]).suffix.lower() not in LISTED:
        return read_vector(source, dofs)
    table = read_table(source)
    for column in ("node", "direction", "value"):
        if column not in table:
            there = ", ".join(table)
            raise InputError(f"{source}: the column {column} is missing; there is {there}")
    if numbering is None:
        raise InputError(
            f"{source}: is given by nodes, and nothing says which degrees of freedom are theirs: give "
            "matrices.dofs"
        )
    vector = np.zeros(dofs)
    rows = zip(table["node"], table["direction"], table["value"], strict=True)
    for node, direction, value in rows:
        word = NAMES.get(int(direction), "")
        if word:
            vector[numbering.row(int(node), word, source)] += value
    if not vector.any():
        raise InputError(f"{source}: holds nothing but zeros")
    return vector


def _base(
    port: Vector, joint: MatricesJoint, mass: sp.csc_matrix, numbering: Numbering | None
) -> Array:
    """Inertia of everything per unit acceleration of the base, in force s²/length."""
    if port.vector is not None:
        return _read_vector(port.vector, mass.shape[0], numbering)
    if numbering is None or port.direction is None:
        raise InputError("a base along a direction needs matrices.dofs, or give its vector")
    return np.asarray(-(mass @ numbering.translation(port.direction)))


def _output(
    output: VectorOutput,
    joint: MatricesJoint,
    relative: sp.csr_matrix,
    pairs: Pairs,
    numbering: Numbering | None,
) -> Array:
    """What an output is of the degrees of freedom, in the unit of length of the file."""
    if not output.across:
        return _vector(output, joint, relative.shape[1], numbering)
    d = relative.shape[0] // pairs.count
    pair = _pair_of(output, pairs, d)
    if output.measured.motion == "gap":
        return -relative[d * pair].toarray().ravel()
    if (output.tangent is None) != (d == 2):
        needed = "give tangent, 1 or 2" if d == 3 else "remove tangent, in the plane there is one"
        raise InputError(f"output {output.name!r}: a slip: {needed}")
    return relative[d * pair + (output.tangent or 1)].toarray().ravel()


def _pair_of(output: VectorOutput, pairs: Pairs, dimension: int) -> int:
    """The pair that a slip or a gap is of."""
    if output.pair is not None:
        if output.pair > pairs.count:
            raise InputError(
                f"output {output.name!r}: pair = {output.pair}: there are {pairs.count} pairs"
            )
        return int(np.flatnonzero(pairs.rows == output.pair)[0])
    assert output.x is not None
    half = 0.5 * np.ptp(pairs.position)
    if not pairs.position[0] - half <= output.x <= pairs.position[-1] + half:
        raise InputError(
            f"output {output.name!r}: x = {output.x:g} m lies off the interface, which reaches from "
            f"{pairs.position[0]:g} to {pairs.position[-1]:g} m"
        )
    away = np.abs(pairs.position - output.x)
    near = np.flatnonzero(away <= away.min() + 1e-9 * half)
    if dimension == 3 and len(near) > 1:
        raise InputError(
            f"output {output.name!r}: {len(near)} pairs are as near to x = {output.x:g} m: give pair, the "
            "row of one in the table"
        )
    return int(np.argmin(away))
