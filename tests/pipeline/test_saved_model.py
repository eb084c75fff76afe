"""A saved model as a joint: what is asked of it has the bits of the joint that it was saved from."""

from __future__ import annotations

import numpy as np
import pytest
from mesh_files import plates_document
from short_lap import SHORT_LAP
from typer.testing import CliRunner

import microslip
from microslip.analyses.prepared.saved import load_model, save_model
from microslip.cli.main import app
from microslip.describe.reading import load_joint, parse_joint
from microslip.errors import InputError
from microslip.pipeline.prepare import assemble
from microslip.pipeline.run import run

LAP = (
    SHORT_LAP
    + """
[support]
left = "clamped"
right = "free"
[damping]
beta = "1 us"
[[port]]
name = "tip"
kind = "force"
at = "right"
[[output]]
name = "tip"
quantity = "velocity"
x = "right end"
[[output]]
name = "edge"
quantity = "slip"
x = "clamp edge"
"""
)

ASKED = """
[load]
port = "tip"
force = "300 N/m"
[analysis.cycle]
smallest = 0.01
largest = 0.3
count = 2
steps = 60
[analysis.response]
count = 11
[analysis.reduced]
amplitudes = 8
steps = 60
upper_modes = 0
[analysis.backbone]
count = 2
methods = ["quasi_static"]
[analysis.time]
frequencies = ["40 Hz"]
steps = 60
max_cycles = 4
[analysis.harmonic]
frequencies = ["40 Hz", "40.1 Hz"]
harmonics = 1
stability = false
[[analysis.history]]
signal = "sine"
frequency = "40 Hz"
cycles = 2
steps = 60
force = "30 N/m"
"""

MODEL = """
kind = "model"
[model]
file = "joint.npz"
[[port]]
name = "tip"
kind = "force"
[[output]]
name = "tip"
quantity = "velocity"
[[output]]
name = "edge"
quantity = "slip"
"""

SHORT = MODEL + "[analysis.cycle]\ncount = 2\nsteps = 60\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A joint file, and beside it its model and the file that names that."""
    there = tmp_path_factory.mktemp("saved")
    (there / "lap.toml").write_text(LAP + ASKED)
    done = CliRunner().invoke(
        app, ["export", str(there / "lap.toml"), "--out", str(there / "joint.npz")]
    )
    assert done.exit_code == 0, done.output
    assert 'kind = "model"' in done.output
    (there / "model.toml").write_text(MODEL + ASKED)
    return there


def test_every_analysis_answers_with_the_same_bits(folder):
    lap, model = (run(load_joint(folder / f"{name}.toml")) for name in ("lap", "model"))
    assert model.prepared.drive == "tip"
    assert set(model.outcomes) == set(lap.outcomes)
    assert len(model.outcomes) >= 7
    for a, b in zip(lap.cycles["load"], model.cycles["load"], strict=True):
        assert np.array_equal(a.r, b.r)
        assert a.dissipated == b.dissipated
    assert max(a.dissipated for a in lap.cycles["load"]) > 1e-6
    for a, b in zip(lap.responses, model.responses, strict=True):
        assert np.array_equal(a.outputs["tip"], b.outputs["tip"])
        assert np.array_equal(a.outputs["edge"], b.outputs["edge"])
    for a, b in zip(lap.time_domain, model.time_domain, strict=True):
        assert a.steady.amplitude == b.steady.amplitude
    for a, b in zip(lap.harmonic, model.harmonic, strict=True):
        assert [p.amplitude for p in a.response.points] == [p.amplitude for p in b.response.points]
    for a, b in zip(lap.histories, model.histories, strict=True):
        assert np.array_equal(a.output, b.output)
    for a, b in zip(lap.backbones, model.backbones, strict=True):
        assert np.array_equal(a.frequency, b.frequency)


