"""Shapes of finite elements: nodes, shape functions, faces and quadrature on the reference element.

Shape functions are the polynomials of a space P, spanned by monomials, that are one at a node and zero
at the others: with the Vandermonde matrix ``V_ij = p_j(xi_i)`` of the nodes,

    N(xi) = V^-T p(xi).

Nodes and faces are numbered as in Abaqus and CalculiX; VTK's order of the nodes is the same. Simplices
have coordinates from 0 to 1, lines, quadrilaterals and hexahedra from -1 to 1, wedges both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import product

import numpy as np
import skfem
from skfem.quadrature import get_quadrature

from microslip.errors import ModelError
from microslip.typing import Array

Loop = tuple[int, ...]
"""Corners of a face, counted from 0, counter-clockwise as seen from outside."""


@dataclass(frozen=True)
class ElementType:
    """One shape of element.

    Attributes
    ----------
    name : str
        Shape and number of nodes: ``hex20``.
    family : str
        ``line``, ``tri``, ``quad``, ``tet``, ``hex`` or ``wedge``.
    dimension : int
        Of the reference element.
    order : int
        1 linear, 2 quadratic.
    reference : (k, d) tuple
        Coordinates of the nodes, corners first.
    exponents : (k, d) tuple
        Of the monomials that span the shape functions.
    loops : tuple of tuple of int
        Corners of each face; its direction is that of an element of positive Jacobian determinant.
    """

    name: str
    family: str
    dimension: int
    order: int
    reference: tuple[tuple[float, ...], ...]
    exponents: tuple[tuple[int, ...], ...]
    loops: tuple[Loop, ...]

    @property
    def size(self) -> int:
        """Number of nodes."""
        return len(self.reference)

    @property
    def corners(self) -> int:
        """Number of corners."""
        return CORNERS[self.family]

    @cached_property
    def nodes(self) -> Array:
        """(k, d) coordinates of the nodes."""
        return np.array(self.reference, dtype=float)

    @cached_property
    def _powers(self) -> Array:
        return np.array(self.exponents)

    @cached_property
    def _coefficients(self) -> Array:
        vandermonde = np.prod(self.nodes[:, None] ** self._powers, axis=2)
        return np.asarray(np.round(np.linalg.inv(vandermonde) * 8) / 8)

    def shapes(self, xi: Array) -> Array:
        """(..., k) shape functions at (..., d) reference coordinates.

        Examples
        --------
        >>> TYPES["line3"].shapes(np.array([[0.5]]))
        array([[-0.125,  0.375,  0.75 ]])
        """
        monomials = np.prod(xi[..., None, :] ** self._powers, axis=-1)
        return np.asarray(monomials @ self._coefficients)

    def gradients(self, xi: Array) -> Array:
        """(..., k, d) derivatives of the shape functions by the reference coordinates."""
        out = np.empty((*xi.shape[:-1], self.size, self.dimension))
        for axis in range(self.dimension):
            lower = self._powers.copy()
            lower[:, axis] = np.maximum(lower[:, axis] - 1, 0)
            monomials = self._powers[:, axis] * np.prod(xi[..., None, :] ** lower, axis=-1)
            out[..., axis] = monomials @ self._coefficients
        return out

    def quadrature(self, degree: int) -> tuple[Array, Array]:
        """Points (q, d) and weights (q,) exact for polynomials of a degree, in each coordinate of a box.

        Examples
        --------
        >>> points, weights = TYPES["wedge15"].quadrature(4)
        >>> round(float(weights.sum()), 12)  # half a square, two high
        1.0
        """
        return _quadrature(self.family, degree)

    @cached_property
    def faces(self) -> tuple[tuple[str, tuple[int, ...]], ...]:
        """Type and nodes of each face: corners in the order of the loop, middles of its sides, centre."""
        return tuple(self._face(loop) for loop in self.loops)

    def _face(self, loop: Loop) -> tuple[str, tuple[int, ...]]:
        corners = self.nodes[list(loop)]
        following = np.roll(corners, -1, axis=0)
        sides = 0.5 * (corners + following)[: len(loop) if len(loop) > 2 else 1]
        nodes = list(loop)
        if self.order == 2:
            nodes += [self._at(point) for point in sides]
        if len(loop) == 4 and (centre := self._at(corners.mean(axis=0))) >= 0:
            nodes.append(centre)
        return f"{ {2: 'line', 3: 'tri', 4: 'quad'}[len(loop)] }{len(nodes)}", tuple(nodes)

    def _at(self, point: Array) -> int:
        """Node at a reference coordinate, -1 where there is none."""
        near = np.flatnonzero(np.abs(self.nodes - point).max(axis=1) < 1e-9)
        return int(near[0]) if len(near) else -1


CORNERS = {"line": 2, "tri": 3, "quad": 4, "tet": 4, "hex": 8, "wedge": 6}
"""Corners of each family."""


@cache
def _quadrature(family: str, degree: int) -> tuple[Array, Array]:
    if family in ("tri", "tet"):
        simplex = skfem.ElementTriP1() if family == "tri" else skfem.ElementTetP1()
        points, weights = get_quadrature(simplex, degree)
        return points.T.copy(), weights
    line, along = np.polynomial.legendre.leggauss(degree // 2 + 1)
    if family == "wedge":
        flat, area = _quadrature("tri", degree)
        points = np.array([[*p, z] for p in flat for z in line])
        return points, np.outer(area, along).ravel()
    dimension = {"line": 1, "quad": 2, "hex": 3}[family]
    points = np.array(list(product(line, repeat=dimension)))
    return points, np.array([np.prod(w) for w in product(along, repeat=dimension)])


SIMPLEX = {2: ((0, 0), (1, 0), (0, 1)), 3: ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1))}
SQUARE = ((-1, -1), (1, -1), (1, 1), (-1, 1))
CUBE = tuple((x, y, z) for z in (-1, 1) for x, y in SQUARE)
PRISM = tuple((x, y, z) for z in (-1, 1) for x, y in SIMPLEX[2])

ROUND = ((0, 1), (1, 2), (2, 3), (3, 0))
EDGES = {
    "line": ((0, 1),),
    "tri": ((0, 1), (1, 2), (2, 0)),
    "quad": ROUND,
    "tet": ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
    "hex": (*ROUND, *((a + 4, b + 4) for a, b in ROUND), *((k, k + 4) for k in range(4))),
    "wedge": ((0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)),
}
"""Edges in the order of their middle nodes."""

LOOPS: dict[str, tuple[Loop, ...]] = {
    "line": (),
    "tri": ((0, 1), (1, 2), (2, 0)),
    "quad": ROUND,
    "tet": ((0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)),
    "hex": (
        (0, 3, 2, 1),
        (4, 5, 6, 7),
        (0, 1, 5, 4),
        (1, 2, 6, 5),
        (2, 3, 7, 6),
        (3, 0, 4, 7),
    ),
    "wedge": ((0, 2, 1), (3, 4, 5), (0, 1, 4, 3), (1, 2, 5, 4), (2, 0, 3, 5)),
}
"""Faces S1, S2, ... of Abaqus and CalculiX, seen from outside."""


def _of_degree(dimension: int, order: int) -> list[tuple[int, ...]]:
    every = product(range(order + 1), repeat=dimension)
    return [e for e in every if sum(e) <= order]


def _serendipity(dimension: int) -> list[tuple[int, ...]]:
    """Monomials of superlinear degree 2: linear factors do not count."""
    every = product(range(3), repeat=dimension)
    return [e for e in every if sum(k for k in e if k > 1) <= 2]


def _box(dimension: int, order: int) -> list[tuple[int, ...]]:
    return list(product(range(order + 1), repeat=dimension))


def _type(
    name: str,
    corners: Sequence[Sequence[float]],
    exponents: Sequence[tuple[int, ...]],
    *,
    order: int = 1,
    centres: Sequence[Sequence[float]] = (),
) -> ElementType:
    family = name.rstrip("0123456789")
    points = [tuple(float(x) for x in corner) for corner in corners]
    if order == 2:
        points += [
            tuple(0.5 * (p + q) for p, q in zip(points[a], points[b], strict=True))
            for a, b in EDGES[family]
        ]
    points += [tuple(float(x) for x in centre) for centre in centres]
    found = ElementType(
        name, family, len(points[0]), order, tuple(points), tuple(exponents), LOOPS[family]
    )
    if found.size != len(exponents) or f"{family}{found.size}" != name:
        raise ModelError(f"{name}: {found.size} nodes and {len(exponents)} monomials")
    return found


_PRISM1 = [(*e, k) for e in _of_degree(2, 1) for k in range(2)]
_PRISM2 = [(*e, k) for e in _of_degree(2, 2) for k in range(3)]

TYPES: dict[str, ElementType] = {
    found.name: found
    for found in (
        _type("line2", ((-1,), (1,)), _box(1, 1)),
        _type("line3", ((-1,), (1,)), _box(1, 2), order=2),
        _type("tri3", SIMPLEX[2], _of_degree(2, 1)),
        _type("tri6", SIMPLEX[2], _of_degree(2, 2), order=2),
        _type("quad4", SQUARE, _box(2, 1)),
        _type("quad8", SQUARE, _serendipity(2), order=2),
        _type("quad9", SQUARE, _box(2, 2), order=2, centres=((0, 0),)),
        _type("tet4", SIMPLEX[3], _of_degree(3, 1)),
        _type("tet10", SIMPLEX[3], _of_degree(3, 2), order=2),
        _type("hex8", CUBE, _box(3, 1)),
        _type("hex20", CUBE, _serendipity(3), order=2),
        _type(
            "hex27",
            CUBE,
            _box(3, 2),
            order=2,
            centres=(
                *((-1, 0, 0), (1, 0, 0), (0, -1, 0), (0, 1, 0), (0, 0, -1), (0, 0, 1)),
                (0, 0, 0),
            ),
        ),
        _type("wedge6", PRISM, _PRISM1),
        _type("wedge15", PRISM, [e for e in _PRISM2 if e[2] < 2 or sum(e[:2]) < 2], order=2),
        _type(
            "wedge18", PRISM, _PRISM2, order=2, centres=((0.5, 0, 0), (0.5, 0.5, 0), (0, 0.5, 0))
        ),
    )
}
"""All element types by name."""


def element_type(name: str) -> ElementType:
    """Element type of a name; raises `ModelError` naming those there are."""
    if name not in TYPES:
        raise ModelError(f"no element type {name!r}; there are {', '.join(TYPES)}")
    return TYPES[name]
