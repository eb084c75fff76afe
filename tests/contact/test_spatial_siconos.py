"""The spatial solver against an independent one, Siconos' NSN_AC, on exported steps; where installed."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import ROOT
from random_contact import plain

from microslip.contact.pairs import STICK, slip_history
from microslip.contact.solver import ContactSolver

sys.path.insert(0, str(ROOT / "benchmarks" / "population"))

from spatial_problems import problems

PYTHON = shutil.which("python3", path="/usr/bin")
HAS_SICONOS = (
    bool(PYTHON)
    and not subprocess.run(
        [PYTHON, "-c", "import siconos.numerics"], capture_output=True, check=False
    ).returncode
)


@pytest.mark.skipif(not HAS_SICONOS, reason="python3-siconos is not installed")
def test_reactions_are_those_of_siconos(tmp_path: Path):
    """Steps of random problems; where both solve, and friction is weak enough for one solution."""
    steps, mine = {}, []
    for number, (W, mu, loads) in enumerate(problems(1001, 12, steps=30)):
        mu = min(mu, 0.15)
        m = len(W) // 3
        solver = ContactSolver(plain(W), mu, np.ones(m), np.full(m, STICK, np.int8))
        vt_old = np.zeros((m, 2))
        for step, v_free in enumerate(loads):
            solution = solver.solve(v_free, np.zeros(0), vt_old)
            if step in (5, 29):
                k = len(mine)
                steps |= {f"W{k}": W, f"v_free{k}": v_free, f"vt_old{k}": vt_old, f"mu{k}": mu}
                mine.append((number, solution.r))
            vt_old = slip_history(solution.v, 3)
    np.savez(tmp_path / "steps.npz", count=len(mine), **steps)
    script = Path(__file__).with_name("siconos_reactions.py")
    subprocess.run(
        [PYTHON, str(script), str(tmp_path / "steps.npz"), str(tmp_path / "found.npz")],
        check=True,
        capture_output=True,
    )
    found = np.load(tmp_path / "found.npz")
    solved = [k for k in range(len(mine)) if not found[f"failed{k}"]]
    assert len(solved) >= 0.8 * len(mine)
    for k in solved:
        number, r = mine[k]
        other = found[f"r{k}"]
        assert np.abs(other - r).max() <= 1e-6 * np.abs(r).max(), f"problem {number}"
