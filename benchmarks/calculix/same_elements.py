"""Our solver on the finite elements and the contact points of CalculiX.

Two rectangles in plane strain are left of one layer of C3D8I: the bilinear rectangle with two
incompatible modes per direction, ``1 - xi²`` and ``1 - eta²``, condensed out (Wilson et al. 1973; on
rectangles the corrections of Taylor et al. 1976 change nothing). Contact acts at integration points of the
faces, each behind its own penalty springs ``k · weight``: pairs of `microslip` with a compliance. So
both programs solve the same discrete problem, and what differs is how.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from microslip.contact.law import contact_law
from microslip.contact.pairs import normal_rows, tangential_rows
from microslip.model.interface import Interface
from microslip.model.joint import Reducer
from microslip.model.structure import constrain


def gauss_points(count):
    """Gauss points on (-1, 1) and weights that sum to 1."""
    points, weights = np.polynomial.legendre.leggauss(count)
    return points, weights / 2


def ccx_points():
    """The points of CalculiX's face-to-face contact on a pair of matching faces, seen along xi.

    ccx cuts the common part of a slave and a master face, here the whole face, into four triangles at its
    middle, with Radon's seven points in each. Points at the same xi move alike in plane strain and are
    merged. Weights sum to 1.
    """
    root = np.sqrt(15.0)
    barycentric, weights = [(1 / 3, 1 / 3, 1 / 3)], [9 / 40]
    for sign in (1, -1):
        a, b = (9 + 2 * sign * root) / 21, (6 - sign * root) / 21
        barycentric += [(a, b, b), (b, a, b), (b, b, a)]
        weights += 3 * [(155 - sign * root) / 1200]
    (first, second, middle), w = np.array(barycentric).T, np.array(weights) / 4
    xi = np.concatenate([1 - middle, middle - 1, first - second, first - second])
    points, index = np.unique(np.round(xi, 12), return_inverse=True)
    return points, np.bincount(index, np.tile(w, 4))


def rectangle_stiffness(width, height, material):
    """Stiffness (8, 8) of the rectangle with incompatible modes, corners counter-clockwise."""
    lam, mu = material.lame()
    D = np.array([[lam + 2 * mu, lam, 0], [lam, lam + 2 * mu, 0], [0, 0, mu]])
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    full = np.zeros((12, 12))
    g = 1 / np.sqrt(3)
    for xi, eta in ((-g, -g), (g, -g), (g, g), (-g, g)):
        dx = np.r_[corners[:, 0] * (1 + corners[:, 1] * eta) / 4, -2 * xi, 0] * 2 / width
        dy = np.r_[corners[:, 1] * (1 + corners[:, 0] * xi) / 4, 0, -2 * eta] * 2 / height
        B = np.zeros((3, 12))
        B[0, 0::2], B[1, 1::2], B[2, 0::2], B[2, 1::2] = dx, dy, dy, dx
        full += B.T @ D @ B * width * height / 4
    k, c, inner = full[:8, :8], full[:8, 8:], full[8:, 8:]
    return k - c @ np.linalg.solve(inner, c.T)


def rectangle_mass(width, height, density):
    """Consistent mass (8, 8) of the bilinear rectangle."""
    line = np.array([[2, 1], [1, 2]]) / 6
    order = [0, 1, 3, 2]
    nodal = np.kron(line, line)[np.ix_(order, order)] * density * width * height
    return np.kron(nodal, np.eye(2))


def linear_structure(joint, material, spring, points):
    """`microslip.model.structure.Structure` of a `mesh.LinearJoint` with contact at integration points.

    Parameters
    ----------
    joint : mesh.LinearJoint
    material : Material
    spring : float
        Horizontal spring at each end, N/m per metre of width.
    points : tuple of arrays
        Positions on (-1, 1) and weights of the contact points of each face.
    """
    count = 2 * len(joint.nodes)
    corner = joint.nodes[joint.quads]
    sizes = corner[:, 2] - corner[:, 0]
    kinds, kind = np.unique(np.round(sizes, 15), axis=0, return_inverse=True)
    k = np.array([rectangle_stiffness(*size, material) for size in kinds])[kind.ravel()]
    m = np.array([rectangle_mass(*size, material.density) for size in kinds])[kind.ravel()]
    dofs = (2 * joint.quads[:, :, None] + np.arange(2)).reshape(-1, 8)
    where = (np.repeat(dofs, 8, axis=1).ravel(), np.tile(dofs, 8).ravel())
    stiffness = sp.csc_matrix((k.ravel(), where), shape=(count, count))
    mass = sp.csc_matrix((m.ravel(), where), shape=(count, count))
    ground = np.zeros(count)
    ground[0::2] = spring * joint.spring
    return constrain(
        (stiffness + sp.diags(ground)).tocsc(),
        mass,
        point_interface(joint, points, count),
        {"clamp": joint.clamp.ravel(), "moment": joint.moment.ravel()},
        2 * joint.supported + 1,
    )


def point_interface(joint, points, dofs):
    """Contact pairs at the integration points of the faces on the plane of contact."""
    xi, weights = points
    x = joint.nodes[joint.lower_nodes, 0]
    size = np.diff(x)
    faces, per_face = len(size), len(xi)
    pair = np.arange(faces * per_face).reshape(faces, per_face)
    right = np.tile((1 + xi) / 2, (faces, 1))
    rows, columns, values = [], [], []
    for end, shape in ((slice(None, -1), 1 - right), (slice(1, None), right)):
        for nodes, sign in ((joint.lower_nodes[end], 1.0), (joint.upper_nodes[end], -1.0)):
            node = np.repeat(nodes[:, None], per_face, axis=1)
            rows += [2 * pair, 2 * pair + 1]
            columns += [2 * node + 1, 2 * node]
            values += [sign * shape, -sign * shape]
    entries = (np.ravel(values), (np.ravel(rows), np.ravel(columns)))
    return Interface(
        position=(x[:-1, None] + size[:, None] * (1 + xi) / 2).ravel(),
        area=(size[:, None] * weights).ravel(),
        relative=sp.csr_matrix(entries, shape=(2 * pair.size, dofs)),
    )


def penalty_law(model, loading):
    """Friction behind the penalty springs of a `ccx_deck.Loading`."""
    compliance = np.empty(2 * model.pairs)
    compliance[normal_rows()] = 1 / (loading.normal_stiffness * model.area)
    compliance[tangential_rows()] = 1 / (loading.tangential_stiffness * model.area)
    return contact_law(model.pairs, loading.friction, compliance)


def matched_model(joint, material, spring, points, modes=60):
    """Joint model of the linear elements."""
    structure = linear_structure(joint, material, spring, points)
    return Reducer(structure, modes, (0.0, 0.0)).model(structure.loads)
