"""Linear normal modes of a structure, free or with contact pairs bonded.

``K phi = omega² M phi`` on the displacements that satisfy ``B_c x = 0`` for the bonded components;
modes are mass-normalised, ``phi^T M phi = 1``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla

from microslip.brief import Brief
from microslip.errors import ModelError
from microslip.model.structure import Structure
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


def factorise(matrix: sp.csc_matrix) -> Callable[[Array], Array]:
    """Return a function that solves with a symmetric matrix (sparse LU, symmetric ordering)."""
    lu = spla.splu(
        matrix.tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    return lu.solve


def spectral_shift(structure: Structure) -> float:
    """Small positive shift sigma that makes ``K + sigma M`` regular, (rad/s)²."""
    return 1e-10 * float(structure.stiffness.diagonal().sum() / structure.mass.diagonal().sum())


def bonding(relative: sp.csr_matrix, bonded: Indices) -> sp.csc_matrix:
    """Basis T of the displacements with ``relative[bonded] @ T = 0``, by eliminating one per row.

    Each bonded row gives up its own degree of freedom, so rows must not all share the same ones.
    """
    count = relative.shape[1]
    rows = relative[bonded].tocsr()
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
    return np.asarray(basis @ factorise(stiffness)(basis.T @ structure.loads[load]))


def linear_modes(
    structure: Structure, bonded: Indices, count: int, align: str | None = None
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
    """
    basis = bonding(structure.interface.relative, np.asarray(bonded, dtype=np.int64))
    stiffness = (basis.T @ structure.stiffness @ basis).tocsc()
    mass = (basis.T @ structure.mass @ basis).tocsc()
    shift = spectral_shift(structure)
    solve = factorise(stiffness + shift * mass)
    operator = spla.LinearOperator(stiffness.shape, matvec=solve, dtype=float)
    start = np.sin(1.0 + np.arange(stiffness.shape[0]) ** 1.5)
    values, vectors = spla.eigsh(
        stiffness, k=count, M=mass, sigma=-shift, OPinv=operator, which="LM", v0=start
    )
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
