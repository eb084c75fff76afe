"""The contact pairs of a joint from files: their table, and the matrix of their relative displacements."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from microslip.brief import Brief
from microslip.describe.matrices import FORCES, LENGTHS, MatricesJoint
from microslip.errors import InputError
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
    normals : (m, 2) array or None
        From the first to the second side.
    rows : (m,) int array
        Row of each in the table, from 1.
    """

    position: Array
    area: Array
    gap: Array
    friction: Array | None
    stiffness: dict[str, Array]
    normals: Array | None
    rows: Indices

    @property
    def count(self) -> int:
        """Number of pairs."""
        return len(self.position)


def pairs_of(
    joint: MatricesJoint, dofs: int, numbering: Numbering | None
) -> tuple[Pairs, sp.csr_matrix]:
    """The pairs of a description, and B in the units of its files, two rows a pair.

    Raises
    ------
    InputError
        Where table or matrix cannot be those of contact pairs.
    """
    source, m = joint.interface.pairs, joint.matrices
    table = read_table(source)
    _check_columns(table, source)
    length = LENGTHS[m.length_unit]
    order = np.argsort(table["position"], kind="stable")
    column = {name: values[order] for name, values in table.items()}
    stiffness = FORCES[m.force_unit] / length**3
    pairs = Pairs(
        position=length * column["position"],
        area=length**2 / m.width * column["area"],
        gap=length * column.get("gap", np.zeros(len(order))),
        friction=column.get("friction"),
        stiffness={name: stiffness * column[name] for name in STIFFNESSES if name in column},
        normals=_normals(column, source) if joint.interface.by_nodes else None,
        rows=order + 1,
    )
    _check_values(pairs, source)
    if joint.interface.by_nodes:
        return pairs, _by_nodes(column, pairs, numbering, dofs, source)
    given = _given_maps(joint, pairs.count, dofs)
    both = sp.vstack([given[0][order], given[1][order]]).tocsr()
    return pairs, both[_interleaved(pairs.count)].tocsr()


def _interleaved(count: int) -> Indices:
    """Rows of all normal and then all tangential components, pair by pair."""
    return np.column_stack([np.arange(count), count + np.arange(count)]).ravel()


def _check_columns(table: Table, source: str) -> None:
    for column in ("position", "area"):
        if column not in table:
            there = ", ".join(table)
            raise InputError(f"{source}: the column {column} is missing; there is {there}")
    if "nz" in table and table["nz"].any():
        raise InputError(f"{source}: a normal has a component nz: {SPATIAL}")


SPATIAL = (
    "pairs with two tangential directions, of three-dimensional interfaces, cannot be computed by this "
    "version: a pair has one normal and one tangential direction"
)


def _check_values(pairs: Pairs, source: str) -> None:
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
    if pairs.count > 1 and not (apart > 1e-12 * np.ptp(pairs.position)).all():
        k = int(np.argmin(apart))
        raise InputError(
            f"{source}: rows {pairs.rows[k]} and {pairs.rows[k + 1]} have the same position: it must tell "
            "the pairs apart along the interface"
        )


def _normals(column: Table, source: str) -> Array:
    missing = [name for name in ("first", "second", "nx", "ny") if name not in column]
    if missing:
        raise InputError(
            f"{source}: the column {missing[0]} is missing: without interface.relative the table names the "
            "nodes of each pair, first and second, and its normal nx, ny"
        )
    normals = np.column_stack([column["nx"], column["ny"]])
    lengths = np.hypot(*normals.T)
    if (np.abs(lengths - 1) > UNIT).any():
        k = int(np.argmax(np.abs(lengths - 1)))
        raise InputError(
            f"{source}: position {column['position'][k]:g}: the normal has the length {lengths[k]:.6g} "
            "and must have 1"
        )
    return np.asarray(normals / lengths[:, None])


def _by_nodes(
    column: Table, pairs: Pairs, numbering: Numbering | None, dofs: int, source: str
) -> sp.csr_matrix:
    """B of pairs of nodes: with the normal n from the first to the second, and t to the right of it,

    ``v_n = n · (u_1 - u_2)``,   ``v_t = t · (u_2 - u_1)``,   ``t = (n_y, -n_x)``.
    """
    if numbering is None:
        raise InputError(
            f"{source}: the pairs are given by nodes, and nothing says which degrees of freedom are "
            "theirs: give matrices.dofs"
        )
    assert pairs.normals is not None
    rows, columns, values = [], [], []
    for k, (nx, ny) in enumerate(pairs.normals):
        where = f"{source}: row {pairs.rows[k]}"
        nodes = int(column["first"][k]), int(column["second"][k])
        if nodes[0] == nodes[1]:
            raise InputError(f"{where}: node {nodes[0]} is both sides of the pair")
        for node, sign in zip(nodes, (1.0, -1.0), strict=True):
            for direction, normal, along in (("x", nx, ny), ("y", ny, -nx)):
                if normal == along == 0:
                    continue
                own = numbering.row(node, direction, where)
                rows += [2 * k, 2 * k + 1]
                columns += [own, own]
                values += [sign * normal, -sign * along]
    shape = (2 * pairs.count, dofs)
    matrix = sp.csr_matrix((values, (rows, columns)), shape=shape)
    matrix.eliminate_zeros()
    return matrix


def _given_maps(joint: MatricesJoint, count: int, dofs: int) -> tuple[sp.csr_matrix, sp.csr_matrix]:
    """Normal and tangential rows of the matrix, or the two matrices, that a description names."""
    given = joint.interface
    if given.relative is not None:
        whole = _map(given.relative, "interface.relative", (2 * count, dofs), count)
        pair = np.arange(count)
        return whole[2 * pair], whole[2 * pair + 1]
    assert given.normal is not None
    assert given.tangential is not None
    shape = (count, dofs)
    return (
        _map(given.normal, "interface.normal", shape, count),
        _map(given.tangential, "interface.tangential", shape, count),
    )


def _map(source: str, key: str, shape: tuple[int, int], count: int) -> sp.csr_matrix:
    matrix = read_matrix(source).matrix.tocsr()
    matrix.eliminate_zeros()
    rows, columns = matrix.shape
    seen = f"{key}: {source} is {rows} by {columns}"
    if (rows, columns) == shape:
        empty = np.flatnonzero(np.diff(matrix.indptr) == 0)
        if len(empty):
            raise InputError(
                f"{key}: {source}, row {empty[0] + 1} of {rows} is empty: this pair would not move at all"
            )
        return matrix
    wanted = f"{shape[0]} by {shape[1]}, a row per component and a column per degree of freedom"
    if (columns, rows) == shape:
        raise InputError(f"{seen}: it is transposed; it must be {wanted}")
    if rows == 3 * count or columns == 3 * count:
        raise InputError(f"{seen}, three rows for each of {count} pairs: {SPATIAL}")
    if columns in (shape[1] + 1, shape[1] - 1):
        hint = ": do its indices count from 1? Here they count from 0"
    elif columns > shape[1]:
        hint = (
            ": does it count degrees of freedom that supports hold? They are not in the stiffness"
        )
    else:
        hint = ""
    raise InputError(f"{seen}; it must be {wanted}{hint}")
