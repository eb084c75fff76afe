"""A joint from a mesh: the lap joint again, an extruded section, two bolted plates, and mistakes."""

from __future__ import annotations

import runpy
import shutil
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from mesh_files import lap_document, plates_document, section_document
from same_joint import (
    LOAD,
    REQUESTS,
    SAME,
    check_answers,
    check_cycles,
    check_states,
    differ,
    reference_document,
)
from typer.testing import CliRunner

from microslip.analyses.prepared.prestress import sliding_load
from microslip.analyses.statics.cycle import quasi_static_cycle
from microslip.analyses.statics.loading import load_path
from microslip.analyses.time.scheme import march, prestressed_state, time_scheme
from microslip.analyses.time.steady import steady_state
from microslip.analyses.time.unreduced import full_scheme, march_full
from microslip.cli.check import app as check
from microslip.cli.new import app as new
from microslip.cli.run import app as command
from microslip.contact.pairs import SLIP, normal, tangential
from microslip.describe.reading import load_joint, parse_joint
from microslip.errors import ContactError, InputError, ModelError
from microslip.model.joint import bonded_modes
from microslip.pipeline.prepare import assemble
from microslip.pipeline.run import run
from microslip.results.history import history_datasets
from microslip.results.store import load_run
from microslip.results.time import time_datasets
from microslip.show.figures import save_figures

ROOT = Path(__file__).parents[2]
EXAMPLE = ROOT / "examples" / "mesh_plates.toml"


@pytest.fixture(scope="module")
def lap_file():
    return reference_document(49)  # so that elements end where the clamp does


@pytest.fixture(scope="module")
def both(lap_file, tmp_path_factory):
    folder = tmp_path_factory.mktemp("mesh")
    lap = parse_joint(lap_file)
    document = lap_document(lap, folder) | {"analysis": REQUESTS, "load": LOAD}
    return run(lap), run(parse_joint(document, "mesh", folder))


def test_reference_joint_as_a_mesh_has_the_same_states(both):
    check_states(*both)


def test_reference_joint_as_a_mesh_has_the_same_cycles(both):
    check_cycles(*both)


def test_reference_joint_as_a_mesh_answers_the_same(both):
    """At resonance a difference of frequency counts 1 / (2 zeta) times."""
    lap, _ = both
    check_answers(*both, quality=1 / (lap.joint.damping.beta * lap.mode.sliding_omega))


# -- an extruded section is the section ------------------------------------------------------------

OTHER_MODES = 1e-5
"""What modes across the section, kept in place of some in its plane, may change: (omega / omega_kept)²."""

PLACE = 1e-7
"""What springs that hold the place of a free body may change: (1e-4 of the lowest frequency)² in each of its
directions."""

OF_SECTION = {
    "cycle": {"count": 3, "steps": 80},
    "response": {"count": 51},
    "reduced": {"amplitudes": 6},
    "backbone": {"count": 3, "steps": 60},
}


@pytest.fixture(scope="module")
def sections(tmp_path_factory):
    folder = tmp_path_factory.mktemp("section")
    documents = [
        section_document(folder, depth) | {"analysis": OF_SECTION} for depth in (None, 8.0)
    ]
    return [run(parse_joint(document, "section", folder)) for document in documents]


def test_extruded_section_has_the_states_of_the_plane_one(sections):
    plane, extruded = sections
    assert extruded.model.dimension == 3
    assert extruded.model.pairs == 2 * plane.model.pairs
    for name in ("sliding_omega", "stuck_omega", "overlap"):
        assert differ(getattr(plane.mode, name), getattr(extruded.mode, name)) < SAME
    both_sides = np.repeat(plane.prestress.pressure, 2)
    assert differ(both_sides, extruded.prestress.pressure) < SAME
    assert differ(plane.assembly.opening_moment, extruded.assembly.opening_moment) < SAME