def test_the_command_line_takes_it(folder, tmp_path):
    runner = CliRunner()
    short = folder / "short.toml"
    short.write_text(SHORT)
    checked = runner.invoke(app, ["check", str(short), "--out", str(tmp_path)])
    assert checked.exit_code == 0, checked.output
    assert "21 contact pairs in the plane" in " ".join(checked.output.split())
    assert "no pictures: a saved model has no geometry" in checked.output
    microslip.write_results(run(load_joint(short)), tmp_path / "out", formats=())
    shown = runner.invoke(app, ["show", str(tmp_path / "out")])
    assert shown.exit_code == 0, shown.output
    again = runner.invoke(app, ["export", str(short), "--out", str(tmp_path / "again.npz")])
    assert again.exit_code == 0, again.output
    first, second = np.load(folder / "joint.npz"), np.load(tmp_path / "again.npz")
    assert set(first.files) == set(second.files)
    assert all(np.array_equal(first[name], second[name]) for name in first.files)


def changed(folder, target, **entries):
    """The saved model with some of its entries changed, or gone."""
    arrays = dict(np.load(folder / "joint.npz")) | entries
    np.savez(target, **{name: value for name, value in arrays.items() if value is not None})


def bent(folder, name, change):
    """An entry of the saved model, changed."""
    value = np.load(folder / "joint.npz")[name].copy()
    return {name: change(value)}


def with_nan(value):
    value.flat[len(value) // 2] = np.nan
    return value


FAULTS = {
    "nan": ("port_modes", with_nan, "port_modes holds what is no number"),
    "infinite": ("residual", lambda x: x / 0.0, "residual holds what is no number"),
    "text": ("area", lambda x: x.astype(str), "area is <U32, and must be numbers"),
    "drive": (
        "drive",
        lambda x: np.array("nose"),
        "drive names 'nose', which is none of the ports",
    ),
    "held": (
        "preload_ports",
        lambda x: np.array(["nut"]),
        "preload_ports names 'nut', which is none of the ports",
    ),
    "mode": ("mode_sliding", lambda x: x[:-1], "mode_sliding is"),
    "pairs": ("friction", lambda x: x[:-1], "friction is (20,), and must be (21,)"),
    "dimension": ("dimension", lambda x: np.array(4), "dimension cannot be 4"),
    "friction": ("friction", lambda x: -x, "friction must not be negative"),
    "area": ("area", lambda x: -x, "area must be positive"),
    "damping": ("rayleigh", lambda x: -x, "rayleigh must not be negative"),
    "order": ("omega", lambda x: x[::-1], "omega must ascend from zero"),
    "residual": ("residual", lambda x: -x, "residual must not be negative on its diagonal"),
    "half": ("residual", np.triu, "residual is not symmetric"),
    "pressed": ("prestress_r", lambda x: -x, "prestress_v is not what the model has"),
    "turned": ("mode_v", lambda x: -x, "prestress_v is not what the model has"),
    "load": ("preload", lambda x: 1.01 * x, "prestress_v is not what the model has"),
    "units": ("area", lambda x: 1000 * x, "prestress_pressure is not prestress_r over area"),
    "width": ("units", lambda x: np.array("pounds"), "is in units that are not known: 'pounds'"),
    "bodies": ("bodies_ports", lambda x: x[:-1], "bodies_ports is"),
    "half turn": ("image", lambda x: 0 * np.arange(21), "image must be a permutation of the pairs"),
}


@pytest.mark.filterwarnings("ignore:divide by zero")
@pytest.mark.parametrize("fault", FAULTS)
def test_a_file_that_was_changed_is_refused_by_name(fault, folder, tmp_path):
    name, change, said = FAULTS[fault]
    entry = {name: change(None)} if name == "image" else bent(folder, name, change)
    changed(folder, tmp_path / "joint.npz", **entry)
    (tmp_path / "model.toml").write_text(SHORT)
    done = CliRunner().invoke(app, ["check", str(tmp_path / "model.toml")])
    assert done.exit_code == 2, done.output
    assert said in done.output
    assert "joint.npz" in done.output
    assert done.output.startswith("error: ")
    assert done.output.count("\n") == 1
    assert isinstance(done.exception, SystemExit)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('name = "tip"\nkind', 'name = "nose"\nkind', "port 'nose': "),
        ('name = "edge"', 'name = "rim"', "output 'rim': "),
        ('"joint.npz"', '"joint.npz"\nwidth = "whole"', "model.width: "),
        ('"joint.npz"', '"gone.npz"', "gone.npz: no such file"),
        ('"joint.npz"', '"joint.npz"\nwidth = "50 mm"', "model.width"),
    ],
)
def test_what_the_model_does_not_have_is_refused_by_name(old, new, said, folder):
    (folder / "other.toml").write_text(SHORT.replace(old, new))
    done = CliRunner().invoke(app, ["run", str(folder / "other.toml"), "--out", str(folder / "no")])
    assert done.exit_code == 2, done.output
    assert said in done.output
    assert isinstance(done.exception, SystemExit)


