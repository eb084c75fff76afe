"""Masses, springs and moments at named places of a mesh: totals and rigid motions."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mesh_files import plates, plates_document
from model.mesh.write_inp import write_inp

from microslip.describe.reading import parse_joint
from microslip.errors import InputError
from microslip.model.described_mesh import read_described_mesh

WIDTH = 0.02


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("loads")
    mesh = plates()
    tip = np.flatnonzero(mesh.points[:, 0] > 80 - 1e-9)
    line = np.flatnonzero((mesh.points[:, 0] > 80 - 1e-9) & (np.abs(mesh.points[:, 1]) < 4.1))
    write_inp(replace(mesh, node_sets={"tip": tip, "line": line}), folder / "plates.inp")
    return folder


def structure(folder, **more):
    document = plates_document(folder, "other.inp") | {"analysis": {"cycle": {"force": [10.0]}}}
    document["mesh"] = document["mesh"] | {"file": "plates.inp"}
    return read_described_mesh(parse_joint(document | more, "loads", folder)).structure


@pytest.mark.parametrize("place", ["right", "tip", "line"])
def test_a_mass_is_all_there_in_every_direction(folder, place):
    plain, heavy = structure(folder), structure(folder, mass={"on": place, "mass": "0.3 kg"})
    added = (heavy.mass - plain.mass).tocsr()
    for axis in range(3):
        along = plain.free % 3 == axis
        assert added[along][:, along].sum() == pytest.approx(0.3 / WIDTH, rel=1e-10)
    assert added.diagonal().min() >= 0


@pytest.mark.parametrize("place", ["right", "tip"])
def test_springs_on_a_name_have_their_total(folder, place):
    spring = {"on": place, "direction": "y", "total": "2e6 N/m/m"}
    plain, held = structure(folder), structure(folder, spring=spring)
    added = held.stiffness - plain.stiffness
    assert added.sum() == pytest.approx(2e6, rel=1e-6)
    assert abs(added - held.supports).max() < 1e-6 * abs(held.supports).max()


@pytest.mark.parametrize("axis", [[0, 1, 0], [1, 0, 0], [0.6, 0.8, 0]])
def test_a_moment_on_nodes_does_its_work_on_a_rotation_alone(folder, axis):
    port = {"name": "twist", "kind": "moment", "on": "tip", "direction": axis}
    output = {"name": "tilt", "quantity": "rotation", "on": "tip", "direction": axis}
    more = {"port": port, "output": output, "load": {"moment": [1.0]}}
    found = structure(folder, **more, analysis={"cycle": {"moment": [1.0]}})
    mesh = plates()
    x, free = mesh.points * 1e-3, found.free
    for moved, work in (
        *((np.tile(e, (len(x), 1)), 0.0) for e in np.eye(3)),
        (np.cross(axis, x), 1.0),
    ):
        own = moved.ravel()[free]
        assert found.loads["twist"] @ own == pytest.approx(work, abs=1e-9)
        assert found.loads["output tilt"] @ own == pytest.approx(work, abs=1e-9)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"spring": {"on": "tip", "direction": "y", "stiffness": 1e7}}, "give total"),
        ({"spring": {"on": "tip", "direction": "y"}}, "give stiffness, per area, or total"),
        ({"mass": {"on": "nowhere", "mass": 1.0}}, 'mass.on = "nowhere": the mesh has no'),
        ({"mass": {"on": "tip", "mass": "-1 kg"}}, r"mass"),
    ],
)
def test_what_is_nowhere_or_nothing_is_refused(folder, more, said):
    with pytest.raises(InputError, match=said):
        structure(folder, **more)
