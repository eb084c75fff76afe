"""A joint from a mesh: the lap joint again, through the same run."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np
import pytest
from mesh_files import lap_document

from microslip.describe.reading import parse_joint
from microslip.pipeline.run import run

ROOT = Path(__file__).parents[2]

SAME = 1e-8
"""What the reference joint may differ as a mesh from itself as dimensions."""

REQUESTS = {
    "cycle": {"moment": ["2 kN*m/m", "15 kN*m/m"], "drives": ["load", "mode"], "steps": 100},
    "response": {"count": 101},
    "reduced": {"amplitudes": 8},
    "harmonic": {"frequencies": [172.0, 176.0], "harmonics": 3, "stability": False},
    "time": {"frequencies": [174.0]},
    "backbone": {"count": 3, "methods": ["quasi_static", "prescribed"]},
}
LOAD = {"moment": ["20 N*m/m", "200 N*m/m"]}


def differ(a, b):
    """Largest difference over the largest value."""
    a, b = np.asarray(a), np.asarray(b)
    return np.abs(a - b).max() / np.abs(a).max()


@pytest.fixture(scope="module")
def lap_file():
    text = (ROOT / "src/microslip/templates/reference_joint.toml").read_text("utf-8")
    document = tomllib.loads(text)
    document["contact"]["pairs"] = 49  # so that elements end where the clamp does
    return document | {"analysis": REQUESTS, "load": LOAD, "output": [{"name": "deflection"}]}


@pytest.fixture(scope="module")
def both(lap_file, tmp_path_factory):
    folder = tmp_path_factory.mktemp("mesh")
    lap = parse_joint(lap_file)
    document = lap_document(lap, folder) | {"analysis": REQUESTS, "load": LOAD}
    return run(lap), run(parse_joint(document, "mesh", folder))


def test_reference_joint_as_a_mesh_has_the_same_states(both):
    lap, mesh = both
    for name in ("sliding_omega", "stuck_omega", "overlap"):
        assert differ(getattr(lap.mode, name), getattr(mesh.mode, name)) < SAME
    assert differ(lap.prestress.pressure, mesh.prestress.pressure) < SAME
    assert differ(lap.assembly.opening_moment, mesh.assembly.opening_moment) < SAME
    assert differ(lap.model.residual, mesh.model.residual) < SAME


def test_reference_joint_as_a_mesh_has_the_same_cycles(both):
    lap, mesh = both
    assert not lap.failures
    assert not mesh.failures
    for drive, cycles in lap.cycles.items():
        for a, b in zip(cycles, mesh.cycles[drive], strict=True):
            assert differ(a.r, b.r) < SAME
            assert differ(a.dissipated, b.dissipated) < SAME
    for drive, table in lap.tables.items():
        assert differ(table.k_eq, mesh.tables[drive].k_eq) < SAME
        assert differ(table.gamma_eq, mesh.tables[drive].gamma_eq) < SAME


def test_reference_joint_as_a_mesh_answers_the_same(both):
    lap, mesh = both
    for a, b in zip(lap.responses, mesh.responses, strict=True):
        assert differ(a.frequency, b.frequency) < SAME
        assert differ(a.outputs["deflection"], b.outputs["deflection"]) < SAME
    for a, b in zip(lap.harmonic, mesh.harmonic, strict=True):
        for one, other in zip(a.points, b.points, strict=True):
            assert differ(one.amplitude, other.amplitude) < SAME
    for a, b in zip(lap.time_domain, mesh.time_domain, strict=True):
        assert differ(a.steady.amplitude, b.steady.amplitude) < SAME
    for a, b in zip(lap.backbones, mesh.backbones, strict=True):
        for one, other in zip(a.points, b.points, strict=True):
            assert differ(one.omega, other.omega) < SAME
            assert differ(one.damping_ratio, other.damping_ratio) < SAME
