"""Multiplier functions of the facets of the slave surface, biorthogonal to its displacements.

On a facet that the master covers wholly the functions are

    Phi = D M^-1 N',   M = ∫ N' N'^T dA,   D = diag ∫ N' dA,

with ``∫ Phi_j N'_k dA = delta_jk ∫ N'_k dA`` and sum one, integrated over the mortar segments (Wohlmuth, SIAM
Journal on Numerical Analysis 38 (2000) 989). N' are the shape functions where their integrals are
positive. Those of six- and eight-node facets are not; there

    N'_c = N_c + alpha (N_m1 + N_m2),   N'_m = (1 - 2 alpha) N_m,   alpha = 1/5,

c a corner between the middles m1 and m2 (Popp, Wohlmuth, Gee & Wall, SIAM Journal on Scientific Computing 34
(2012) B421), so that every corner and middle has a positive area. On a facet that is covered in part only,
functions that are nowhere negative take their place: biorthogonal ones would extrapolate from what is
covered to what is not.
"""

from __future__ import annotations

import numpy as np

from microslip.errors import ModelError
from microslip.model.mesh.element_types import ElementType, element_type
from microslip.typing import Array, Mask

ALPHA = {"tri6": 0.2, "quad8": 0.2}
"""Share of a middle in its corners where functions are biorthogonal; 0 for those not named."""

POSITIVE = {"line3": 0.25, "tri6": 0.25, "quad8": 0.375}
"""Share that leaves no function negative anywhere."""

WORST = 1e12
"""Condition number of M from which on a facet counts as covered in part."""


def multipliers(kind: str, moments: Array, whole: Mask) -> Array:
    """Coefficients C of the multiplier functions of facets, ``Phi = C N``.

    Parameters
    ----------
    kind : str
        Type of the facets.
    moments : (f, k, k) array
        ``∫ N N^T dA`` over what is covered.
    whole : (f,) bool array
        Which facets are covered wholly.

    Returns
    -------
    (f, k, k) array

    Examples
    --------
    >>> line = np.array([[[1.0, 0.5], [0.5, 1.0]]]) / 3
    >>> multipliers("line2", line, np.array([True]))[0].round(12)
    array([[ 2., -1.],
           [-1.,  2.]])
    """
    shape = element_type(kind)
    mixed = mixing(shape, ALPHA.get(kind, 0.0))
    mass = mixed @ moments @ mixed.T
    sound = whole & (np.linalg.cond(mass) < WORST)
    out = np.empty_like(moments)
    out[~sound] = positive(shape)
    weight = mass[sound].sum(axis=2)
    out[sound] = weight[:, :, None] * (np.linalg.inv(mass[sound]) @ mixed)
    return out


def positive(shape: ElementType) -> Array:
    """(k, k) coefficients of functions that are nowhere negative and whose sum is one.

    Examples
    --------
    >>> bool((positive(element_type("quad9")) @ element_type("quad9").shapes(np.zeros(2)) >= 0).all())
    True
    """
    if shape.name != "quad9":
        return mixing(shape, POSITIVE.get(shape.name, 0.0))
    # products of those of line3, by the places of the nodes in both directions
    line = mixing(element_type("line3"), POSITIVE["line3"])
    place = np.array([[{-1.0: 0, 1.0: 1, 0.0: 2}[c] for c in node] for node in shape.reference])
    across, along = place.T
    return np.asarray(line[np.ix_(across, across)] * line[np.ix_(along, along)])


def mixing(shape: ElementType, alpha: float) -> Array:
    """(k, k) matrix T of ``N' = T N`` with the share `alpha` of every middle in its two corners."""
    T = np.eye(shape.size)
    if alpha == 0.0:
        return T
    if shape.name not in POSITIVE:
        raise ModelError(f"facets {shape.name} have no middles to be shared by corners")
    corners = shape.corners
    for k in range(shape.size - corners):
        T[corners + k, corners + k] = 1 - 2 * alpha
        T[[k, (k + 1) % corners], corners + k] = alpha
    return T
