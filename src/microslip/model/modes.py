"""Linear normal modes of a structure, free or with contact pairs bonded.

``K phi = omega² M phi`` on the displacements that satisfy ``B_c x = 0`` for the bonded components;
modes are mass-normalised, ``phi^T M phi = 1``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import scipy.sparse.csgraph as csgraph
import scipy.sparse.linalg as spla

from microslip.brief import Brief
from microslip.errors import ModelError
from microslip.model.structure import Structure
from microslip.numerics.factors import factorise
from microslip.typing import Array, Indices


@dataclass(frozen=True, repr=False)
class LinearModes(Brief):
    """Normal modes of a linear state of the joint.

    Attributes
    ----------
    omega : (k,) array
        Circular frequencies, rad/s, ascending.
    shapes : (n, k) array
        Mass-normalised mode shapes.
    bonded : (c,) int array
        Components of the relative displacement that were held at zero.
    """

    omega: Array
    shapes: Array
    bonded: Indices

    @property
    def frequency(self) -> Array:
        """Natural frequencies, Hz."""
        return self.omega / (2 * np.pi)


class PartFactors:
    """Factors of a symmetric matrix, one for each of its connected parts.

    Bodies that touch nowhere in a matrix are parts of their own: their modes are found apart. Of parts
    that are equal to the last bit, as two beams of one kind are, one is factorised.

    Parameters
    ----------
    matrix : (n, n) sparse

    Attributes
    ----------
    parts : list of int arrays
        Degrees of freedom of each part.
    likeness : list of int
        Number of the first part that is equal to each.
    """

    def __init__(self, matrix: sp.csc_matrix) -> None:
        count, label = csgraph.connected_components(matrix, directed=False)
        # a part of a few degrees of freedom is no body
        large = count <= MOST_PARTS and np.bincount(label).min() > LEAST_PART
        self.parts: list[Indices] = (
            [np.flatnonzero(label == k) for k in range(count)]
            if large
            else [np.arange(matrix.shape[0])]
        )
        blocks = [matrix[part][:, part] for part in self.parts]
        self.likeness = likeness(blocks)
        made = {k: factorise(blocks[k]) for k in dict.fromkeys(self.likeness)}
        self._factors = [made[k] for k in self.likeness]

    def solve(self, right: Array) -> Array:
        """Solution of the whole system."""
        out = np.empty(right.shape)
        for part, factors in zip(self.parts, self._factors, strict=True):
            out[part] = factors.solve(np.ascontiguousarray(right[part]))
        return out

    def solve_part(self, number: int, right: Array) -> Array:
        """Solution of one part."""
        return self._factors[number].solve(right)

    @property
    def orders(self) -> list[Indices]:
        """Order in which the degrees of freedom of each part were eliminated."""
        return [
            part[factors.order] for part, factors in zip(self.parts, self._factors, strict=True)
        ]


def likeness(blocks: Sequence[sp.csc_matrix]) -> list[int]:
    """Number of the first of some sparse matrices that is equal to each.

    Examples
    --------
    >>> one, two = sp.identity(2, format="csc"), sp.csc_matrix(2 * np.eye(2))
    >>> likeness([one, two, one.copy(), two])
    [0, 1, 0, 1]
    """
    return [
        next(j for j in range(k + 1) if j == k or equal(blocks[j], block))
        for k, block in enumerate(blocks)
    ]


def equal(one: sp.csc_matrix, other: sp.csc_matrix) -> bool:
    """Whether two sparse matrices have the same entries, in the same places, to the last bit.

    Examples
    --------
    >>> equal(sp.identity(2, format="csc"), sp.csc_matrix(np.eye(2)))
    True
    """
    return (
        one.shape == other.shape
        and one.nnz == other.nnz
        and np.array_equal(one.indptr, other.indptr)
        and np.array_equal(one.indices, other.indices)
        and np.array_equal(one.data, other.data)
    )


MOST_PARTS, LEAST_PART = 4, 400
"""Bodies at most, and degrees of freedom of one, that are taken apart."""


def spectral_shift(structure: Structure) -> float:
    """Small positive shift sigma that makes ``K + sigma M`` regular, (rad/s)²."""
    return 1e-10 * float(structure.stiffness.diagonal().sum() / structure.mass.diagonal().sum())


def bonding(relative: sp.csr_matrix, bonded: Indices) -> sp.csc_matrix:
    """Basis T of the displacements with ``relative[bonded] @ T = 0``, by eliminating one per row.

    Each bonded row gives up its own degree of freedom, so rows must not all share the same ones. Rows
    without any, of which supports hold both sides, are bonded already.
    """
    count = relative.shape[1]
    rows = relative[bonded].tocsr()
    bonded = bonded[np.diff(rows.indptr) > 0]
    rows = rows[np.diff(rows.indptr) > 0]
    slave = np.full(len(bonded), -1)
    taken: set[int] = set()
    for k in range(len(bonded)):
        span = slice(rows.indptr[k], rows.indptr[k + 1])
        order = np.argsort(-np.abs(rows.data[span]), kind="stable")
        for j in rows.indices[span][order]:
            if int(j) not in taken:
                slave[k] = j
                taken.add(int(j))
                break
    if (slave < 0).any():
        raise ModelError("bonded contact pairs share all their degrees of freedom: bond fewer")
    master = np.setdiff1d(np.arange(count), slave)
    if len(bonded) == 0:
        return sp.identity(count, format="csc")
    # most columns of the masters are empty, and the solver would take them one by one
    rest = rows[:, master].tocsc()
    felt = np.flatnonzero(np.diff(rest.indptr))
    values = spla.splu(rows[:, slave].tocsc()).solve(-rest[:, felt].toarray())
    i, j = np.nonzero(values)
    dependent = sp.csr_matrix((values[i, j], (i, felt[j])), shape=(len(slave), len(master)))
    order = np.concatenate([master, slave])
    stacked = sp.vstack([sp.identity(len(master)), dependent]).tocsr()
    return stacked[np.argsort(order)].tocsc()


def static_shape(structure: Structure, bonded: Indices, load: str) -> Array:
    """Displacement of all degrees of freedom under a unit load with components of ``v`` bonded.

    Parameters
    ----------
    structure : Structure
    bonded : (c,) int array
    load : str
        Its name.
    """
    basis = bonding(structure.interface.relative, np.asarray(bonded, dtype=np.int64))
    stiffness = (basis.T @ structure.stiffness @ basis).tocsc()
    return np.asarray(basis @ factorise(stiffness).solve(basis.T @ structure.loads[load]))


def linear_modes(
    structure: Structure,
    bonded: Indices,
    count: int,
    align: str | None = None,
    factors: PartFactors | None = None,
) -> LinearModes:
    """Lowest modes with some components of the relative displacement bonded.

    Parameters
    ----------
    structure : Structure
    bonded : (c,) int array
        Components of ``v`` held at zero; empty for the free bodies.
    count : int
        Number of modes.
    align : str, optional
        Name of a load; every mode's sign is such that the load does positive work on it.
    factors : PartFactors, optional
        Of ``K + sigma M`` with the shift of `spectral_shift`, where nothing is bonded.
    """
    basis = bonding(structure.interface.relative, np.asarray(bonded, dtype=np.int64))
    stiffness = (basis.T @ structure.stiffness @ basis).tocsc()
    mass = (basis.T @ structure.mass @ basis).tocsc()
    shift = spectral_shift(structure)
    factors = factors or PartFactors(stiffness + shift * mass)
    values, vectors = _lowest(stiffness, mass, shift, factors, count)
    if not (np.isfinite(values).all() and np.isfinite(vectors).all()):
        raise ModelError(
            "the normal modes are not finite numbers: check the dimensions, the material and the "
            "supports, and their units"
        )
    order = np.argsort(values)
    shapes = basis @ vectors[:, order]
    shapes /= np.sqrt(np.einsum("ij,ij->j", shapes, structure.mass @ shapes))
    reference = structure.loads[align] if align else None
    for k in range(count):
        pivot = shapes[np.argmax(np.abs(shapes[:, k])), k]
        work = reference @ shapes[:, k] if reference is not None else pivot
        shapes[:, k] *= 1.0 if work >= 0 else -1.0
    omega = np.sqrt(np.maximum(values[order], 0.0))
    return LinearModes(omega, shapes, np.asarray(bonded, dtype=np.int64))


MARGIN = 6
"""Modes beyond its equal share that each of several parts is asked for first."""


def _lowest(
    stiffness: sp.csc_matrix,
    mass: sp.csc_matrix,
    shift: float,
    factors: PartFactors,
    count: int,
) -> tuple[Array, Array]:
    """The lowest eigenvalues and eigenvectors, part by part.

    A part that ends below the last one wanted is asked for more. One that is equal to another has its modes.
    """
    parts, own = factors.parts, _first_alike(stiffness, mass, factors)
    first = min(-(-count // len(parts)) + MARGIN * (len(parts) > 1), count)
    asked = dict.fromkeys(own, first)
    found = {k: _lowest_of(stiffness, mass, shift, factors, k, n) for k, n in asked.items()}
    while True:
        last = np.sort(np.concatenate([found[k][0] for k in own]))[count - 1]
        short = [k for k in asked if asked[k] < count and not found[k][0].max() > last]
        if not short or not np.isfinite(last):
            break
        for k in short:
            asked[k] = min(count, asked[k] + asked[k] // 2 + 1)
            found[k] = _lowest_of(stiffness, mass, shift, factors, k, asked[k])
    values = np.concatenate([found[k][0] for k in own])
    vectors = np.zeros((stiffness.shape[0], len(values)))
    column = 0
    for part, k in zip(parts, own, strict=True):
        shapes = found[k][1]
        vectors[part, column : column + shapes.shape[1]] = shapes
        column += shapes.shape[1]
    order = np.argsort(values, kind="stable")[:count]
    return values[order], vectors[:, order]


def _first_alike(stiffness: sp.csc_matrix, mass: sp.csc_matrix, factors: PartFactors) -> list[int]:
    """The first part of the stiffness and mass of each; that they add up alike is not enough."""

    def same(one: Indices, other: Indices) -> bool:
        return all(equal(A[one][:, one], A[other][:, other]) for A in (stiffness, mass))

    parts = factors.parts
    return [
        like if like == k or same(parts[like], parts[k]) else k
        for k, like in enumerate(factors.likeness)
    ]


def _lowest_of(
    stiffness: sp.csc_matrix,
    mass: sp.csc_matrix,
    shift: float,
    factors: PartFactors,
    number: int,
    count: int,
) -> tuple[Array, Array]:
    part = factors.parts[number]
    K, M = stiffness, mass
    if len(part) < K.shape[0]:
        K, M = K[part][:, part], M[part][:, part]
    operator = spla.LinearOperator(
        K.shape, matvec=lambda x: factors.solve_part(number, x), dtype=float
    )
    start = np.sin(1.0 + np.arange(len(part)) ** 1.5)
    values, vectors = spla.eigsh(
        K, k=count, M=M, sigma=-shift, OPinv=operator, which="LM", v0=start
    )
    return values, vectors
