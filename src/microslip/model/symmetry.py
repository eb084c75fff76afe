"""Whether a half turn takes a joint onto itself, found from its joint model alone.

Under a half turn about the middle of the interface the pair at x comes to -x and its two sides change places:
approach and slip keep their signs. The joint is its own image where its flexibility

    H(s) = W_res + Psi diag(1 / (omega² + s²)) Psi^T

is the same between the images of all pairs at every s; it is looked at three, which lie far apart.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from microslip.model.joint import JointModel
from microslip.numerics.alike import alike
from microslip.typing import Array

ALIKE = 1e-9
"""Relative difference of what counts as its own image."""


def with_half_turn(model: JointModel) -> JointModel:
    """The model with the images of its pairs under a half turn; itself where it has no such symmetry.

    Examples
    --------
    >>> import microslip
    >>> model = microslip.prepare(microslip.reference_joint(pairs=11)).model
    >>> with_half_turn(replace(model, image=None)).image.tolist()
    [10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0]
    """
    if model.dimension != 2 or model.image is not None:
        return model
    image = np.arange(model.pairs)[::-1].copy()
    x = model.position - 0.5 * (model.position[0] + model.position[-1])
    if not (alike(x, -x[image], ALIKE) and alike(model.area, model.area[image], ALIKE)):
        return model
    rows = np.column_stack([2 * image, 2 * image + 1]).ravel()
    elastic = model.omega[model.equilibrium_modes :]
    for s in (elastic[0], np.sqrt(elastic[0] * elastic[-1]), elastic[-1]):
        H = _flexibility(model, float(s))
        if not alike(H, H[np.ix_(rows, rows)], ALIKE):
            return model
    return replace(model, image=image)


def _flexibility(model: JointModel, s: float) -> Array:
    v = model.mode_v
    return np.asarray(model.residual + (v / (model.omega**2 + s**2)) @ v.T)
