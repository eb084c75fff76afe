"""Names and directions of a mesh, as a joint file writes them."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator

AXES: dict[str, tuple[float, float, float]] = {
    "x": (1.0, 0.0, 0.0),
    "y": (0.0, 1.0, 0.0),
    "z": (0.0, 0.0, 1.0),
}
"""Directions that have a name."""


def _direction(value: Any) -> tuple[float, ...]:
    if isinstance(value, str) and value in AXES:
        return AXES[value]
    message = 'must be "x", "y", "z", or a vector of two or three numbers, [0.6, 0.8, 0]'
    if not isinstance(value, list | tuple) or len(value) not in (2, 3):
        raise ValueError(message)
    if any(isinstance(v, bool) or not isinstance(v, int | float) for v in value):
        raise ValueError(message)
    length = math.hypot(*value)
    if not 0 < length < math.inf:
        raise ValueError("the vector has no length: " + message)
    x, y, z = (*value, 0.0)[:3]
    return (x / length, y / length, z / length)


def _names(value: Any) -> tuple[Any, ...]:
    values = tuple(value) if isinstance(value, list | tuple) else (value,)
    if not values or not all(isinstance(v, str) and v for v in values):
        raise ValueError("must be the name of a set or surface of the mesh, or a list of them")
    return values


Vector = Annotated[tuple[float, ...], BeforeValidator(_direction)]
"""A direction: a unit vector."""

OnNames = Annotated[tuple[str, ...], BeforeValidator(_names)]
"""One name of the mesh, or several."""

Components = Annotated[
    tuple[Literal["x", "y", "z", "rx", "ry", "rz"], ...], BeforeValidator(_names)
]
