"""Whether contact pairs are where their degrees of freedom are, as far as nodes and coordinates are known."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from microslip.describe.matrices import LENGTHS, MatricesJoint
from microslip.errors import InputError
from microslip.model.numbering import Numbering
from microslip.model.pair_table import Pairs
from microslip.model.readers.found import DIRECTIONS
from microslip.typing import Array

APART = 0.5
"""Of the distance of neighbouring pairs, how far along the interface the two nodes of one may be apart."""


def check_pairs(
    relative: sp.csr_matrix, numbering: Numbering | None, pairs: Pairs, joint: MatricesJoint
) -> None:
    """Raise `InputError` for the first pair whose relative displacement cannot be what it is said to be.

    Parameters
    ----------
    relative : (2 m, n) sparse
        B.
    numbering : Numbering or None
        Without it nothing can be said.
    pairs : Pairs
    joint : MatricesJoint
    """
    if numbering is None:
        return
    given = joint.interface
    source = given.relative or given.normal or given.pairs
    _move_together(relative, numbering, pairs, source)
    if numbering.x is None or numbering.y is None or pairs.count < 2:
        return
    length = LENGTHS[joint.matrices.length_unit]
    places = length * np.column_stack([numbering.x, numbering.y])
    if given.by_nodes:
        _face_each_other(relative, places, pairs, source)
    else:
        _point_across(relative, numbering, places, pairs, source)


def _move_together(
    relative: sp.csr_matrix, numbering: Numbering, pairs: Pairs, source: str
) -> None:
    """A translation of everything moves no sides of a pair apart."""
    size = abs(relative).sum(axis=1).max()
    for direction in ("x", "y"):
        moved = np.asarray(relative @ numbering.translation(direction)).reshape(-1, 2)
        worst = int(np.argmax(np.abs(moved).max(axis=1)))
        if np.abs(moved[worst]).max() > 1e-6 * size:
            raise InputError(
                f"{source}: row {pairs.rows[worst]}: the sides of this pair part when everything moves "
                f"along {direction}: are the columns shifted by one, because indices count from 1, or is "
                "one side held by a support and missing?"
            )


def _face_each_other(relative: sp.csr_matrix, places: Array, pairs: Pairs, source: str) -> None:
    """The two nodes of a pair are not further apart along the interface than pairs are."""
    assert pairs.normals is not None
    tangents = np.column_stack([pairs.normals[:, 1], -pairs.normals[:, 0]])
    for k, along in enumerate(tangents):
        row = relative[2 * k]
        apart = abs(float(np.ptp(places[row.indices] @ along)))
        spacing = np.abs(np.delete(pairs.position, k) - pairs.position[k]).min()
        if apart > APART * spacing:
            raise InputError(
                f"{source}: row {pairs.rows[k]}: its nodes are {apart:.3g} m apart along the interface, "
                f"and pairs are {spacing:.3g} m apart: they must face each other; is a node, or the "
                "normal, wrong?"
            )


def _point_across(
    relative: sp.csr_matrix, numbering: Numbering, places: Array, pairs: Pairs, source: str
) -> None:
    """Tangential components are along the interface, from pair to pair, and normal ones across it."""
    each = 2 * np.arange(pairs.count)
    normal, tangent = (_directions(relative[each + c], numbering) for c in (0, 1))
    centre = np.array([places[relative[2 * k].indices].mean(axis=0) for k in range(pairs.count)])
    along = np.gradient(centre, axis=0)
    across = np.abs((normal * along).sum(axis=1)) > np.abs((tangent * along).sum(axis=1))
    if across.sum() > 0.5 * pairs.count:
        k = int(np.flatnonzero(across)[0])
        raise InputError(
            f"{source}: row {pairs.rows[k]}: the normal component of this pair is along the interface, and "
            "the tangential one across it: are the columns shifted by one, because indices count from 1, "
            "or the two rows of a pair exchanged?"
        )


def _directions(rows: sp.csr_matrix, numbering: Numbering) -> Array:
    """(m, 2) directions in which rows of B measure: those of the node that counts most in each."""
    x, y = (numbering.direction == DIRECTIONS[name] for name in ("x", "y"))
    found = np.zeros((rows.shape[0], 2))
    for k in range(rows.shape[0]):
        span = slice(rows.indptr[k], rows.indptr[k + 1])
        columns, values = rows.indices[span], rows.data[span]
        node = numbering.labels[columns[np.argmax(np.abs(values))]][0]
        own = np.array([numbering.labels[c][0] == node for c in columns])
        found[k] = values[own & x[columns]].sum(), values[own & y[columns]].sum()
    return found
