"""The reference joint described in another way: what is asked of both, and that they answer the same."""

from __future__ import annotations

import tomllib
from pathlib import Path

import numpy as np

SAME = 1e-8
"""What the reference joint may differ from itself as dimensions."""

ROUNDING, STUCK = 1e-15, 1e-6
"""Where the loss of a cycle is this part of the largest one it is rounding of the preload's reactions, and so
is what damping there has of it."""

REQUESTS = {
    "cycle": {"moment": ["2 kN*m/m", "15 kN*m/m"], "drives": ["load", "mode"], "steps": 100},
    "response": {"count": 101, "checks": 1},
    "reduced": {"amplitudes": 8},
    "harmonic": {"frequencies": [172.0, 176.0], "harmonics": 3, "stability": False},
    "time": {"frequencies": [174.0]},
    "backbone": {"count": 3, "methods": ["quasi_static", "prescribed"]},
}
LOAD = {"moment": ["20 N*m/m", "200 N*m/m"]}

TEMPLATE = Path(__file__).parents[1] / "src/microslip/templates/reference_joint.toml"


def reference_document(pairs):
    """The reference joint with analyses of every kind, and an output that every description can name."""
    document = tomllib.loads(TEMPLATE.read_text("utf-8"))
    document["contact"]["pairs"] = pairs
    return document | {"analysis": REQUESTS, "load": LOAD, "output": [{"name": "deflection"}]}


def differ(a, b):
    """Largest difference over the largest value."""
    a, b = np.asarray(a), np.asarray(b)
    return np.abs(a - b).max() / np.abs(a).max()


def check_states(lap, other):
    """Both linear states, prestress, opening and flexibility."""
    for name in ("sliding_omega", "stuck_omega", "overlap"):
        assert differ(getattr(lap.mode, name), getattr(other.mode, name)) < SAME
    assert differ(lap.prestress.pressure, other.prestress.pressure) < SAME
    assert differ(lap.assembly.opening_moment, other.assembly.opening_moment) < SAME
    assert differ(lap.model.residual, other.model.residual) < SAME


def check_cycles(lap, other):
    """Every cycle and every table."""
    assert not lap.failures
    assert not other.failures
    for drive, cycles in lap.cycles.items():
        for a, b in zip(cycles, other.cycles[drive], strict=True):
            assert differ(a.r, b.r) < SAME
            assert differ(a.dissipated, b.dissipated) < SAME
    for drive, table in lap.tables.items():
        assert differ(table.k_eq, other.tables[drive].k_eq) < SAME
        assert differ(table.gamma_eq, other.tables[drive].gamma_eq) < SAME


def check_answers(lap, other, quality=1.0):
    """Responses, harmonic balance and a time point within `quality` times `SAME`; backbones."""
    for a, b in zip(lap.responses, other.responses, strict=True):
        assert differ(a.frequency, b.frequency) < SAME
        assert differ(a.outputs["deflection"], b.outputs["deflection"]) < SAME * quality
    for a, b in zip(lap.harmonic, other.harmonic, strict=True):
        for one, two in zip(a.points, b.points, strict=True):
            assert differ(one.amplitude, two.amplitude) < SAME * quality
    for a, b in zip(lap.time_domain, other.time_domain, strict=True):
        assert differ(a.steady.amplitude, b.steady.amplitude) < SAME * quality
    for a, b in zip(lap.backbones, other.backbones, strict=True):
        for one, two in zip(a.points, b.points, strict=True):
            assert differ(one.omega, two.omega) < SAME
            sticks = one.dissipated < ROUNDING * a.points[-1].dissipated
            allowed = STUCK if sticks else SAME
            assert differ(one.damping_ratio, two.damping_ratio) < allowed
