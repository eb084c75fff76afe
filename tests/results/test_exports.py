"""Files for other programs: read back, they hold what the run has."""

from __future__ import annotations

import re
import tomllib
from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
import pyuff
from conftest import ROOT, description
from mesh_files import plates_document, section_document

from microslip.describe.reading import parse_joint
from microslip.errors import InputError
from microslip.pipeline.run import run as run_joint
from microslip.results.universal import UFF, Curve, curves_of, write_universal
from microslip.results.vtk import NAMES, steps_of, write_vtk
from microslip.show.exports import export, not_exported

FORCE = 12e3
"""Of the bolt of the plates, N."""


@pytest.fixture(scope="module")
def plates(tmp_path_factory):
    folder = tmp_path_factory.mktemp("plates")
    document = plates_document(folder)
    document["analysis"] = {"cycle": {"force": [1.5e4], "drives": ["load"], "steps": 40}}
    return run_joint(parse_joint(document, "mesh", folder))


@pytest.fixture(scope="module")
def vtk(plates, tmp_path_factory):
    folder = tmp_path_factory.mktemp("vtk")
    return folder, write_vtk(plates, folder, "load", 0)


@pytest.fixture(scope="module")
def lap():
    return run_joint(
        parse_joint(
            description(
                21,
                30,
                load={"moment": [20.0, 60.0]},
                analysis={
                    "cycle": {"moment_over_clamp_force_length": [1e-3, 4e-3], "steps": 40},
                    "response": {"from": "170 Hz", "to": "185 Hz", "count": 31},
                    "harmonic": {"from": "172 Hz", "to": "180 Hz", "count": 5, "harmonics": 3},
                },
                output=[
                    {"name": "middle"},
                    {"name": "end", "quantity": "rotation", "x": "right end"},
                    {"name": "rate", "quantity": "velocity"},
                    {"name": "slip", "quantity": "slip", "x": "clamp edge"},
                ],
            )
        )
    )


def test_every_file_is_listed_and_read(vtk):
    folder, written = vtk
    assert set(written) == {p for p in folder.rglob("*") if p.is_file()}
    for path in written:
        if path.suffix == ".vtu":
            assert len(meshio.read(path).points)


def test_elements_are_those_of_the_mesh(plates, vtk):
    found = meshio.read(vtk[0] / "modes.vtu")
    assert found.points == pytest.approx(plates.geometry.points, abs=0)
    (block,) = plates.geometry.blocks
    assert found.cells_dict[NAMES[block.kind]].tolist() == block.nodes.tolist()


def test_modes_are_those_of_the_structure(plates, vtk):
    """Names hold the frequencies; shapes move the points as the output of the tip says."""
    data = meshio.read(vtk[0] / "modes.vtu").point_data
    mode, g = plates.mode, plates.geometry
    for word, shape, f in (
        ("sliding", plates.assembly.states.sliding, mode.sliding_frequency),
        ("stuck", plates.assembly.states.stuck, mode.stuck_frequency),
    ):
        (name,) = [n for n in data if n.startswith(word)]
        assert float(name.split("_")[1]) == pytest.approx(f, rel=1e-5)
        assert data[name] == pytest.approx(g.displacement(shape), abs=0)
        tip = plates.structure.loads["tip"]
        assert (data[name] * g.forces(tip)).sum() == pytest.approx(shape @ tip, rel=1e-9)
    free = [n for n in data if n.startswith("free_interface")]
    assert len(free) == len(plates.model.omega)


def test_pressure_over_the_faces_carries_the_bolt(vtk):
    """Bilinear over quadrilaterals: the mean of the corners over the area."""
    found = meshio.read(vtk[0] / "prestress_contact.vtu")
    quads = found.cells_dict["quad"]
    x = found.points[quads]
    size = 0.5 * np.linalg.norm(np.cross(x[:, 2] - x[:, 0], x[:, 3] - x[:, 1]), axis=1)
    mean = found.point_data["pressure"][quads].mean(axis=1)
    assert size @ mean == pytest.approx(FORCE, rel=1e-6)
    state, gap = found.point_data["state"], found.point_data["gap"]
    assert (found.point_data["pressure"][state == 4] == 0).all()
    assert (gap[state == 4] > 0).all()


def test_contact_over_the_cycle_is_that_of_the_run(plates, vtk):
    (cycle,) = plates.cycles["load"]
    (surface,) = plates.geometry.surfaces
    steps = steps_of(cycle)
    listed = ElementTree.parse(vtk[0] / "contact_contact.pvd").getroot().findall(".//DataSet")
    assert [float(e.get("timestep")) for e in listed] == pytest.approx(cycle.theta[steps])
    for entry, step in list(zip(listed, steps, strict=True))[::9]:
        found = meshio.read(vtk[0] / entry.get("file"))
        at = [int(np.argmin(np.linalg.norm(surface.points - x, axis=1))) for x in found.points]
        data = found.point_data
        assert data["pressure"] == pytest.approx(cycle.pressure[step, at], abs=0)
        assert (data["state"] == cycle.status[step, at]).all()
        assert data["gap"] == pytest.approx(cycle.gap[step, at], abs=0)
        # the interface is horizontal: both vectors lie in it, of the sizes that the pairs have
        for name, own in (("traction", cycle.traction), ("slip", cycle.slip)):
            assert np.abs(data[name][:, 2]).max() == 0
            sizes = np.linalg.norm(own[step, at], axis=1)
            assert np.linalg.norm(data[name], axis=1) == pytest.approx(sizes, rel=1e-12)
    width = 600e-6 / plates.model.area.sum()
    areas = width * plates.model.area[at]
    assert data["dissipation"] @ areas == pytest.approx(width * cycle.dissipated, rel=1e-9)


