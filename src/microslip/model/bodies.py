"""Rigid motions of the bodies of a structure: what its contact must balance by itself.

A load that moves the bodies as rigid ones is carried by the contact pairs, as far as the supports
do not carry it. How far the pairs can go is a question of statics alone, without elasticity and without
the stiffness of the supports; the rigid motions answer it for supports of any stiffness.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from microslip.brief import Brief
from microslip.typing import Array, Indices


@dataclass(frozen=True, repr=False)
class BodyMotions(Brief):
    """Rigid motions of the bodies that their fixed supports leave free, as a joint model sees them.

    Attributes
    ----------
    v : (d m, e) array
        Relative displacement of the contact pairs.
    ports : (p, e) array
        Work of each port.
    modes : (k, e) array
        Their coordinates in the kept free-interface modes, ``Phi^T M x``.
    """

    v: Array
    ports: Array
    modes: Array

    def with_ports(self, work: Array) -> BodyMotions:
        """More ports, from the (n, e) work of each."""
        return replace(self, ports=np.vstack([self.ports, work]))

    def with_modal_ports(self, coordinates: Array) -> BodyMotions:
        """Ports of inertia loads, from the (k, n) coordinates of their shapes in the modes."""
        return self.with_ports(coordinates.T @ self.modes)


def rigid_motions(nodes: Array, first: int, dofs: int) -> Array:
    """(dofs, 3) displacements of a plane body that moves as a rigid one: along x, along y, turning.

    The turn is about the mean of the nodes, over their largest distance from it, so that all three
    are of the same size.

    Parameters
    ----------
    nodes : (2, n) array
        Coordinates, m.
    first : int
        Number of the body's first node in the structure.
    dofs : int
        Degrees of freedom of the structure; node ``k`` has ``2 k`` (x) and ``2 k + 1`` (y).

    Examples
    --------
    >>> rigid_motions(np.array([[-1.0, 1.0], [0.0, 0.0]]), 0, 4)
    array([[ 1.,  0., -0.],
           [ 0.,  1., -1.],
           [ 1.,  0., -0.],
           [ 0.,  1.,  1.]])
    """
    arm = nodes - nodes.mean(axis=1, keepdims=True)
    arm /= np.hypot(*arm).max()
    out = np.zeros((dofs, 3))
    x = 2 * (first + np.arange(nodes.shape[1]))
    out[x, 0] = 1.0
    out[x + 1, 1] = 1.0
    out[x, 2], out[x + 1, 2] = -arm[1], arm[0]
    return out


def left_free(motions: Array, fixed: Indices) -> Array:
    """Combinations of motions (columns) that do not move the degrees of freedom in `fixed`.

    Examples
    --------
    >>> left_free(np.eye(3), np.array([1])).shape
    (3, 2)
    """
    if not len(fixed):
        return motions
    _, size, directions = np.linalg.svd(motions[fixed], full_matrices=True)
    rank = int(np.sum(size > 1e-9 * size.max(initial=1e-300)))
    return np.asarray(motions @ directions[rank:].T)
