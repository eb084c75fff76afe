"""Contact pairs: where they are, what area each stands for, and their relative displacement.

The relative displacement of all pairs is one vector ``v = B x``; the reactions ``r`` act on the
structure as ``K x + B^T r = f``. Layout and signs of both: `microslip.contact.pairs`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from microslip.brief import Brief
from microslip.errors import ModelError
from microslip.typing import Array, Indices


@dataclass(frozen=True, repr=False)
class Interface(Brief):
    """The contact pairs of a joint.

    Attributes
    ----------
    position : (m,) array
        Coordinate of each pair along the interface, m, ascending.
    area : (m,) array
        Area of each pair per metre of width, m.
    relative : (d m, n) scipy.sparse.csr_matrix
        B: relative displacement of the pairs from the displacement of the structure.
    dimension : int
        d: 2 or 3.
    image : (m,) int array, optional
        Where a half turn of the structure onto itself takes each pair; None where it has no such
        symmetry.
    """

    position: Array
    area: Array
    relative: sp.csr_matrix
    dimension: int = 2
    image: Indices | None = None

    @property
    def pairs(self) -> int:
        """Number of contact pairs."""
        return len(self.position)


def matching_interface(
    lower_nodes: Indices,
    upper_nodes: Indices,
    x: Array,
    dofs: int,
    image: Indices | None = None,
) -> Interface:
    """Interface of pairs of coincident nodes on a horizontal plane, upper body above.

    Parameters
    ----------
    lower_nodes, upper_nodes : (m,) int arrays
        Global node numbers, in order of ascending `x`.
    x : (m,) array
        Coordinates, m.
    dofs : int
        Degrees of freedom of the structure; node ``k`` has ``2 k`` (x) and ``2 k + 1`` (y).
    image : (m,) int array, optional
        See `Interface`.

    Raises
    ------
    ModelError
        Where the number of pairs is even or below 3.

    Examples
    --------
    >>> lower, upper = np.array([0, 1, 2]), np.array([3, 4, 5])
    >>> pairs = matching_interface(lower, upper, np.array([0.0, 1.0, 2.0]), 12)
    >>> pairs.relative.toarray()[0]  # lower node 0 moves up: the gap closes
    array([ 0.,  1.,  0.,  0.,  0.,  0.,  0., -1.,  0.,  0.,  0.,  0.])
    """
    m = len(x)
    i = np.arange(m)
    rows = np.concatenate([2 * i, 2 * i, 2 * i + 1, 2 * i + 1])
    columns = np.concatenate(
        [2 * lower_nodes + 1, 2 * upper_nodes + 1, 2 * lower_nodes, 2 * upper_nodes]
    )
    values = np.concatenate([np.ones(m), -np.ones(m), -np.ones(m), np.ones(m)])
    relative = sp.csr_matrix((values, (rows, columns)), shape=(2 * m, dofs))
    return Interface(np.asarray(x, dtype=float), nodal_areas(x), relative, image=image)


def nodal_areas(x: Array) -> Array:
    """Share of each node in the length of a line of quadratic elements (Simpson's rule).

    Nodes alternate: corner, mid-side, corner, ...

    Examples
    --------
    >>> nodal_areas(np.array([0.0, 3.0, 6.0, 9.0, 12.0]))
    array([1., 4., 2., 4., 1.])
    """
    if len(x) < 3 or len(x) % 2 == 0:
        raise ModelError(
            f"{len(x)} contact nodes cannot be corners and mid-sides of quadratic elements: "
            "their number is odd and at least 3"
        )
    area = np.zeros(len(x))
    size = x[2::2] - x[:-2:2]
    area[:-2:2] += size / 6
    area[1::2] += 4 * size / 6
    area[2::2] += size / 6
    return area
