"""Structured, graded mesh of the lap joint of two identical beams.

Lower beam: ``x`` from ``overlap - length`` to ``overlap``, ``y`` from ``-thickness`` to 0.
Upper beam: its image under a half turn about the origin. The image is made by negating the
coordinates, so the mesh is symmetric to the last bit and a reversed moment mirrors every result.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import skfem

from microslip.typing import Array


@dataclass(frozen=True)
class LapGeometry:
    """Dimensions of a lap joint in metres.

    Attributes
    ----------
    length : float
        Length of each beam.
    thickness : float
        Thickness of each beam.
    overlap_half_length : float
        The beams overlap over ``|x| <= overlap_half_length``.
    clamp_half_length : float
        The clamp presses the outer faces over ``|x| <= clamp_half_length``.
    """

    length: float
    thickness: float
    overlap_half_length: float
    clamp_half_length: float


@dataclass(frozen=True)
class MeshControl:
    """How fine the mesh is in its three regions.

    Attributes
    ----------
    contact_pairs : int
        Number of contact pairs over the overlap (contact region): corner and mid-side nodes of
        the quadratic elements, hence odd. An even number is raised by one.
    overlap_growth : float
        Ratio of neighbouring layer heights from the interface outward (overlap region).
    max_layer : float
        Largest height of a layer, as a fraction of the thickness.
    rest_size : float
        Element length far from the overlap, as a fraction of the thickness (rest region).
    """

    contact_pairs: int = 201
    overlap_growth: float = 1.3
    max_layer: float = 0.2
    rest_size: float = 0.5


def overlap_grid(geometry: LapGeometry, pairs: int) -> Array:
    """Evenly spaced element corners over the overlap, symmetric about zero to the last bit.

    Examples
    --------
    >>> overlap_grid(LapGeometry(9.0, 0.1, 3.0, 2.0), 13)
    array([-3., -2., -1.,  0.,  1.,  2.,  3.])
    """
    elements = pairs // 2
    x = np.linspace(-geometry.overlap_half_length, geometry.overlap_half_length, elements + 1)
    return 0.5 * (x - x[::-1])


def graded(start: float, stop: float, first: float, growth: float, largest: float) -> Array:
    """Nodes from `start` to `stop` whose spacing grows geometrically from `first` to `largest`."""
    span = abs(stop - start)
    sizes = [min(first, span)]
    while sum(sizes) < span:
        sizes.append(min(sizes[-1] * growth, largest))
    steps = np.concatenate([[0.0], np.cumsum(sizes)])
    return start + (stop - start) * steps / steps[-1]


def lap_joint_meshes(
    geometry: LapGeometry, control: MeshControl
) -> tuple[skfem.MeshQuad, skfem.MeshQuad]:
    """Meshes of the lower and the upper beam, with matching nodes on the plane of contact.

    Node ``i`` of the lower mesh at ``(x, y)`` has its image, node ``i`` of the upper mesh, at
    ``(-x, -y)``.
    """
    g = geometry
    x_overlap = overlap_grid(g, control.contact_pairs)
    size = 2 * g.overlap_half_length / (control.contact_pairs // 2)
    x = x_overlap
    far = g.overlap_half_length - g.length
    if far < -g.overlap_half_length * (1 + 1e-12):
        rest = graded(
            -g.overlap_half_length, far, size, 1.4, max(control.rest_size * g.thickness, size)
        )
        x = np.concatenate([rest[:0:-1], x_overlap])
    y = graded(
        0.0,
        -g.thickness,
        min(size, control.max_layer * g.thickness),
        control.overlap_growth,
        control.max_layer * g.thickness,
    )[::-1]
    lower = skfem.MeshQuad.init_tensor(x, y)
    upper = skfem.MeshQuad(-lower.p, lower.t)
    return lower, upper
