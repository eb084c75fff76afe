"""Gaps of contact pairs from a table of measured distances.

Points are projected onto the mean tangents of the interface, or where it turns, in the plane, onto the
tangent of the nearest pair; between them gaps are linear: along the interface in the plane, on a Delaunay
triangulation in space.
"""

from __future__ import annotations

import numpy as np
import scipy.spatial
from scipy.interpolate import LinearNDInterpolator

from microslip.errors import InputError
from microslip.model.mortar.coupling import MortarCoupling
from microslip.model.mortar.positions import turns
from microslip.model.readers.files import Table, read_table
from microslip.typing import Array

NEAR = 1e-6
"""Of the size of an interface: a pair so far off the table is on its edge."""

CLOSED = 2.0
"""An interface is closed where its ends are no farther apart than so many pairs."""


def gaps_from(source: str, coupling: MortarCoupling, length: float) -> Array:
    """(m,) gaps of the pairs of an interface, m.

    Parameters
    ----------
    source : str
        Table with columns x, y (and z) and gap.
    coupling : MortarCoupling
    length : float
        Unit of the table, m.

    Raises
    ------
    InputError
        Where a column is missing, a value is none, or pairs lie outside of the points.
    """
    table = read_table(source)
    d = coupling.dimension
    points = length * np.column_stack([_column(table, name, source) for name in "xyz"[:d]])
    gap = length * _column(table, "gap", source)
    tangents = coupling.tangents.mean(axis=0)
    measured, wanted = points @ tangents.T, coupling.points @ tangents.T
    if turns(coupling.tangents):
        measured, wanted = _around(points, coupling), coupling.position[:, None]
        gap = np.resize(gap, len(measured))
    found = _along(measured, gap, wanted) if d == 2 else _over(measured, gap, wanted, source)
    lost = np.flatnonzero(np.isnan(found))
    for pair in lost:
        apart = np.linalg.norm(measured - wanted[pair], axis=1)
        if apart.min() <= NEAR * np.ptp(wanted, axis=0).max():
            found[pair] = gap[np.argmin(apart)]
    lost = np.flatnonzero(np.isnan(found))
    if len(lost):
        at = ", ".join(f"{x:.4g}" for x in coupling.points[lost[0]])
        raise InputError(
            f"{source}: {len(lost)} of {coupling.pairs} contact pairs lie outside of its points, the first "
            f"at ({at}) m: measure farther, and are its lengths in mesh.length_unit?"
        )
    return found


def _around(points: Array, coupling: MortarCoupling) -> Array:
    """(k, 1) positions of points along an interface that turns; of a closed one three times, a turn apart."""
    nearest = scipy.spatial.cKDTree(coupling.points).query(points)[1]
    aside = points - coupling.points[nearest]
    found = coupling.position[nearest] + np.einsum("kd,kd->k", aside, coupling.tangents[nearest, 0])
    ends = np.linalg.norm(coupling.points[0] - coupling.points[-1])
    step = np.diff(coupling.position).max()
    if ends > CLOSED * step:
        return found[:, None]
    length = float(np.ptp(coupling.position) + ends)
    return np.concatenate([found - length, found, found + length])[:, None]


def _column(table: Table, name: str, source: str) -> Array:
    if name not in table:
        raise InputError(f"{source}: the column {name} is missing; there is {', '.join(table)}")
    values = np.asarray(table[name], dtype=float)
    if not np.isfinite(values).all():
        raise InputError(f"{source}: the column {name} has values that are not numbers")
    return values


def _along(measured: Array, gap: Array, wanted: Array) -> Array:
    order = np.argsort(measured[:, 0])
    return np.interp(wanted[:, 0], measured[order, 0], gap[order], left=np.nan, right=np.nan)


def _over(measured: Array, gap: Array, wanted: Array, source: str) -> Array:
    spread = measured - measured.mean(axis=0)
    if len(measured) < 3 or np.linalg.matrix_rank(spread, tol=NEAR * np.abs(spread).max()) < 2:
        raise InputError(f"{source}: its points lie on one line, and the interface is a surface")
    return np.asarray(LinearNDInterpolator(measured, gap)(wanted))