def test_extruded_section_answers_as_the_plane_one(sections):
    plane, extruded = sections
    assert not plane.failures
    assert not extruded.failures
    for a, b in zip(plane.responses, extruded.responses, strict=True):
        assert differ(a.peak_frequency, b.peak_frequency) < OTHER_MODES
        peaks = (np.abs(each.outputs["tip"]).max() for each in (a, b))
        assert differ(*peaks) < 1e-3  # frequencies of both are apart by a part of a step
    for a, b in zip(plane.backbones, extruded.backbones, strict=True):
        for one, other in zip(a.points, b.points, strict=True):
            assert differ(one.omega, other.omega) < OTHER_MODES
        for one, other in zip(a.points[:-1], b.points[:-1], strict=True):
            assert differ(one.damping_ratio, other.damping_ratio) < 1e-3
        # near opening rounding decides what the load steps lock in: 1 % is asked of a cycle
        assert differ(a.points[-1].damping_ratio, b.points[-1].damping_ratio) < 0.01


@pytest.mark.parametrize(("share", "steps", "lost"), [(0.1, 80, PLACE), (0.8, 320, 1e-4)])
def test_extruded_section_has_the_cycles_of_the_plane_one(sections, share, steps, lost):
    """Near opening the two solvers halve other load steps, and dissipation has the error of steps."""
    load = share * sections[0].assembly.opening_moment
    plane, extruded = (
        quasi_static_cycle(each.prepared, "tip", load, steps=steps) for each in sections
    )
    both_sides = extruded.r.reshape(steps + 1, -1, 2, 3).sum(axis=2)
    assert differ(normal(plane.r), both_sides[..., 0]) < PLACE
    across = np.abs(both_sides[..., 2]).max()
    assert across < SAME * np.abs(both_sides).max()
    assert differ(np.abs(tangential(plane.r)), np.abs(both_sides[..., 1])) < PLACE
    assert differ(plane.dissipated, extruded.dissipated) < lost


def test_extruded_section_has_the_time_point_of_the_plane_one(sections):
    """On the flank of the resonance, in wide slip; both solvers end at the tolerance of the search."""
    load = 0.02 * sections[0].assembly.opening_moment
    frequency = 1.01 * sections[0].mode.sliding_frequency
    plane, extruded = (
        steady_state(
            time_scheme(each.prepared, 1 / (100 * frequency), frequency=frequency),
            frequency,
            load,
            tolerance=1e-7,
        )
        for each in sections
    )
    assert plane.converged
    assert extruded.converged
    assert (extruded.cycle.status == SLIP).any()
    quality = 1 / (sections[0].joint.damping.beta * sections[0].mode.sliding_omega)
    assert differ(plane.amplitude, extruded.amplitude) < min(1e-2, OTHER_MODES * quality)
    assert differ(plane.cycle.dissipated, extruded.cycle.dissipated) < 1e-2


def test_extruded_section_marched_in_every_degree_of_freedom(sections):
    """From rest into slip: the same motion, reactions of the plane section shared by both sides."""
    load = 0.05 * sections[0].assembly.opening_moment
    dt = 1 / (60 * sections[0].mode.sliding_frequency)
    wave = load * np.sin(2 * np.pi * np.arange(91) / 60)
    plane, extruded = (
        march_full(full_scheme(each.structure, each.prepared, dt, port="tip"), wave)
        for each in sections
    )
    assert (extruded.status == SLIP).any()
    assert differ(plane.output["tip"], extruded.output["tip"]) < PLACE
    both_sides = extruded.r.reshape(len(wave), -1, 2, 3).sum(axis=2)
    assert differ(normal(plane.r), both_sides[..., 0]) < 1e-6
    assert differ(plane.dissipated, extruded.dissipated) < 1e-6


# -- two plates and a bolt -------------------------------------------------------------------------


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("plates")


def assembled(document, folder):
    return assemble(parse_joint(document, "plates", folder))


def cycles_alone(document):
    return document | {"analysis": {"cycle": {"force": [1e3]}}}


