"""Compliance of a structure at its interface alone, from one factorisation and no solves.

With the degrees of freedom of the interface last, ``A = L U`` has their Schur complement in its last block,

    S = A_bb - A_bi A_ii^-1 A_ib = L_bb U_bb,      (A^-1)_bb = S^-1,

which is dense and small. What would cost a solve with the whole matrix per column of the interface is an
inverse of the size of the interface.

Nearly rigid motions Phi are taken out, as their compliance would drown the rest: G f is the x of
``A x + M Phi lambda = f`` with ``Phi^T M x = 0``. A is regular enough to factorise once springs k hold some
degrees of freedom E, ``A_s = A + k E E^T``; with ``s = E^T x`` that is

    A_s x + M Phi lambda - k E s = f,      Phi^T M x = 0,      E^T x = s.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp

from microslip.numerics.factors import trailing_inverse
from microslip.typing import Array, Indices


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
    held = sl.qr(rigid.T, mode="r", pivoting=True)[1][:e] if e else np.zeros(0, dtype=np.int64)
    spring = float(matrix.diagonal().mean())
    springs = np.zeros(n)
    springs[held] = spring
    stiff = (matrix + sp.diags(springs)).tocsc()
    unit = np.zeros((n, e))
    unit[held, np.arange(e)] = 1.0
    border = np.hstack([mass_rigid, unit])
    answer = np.empty_like(border)
    total = np.zeros((relative.shape[0], relative.shape[0]))
    felt = np.zeros(n, dtype=bool)
    felt[np.unique(relative.indices)] = True
    for order in orders:
        boundary = order[felt[order]]
        own = np.concatenate([order[~felt[order]], boundary])
        inverse, answer[own] = trailing_inverse(stiff[own][:, own], len(boundary), border[own])
        local = relative[:, boundary]
        total += _sandwich(local, inverse)
    of_border = np.asarray(relative @ answer)
    small = border.T @ answer
    # unknowns lambda and s: x = x_f - X_U lambda + k X_E s
    signs = np.concatenate([-np.ones(e), np.full(e, spring)])
    system = small * signs
    system[e:, e:] -= np.eye(e)
    return np.asarray(total - (of_border * signs) @ np.linalg.solve(system, of_border.T))


def _sandwich(relative: sp.csr_matrix, compliance: Array) -> Array:
    """``B C B^T``."""
    return np.asarray(relative @ np.asarray(relative @ compliance.T).T)
