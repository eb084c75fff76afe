"""How a unit force is spread along x over the outer faces of the beams."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.integrate import trapezoid

from microslip.errors import ModelError
from microslip.model.elasticity import Body
from microslip.typing import Array, Indices


@dataclass(frozen=True)
class Pressing:
    """A density of unit resultant, a polynomial of at most second degree between its knots.

    Attributes
    ----------
    knots : (k,) array
        Ascending, m; nothing presses outside.
    density : callable
        1/m at positions between the first and the last knot.
    """

    knots: Array
    density: Callable[[Array], Array]

    @property
    def symmetric(self) -> bool:
        """Whether it is its own mirror image about ``x = 0``, at the knots and between them."""
        k = self.knots
        if not np.array_equal(k, -k[::-1]):
            return False
        x = (k[:-1, None] + np.diff(k)[:, None] * np.array([0.25, 0.5, 0.75])).ravel()
        return bool(np.allclose(self.density(x), self.density(-x), rtol=1e-12, atol=0.0))


def uniform(centre: float, half_length: float) -> Pressing:
    """The same everywhere on ``|x - centre| <= half_length``."""
    knots = np.array([centre - half_length, centre + half_length])
    return Pressing(knots, lambda x: np.full_like(x, 0.5 / half_length))


def parabolic(centre: float, half_length: float) -> Pressing:
    """``3 (1 - s²)/(4 half_length)``, ``s = (x - centre)/half_length``: none at the ends."""
    knots = np.array([centre - half_length, centre + half_length])
    return Pressing(knots, lambda x: 0.75 / half_length * (1 - ((x - centre) / half_length) ** 2))


def tabulated(x: Array, values: Array) -> Pressing:
    """In proportion to `values` at ascending `x`, straight in between.

    Raises
    ------
    ModelError
        Where nothing presses, or something pulls.
    """
    whole = trapezoid(values, x)
    if not whole > 0 or np.min(values) < 0:
        raise ModelError("a table of clamp pressure must press somewhere and pull nowhere")
    return Pressing(np.asarray(x, dtype=float), lambda at: np.interp(at, x, values) / whole)


def pressed_load(body: Body, facets: Indices, pressing: Pressing) -> Array:
    """Vertical nodal forces of a unit force spread over horizontal facets.

    Facets may be cut by the knots: three Gauss points on every piece integrate the density times
    the quadratic shape functions exactly.

    Parameters
    ----------
    body : Body
    facets : (k,) int array
    pressing : Pressing

    Returns
    -------
    (2 n,) array
    """
    mesh, knots = body.mesh, pressing.knots
    corners = mesh.p.shape[1]
    load = np.zeros(body.nodes.shape[1])
    points, weights = np.polynomial.legendre.leggauss(3)
    for facet in facets:
        first, second = mesh.facets[:, facet]
        x0, x1 = mesh.p[0, first], mesh.p[0, second]
        for left, right in pairwise(knots):
            a, b = max(min(x0, x1), left), min(max(x0, x1), right)
            if b <= a:
                continue
            x = 0.5 * (a + b) + 0.5 * (b - a) * points
            force = 0.5 * (b - a) * weights * pressing.density(x)
            s = (x - x0) / (x1 - x0)
            load[first] += force @ ((1 - s) * (1 - 2 * s))
            load[second] += force @ (s * (2 * s - 1))
            load[corners + facet] += force @ (4 * s * (1 - s))
    return np.column_stack([np.zeros_like(load), load]).ravel()
