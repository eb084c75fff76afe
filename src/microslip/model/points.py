"""Points of a structure whose motion is wanted, as load vectors.

By reciprocity the output ``y = p^T x`` of a load vector p is what a unit load does work on: a unit
force at a point gives its displacement, a unit moment on a section its rotation, two opposite
forces across the interface the slip or the gap there. Between the nodes displacements are those of
the elements' own shape functions, so that nothing is interpolated twice.

A section's rotation, counter-clockwise, is that of the straight line which fits its axial
displacement best,

    theta = -12/h³ ∫ (y - y_c) u_x dy,

and what a bending stress that is linear over the height does work on.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import skfem

from microslip.describe.outputs import Output, position_of
from microslip.errors import ModelError
from microslip.model.elasticity import ELEMENT
from microslip.model.structure import Structure
from microslip.typing import Array, Indices

NEAR = 1e-9
"""Of the size of a body: so far off it a point still counts as on it."""

AXIAL, VERTICAL = 0, 1
"""Components of a displacement."""

FACING = {"lower": "top", "upper": "bottom"}
"""Face in contact of each body."""


@dataclass(frozen=True)
class Body:
    """One body among those of a structure.

    Attributes
    ----------
    name : str
    mesh : skfem.MeshQuad
    first : int
        Its first degree of freedom among those of the whole mesh.
    dofs : int
        Of the whole mesh.
    """

    name: str
    mesh: skfem.MeshQuad
    first: int
    dofs: int

    @property
    def reach(self) -> tuple[float, float]:
        """Least and largest x, m."""
        return float(self.mesh.p[0].min()), float(self.mesh.p[0].max())

    def holds(self, x: float) -> bool:
        """Whether it has a section at x."""
        left, right = self.reach
        margin = NEAR * (right - left)
        return left - margin <= x <= right + margin


def bodies_of(
    meshes: Sequence[skfem.MeshQuad], names: Sequence[str] = ("lower", "upper")
) -> tuple[Body, ...]:
    """Bodies by name, in the order of their degrees of freedom: two per corner and mid-side node."""
    sizes = [2 * (mesh.p.shape[1] + mesh.facets.shape[1]) for mesh in meshes]
    starts = np.concatenate([[0], np.cumsum(sizes)])
    return tuple(
        Body(name, mesh, int(start), int(starts[-1]))
        for name, mesh, start in zip(names, meshes, starts[:-1], strict=True)
    )


def point_load(body: Body, x: float, y: float, component: int) -> Array:
    """Unit force at a point of a body.

    Parameters
    ----------
    body : Body
    x, y : float
        m.
    component : int
        `AXIAL` or `VERTICAL`.

    Returns
    -------
    (n,) array
        On all degrees of freedom of the mesh; ``p @ u`` is the displacement of the point.

    Raises
    ------
    ModelError
        Where the body does not reach there.

    Examples
    --------
    >>> square = bodies_of([skfem.MeshQuad()], ["plate"])[0]
    >>> p = point_load(square, 0.3, 0.8, VERTICAL)
    >>> round(float(p.sum()), 12)  # the whole force arrives
    1.0
    """
    cell, local = _find(body, x, y)
    scalar = ELEMENT.elem
    shape = np.array([scalar.lbasis(local, i)[0] for i in range(8)])
    mesh = body.mesh
    nodes = np.concatenate([mesh.t[:, cell], mesh.p.shape[1] + mesh.t2f[:, cell]])
    load = np.zeros(body.dofs)
    load[body.first + 2 * nodes + component] = shape
    return load


def section_height(body: Body, x: float) -> Array:
    """Levels of the element edges over a section, m, ascending."""
    cells = _beside(body, x)
    if not len(cells):
        left, right = body.reach
        raise ModelError(
            f"x = {x:g} m lies off the {body.name} beam, which reaches from {left:g} to {right:g} m"
        )
    level = np.sort(body.mesh.p[1, body.mesh.t[:, cells]].ravel())
    apart = np.diff(level) > NEAR * np.ptp(level)
    return level[np.concatenate([[True], apart])]


def rotation_load(body: Body, x: float) -> Array:
    """Unit moment on a section, linear over its height; the output is the section's rotation.

    Examples
    --------
    >>> square = bodies_of([skfem.MeshQuad()], ["plate"])[0]
    >>> corner_x = square.mesh.p[0]
    >>> bool(abs(rotation_load(square, 0.5).sum()) < 1e-12)  # no force in it
    True
    """
    level = section_height(body, x)
    middle, height = 0.5 * (level[0] + level[-1]), level[-1] - level[0]
    nodes, weights = np.polynomial.legendre.leggauss(3)
    load = np.zeros(body.dofs)
    for low, high in pairwise(level):
        for s, w in zip(nodes, weights, strict=True):
            y = 0.5 * (low + high) + 0.5 * (high - low) * s
            share = -12 / height**3 * (y - middle) * 0.5 * (high - low) * w
            load += share * point_load(body, x, y, AXIAL)
    return load


def level_of(body: Body, x: float, side: str) -> float:
    """Height of a point of a section, m.

    Parameters
    ----------
    body : Body
    x : float
    side : str
        ``"top"``, ``"bottom"``, ``"mid-height"`` or ``"contact"``: the face towards the other body.
    """
    level = section_height(body, x)
    where = FACING[body.name] if side == "contact" else side
    return float({"top": level[-1], "bottom": level[0]}.get(where, 0.5 * (level[0] + level[-1])))


def output_load(output: Output, bodies: Sequence[Body], clamp: float) -> Array:
    """Load vector of an output on all degrees of freedom of the mesh.

    Parameters
    ----------
    output : Output
    bodies : sequence of Body
    clamp : float
        Where the clamp ends, m.

    Raises
    ------
    ModelError
        Where no body is there.
    """
    x = position_of(output, {body.name: body.reach for body in bodies}, clamp)
    motion = output.measured.motion
    if output.across:
        component = AXIAL if motion == "slip" else VERTICAL
        lower, upper = (
            point_load(body, x, level_of(body, x, "contact"), component) for body in bodies
        )
        return upper - lower
    there = [b for b in bodies if b.holds(x) and output.beam in (None, b.name)]
    if not there:
        raise ModelError(f"output {output.name!r}: there is no beam at x = {x:g} m")
    if motion == "rotation":
        return np.asarray(sum(rotation_load(body, x) for body in there) / len(there))
    side = output.side or ("contact" if len(there) > 1 else "mid-height")
    component = AXIAL if motion == "axial" else VERTICAL
    loads = [point_load(body, x, level_of(body, x, side), component) for body in there]
    return np.asarray(sum(loads) / len(loads))


def with_outputs(structure: Structure, outputs: Sequence[Output], clamp: float) -> Structure:
    """The structure with a load, and so a port, per output; reactions have theirs already.

    Parameters
    ----------
    structure : Structure
        With meshes, in the order of its degrees of freedom.
    outputs : sequence of Output
    clamp : float
        Where the clamp ends, m.

    Raises
    ------
    ModelError
        Where an output lies off the bodies.
    """
    bodies = bodies_of(structure.meshes)
    loads = {o.port: output_load(o, bodies, clamp)[structure.free] for o in outputs if not o.reacts}
    return replace(structure, loads={**structure.loads, **loads})


def _beside(body: Body, x: float) -> Indices:
    """Elements that a vertical line at x meets."""
    corners = body.mesh.p[0, body.mesh.t]
    margin = NEAR * np.ptp(body.mesh.p[0])
    return np.flatnonzero((corners.min(axis=0) <= x + margin) & (corners.max(axis=0) >= x - margin))


def _find(body: Body, x: float, y: float) -> tuple[int, Array]:
    """Element that a point lies in, and where in it, both coordinates from 0 to 1."""
    cells = _beside(body, x)
    corners = body.mesh.p[1, body.mesh.t[:, cells]]
    margin = NEAR * np.ptp(body.mesh.p[1])
    cells = cells[(corners.min(axis=0) <= y + margin) & (corners.max(axis=0) >= y - margin)]
    if len(cells):
        mapping = body.mesh.mapping()
        point = np.tile(np.array([[x], [y]])[:, None], (1, len(cells), 1))
        local = mapping.invF(point, tind=cells)[:, :, 0]
        outside = np.abs(local - 0.5).max(axis=0)
        best = int(np.argmin(outside))
        if outside[best] <= 0.5 + 1e-6:
            return int(cells[best]), np.clip(local[:, best], 0.0, 1.0)
    raise ModelError(f"({x:g}, {y:g}) m lies off the {body.name} beam")
