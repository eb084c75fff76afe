"""Compliance of a structure at its interface alone, from one factorisation and no solves.

With the degrees of freedom of the interface last, ``A = L U`` has their Schur complement in its last block,

    S = A_bb - A_bi A_ii^-1 A_ib = L_bb U_bb,      (A^-1)_bb = S^-1,

which is dense and small. What would cost a solve with the whole matrix per column of the interface is an
inverse of the size of the interface.

Nearly rigid motions Phi are taken out, as their compliance would drown the rest: G f is the x of
``A x + M Phi lambda = f`` with ``Phi^T M x = 0``. A is regular enough to factorise once springs k hold some
degrees of freedom E, ``A_s = A + k E E^T``; with ``s = E^T x`` that is

    A_s x + M Phi lambda - k E s = f,      Phi^T M x = 0,      E^T x = s.

Each connected part gets as many springs as it has nearly rigid motions of its own, so that parts that are
equal stay equal: one of them is factorised.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp

from microslip.model.modes import likeness
from microslip.numerics.factors import trailing_inverse
from microslip.typing import Array, Indices

RIGID = 1e-6
"""A motion this small beside the largest of a part adds no spring to it."""


def interface_compliance(
    matrix: sp.csc_matrix,
    relative: sp.csr_matrix,
    rigid: Array,
    mass_rigid: Array,
    orders: Sequence[Indices],
) -> Array:
    """``B G B^T``: relative displacement under unit relative forces without the rigid motions.

    Parameters
    ----------
    matrix : (n, n) sparse
        A, symmetric.
    relative : (b, n) sparse
        B.
    rigid, mass_rigid : (n, e) arrays
        Phi, orthonormal with respect to M, and M Phi; eigenvectors of A with M.
    orders : sequence of int arrays
        Degrees of freedom of each connected part of A, in an order of elimination that keeps its
        factors sparse.

    Raises
    ------
    ModelError
        Where the factors do not keep the interface last.
    """
    n, e = rigid.shape
    held = np.concatenate([np.zeros(0, dtype=np.int64), *(_sprung(rigid, part) for part in orders)])
    count = len(held)
    spring = float(matrix.diagonal().mean())
    springs = np.zeros(n)
    springs[held] = spring
    stiff = (matrix + sp.diags(springs)).tocsc()
    unit = np.zeros((n, count))
    unit[held, np.arange(count)] = 1.0
    border = np.hstack([mass_rigid, unit])
    answer = np.empty_like(border)
    total = np.zeros((relative.shape[0], relative.shape[0]))
    felt = np.zeros(n, dtype=bool)
    felt[np.unique(relative.indices)] = True
    boundaries = [order[felt[order]] for order in orders]
    parts = [
        np.concatenate([order[~felt[order]], boundary])
        for order, boundary in zip(orders, boundaries, strict=True)
    ]
    blocks = [stiff[part][:, part].tocsc() for part in parts]
    first = likeness(blocks)
    for own in dict.fromkeys(first):
        # factors of one kind at a time: they are most of the memory
        factors, compliance = trailing_inverse(blocks[own], len(boundaries[own]))
        for k in (k for k, like in enumerate(first) if like == own):
            answer[parts[k]] = factors.solve(border[parts[k]])
            total += _sandwich(relative[:, boundaries[k]], compliance)
    of_border = np.asarray(relative @ answer)
    small = border.T @ answer
    # unknowns lambda and s: x = x_f - X_U lambda + k X_E s
    signs = np.concatenate([-np.ones(e), np.full(count, spring)])
    system = small * signs
    system[e:, e:] -= np.eye(count)
    return np.asarray(total - (of_border * signs) @ np.linalg.solve(system, of_border.T))


def _sprung(rigid: Array, part: Indices) -> Indices:
    """Degrees of freedom of a part that springs hold: one for each rigid motion that it has."""
    part = np.sort(part)
    if not rigid.shape[1]:
        return part[:0]
    R, place = sl.qr(rigid[part].T, mode="r", pivoting=True)
    size = np.abs(np.diag(R))
    return np.asarray(part[place[: int((size > RIGID * size[0]).sum())]])


def _sandwich(relative: sp.csr_matrix, compliance: Array) -> Array:
    """``B C B^T``."""
    return np.asarray(relative @ np.asarray(relative @ compliance.T).T)
