"""The contact pairs of a joint from files: their table, and the matrix of their relative displacements."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from microslip.brief import Brief
from microslip.describe.matrices import FORCES, LENGTHS, MatricesJoint
from microslip.errors import InputError
from microslip.model.mortar.segments import tangents_of
from microslip.model.numbering import Numbering
from microslip.model.readers.files import Table, read_matrix, read_table
from microslip.typing import Array, Indices, Mask

FEWEST = 1
"""Pairs that an interface has at least."""

UNIT = 1e-6
"""A normal may differ so much from the length one."""

STIFFNESSES = ("normal_stiffness", "tangential_stiffness")
"""Columns of the stiffness of each pair, normal first."""


@dataclass(frozen=True, repr=False)
class Pairs(Brief):
    """What is known of the contact pairs, in ascending order of their position. SI units.

    Attributes
    ----------
    position : (m,) array
    area : (m,) array
        Per metre of width, m.
    gap : (m,) array
        Initial distance of the two sides, m; negative where they overlap.
    friction : (m,) array or None
    stiffness : mapping of str to (m,) array
        Normal and tangential stiffness per area, Pa/m, where the table has them.
    normals : (m, d) array or None
        From the first to the second side.
    rows : (m,) int array
        Row of each in the table, from 1.
    tangents : (m, d - 1, d) array, optional
        Directions of the tangential components, where normals are known.
    """

    position: Array
    area: Array
    gap: Array
    friction: Array | None
    stiffness: dict[str, Array]
    normals: Array | None
    rows: Indices
    tangents: Array | None = None

    @property
    def count(self) -> int:
        """Number of pairs."""
        return len(self.position)


def pairs_of(
    joint: MatricesJoint, dofs: int, numbering: Numbering | None
) -> tuple[Pairs, sp.csr_matrix]:
    """The pairs of a description, and B in the units of its files: two rows a pair, in space three.

    Raises
    ------
    InputError
        Where table or matrix cannot be those of contact pairs.
    """
    source, m = joint.interface.pairs, joint.matrices
    table = read_table(source)
    _check_columns(table, source)
    by_nodes = joint.interface.by_nodes
    spatial = by_nodes and "nz" in table and numbering is not None and numbering.spatial
    given = None if by_nodes else _given_maps(joint, len(table["position"]), dofs)
    if given is not None:
        spatial = given.shape[0] == 3 * len(table["position"])
    if not spatial and "nz" in table and table["nz"].any():
        raise InputError(f"{source}: a normal has a component nz, and {NOT_IN_SPACE[by_nodes]}")
    length = LENGTHS[m.length_unit]
    order = np.argsort(table["position"], kind="stable")
    column = {name: values[order] for name, values in table.items()}
    stiffness = FORCES[m.force_unit] / length**3
    frames = _frames(column, source, spatial, by_nodes)
    pairs = Pairs(
        position=length * column["position"],
        area=length**2 / joint.width * column["area"],
        gap=length * column.get("gap", np.zeros(len(order))),
        friction=column.get("friction"),
        stiffness={name: stiffness * column[name] for name in STIFFNESSES if name in column},
        normals=None if frames is None else frames[0],
        rows=order + 1,
        tangents=None if frames is None else frames[1],
    )
    _check_values(pairs, source, spatial)
    if given is None:
        return pairs, _by_nodes(column, pairs, numbering, dofs, source)
    d = 3 if spatial else 2
    return pairs, given[(d * order[:, None] + np.arange(d)).ravel()].tocsr()


NOT_IN_SPACE = {
    True: "no degree of freedom is along z: pairs in space need those",
    False: "B has two rows a pair: in space it has three",
}
"""Why pairs are not in space, by whether they are given by nodes."""


def _check_columns(table: Table, source: str) -> None:
    for column in ("position", "area"):
        if column not in table:
            there = ", ".join(table)
            raise InputError(f"{source}: the column {column} is missing; there is {there}")


def _check_values(pairs: Pairs, source: str, spatial: bool) -> None:
    """Raise `InputError` for the first row whose values no pair can have."""
    rules: tuple[tuple[str, Array | None, Callable[[Array], Mask], str], ...] = (
        ("area", pairs.area, lambda a: a > 0, "must be greater than 0"),
        ("friction", pairs.friction, lambda a: (a >= 0) & (a <= 2), "must be 0 to 2"),
        *(
            (name, values, lambda a: a > 0, "must be greater than 0")
            for name, values in pairs.stiffness.items()
        ),
    )
    for name, values, fits, allowed in rules:
        if values is None or fits(values).all():
            continue
        k = int(np.flatnonzero(~fits(values))[0])
        raise InputError(f"{source}: row {pairs.rows[k]}, {name}: {allowed}")
    apart = np.diff(pairs.position)
    if not spatial and pairs.count > 1 and not (apart > 1e-12 * np.ptp(pairs.position)).all():
        k = int(np.argmin(apart))
        raise InputError(
            f"{source}: rows {pairs.rows[k]} and {pairs.rows[k + 1]} have the same position: it must tell "
            "the pairs apart along the interface"
        )


def _frames(
    column: Table, source: str, spatial: bool, by_nodes: bool
) -> tuple[Array, Array] | None:
    """(m, d) normals and (m, d - 1, d) tangents that a table has, or that its pairs of nodes must have.

    In space the first tangent is given, tx, ty, tz, or by the rule of `tangents_of`, and the second is
    ``n × t_1``. Beside a matrix B normals are known where both are given.
    """
    along = ("nx", "ny", "nz") if spatial else ("nx", "ny")
    ways = ("tx", "ty", "tz") if spatial and any(k in column for k in ("tx", "ty", "tz")) else ()
    if not by_nodes and not (ways and all(name in column for name in (*along, *ways))):
        return None
    wanted = (*(("first", "second") if by_nodes else ()), *along, *ways)
    missing = [name for name in wanted if name not in column]
    if missing:
        raise InputError(
            f"{source}: the column {missing[0]} is missing: without interface.relative the table names the "
            f"nodes of each pair, first and second, and its normal {', '.join(along)}"
            + (f", and here its tangent {', '.join(ways)}" if ways else "")
        )
    normals = _unit(column, along, "normal", source)
    if not ways:
        return normals, tangents_of(normals)
    first = _unit(column, ways, "tangent", source)
    slant = np.abs(np.sum(normals * first, axis=1))
    if (slant > UNIT).any():
        k = int(np.argmax(slant))
        raise InputError(
            f"{source}: position {column['position'][k]:g}: the tangent is not at right angles to the "
            f"normal: their product is {slant[k]:.3g}"
        )
    return normals, np.stack([first, np.cross(normals, first)], axis=1)


def _unit(column: Table, names: Sequence[str], what: str, source: str) -> Array:
    """(m, d) vectors of a table that must have the length one."""
    vectors = np.column_stack([column[name] for name in names])
    lengths = np.linalg.norm(vectors, axis=1)
    if (np.abs(lengths - 1) > UNIT).any():
        k = int(np.argmax(np.abs(lengths - 1)))
        raise InputError(
            f"{source}: position {column['position'][k]:g}: the {what} has the length {lengths[k]:.6g} "
            "and must have 1"
        )
    return np.asarray(vectors / lengths[:, None])


def _by_nodes(
    column: Table, pairs: Pairs, numbering: Numbering | None, dofs: int, source: str
) -> sp.csr_matrix:
    """B of pairs of nodes: with the normal n from the first to the second, and tangents t,

    ``v_n = n · (u_1 - u_2)``,   ``v_t = t · (u_2 - u_1)``;   in the plane ``t = (n_y, -n_x)``.

    A component that neither node has is held on both sides, as on a plane of symmetry in space.
    """
    if numbering is None:
        raise InputError(
            f"{source}: the pairs are given by nodes, and nothing says which degrees of freedom are "
            "theirs: give matrices.dofs"
        )
    assert pairs.normals is not None
    assert pairs.tangents is not None
    frames = np.concatenate([-pairs.normals[:, None], pairs.tangents], axis=1)
    d = frames.shape[1]
    rows, columns, values, seen = [], [], [], set()
    for k, frame in enumerate(frames):
        where = f"{source}: row {pairs.rows[k]}"
        nodes = int(column["first"][k]), int(column["second"][k])
        if nodes[0] == nodes[1]:
            raise InputError(f"{where}: node {nodes[0]} is both sides of the pair")
        if frozenset(nodes) in seen:
            raise InputError(f"{where}: nodes {nodes[0]} and {nodes[1]} are a pair already")
        seen.add(frozenset(nodes))
        for axis, direction in enumerate(("x", "y", "z")[:d]):
            if not frame[:, axis].any() or (d == 3 and numbering.held(nodes, direction)):
                continue
            for node, sign in zip(nodes, (-1.0, 1.0), strict=True):
                own = numbering.row(node, direction, where)
                rows += (d * k + np.arange(d)).tolist()
                columns += [own] * d
                values += (sign * frame[:, axis]).tolist()
    matrix = sp.csr_matrix((values, (rows, columns)), shape=(d * pairs.count, dofs))
    matrix.eliminate_zeros()
    return matrix


def _given_maps(joint: MatricesJoint, count: int, dofs: int) -> sp.csr_matrix:
    """B in the order of the table, of the matrix or the two matrices that a description names."""
    given = joint.interface
    if given.relative is not None:
        return _map(given.relative, "interface.relative", (2, 3), count, dofs)
    assert given.normal is not None
    assert given.tangential is not None
    normal = _map(given.normal, "interface.normal", (1,), count, dofs)
    tangential = _map(given.tangential, "interface.tangential", (1, 2), count, dofs)
    each = tangential.shape[0] // count
    pair = np.arange(count)[:, None]
    rows = np.hstack([pair, count + each * pair + np.arange(each)])
    return sp.vstack([normal, tangential]).tocsr()[rows.ravel()]


def _map(source: str, key: str, rows_each: Sequence[int], count: int, dofs: int) -> sp.csr_matrix:
    """A matrix with one of some numbers of rows a pair."""
    matrix = read_matrix(source).matrix.tocsr()
    matrix.eliminate_zeros()
    rows, columns = matrix.shape
    seen = f"{key}: {source} is {rows} by {columns}"
    shape = next(
        (
            (each * count, dofs)
            for each in rows_each
            if each * count in (rows, columns) and dofs in (rows, columns)
        ),
        (rows_each[0] * count, dofs),
    )
    if (rows, columns) == shape:
        each = rows // count
        _check_rows(matrix, f"{key}: {source}", each, rows_each[1:] == (each,))
        return matrix
    wanted = f"{shape[0]} by {shape[1]}, a row per component and a column per degree of freedom"
    if (columns, rows) == shape:
        raise InputError(f"{seen}: it is transposed; it must be {wanted}")
    if columns in (shape[1] + 1, shape[1] - 1):
        hint = ": do its indices count from 1? Here they count from 0"
    elif columns > shape[1]:
        hint = (
            ": does it count degrees of freedom that supports hold? They are not in the stiffness"
        )
    else:
        hint = ""
    if len(rows_each) == 2 and rows == rows_each[1] * count:
        wanted = wanted.replace(f"{shape[0]} by", f"{rows} by", 1)
    elif len(rows_each) == 2:
        wanted += f", or {rows_each[1] * count} rows in space"
    raise InputError(f"{seen}; it must be {wanted}{hint}")


def _check_rows(matrix: sp.csr_matrix, where: str, each: int, spatial: bool) -> None:
    """Raise `InputError` where a pair cannot move; in space supports may hold one tangential direction."""
    empty = (np.diff(matrix.indptr) == 0).reshape(-1, each)
    if spatial:
        empty[:, -2:] &= empty[:, -2:].all(axis=1, keepdims=True)
    found = np.flatnonzero(empty)
    if len(found):
        raise InputError(
            f"{where}, row {found[0] + 1} of {empty.size} is empty: this pair would not move at all"
        )
