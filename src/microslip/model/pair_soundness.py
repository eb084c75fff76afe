"""Whether contact pairs are where their degrees of freedom are, as far as nodes and coordinates are known."""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp
import scipy.spatial

from microslip.describe.matrices import LENGTHS, MatricesJoint
from microslip.errors import InputError
from microslip.model.numbering import Numbering
from microslip.model.pair_sense import check_sense
from microslip.model.pair_table import Pairs
from microslip.model.readers.found import DIRECTIONS
from microslip.typing import Array, Indices

APART = 0.5
"""Of the distance of neighbouring pairs, how far along the interface the two nodes of one may be apart."""

SLANTED = 1e-3
"""How far the directions of a pair may be from right angles and one length."""

AXES = ("x", "y", "z")


def check_pairs(
    relative: sp.csr_matrix,
    stiffness: sp.csc_matrix,
    numbering: Numbering | None,
    pairs: Pairs,
    joint: MatricesJoint,
) -> None:
    """Raise `InputError` for the first pair whose relative displacement cannot be what it is said to be.

    Parameters
    ----------
    relative : (d m, n) sparse
        B.
    stiffness : (n, n) sparse
        It says which sides are of one body.
    numbering : Numbering or None
        Without it nothing can be said.
    pairs : Pairs
    joint : MatricesJoint
    """
    if numbering is None:
        return
    given = joint.interface
    source = given.relative or given.normal or given.pairs
    d = relative.shape[0] // pairs.count
    _move_together(relative, numbering, pairs, source)
    if d == 3:
        _at_right_angles(relative, numbering, pairs, source)
    places = numbering.coordinates(d)
    if pairs.count < 2:
        return
    if places is not None:
        places = LENGTHS[joint.matrices.length_unit] * places
        if given.by_nodes:
            _face_each_other(relative, places, pairs, source)
        else:
            _point_across(relative, numbering, places, pairs, source)
    check_sense(relative, stiffness, numbering, places, pairs, source)


def _move_together(
    relative: sp.csr_matrix, numbering: Numbering, pairs: Pairs, source: str
) -> None:
    """A translation of everything moves no sides of a pair apart."""
    size = abs(relative).sum(axis=1).max()
    for direction in AXES if numbering.spatial else AXES[:2]:
        moved = np.asarray(relative @ numbering.translation(direction)).reshape(pairs.count, -1)
        worst = int(np.argmax(np.abs(moved).max(axis=1)))
        if np.abs(moved[worst]).max() > 1e-6 * size:
            raise InputError(
                f"{source}: row {pairs.rows[worst]}: the sides of this pair part when everything moves "
                f"along {direction}: are the columns shifted by one, because indices count from 1, or is "
                "one side held by a support and missing?"
            )


def _face_each_other(relative: sp.csr_matrix, places: Array, pairs: Pairs, source: str) -> None:
    """The two nodes of a pair are not further apart along the interface than pairs are."""
    assert pairs.tangents is not None
    d = relative.shape[0] // pairs.count
    nodes = [relative[d * k : d * (k + 1)].indices for k in range(pairs.count)]
    centre = np.array([places[own].mean(axis=0) for own in nodes])
    for k, along in enumerate(pairs.tangents):
        apart = float(np.linalg.norm(np.ptp(places[nodes[k]] @ along.T, axis=0)))
        if d == 2:
            away = np.abs(np.delete(pairs.position, k) - pairs.position[k])
        else:
            away = np.linalg.norm(np.delete(centre, k, axis=0) - centre[k], axis=1)
        spacing = away.min()
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
    d = relative.shape[0] // pairs.count
    frames = _frames(relative, numbering, d)
    centre = np.array([places[relative[d * k].indices].mean(axis=0) for k in range(pairs.count)])
    along = np.gradient(centre, axis=0) if d == 2 else centre[_nearest(centre)] - centre
    seen = np.einsum("mij,mj->mi", frames, along)
    across = np.abs(seen[:, 0]) > np.linalg.norm(seen[:, 1:], axis=1)
    if across.sum() > 0.5 * pairs.count:
        k = int(np.flatnonzero(across)[0])
        raise InputError(
            f"{source}: row {pairs.rows[k]}: the normal component of this pair is along the interface, and "
            "the tangential one across it: are the columns shifted by one, because indices count from 1, "
            "or the two rows of a pair exchanged?"
        )


def _nearest(points: Array) -> Indices:
    """The other point that is nearest to each."""
    _, near = scipy.spatial.cKDTree(points).query(points, k=2)
    return np.asarray(near[:, 1])


def _at_right_angles(
    relative: sp.csr_matrix, numbering: Numbering, pairs: Pairs, source: str
) -> None:
    """The three directions of a pair are at right angles and of one length: friction is alike all round."""
    frames = _frames(relative, numbering, 3, whole=True)
    size = np.einsum("mij,mij->m", frames, frames) / 3
    slant = np.abs(frames @ frames.transpose(0, 2, 1) - size[:, None, None] * np.eye(3))
    with np.errstate(invalid="ignore", divide="ignore"):
        off = np.nan_to_num(slant.max(axis=(1, 2)) / size)
    k = int(np.argmax(off))
    if off[k] > SLANTED:
        raise InputError(
            f"{source}: row {pairs.rows[k]}: the normal and the two tangential directions of this pair are "
            f"not at right angles, or not of one length, by {off[k]:.2g}: are the columns shifted by one, "
            "because indices count from 1, rows exchanged between pairs, or tangents not of unit length?"
        )


def _frames(relative: sp.csr_matrix, numbering: Numbering, d: int, *, whole: bool = False) -> Array:
    """(m, d, d) directions in which the rows of B of a pair measure: those of the node that counts most.

    With `whole` of nodes alone that move in all directions; zeros where a pair has none.
    """
    axis = np.full(len(numbering.labels), -1)
    for k, name in enumerate(AXES[:d]):
        axis[numbering.direction == DIRECTIONS[name]] = k
    found = np.zeros((relative.shape[0] // d, d, d))
    for pair in range(len(found)):
        blocks: dict[int, Array] = {}
        rows = relative[d * pair : d * (pair + 1)].tocoo()
        for row, column, value in zip(rows.row, rows.col, rows.data, strict=True):
            if axis[column] < 0:
                continue
            node = numbering.labels[column][0]
            blocks.setdefault(node, np.zeros((d, d)))[row, axis[column]] += value
        if whole:
            blocks = {node: block for node, block in blocks.items() if _moves(numbering, node)}
        if blocks:
            found[pair] = max(blocks.values(), key=np.linalg.norm)
    return found


def _moves(numbering: Numbering, node: int) -> bool:
    """Whether a node moves along all axes."""
    return all((node, DIRECTIONS[name]) in numbering.places for name in AXES)
