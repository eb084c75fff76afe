"""Displacements of the whole structure, back from the joint model."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import description
from mesh_files import plates_document

from microslip.analyses.statics.cycle import quasi_static_cycle
from microslip.describe.reading import parse_joint
from microslip.pipeline.motion import motion_from_prestress, static_motion
from microslip.pipeline.prepare import assemble


def spatial(folder):
    return assemble(parse_joint(plates_document(folder), "mesh", folder)), "tip", 1e4


def planar(folder):
    """A lap joint on weak springs: its rigid motions are unknowns of statics."""
    assembly = assemble(parse_joint(description(41, 30, analysis={})))
    return assembly, "moment", 4e-3 * assembly.moment_unit


@pytest.mark.parametrize("made", [spatial, planar])
def test_motion_is_that_of_the_finite_elements(made, tmp_path):
    """``K u = P a - B^T r``, ``B u = v`` and ``P^T u = y``: none of them is how u is computed."""
    assembly, port, load = made(tmp_path)
    cycle = quasi_static_cycle(assembly.prepared, port, load, steps=24)
    start, structure = assembly.prestress.solution, assembly.structure
    steps = np.arange(0, 25, 6)
    a = np.tile(assembly.prepared.held, (len(steps), 1))
    a[:, assembly.model.port(port)] += cycle.load[steps]
    u = static_motion(assembly, a, cycle.r[steps], cycle.v[steps])
    B, K = structure.interface.relative, structure.stiffness
    force = sum(
        structure.loads[name][:, None] * a[:, assembly.model.port(name)] for name in structure.loads
    )
    force = force - B.T @ cycle.r[steps].T
    assert np.abs(K @ u.T - force).max() < 1e-6 * np.abs(force).max()
    seen = np.abs((B @ u.T).T - cycle.v[steps]).max()
    assert seen < 1e-6 * np.abs(u).max()
    moved = motion_from_prestress(assembly, cycle, steps)
    rest = static_motion(assembly, assembly.prepared.held[None], start.r[None], start.v[None])
    # Contact alone holds one plate: the stiffness has no inverse, and magnifies what forces lose by rounding.
    assert np.abs(rest).max() > 1e-4 * np.abs(u).max()
    assert moved == pytest.approx(u - rest, abs=1e-9 * np.abs(u).max())
    for name, p in structure.loads.items():
        y = cycle.output[steps, assembly.model.port(name)]
        assert moved @ p == pytest.approx(y, abs=1e-6 * np.abs(cycle.output).max())
