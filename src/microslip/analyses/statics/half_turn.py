"""The half turn of a held joint: what happens at x happens at -x half a period later.

Where the joint is its own image under a half turn that keeps the preload, every port either keeps its sign or
changes it. A cycle whose loads obey that, ``a_p(theta + pi) = s_p a_p(theta)``, answers with

    r(theta + pi) = r(theta) turned,   v likewise,   q(theta + pi) = T q(theta),

once it is closed. Half a cycle then says all, and it is closed as soon as two halves are images.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from microslip.brief import Brief
from microslip.contact.pairs import components
from microslip.model.flexibility import Flexibility
from microslip.numerics.alike import alike
from microslip.typing import Array, Indices

ALIKE = 1e-7
"""Relative difference of what counts as its own image."""


@dataclass(frozen=True, repr=False)
class HalfTurn(Brief):
    """What a half turn does to the arrays of a contact problem.

    Attributes
    ----------
    pairs : (m,) int array
        Image of every pair.
    rows : (2 m,) int array
        Image of every component.
    q : (e, e) array
        T.
    signs : (p,) array
        1, -1 of every port; 0 of one that is neither its image nor the opposite.
    """

    pairs: Indices
    rows: Indices
    q: Array
    signs: Array

    def turns(self, path: Array) -> bool:
        """Whether the second half of a closed load path, (2 h + 1, p), is the image of the first."""
        half = len(path) // 2
        size = np.abs(path).max(axis=0)
        differs = np.abs(path[half:] - self.signs * path[: half + 1]).max(axis=0)
        return len(path) % 2 == 1 and bool((differs <= 1e-12 * size).all())


def find_half_turn(
    image: Indices | None, flexibility: Flexibility, friction: Array, r: Array
) -> HalfTurn | None:
    """The half turn of a contact problem with prestress reactions r; None where there is none.

    Planar: how a half turn takes the tangential directions of spatial pairs is not said by `image`.
    """
    if image is None or len(flexibility.W) != 2 * len(image):
        return None
    f, rows = flexibility, components(image)
    T = np.asarray(np.linalg.lstsq(f.R, f.R[rows], rcond=None)[0], dtype=float)
    same = [
        (f.W, f.W[np.ix_(rows, rows)]),
        (f.R @ T, f.R[rows]),
        (np.diag(f.stiffness) @ T, T @ np.diag(f.stiffness)),
        (friction, friction[image]),
        (r, r[rows]),
    ]
    if not all(alike(a, b, ALIKE) for a, b in same):
        return None
    signs = np.zeros(f.loads_v.shape[1])
    # forces on q that reactions of the size of v would bring into balance
    felt = np.abs(f.R).max(initial=0.0) / np.abs(f.W).max()
    for p in range(len(signs)):
        v, q = f.loads_v[:, p], f.loads_q[:, p]
        size = np.array([np.abs(v).max(), max(np.abs(q).max(initial=0.0), felt * np.abs(v).max())])
        for sign in (1.0, -1.0):
            missed = [
                np.abs(v - sign * v[rows]).max(),
                np.abs(q - sign * (T @ q)).max(initial=0.0),
            ]
            if (np.array(missed) <= ALIKE * size).all():
                signs[p] = sign
    return HalfTurn(image, rows, T, signs)