@pytest.fixture(scope="module")
def bolted(folder):
    return assembled(cycles_alone(plates_document(folder)), folder)


def test_bolted_plates_are_in_equilibrium(bolted):
    """The force of the bolt is carried by the contact, and no motion of the free plate gains energy."""
    start, structure = bolted.prestress, bolted.structure
    pressed = normal(start.solution.r, 3)
    assert (pressed >= 0).all()
    assert pressed.sum() == pytest.approx(12e3 / 0.02, rel=1e-8)
    load = start.preload["bolt"] * structure.loads["bolt"]
    force = load - structure.interface.relative.T @ start.solution.r
    motions = structure.motions
    assert motions.shape[1] == 6
    size = np.abs(motions).T @ np.abs(load)
    assert (np.abs(motions.T @ force) <= 1e-8 * size.max()).all()


def test_bolted_plates_open_where_statics_says(bolted):
    """The free plate turns about an edge of the overlap: F (80 + 15) = P 15, with the tip at 80 mm."""
    assert bolted.opening_moment == pytest.approx(12e3 / 0.02 * 15 / 95, rel=1e-6)


def test_a_moment_opens_them_where_statics_says(folder):
    """About either edge of the overlap, M = P 15 mm."""
    document = cycles_alone(plates_document(folder))
    document["port"] = {"name": "twist", "kind": "moment", "on": "right", "direction": "y"}
    document["load"] = {"moment": [1.0]}
    document["analysis"] = {"cycle": {"moment": [1.0]}}
    document["output"] = {
        "name": "tilt",
        "quantity": "rotation",
        "on": "right",
        "direction": "y",
    }
    found = assembled(document, folder)
    assert found.opening_moment == pytest.approx(12e3 / 0.02 * 0.015, rel=1e-6)
    same = [found.structure.loads[name] for name in ("twist", "output tilt")]
    np.testing.assert_array_equal(*same)


def test_a_mesh_that_has_changed_is_read_again(folder):
    document = cycles_alone(plates_document(folder, "changing.inp"))
    before = assembled(document, folder).mode.stuck_omega
    deck = folder / "changing.inp"
    deck.write_text(deck.read_text().replace("210000.0", "105000.0"))
    after = assembled(document, folder).mode.stuck_omega
    assert after == pytest.approx(before * np.sqrt(0.5), rel=1e-9)


def test_another_unit_of_length_is_doubted(folder):
    document = cycles_alone(plates_document(folder))
    document["mesh"] = document["mesh"] | {"length_unit": "m", "width": "20 m"}
    said = " ".join(map(str, assembled(document, folder).doubts))
    assert "E = 2.1e+05 Pa" in said
    assert "are these the units of the file?" in said


@pytest.mark.parametrize(
    ("unit", "width", "size"), [("m", "20 m", "160 m"), ("um", "20 um", "160 µm")]
)
def test_bodies_of_another_size_are_doubted_where_the_material_is_said_beside(
    folder, unit, width, size
):
    """Neither stiffness nor density of the file tells that its lengths are in mm."""
    document = cycles_alone(plates_document(folder))
    document["mesh"] = document["mesh"] | {"length_unit": unit, "width": width}
    document["output"] = []
    document["material"] = {"youngs_modulus": "210 GPa", "poissons_ratio": 0.3, "density": 7800.0}
    said = " ".join(map(str, assembled(document, folder).doubts))
    assert f"the bodies measure {size}" in said
    assert "E = " not in said


def test_the_template_is_a_joint_file(tmp_path):
    made = CliRunner().invoke(new, ["mesh", str(tmp_path / "joint.toml")])
    assert made.exit_code == 0, made.output
    (tmp_path / "joint.inp").write_text("*NODE\n")
    joint = load_joint(tmp_path / "joint.toml")
    assert joint.preload[0].on == ("head", "nut")
    with pytest.raises(InputError, match=r"joint\.inp: there are no nodes"):
        assemble(joint)


