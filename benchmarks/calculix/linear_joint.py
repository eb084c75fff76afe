"""The joint on linear quadrilaterals: one node at every contact pair of the quadratic mesh.

Each eight-node element of `microslip.model.lap_mesh` is cut into four, at its mid-side nodes. Corner
and mid-side nodes of the interface are contact pairs there, so pairs and nodes coincide here. Loads
are the consistent nodal forces of the linear shape functions, per metre of width, SI.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from microslip.errors import ModelError
from microslip.model.lap_mesh import lap_joint_meshes


@dataclass(frozen=True)
class LinearJoint:
    """Two beams of four-node rectangles, lower one first.

    Attributes
    ----------
    nodes : (n, 2) array
        Positions, m.
    quads : (e, 4) int array
        Corners of each element, counter-clockwise from its lower left.
    lower_nodes, upper_nodes : (m,) int arrays
        Coincident nodes on ``y = 0`` within the overlap, ascending x.
    lower_faces, upper_faces : (m - 1,) int arrays
        Elements below and above each interval of the overlap, ascending x.
    end_nodes : (k,) int array
        Nodes on the two far ends.
    supported : (2,) int array
        Nodes held vertically.
    clamp, moment : (n, 2) arrays
        Nodal forces of a unit clamp force (1 N/m) and of a unit end moment (1 N m/m).
    spring : (n,) array
        Share of the end's horizontal spring (stiffness 1 per end) at each node.
    """

    nodes: np.ndarray
    quads: np.ndarray
    lower_nodes: np.ndarray
    upper_nodes: np.ndarray
    lower_faces: np.ndarray
    upper_faces: np.ndarray
    end_nodes: np.ndarray
    supported: np.ndarray
    clamp: np.ndarray
    moment: np.ndarray
    spring: np.ndarray


def linear_joint(geometry, control):
    """The joint of `lap_joint_meshes`, each quadratic element cut into four linear ones."""
    g = geometry
    corners = lap_joint_meshes(g, control)[0].p
    x, y = (halved(np.unique(line)) for line in corners)
    tol = 1e-9 * g.length
    parts = []
    offset = element_offset = 0
    for side, xs, ys in ((-1.0, x, y), (1.0, -x[::-1], -y[::-1])):
        number = offset + np.arange(len(xs) * len(ys)).reshape(len(ys), len(xs))
        element = element_offset + np.arange((len(xs) - 1) * (len(ys) - 1)).reshape(
            len(ys) - 1, len(xs) - 1
        )
        face, outer, end = (-1, 0, 0) if side < 0 else (0, -1, -1)
        inside = np.abs(xs) <= g.overlap_half_length + tol
        middle = side * g.thickness / 2
        height = ys - middle
        clamp = np.zeros((number.size, 2))
        clamp[number[outer] - offset, 1] = -side * pressed_share(xs, g.clamp_half_length)
        moment = np.zeros((number.size, 2))
        moment[number[:, end] - offset, 0] = -side * 12 / g.thickness**3 * hat_moments(ys, height)
        spring = np.zeros(number.size)
        spring[number[:, end] - offset] = hat_moments(ys, np.ones_like(ys)) / g.thickness
        parts.append(
            {
                "nodes": np.column_stack([np.tile(xs, len(ys)), np.repeat(ys, len(xs))]),
                "quads": np.column_stack(
                    [
                        number[:-1, :-1].ravel(),
                        number[:-1, 1:].ravel(),
                        number[1:, 1:].ravel(),
                        number[1:, :-1].ravel(),
                    ]
                ),
                "interface": number[face, inside],
                "faces": element[face, inside[:-1] & inside[1:]],
                "end_nodes": number[:, end],
                "supported": number[np.argmin(np.abs(height)), end],
                "clamp": clamp,
                "moment": moment,
                "spring": spring,
            }
        )
        offset += number.size
        element_offset += element.size
    lower, upper = parts
    if not np.array_equal(
        x[np.abs(x) <= g.overlap_half_length + tol],
        -x[::-1][np.abs(x[::-1]) <= g.overlap_half_length + tol],
    ):
        raise ModelError("the nodes of the two beams do not match on the plane of contact")
    joined = {
        key: np.concatenate([lower[key], upper[key]])
        for key in ("nodes", "quads", "end_nodes", "clamp", "moment", "spring")
    }
    return LinearJoint(
        lower_nodes=lower["interface"],
        upper_nodes=upper["interface"],
        lower_faces=lower["faces"],
        upper_faces=upper["faces"],
        supported=np.array([lower["supported"], upper["supported"]]),
        **joined,
    )


def halved(line):
    """A line of nodes with the middle of every interval added."""
    fine = np.empty(2 * len(line) - 1)
    fine[::2] = line
    fine[1::2] = 0.5 * (line[1:] + line[:-1])
    return fine


def hat_moments(line, values):
    """Integral of each node's linear shape function times the linear interpolant of `values`."""
    size = np.diff(line)
    result = np.zeros_like(line)
    result[:-1] += size * (2 * values[:-1] + values[1:]) / 6
    result[1:] += size * (values[:-1] + 2 * values[1:]) / 6
    return result


def pressed_share(line, half_length):
    """Nodal forces of a unit force spread evenly over ``|x| <= half_length``, exactly."""
    share = np.zeros_like(line)
    a = np.clip(line[:-1], -half_length, half_length)
    b = np.clip(line[1:], -half_length, half_length)
    right = (0.5 * (a + b) - line[:-1]) / np.diff(line)
    share[:-1] += (b - a) * (1 - right)
    share[1:] += (b - a) * right
    return share / (2 * half_length)