def test_motion_over_the_cycle_moves_the_tip_as_the_output_says(plates, vtk):
    (cycle,) = plates.cycles["load"]
    listed = ElementTree.parse(vtk[0] / "motion.pvd").getroot().findall(".//DataSet")
    tip = plates.geometry.forces(plates.structure.loads["tip"])
    y = [
        (meshio.read(vtk[0] / e.get("file")).point_data["displacement"] * tip).sum() for e in listed
    ]
    expected = cycle.output[steps_of(cycle), plates.model.port("tip")]
    assert y == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


def test_a_lap_joint_is_written_as_well(lap, tmp_path):
    """Quadratic quadrilaterals in the plane z = 0; pairs in a line."""
    written = export(lap, tmp_path, ("vtk",))
    names = {path.relative_to(tmp_path / "vtk").as_posix() for path in written}
    assert {"modes.vtu", "prestress.vtu", "motion.pvd", "contact_contact.pvd"} <= names
    found = meshio.read(tmp_path / "vtk" / "modes.vtu")
    assert found.cells_dict["quad8"].shape[1] == 8
    x = found.points[found.cells_dict["quad8"]]
    assert np.abs(x[:, 4] - 0.5 * (x[:, 0] + x[:, 1])).max() < 1e-12
    line = meshio.read(tmp_path / "vtk" / "prestress_contact.vtu")
    assert np.sort(line.points[:, 0]) == pytest.approx(lap.model.position, abs=1e-12)
    assert line.point_data["pressure"] @ lap.model.area == pytest.approx(
        lap.prestress.preload["clamp"], rel=1e-9
    )


def test_vtk_itself_reads_the_files(vtk):
    """Integrated by VTK: the pressure is the bolt, the elements are two plates of 95 by 20 by 5 mm."""
    io = pytest.importorskip("vtkmodules.vtkIOXML")
    parallel = pytest.importorskip("vtkmodules.vtkFiltersParallel")
    for name, size, volume in (("prestress_contact", "Area", 600e-6), ("modes", "Volume", 19e-6)):
        reader = io.vtkXMLUnstructuredGridReader()
        reader.SetFileName(str(vtk[0] / f"{name}.vtu"))
        whole = parallel.vtkIntegrateAttributes()
        whole.SetInputConnection(reader.GetOutputPort())
        whole.Update()
        found = whole.GetOutput()
        assert found.GetCellData().GetArray(size).GetValue(0) == pytest.approx(volume, rel=1e-9)
        if size == "Area":
            force = found.GetPointData().GetArray("pressure").GetValue(0)
            assert force == pytest.approx(FORCE, rel=1e-6)


def test_motion_of_matrices_in_millimetres_is_in_metres(tmp_path):
    """The node that the load acts on moves as its output says."""
    document = tomllib.loads((ROOT / "examples" / "matrices_beam.toml").read_text("utf-8"))
    document["analysis"] = {"cycle": {"force": [200.0], "drives": ["load"], "steps": 24}}
    beam = run_joint(parse_joint(document, "matrices", ROOT / "examples"))
    write_vtk(beam, tmp_path, "load", 0)
    (cycle,) = beam.cycles["load"]
    node = int(np.flatnonzero(beam.geometry.labels == 144)[0])
    y = [
        meshio.read(tmp_path / "cycle" / f"motion_{k:03d}.vtu").point_data["displacement"][node, 1]
        for k in range(len(steps_of(cycle)))
    ]
    expected = cycle.output[steps_of(cycle), beam.model.port("tip")]
    assert y == pytest.approx(expected, abs=1e-6 * np.abs(expected).max())


def test_without_places_of_nodes_there_is_no_vtk(plates, tmp_path):
    bare = type(plates)(plates.assembly, plates.outcomes)
    bare.__dict__["geometry"] = None
    with pytest.raises(InputError, match=r"no coordinates: give matrices\.nodes"):
        write_vtk(bare, tmp_path)


def sets_of(path):
    file = pyuff.UFF(str(path))
    return [file.read_sets(k) for k in range(file.get_n_sets())]