def test_bolted_plates_that_stick_answer_as_the_bonded_ones(bolted):
    """Under a load too light for slip: the sum over the modes of the joint with its touching pairs bonded."""
    joint, frequency, load = bolted.prepared, 1.002 * bolted.mode.stuck_frequency, 0.1
    model, turn = joint.model, 2 * np.pi * frequency
    omega, shapes = bonded_modes(model, joint.prestress.bonded(3), joint.law.compliance)
    alpha, beta = model.rayleigh
    driven, read = (model.port_modes[:, model.port(p)] @ shapes for p in ("tip", joint.coordinate))
    wanted = (driven * read / (omega**2 - turn**2 + 1j * turn * (alpha + beta * omega**2))).sum()
    scheme = time_scheme(joint, 1 / (100 * frequency), frequency=frequency)
    found = steady_state(scheme, frequency, load, tolerance=1e-6)
    assert found.converged
    assert abs(found.amplitude / load - wanted) < 1e-3 * abs(wanted)


def test_turned_plates_move_as_before(folder, bolted):
    """Turned about the normal of the interface, three cycles at a load that slips widely."""
    other = assembled(cycles_alone(plates_document(folder, "turned_in_time.inp", turn=0.6)), folder)
    dt = 1 / (60 * bolted.mode.stuck_frequency)
    load = 2e3 * np.sin(2 * np.pi * np.arange(181) / 60)
    found = []
    for each in (bolted, other):
        scheme = time_scheme(each.prepared, dt)
        found.append(march(scheme, prestressed_state(scheme), load, keep=True))
    port = bolted.model.port("tip")
    assert (found[0].status[1:] == SLIP).any()
    assert differ(found[0].output[:, port], found[1].output[:, port]) < SAME
    assert differ(found[0].dissipated, found[1].dissipated) < SAME


@pytest.mark.validate
def test_bolted_plates_in_time(folder, tmp_path):
    """Below resonance a steady state is that of the reduced model; histories and results hold both slips."""
    document = plates_document(folder)
    frequency = 112.0
    document |= {
        "analysis": {
            "cycle": {"count": 6, "steps": 60},
            "response": {"from": frequency, "to": 180.0, "count": 41},
            "time": {"frequencies": [frequency], "steps": 100},
            "history": [
                {"signal": "sine", "frequency": frequency, "cycles": 2, "steps": 60, "force": 20.0}
            ],
        }
    }
    found = run(parse_joint(document, "plates", folder))
    assert not found.failures
    (point,), (history,) = found.time_domain, found.histories
    reduced = next(r for r in found.responses if r.variant == "refined")
    wanted = reduced.amplitude[reduced.frequency == frequency][0]
    assert abs(point.steady.amplitude) == pytest.approx(abs(wanted), rel=1e-2)
    assert history.slip.shape[1:] == (1, 2)
    stored = time_datasets(found)["time_domain"]
    assert stored["local_slip"].dims == ("point", "step", "position", "tangent")
    assert history_datasets(found)["history/sine"]["local_slip"].dims[-1] == "tangent"
    drawn = save_figures(found, tmp_path)
    for name in ("steady_state", "history_sine"):
        assert any(name in file.name for file in drawn)


def test_motions_that_nothing_holds_have_names(bolted):
    names = bolted.imported.zero_modes
    translations = [f"translation along {axis} of upper" for axis in "xyz"]
    assert list(names) == [*translations, *["rotation of upper"] * 3]


def test_dissipation_of_bolted_plates_converges_with_the_load_steps(bolted):
    """Steps are implicit: the error goes at least with the step where the way of the slip turns."""
    load = 0.2 * bolted.opening_moment
    cycles = [
        quasi_static_cycle(bolted.prepared, "tip", load, steps=n) for n in (50, 100, 200, 800)
    ]
    found = np.array([cycle.dissipated for cycle in cycles])
    errors = np.abs(found[:-1] / found[-1] - 1)
    assert (errors[1:] < 0.6 * errors[:-1]).all()
    assert errors[-1] < 1e-3
    work = cycles[-1].dissipated + cycles[-1].normal_work
    assert cycles[-1].external_work == pytest.approx(work, rel=1e-6)


