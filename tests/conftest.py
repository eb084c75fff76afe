"""The reference joint (theory, section 5), built once for all tests."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from microslip.analyses.statics.cycle import Prestress, prestress
from microslip.model.elasticity import Material
from microslip.model.flexibility import Flexibility, static_flexibility
from microslip.model.joint import JointModel, Reducer
from microslip.model.lap import lap_joint_structure
from microslip.model.lap_mesh import LapGeometry, MeshControl
from microslip.model.modes import LinearModes, linear_modes
from microslip.model.structure import Structure

ROOT = Path(__file__).parents[1]
"""Of the repository."""

GEOMETRY = LapGeometry(
    length=0.2515, thickness=0.0125, overlap_half_length=0.0375, clamp_half_length=0.025
)
MATERIAL = Material(70e9, 0.3, 2000.0, "strain")
SPRING = 1e5
CLAMP = 1e6
FRICTION = 0.25
RAYLEIGH = (0.0, 7.3e-7)
MODES = 80


def joint_structure(
    pairs: int, geometry: LapGeometry = GEOMETRY, material: Material = MATERIAL
) -> Structure:
    """The reference joint with another number of contact pairs, or another geometry."""
    return lap_joint_structure(
        geometry, material, MeshControl(contact_pairs=pairs), horizontal_spring=SPRING
    )


def bending_mode(modes: LinearModes, structure: Structure) -> int:
    """The mode that the end moment drives most: largest static modal response."""
    work = structure.loads["moment"] @ modes.shapes
    return int(np.argmax(np.abs(work) / modes.omega**2))


@dataclass(frozen=True)
class Reference:
    """A joint with its model, prestress, and its sliding and stuck bending modes."""

    geometry: LapGeometry
    structure: Structure
    reducer: Reducer
    model: JointModel
    flexibility: Flexibility
    start: Prestress
    omega_sliding: float
    omega_stuck: float
    shape_sliding: NDArray[np.float64]
    shape_stuck: NDArray[np.float64]

    @property
    def moment(self) -> float:
        """P L: the end moments are given in units of it."""
        return self.start.clamp * self.geometry.length

    @property
    def spacing(self) -> float:
        """Distance between neighbouring contact pairs."""
        return float(np.diff(self.model.position).max())


def build_reference(pairs: int, clamp: float = CLAMP, modes: int = MODES) -> Reference:
    """Reference joint with ports for its loads and for both modal inertia loads."""
    structure = joint_structure(pairs)
    reducer = Reducer(structure, modes, RAYLEIGH)
    plain = reducer.model(structure.loads)
    start = prestress(plain, static_flexibility(plain), clamp)
    chosen = []
    for directions in (1, 2):
        linear = linear_modes(structure, start.bonded(directions), 8, align="moment")
        k = bending_mode(linear, structure)
        chosen.append((linear.omega[k], linear.shapes[:, k]))
    (omega_sliding, sliding), (omega_stuck, stuck) = chosen
    model = reducer.with_ports(
        plain, {"sliding": structure.mass @ sliding, "stuck": structure.mass @ stuck}
    )
    flexibility = static_flexibility(model)
    return Reference(
        GEOMETRY,
        structure,
        reducer,
        model,
        flexibility,
        prestress(model, flexibility, clamp),
        float(omega_sliding),
        float(omega_stuck),
        sliding,
        stuck,
    )


@pytest.fixture(scope="session")
def reference() -> Reference:
    """The reference joint with 201 contact pairs."""
    return build_reference(201)


@pytest.fixture(scope="session")
def small_reference() -> Reference:
    """The reference joint with 51 contact pairs, for tests that need many cycles."""
    return build_reference(51, modes=40)


@pytest.fixture(scope="session")
def published() -> dict:
    """Published and derived numbers, each table with its source."""
    with (Path(__file__).parent / "benchmarks_physics" / "references.toml").open("rb") as file:
        return tomllib.load(file)