def test_another_port_drives_it_with_the_mode_that_it_excites(folder):
    """As the joint that was assembled for that port, to the error of the reduction."""
    text = SHORT.replace('name = "tip"\nkind = "force"', 'name = "moment"\nkind = "moment"', 1)
    (folder / "moment.toml").write_text(text)
    found = assemble(load_joint(folder / "moment.toml"))
    assert found.prepared.drive == "moment"
    own = load_model(folder / "joint.npz")
    assert found.mode.sliding_frequency == pytest.approx(own.mode.sliding_frequency, rel=1e-3)
    assert sorted(found.model.ports) == sorted(own.model.ports)
    a, b = (microslip.cycle(each, 30.0, steps=60) for each in (own, found.prepared))
    assert not np.array_equal(a.r, b.r)
    assert np.array_equal(own.prestress.solution.r, found.prestress.solution.r)


def test_outputs_are_any_port(folder):
    text = SHORT + '[[output]]\nname = "turn"\nquantity = "rotation"\nof = "moment"\n'
    (folder / "turn.toml").write_text(text)
    joint = load_joint(folder / "turn.toml")
    assert [output.port for output in joint.outputs] == ["output tip", "output edge", "moment"]
    with pytest.raises(InputError, match="two outputs are called"):
        parse_joint({**joint.model_dump(exclude_none=True), "output": [{"name": "a"}] * 2})


@pytest.mark.parametrize("other", ["x", "y"])
def test_another_port_in_space_picks_the_mode_that_the_structure_has(tmp_path, other):
    """Plates saved for a load across them, driven along them or sideways: as assembled for that."""
    document = plates_document(tmp_path)
    document["mesh"] = document["mesh"] | {"modes": 60}
    document["port"] = [
        {"name": name, "kind": "force", "on": "right", "direction": name} for name in ("z", other)
    ]
    cycles = {"cycle": {"force": [1.0], "steps": 20}}
    given = document | {"load": {"port": "z", "force": [50.0]}, "analysis": cycles}
    assembly = assemble(parse_joint(given, "saved", tmp_path))
    save_model(assembly.prepared, tmp_path / "joint.npz")
    driven = {"load": {"port": other, "force": [50.0]}}
    asked = driven | {"kind": "model", "model": {"file": "joint.npz"}, "port": [{"name": other}]}
    found, refused = {}, {}
    for name, joint in (("structure", document | driven), ("model", asked)):
        found[name] = assemble(parse_joint(joint | {"analysis": cycles}, name, tmp_path)).mode
        try:
            assemble(parse_joint(joint | {"analysis": {"response": {"count": 5}}}, name, tmp_path))
        except InputError as error:
            refused[name] = "friction alone holds" in str(error)
    assert found["model"].stuck_frequency == pytest.approx(
        found["structure"].stuck_frequency, rel=1e-2
    )
    assert found["model"].sliding_frequency == pytest.approx(
        found["structure"].sliding_frequency, rel=1e-2
    )
    assert refused.get("model") == refused.get("structure")