@pytest.mark.parametrize("turn", [0.5, 2.0])
def test_turning_the_mesh_about_the_normal_changes_nothing(bolted, folder, turn):
    document = cycles_alone(plates_document(folder, f"turned_{turn}.inp", turn))
    turned = assembled(document, folder)
    for name in ("sliding_omega", "stuck_omega"):
        assert differ(getattr(bolted.mode, name), getattr(turned.mode, name)) < SAME
    c, s = np.cos(turn), np.sin(turn)
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    apart = np.linalg.norm((bolted.imported.points @ R.T)[:, None] - turned.imported.points, axis=2)
    same = np.argmin(apart, axis=1)
    assert apart.min(axis=1).max() < 1e-12
    assert differ(bolted.prestress.pressure, turned.prestress.pressure[same]) < SAME
    load = 0.2 * bolted.opening_moment
    a, b = (quasi_static_cycle(j.prepared, "tip", load, steps=100) for j in (bolted, turned))
    assert differ(a.dissipated, b.dissipated) < SAME
    assert differ(a.friction_work, b.friction_work[same]) < SAME
    for name in ("output tip", "output slip"):
        ports = bolted.model.port(name), turned.model.port(name)
        assert differ(a.output[:, ports[0]], b.output[:, ports[1]]) < SAME


def test_width_only_says_what_results_are_per(bolted, folder):
    document = cycles_alone(plates_document(folder))
    document["mesh"] = document["mesh"] | {"width": "1 m"}
    document["preload"] = document["preload"] | {"force": "12 kN/m"}
    whole = assembled(document, folder)
    assert differ(bolted.prestress.pressure, whole.prestress.pressure) < SAME
    load = 0.2 * bolted.opening_moment
    a = quasi_static_cycle(bolted.prepared, "tip", load, steps=60)
    b = quasi_static_cycle(whole.prepared, "tip", load * 0.02, steps=60)
    assert differ(a.dissipated * 0.02, b.dissipated) < SAME


def split(document, **aft):
    """Contact before and behind the bolt, and nothing under it."""
    faces = {"first": "lower_{}", "second": "upper_{}"}
    fore, behind = (
        {"name": name} | {key: text.format(name) for key, text in faces.items()}
        for name in ("fore", "aft")
    )
    return document | {"interface": [fore | {"friction": 0.2}, behind | {"friction": 0.4} | aft]}


def test_each_interface_has_its_own_friction_gap_and_stiffness(folder):
    """Both carry the bolt, without a moment about the middle, whatever the gap of one of them."""
    stiffness = {"tangential_stiffness": 1e13, "normal_stiffness": 5e12}
    document = split(cycles_alone(plates_document(folder)), gap=1e-6, **stiffness)
    found = assembled(document, folder)
    law, pairs = found.prepared.law, found.imported.pairs
    behind = found.imported.points[:, 0] > 0
    assert set(law.friction[behind]) == {0.4}
    assert set(law.friction[~behind]) == {0.2}
    assert (pairs.gap == np.where(behind, 1e-6, 0.0)).all()
    compliance = law.compliance.reshape(-1, 3)
    assert not compliance[~behind].any()
    per_area = 1 / (np.array([5e12, 1e13, 1e13]) * found.model.area[behind, None])
    np.testing.assert_allclose(compliance[behind], per_area, rtol=1e-14)
    pressed = normal(found.prestress.solution.r, 3)
    assert pressed.sum() == pytest.approx(6e5, rel=1e-8)
    assert abs(pressed @ found.imported.points[:, 0]) < 1e-8 * 6e5 * 0.01
    assert pressed[behind].sum() > 0


