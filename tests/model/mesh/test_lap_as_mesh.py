"""The lap joint as a mesh, with its interface by mortar, is the lap joint."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from lap_as_mesh import lap_as_mesh

import microslip
from microslip.analyses.prepared.joint import prepare_joint
from microslip.analyses.statics.cycle import quasi_static_cycle
from microslip.model.joint import Reducer
from microslip.model.lap import structure_of
from microslip.model.mesh.loads import moment_load, spring_stiffness
from microslip.model.meshed import structure_from_mesh
from microslip.model.mortar.coupling import couple


def of_mesh(joint, mesh):
    """The structure of a mesh with the supports of the lap joint, and the lap's own."""
    lap = structure_of(joint)
    stiff = joint.spring_used / joint.beams.thickness
    springs = sum(spring_stiffness(mesh, name, stiff, 0) for name in ("left_end", "right_end"))
    whole = {}
    for name, load in lap.loads.items():
        whole[name] = np.zeros(mesh.points.size)
        whole[name][lap.free] = load
    fixed = np.setdiff1d(np.arange(mesh.points.size), lap.free)
    assert (fixed % 2 == 1).all()
    held = replace(mesh, node_sets={"pins": fixed // 2})
    pairs = couple(mesh, "lower_contact", "upper_contact")
    return structure_from_mesh(
        held, [pairs], held={"pins": (1,)}, loads=whole, springs=springs
    ), lap


def same(a, b, tolerance=1e-8):
    return abs(a - b).max() <= tolerance * abs(b).max()


@pytest.fixture(scope="module")
def both():
    joint = microslip.reference_joint(pairs=41)
    meshed, lap = of_mesh(joint, lap_as_mesh(joint))
    return joint, meshed.structure, lap


def test_matrices_and_interface_are_those_of_the_lap_joint(both):
    _, meshed, lap = both
    assert np.array_equal(meshed.free, lap.free)
    assert same(meshed.stiffness, lap.stiffness)
    assert same(meshed.mass, lap.mass)
    assert same(meshed.interface.relative, lap.interface.relative)
    assert same(meshed.interface.area, lap.interface.area)
    assert same(meshed.interface.position, lap.interface.position)
    assert same(meshed.supports, lap.supports)
    assert meshed.motions.shape[1] == lap.motions.shape[1]
    both = np.linalg.matrix_rank(np.hstack([meshed.motions, lap.motions]), tol=1e-8)
    assert both == lap.motions.shape[1]


def test_frequencies_prestress_and_a_cycle_are_those_of_the_lap_joint(both):
    joint, meshed, lap = both
    law = microslip.prepare(joint).law
    found = []
    for structure in (meshed, lap):
        reducer = Reducer(structure, 30, (joint.damping.alpha, joint.damping.beta))
        model = reducer.model(structure.loads)
        ready = prepare_joint(model, law, {"clamp": joint.clamp.force}, "moment")
        loop = quasi_static_cycle(ready, "moment", 0.05 * joint.clamp_force_length)
        pressure = ready.prestress.pressure
        found.append((model.omega, pressure, loop.dissipated, loop.pressure, loop.slip))
        assert loop.dissipated > 0
    for a, b in zip(*found, strict=True):
        assert same(np.asarray(a), np.asarray(b))


def test_moment_on_an_end_is_that_of_the_lap_joint(both):
    joint, _, lap = both
    mesh = lap_as_mesh(joint)
    load = moment_load(mesh, "right_end") - moment_load(mesh, "left_end")
    assert same(sp.csr_matrix(load[lap.free]), sp.csr_matrix(lap.loads["moment"]))
