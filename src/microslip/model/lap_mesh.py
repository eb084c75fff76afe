"""Structured, graded mesh of a lap joint of two beams.

Lower beam: ``x`` from ``overlap - length`` to ``overlap``, ``y`` from ``-thickness`` to 0.
Upper beam: a lower one of its own dimensions under a half turn about the origin. The turn negates the
coordinates, so that the mesh of identical beams is symmetric to the last bit and a reversed moment
mirrors every result.
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
        Length of the lower beam, and of the upper one where that has none of its own.
    thickness : float
        Thickness, likewise.
    overlap_half_length : float
        The beams overlap over ``|x| <= overlap_half_length``.
    clamp_half_length : float
        The clamp presses the outer faces over ``|x - clamp_centre| <= clamp_half_length``.
    clamp_centre : float
    upper_length, upper_thickness : float, optional
        Of the upper beam, where they are others.
    """

    length: float
    thickness: float
    overlap_half_length: float
    clamp_half_length: float
    clamp_centre: float = 0.0
    upper_length: float | None = None
    upper_thickness: float | None = None

    @property
    def lengths(self) -> tuple[float, float]:
        """Of the lower and the upper beam."""
        return self.length, self.upper_length or self.length

    @property
    def thicknesses(self) -> tuple[float, float]:
        """Of the lower and the upper beam."""
        return self.thickness, self.upper_thickness or self.thickness


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

    Where the beams are identical, node ``i`` of the lower mesh at ``(x, y)`` has its image, node
    ``i`` of the upper mesh, at ``(-x, -y)``.
    """
    lower, turned = (
        _lower_mesh(geometry, length, thickness, control)
        for length, thickness in zip(geometry.lengths, geometry.thicknesses, strict=True)
    )
    return lower, skfem.MeshQuad(-turned.p, turned.t)


def _lower_mesh(
    g: LapGeometry, length: float, thickness: float, control: MeshControl
) -> skfem.MeshQuad:
    """Mesh of a beam that lies to the left and below."""
    x_overlap = overlap_grid(g, control.contact_pairs)
    size = 2 * g.overlap_half_length / (control.contact_pairs // 2)
    x = x_overlap
    far = g.overlap_half_length - length
    if far < -g.overlap_half_length * (1 + 1e-12):
        rest = graded(
            -g.overlap_half_length, far, size, 1.4, max(control.rest_size * thickness, size)
        )
        x = np.concatenate([rest[:0:-1], x_overlap])
    y = graded(
        0.0,
        -thickness,
        min(size, control.max_layer * thickness),
        control.overlap_growth,
        control.max_layer * thickness,
    )[::-1]
    return skfem.MeshQuad.init_tensor(x, y)