def test_a_measured_surface_is_linear_between_its_points(folder):
    """A plane of gaps, measured at random: what rigid plates do of it is to lie down on it."""
    rng = np.random.default_rng(3)
    x, y = rng.uniform(-20, 20, (2, 60))
    x[:4], y[:4] = [-20, 20, 20, -20], [-20, -20, 20, 20]
    gap = 1e-3 + 1e-5 * x - 2e-5 * y
    rows = zip(x, y, 0 * x, gap, strict=True)
    text = "x,y,z,gap\n" + "".join(",".join(map(repr, map(float, row))) + "\n" for row in rows)
    (folder / "plane.csv").write_text(text)
    document = cycles_alone(plates_document(folder))
    flat = assembled(document, folder)
    document["interface"] = document["interface"] | {"topography": "plane.csv"}
    found = assembled(document, folder)
    at = found.imported.points
    expected = 1e-3 * (1e-3 + 1e-2 * at[:, 0] - 2e-2 * at[:, 1])
    np.testing.assert_allclose(found.imported.pairs.gap, expected, atol=1e-15)
    assert differ(flat.prestress.pressure, found.prestress.pressure) < PLACE
    (folder / "short.csv").write_text("x,y,z,gap\n0,0,0,1\n1,0,0,1\n0,1,0,1\n")
    document["interface"] = document["interface"] | {"topography": "short.csv"}
    assert "contact pairs lie outside of its points" in refused(document, folder)


def test_what_is_tied_is_not_free(folder):
    document = split(cycles_alone(plates_document(folder)))
    document["interface"] = document["interface"][1]
    document["tie"] = {"slave": "upper_fore", "master": "lower_fore"}
    assert assembled(document, folder).imported.zero_modes == ()


def test_a_base_moves_the_mass(folder):
    """The inertia load does the work of the mass of the free plate on its translation, per metre of width."""
    document = cycles_alone(plates_document(folder))
    document["port"] = {"name": "wall", "kind": "base", "direction": "z"}
    document["load"] = {"acceleration": [1.0]}
    document["analysis"] = {"cycle": {"acceleration": [1.0]}}
    found = assembled(document, folder)
    structure = found.structure
    moved = structure.motions @ np.linalg.lstsq(structure.motions, _lifted(found), rcond=None)[0]
    mass = 0.095 * 0.02 * 0.005 * 7850 / 0.02
    assert structure.loads["wall"] @ moved == pytest.approx(-mass, rel=1e-8)


def _lifted(found):
    """Unit translation along z of the plate that nothing holds."""
    free = np.abs(found.structure.motions).max(axis=1) > 1e-12
    return (free & (found.structure.free % 3 == 2)).astype(float)


# -- through the command line ----------------------------------------------------------------------


@pytest.mark.validate  # its run and figures are those of `tests/docs/test_examples.py`
def test_the_example_is_checked_run_and_read_again(tmp_path):
    out = tmp_path / "out"
    shutil.copytree(EXAMPLE.with_suffix(""), tmp_path / "mesh_plates")
    small = EXAMPLE.read_text("utf-8").replace("count = 12", "count = 3")
    (tmp_path / "plates.toml").write_text(small)
    shown = CliRunner().invoke(check, [str(tmp_path / "plates.toml")])
    assert shown.exit_code == 0, shown.output
    said = " ".join(shown.output.split())
    for fact in ("LOWER (96 elements", "rotation of UPPER (3)", "54 pairs on UPPER_CONTACT"):
        assert fact in said
    done = CliRunner().invoke(
        command, [str(tmp_path / "plates.toml"), "--out", str(out), "--format", "png"]
    )
    assert done.exit_code == 0, done.output
    again = load_run(out)
    assert again.model.dimension == 3
    assert again.responses[0].peak_frequency > 0
    with xr.open_dataset(out / "results.nc", group="cycles_load", engine="h5netcdf") as cycles:
        assert cycles["slip"].dims == ("cycle", "step", "pair", "tangent")
        assert cycles["point"].shape == (again.model.pairs, 3)
    for name in ("response", "tractions"):
        assert (out / "figures" / f"{name}.png").is_file()
    deck = tmp_path / "mesh_plates" / "plates.inp"
    deck.write_text(deck.read_text().replace("210000.", "200000."))
    with pytest.raises(InputError, match="have changed since"):
        load_run(out)


