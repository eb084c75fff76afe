"""Benchmarks are run by hand: what they call of the package must be there all the same."""

from __future__ import annotations

import math
import runpy

import pytest
from conftest import ROOT

from microslip.describe.reading import load_joint
from microslip.pipeline.prepare import assemble


@pytest.mark.parametrize("name", ["run", "time_step"])
def test_the_unit_of_time_is_measured(name):
    """A triangular solve, over which the steps of contact are given."""
    solve = runpy.run_path(str(ROOT / "benchmarks" / f"{name}.py"))["triangular_solve"]
    joint = load_joint(ROOT / "examples" / "lap_joint.toml")
    small = joint.contact.model_copy(update={"pairs": 21})
    seconds = solve(assemble(joint.model_copy(update={"contact": small})))
    assert 0 < seconds < math.inf
