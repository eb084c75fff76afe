"""Unit loads of a lap joint: moments and forces at its far ends, and the motion of its base.

The amplitude of a load is per metre of width, and the output of its port is what it does work on: the
rotation of the ends for a moment, their mean displacement for a force. Ends are faces; a moment is a
linear traction over them, as bending stress is, a force an even one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from microslip.errors import ModelError
from microslip.model.elasticity import Body, traction_load
from microslip.typing import Array, Indices

LEFT, RIGHT, BOTH = "left", "right", "both"
MOMENT, FORCE, BASE = "moment", "force", "base"

ON_FACE = 1e-9
"""Of the distance of an end: so far off its face a node still lies on it."""

PINNED, CLAMPED, FREE = "pinned", "clamped", "free"
"""What holds a far end: its middle held vertically, on horizontal springs; the whole face; nothing."""


@dataclass(frozen=True)
class EndLoad:
    """A unit load.

    Attributes
    ----------
    name : str
        Of its port.
    kind : str
        ``"moment"`` in N m/m, positive where it bends the joint concave up; ``"force"`` in N/m;
        ``"base"`` the acceleration of what the joint is fixed to, m/s²: displacements are then
        those relative to it.
    at : str
        ``"left"``, ``"right"``, or ``"both"`` far ends; not of a base.
    direction : str
        ``"x"`` or ``"y"``, of a force and a base. Forces along x at both ends pull them apart.
    """

    name: str
    kind: str
    at: str = BOTH
    direction: str = "y"


@dataclass(frozen=True)
class EndReaction:
    """What the support of an end holds with.

    Attributes
    ----------
    name : str
        Of its port.
    at : str
        ``"left"`` or ``"right"``.
    direction : str or None
        ``"x"`` or ``"y"`` of a force, N/m; None of the moment about the middle of the face, N m/m,
        counter-clockwise.
    """

    name: str
    at: str
    direction: str | None


@dataclass(frozen=True)
class FarEnd:
    """A body and its far end.

    Attributes
    ----------
    side : float
        -1 of the lower beam, whose end is on the left; 1 of the upper one.
    body : Body
    x : float
        Of the end, m.
    thickness : float
    face : (k,) int array
        Its facets.
    """

    side: float
    body: Body
    x: float
    thickness: float
    face: Indices

    @property
    def middle(self) -> float:
        """y of mid-height, m."""
        return self.side * self.thickness / 2


def end_load(load: EndLoad, ends: Sequence[FarEnd]) -> Array:
    """Load vector of a unit load on the bodies, one after the other.

    Parameters
    ----------
    load : EndLoad
    ends : sequence of FarEnd
        The lower and the upper beam.

    Raises
    ------
    ModelError
        Where its kind, place or direction is none of those there are.
    """
    if load.kind not in (MOMENT, FORCE, BASE):
        raise ModelError(f"no load {load.kind!r}: choose {MOMENT}, {FORCE} or {BASE}")
    if load.at not in (LEFT, RIGHT, BOTH):
        raise ModelError(f"no end {load.at!r}: choose {LEFT}, {RIGHT} or {BOTH}")
    if load.direction not in ("x", "y"):
        raise ModelError(f"no direction {load.direction!r}: choose x or y")
    axis = "xy".index(load.direction)
    parts = []
    for end, name in zip(ends, (LEFT, RIGHT), strict=True):
        body = end.body
        if load.kind == BASE:
            moved = np.zeros((body.nodes.shape[1], 2))
            moved[:, axis] = 1.0
            parts.append(-(body.mass @ moved.ravel()))
        elif load.at not in (BOTH, name):
            parts.append(np.zeros(body.mass.shape[0]))
        elif load.kind == MOMENT:
            gradient = -end.side * 12 / end.thickness**3
            traction = partial(_linear_traction, centre=end.middle, gradient=gradient)
            parts.append(traction_load(body, end.face, traction))
        else:
            size = np.zeros(2)
            size[axis] = (end.side if load.at == BOTH and axis == 0 else 1.0) / end.thickness
            parts.append(traction_load(body, end.face, partial(_even_traction, size=size)))
    return np.concatenate(parts)


def end_motion(reaction: EndReaction, ends: Sequence[FarEnd]) -> Array:
    """Unit motion of the face of an end on the bodies, one after the other: a shift, or a turn.

    Parameters
    ----------
    reaction : EndReaction
    ends : sequence of FarEnd
        The lower and the upper beam.
    """
    parts = []
    for end, name in zip(ends, (LEFT, RIGHT), strict=True):
        nodes = end.body.nodes
        moved = np.zeros((nodes.shape[1], 2))
        if reaction.at == name:
            on = np.flatnonzero(np.abs(nodes[0] - end.x) < ON_FACE * np.abs(end.x))
            if reaction.direction is None:
                moved[on, 0] = -(nodes[1, on] - end.middle)
            else:
                moved[on, "xy".index(reaction.direction)] = 1.0
        parts.append(moved.ravel())
    return np.concatenate(parts)


def _linear_traction(x: Array, y: Array, centre: float, gradient: float) -> tuple[Array, Array]:
    """Horizontal traction that grows linearly over the height, as bending stress does."""
    return gradient * (y - centre), np.zeros_like(x)


def _even_traction(x: Array, y: Array, size: Array) -> tuple[Array, Array]:
    return np.full_like(x, size[0]), np.full_like(y, size[1])
