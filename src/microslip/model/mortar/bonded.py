"""Contact pairs whose sides constraints hold together: they can neither slide nor open."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp

from microslip.errors import Caution, ModelError
from microslip.model.mortar.coupling import MortarCoupling
from microslip.typing import Array, Indices

BONDED = 1e-9
"""Of its entries: a row of relative displacements below this moves by rounding alone."""


def bonded_pairs(
    couplings: Sequence[MortarCoupling],
    relative: sp.csr_matrix,
    moved: sp.csr_matrix,
    fixed: Indices,
) -> tuple[int, ...]:
    """How many pairs of each coupling ties, equations or couplings of the mesh bond.

    Parameters
    ----------
    couplings : sequence of MortarCoupling
    relative : (d m, N) sparse
        Relative displacements of all pairs.
    moved : (d m, n) sparse
        The same of the displacements that constraints leave free.
    fixed : int array
        Degrees of freedom that supports hold: pairs that these alone hold are none of them.
    """
    free = np.ones(relative.shape[1])
    free[fixed] = 0.0
    rows, left = _largest(relative @ sp.diags(free)), _largest(moved)
    out, start = [], 0
    for own in couplings:
        part = slice(start, start + own.dimension * own.pairs)
        start = part.stop
        size = rows[part].reshape(own.pairs, -1).max(axis=1)
        still = left[part].reshape(own.pairs, -1).max(axis=1) <= BONDED * size
        out.append(int((still & (size > 0)).sum()))
    return tuple(out)


def bonded_cautions(
    couplings: Sequence[MortarCoupling], bonded: Sequence[int]
) -> tuple[Caution, ...]:
    """A word about so many pairs that are bonded.

    Raises
    ------
    ModelError
        Where all pairs of two surfaces are.
    """
    out = []
    for own, count in zip(couplings, bonded, strict=True):
        where = f"surfaces {own.slave!r} and {own.master!r}"
        if count == own.pairs:
            raise ModelError(
                f"{where}: ties, equations or couplings of the mesh hold both sides of all {count} contact "
                "pairs together: what is bonded can neither slide nor open. Take them out"
            )
        if count:
            out.append(
                Caution(
                    "mesh",
                    where,
                    f"{count} of {own.pairs} contact pairs can neither slide nor open: ties, equations or "
                    "couplings of the mesh hold both sides together",
                    "is that meant?",
                )
            )
    return tuple(out)


def _largest(rows: sp.spmatrix) -> Array:
    """Largest entry of each row."""
    return np.asarray(abs(rows).max(axis=1).toarray().ravel())