def test_frequency_responses_are_read_back_as_they_are(lap, tmp_path):
    """Frequencies and complex values to the last bit, over the load."""
    path = write_universal(lap, tmp_path / UFF)
    found = [each for each in sets_of(path) if each["type"] == 58]
    reduced = [each for each in found if "model" in each["id4"]]
    assert len(reduced) == len(lap.responses) * 4
    for response in lap.responses:
        said = f"{response.variant} model, M = {response.load:.4g} N m/m"
        good = response.flag == 0
        for name, y in response.outputs.items():
            (own,) = [
                e for e in reduced if e["id4"].strip() == said and e["id1"].startswith(f"{name}:")
            ]
            assert (own["x"] == response.frequency[good]).all()
            assert (own["data"] == y[good] / response.load).all()
    harmonic = [each for each in found if each["id4"].startswith("harmonic")]
    assert {len(e["x"]) >= 2 and (np.diff(e["x"]) > 0).all() for e in harmonic} == {True}


def test_functions_say_what_they_are(lap, tmp_path):
    """Frequency response; displacement, rotation, velocity and slip per moment about z, SI."""
    units, nodes, *functions = sets_of(write_universal(lap, tmp_path / UFF))
    assert (units["type"], units["units_code"], units["length"], units["force"]) == (164, 1, 1, 1)
    assert nodes["type"] == 15
    kinds = {
        "middle": (8, 2, "m"),
        "end": (8, 6, "rad"),
        "rate": (11, 2, "m/s"),
        "slip": (8, 0, "m"),
    }
    for each in functions:
        kind, direction, unit = kinds[each["rsp_ent_name"].strip()]
        assert each["func_type"] == 4
        assert each["abscissa_spec_data_type"] == 18
        assert each["ordinate_spec_data_type"] == kind
        assert each["rsp_dir"] == direction
        assert each["ordinate_axis_units_lab"].strip() == unit
        assert each["orddenom_spec_data_type"] == 13
        assert each["orddenom_axis_units_lab"].strip() == lap.joint.driven.load.unit
    named = {int(n) for n in nodes["node_nums"]}
    assert {each["rsp_node"] for each in functions} | {
        each["ref_node"] for each in functions
    } <= named


def test_reactions_are_at_their_support_and_along_their_direction(tmp_path):
    """Far below the resonance the support holds against the load, which is up, as reduced models have it."""
    document = section_document(tmp_path) | {
        "load": {"force": [20.0]},
        "output": [
            {"name": "hold", "quantity": "reaction", "on": "left", "direction": "y"},
            {"name": "along", "quantity": "reaction", "on": "left", "direction": "x"},
            {"name": "turn", "quantity": "reaction moment", "on": "left"},
        ],
        "analysis": {
            "response": {"from": "5 Hz", "to": "8 Hz", "count": 3},
            "reduced": {"amplitudes": 6, "steps": 60},
        },
    }
    found = run_joint(parse_joint(document, "mesh", tmp_path))
    _, _, *functions = sets_of(write_universal(found, tmp_path / UFF))
    own = {each["rsp_ent_name"].strip(): each for each in functions}
    left = found.geometry.labels[found.geometry.points[:, 0] < -0.08 + 1e-9]
    for name, direction in (("hold", 2), ("along", 1), ("turn", 6)):
        assert (own[name]["ordinate_spec_data_type"], own[name]["rsp_dir"]) == (9, direction)
        assert own[name]["rsp_node"] in left
    assert own["hold"]["data"].real == pytest.approx(-1.0, rel=0.05)


def test_binary_datasets_say_how_long_they_are(lap, tmp_path):
    """Bytes up to the end of the dataset, as readers that skip by them need it."""
    text = write_universal(lap, tmp_path / UFF).read_bytes()
    headers = list(re.finditer(rb"\n {4}58b", text))
    assert headers
    for start in headers:
        lines = text[start.start() + 1 :].split(b"\n", 12)
        size = int(lines[0].split()[4])
        assert lines[12][size : size + 7] == b"    -1\n"


def test_what_has_no_responses_has_no_universal_file(plates, tmp_path):
    assert export(plates, tmp_path, ("uff",)) == []
    assert not (tmp_path / UFF).exists()


def test_a_single_point_is_no_function_and_is_said_to_be_left_out(lap, tmp_path, monkeypatch):
    """A method with an answer at one frequency alone; with two there is nothing to say."""
    assert not_exported(lap, ("uff",)) == []
    curves = [*curves_of(lap), Curve("time integration", 20.0, np.array([172.0]), {"middle": [1j]})]
    monkeypatch.setattr("microslip.results.universal.curves_of", lambda run: curves)
    (said,) = not_exported(lap, ("vtk", "uff"))
    assert "time integration, M = 20 N m/m, 172 Hz" in said
    assert not_exported(lap, ("vtk",)) == []
    path = write_universal(lap, tmp_path / UFF)
    assert not any("time integration" in found["id4"] for found in sets_of(path) if "id4" in found)


def test_a_rate_is_the_displacement_times_i_omega(lap, tmp_path):
    found = [each for each in sets_of(write_universal(lap, tmp_path / UFF)) if each["type"] == 58]
    own = {each["rsp_ent_name"].strip(): each for each in found[:4]}
    rate = 2j * np.pi * own["middle"]["x"] * own["middle"]["data"]
    assert own["rate"]["data"] == pytest.approx(rate, rel=1e-12)