def test_the_mesh_of_the_example_is_what_its_script_writes(tmp_path):
    script = tmp_path / "make.py"
    shutil.copy(EXAMPLE.with_suffix("") / "make.py", script)
    runpy.run_path(str(script), run_name="__main__")
    written = EXAMPLE.with_suffix("") / "plates.inp"
    assert (tmp_path / "plates.inp").read_text() == written.read_text()


# -- mistakes --------------------------------------------------------------------------------------


def refused(document, folder):
    with pytest.raises(InputError) as caught:
        assembled(document, folder)
    return str(caught.value)


@pytest.mark.parametrize(
    ("section", "change", "said"),
    [
        ("mesh", {"width": None}, "mesh.width is missing"),
        ("support", {"on": "wall"}, 'support.on = "wall": the mesh has no surface or node set'),
        (
            "interface",
            {"first": "lower", "second": "upper_contact"},
            'interface.first = "lower": is an element set; a surface is needed',
        ),
        (
            "interface",
            {"first": "lower_contacts", "second": "nut"},
            "did you mean 'lower_contact'?",
        ),
        ("interface", {"first": "nut", "second": "head"}, "overlap by"),
        ("preload", {"on": ["head", "washer"]}, 'preload.on[1] = "washer": the mesh has no'),
        ("preload", {"on": ["nut", "head"], "direction": [0, 0, -1.0]}, "pulls the sides"),
        ("port", {"on": "left"}, "it moves nothing"),
        ("output", {"on": "tip"}, 'output.on = "tip": the mesh has no'),
        ("output", {"on": "left"}, "it does not move"),
    ],
)
def test_a_mistake_is_named(folder, section, change, said):
    document = cycles_alone(plates_document(folder))
    own = document[section]
    own = {**(own[0] if isinstance(own, list) else own), **change}
    document[section] = {key: value for key, value in own.items() if value is not None}
    assert said in refused(document, folder)


def test_a_response_that_friction_alone_holds_is_refused(folder):
    document = plates_document(folder)
    document["port"] = document["port"] | {"direction": "y"}
    assert "friction alone holds the bodies" in refused(document, folder)


@pytest.mark.parametrize("free", [False, True])
def test_what_friction_alone_holds_is_coulombs(folder, free):
    """The bolt of 600 kN/m closes upon itself: along x the upper plate is held by 0.3 times that.

    Free in space, plates that are drawn past each other are held by the same.
    """
    document = cycles_alone(plates_document(folder))
    document["port"] = document["port"] | {"direction": "x"}
    if free:
        del document["support"]
        document["port"] |= {"on": "upper_contact", "opposite": "lower_contact"}
    joint = assembled(document, folder).prepared
    limit = 0.3 * 600e3
    found = sliding_load(joint.model, joint.prestress, "tip", joint.law.friction)
    assert limit <= found < 1.0015 * limit
    drawn = sliding_load(joint.model, joint.prestress, "bolt", joint.law.friction)
    assert drawn == pytest.approx(600e3, rel=1e-6)  # the bolt undone
    assert quasi_static_cycle(joint, "tip", 0.5 * limit, steps=40).residual.max() < 1e-8
    with pytest.raises(ContactError, match="slides bodies away that friction alone holds"):
        quasi_static_cycle(joint, "tip", 1.01 * limit)
    with pytest.raises(ContactError, match=r"no more than 1\.80"):
        load_path(joint, {"tip": np.array([0.0, 2 * limit])})
    with pytest.raises(ModelError, match="must be a finite number"):
        quasi_static_cycle(joint, "tip", np.nan)
    with pytest.raises(ModelError, match="one of 'bolt', not 2"):
        joint.with_preload(2)
