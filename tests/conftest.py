"""The reference joint (theory, section 5), described once and built once for all tests."""

from __future__ import annotations

import importlib.util
import tomllib
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from microslip.analyses.prepared.joint import PreparedJoint, prepare_joint
from microslip.analyses.prepared.joint_modes import mode_of_structure
from microslip.analyses.prepared.prestress import Prestress, prestress
from microslip.contact.law import contact_law
from microslip.model.elasticity import Material
from microslip.model.flexibility import Flexibility, static_flexibility
from microslip.model.joint import JointModel, Reducer
from microslip.model.lap import lap_joint_structure
from microslip.model.lap_mesh import LapGeometry, MeshControl
from microslip.model.modes import LinearModes
from microslip.model.states import LinearStates, linear_states
from microslip.model.structure import Structure
from microslip.pipeline.outcome import Outcome
from microslip.pipeline.run import Run

pytest_plugins = ["findings"]

collect_ignore = ["contact/siconos_reactions.py"]  # run by another Python, which has Siconos

ROOT = Path(__file__).parents[1]
"""Of the repository."""


@pytest.fixture(autouse=True, scope="session")
def figures_do_not_depend_on_what_is_installed():
    """Bodies are drawn by matplotlib, also where PyVista is installed."""
    with pytest.MonkeyPatch.context() as patch:
        if importlib.util.find_spec("pyvista") is not None:
            patch.setattr("microslip.show.plots.solid.missing", lambda: "left out")
        yield


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


def description(pairs: int, modes: int, **sections: Any) -> dict[str, Any]:
    """The reference joint as an input file has it, with more sections or others."""
    return {
        "beams": {"length": "251.5 mm", "thickness": "12.5 mm", "overlap_half_length": "37.5 mm"},
        "material": {"youngs_modulus": "70 GPa", "poissons_ratio": 0.3, "density": "2 g/cm^3"},
        "contact": {"friction": FRICTION, "pairs": pairs},
        "clamp": {"force": "1 MN/m", "half_length": "25 mm"},
        "damping": {"beta": "0.73 us"},
        "mesh": {"modes": modes},
        **sections,
    }


@dataclass(frozen=True)
class Reference:
    """A joint with its structure, and the sliding and stuck bending mode on all its degrees of freedom."""

    geometry: LapGeometry
    structure: Structure
    reducer: Reducer
    states: LinearStates
    joint: PreparedJoint

    @property
    def model(self) -> JointModel:
        return self.joint.model

    @property
    def flexibility(self) -> Flexibility:
        return self.joint.flexibility

    @property
    def start(self) -> Prestress:
        return self.joint.prestress

    @property
    def moment(self) -> float:
        """P L: the end moments are given in units of it."""
        return self.start.force * self.geometry.length

    @property
    def spacing(self) -> float:
        """Distance between neighbouring contact pairs."""
        return float(np.diff(self.model.position).max())


def build_reference(
    pairs: int,
    clamp: float = CLAMP,
    modes: int = MODES,
    structure: Structure | None = None,
    geometry: LapGeometry = GEOMETRY,
) -> Reference:
    """Reference joint, or that of another structure, driven by the end moment."""
    structure = structure or joint_structure(pairs)
    reducer = Reducer(structure, modes, RAYLEIGH)
    plain = reducer.model(structure.loads)
    start = prestress(plain, static_flexibility(plain), {"clamp": clamp})
    bonded = start.bonded(1), start.bonded(2)
    states = linear_states(structure, np.flatnonzero(start.touching), bonded, "moment")
    model = reducer.with_ports(plain, states.ports(structure))
    mode = mode_of_structure(states, structure, model)
    law = contact_law(model.pairs, FRICTION)
    joint = prepare_joint(model, law, {"clamp": clamp}, "moment", mode)
    return Reference(geometry, structure, reducer, states, joint)


def with_value(run: Run, analysis: str, value: object) -> Run:
    """The same run, as if an analysis had found something else."""
    return replace(run, outcomes={**run.outcomes, analysis: Outcome(value)})


def times(start: Prestress, factor: float) -> Prestress:
    """What a preload as many times as large makes of a prestress: all its fields are linear in it."""
    s = start.solution
    return replace(
        start,
        preload={port: factor * amplitude for port, amplitude in start.preload.items()},
        pressure=factor * start.pressure,
        solution=replace(s, r=factor * s.r, v=factor * s.v, q=factor * s.q),
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
