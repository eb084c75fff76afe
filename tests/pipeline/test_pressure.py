"""Pressure ports of joints from meshes: resultant, volume, and the force that they are."""

from __future__ import annotations

import numpy as np
import pytest
import xarray as xr
from mesh_files import plates, plates_document, section_document
from typer.testing import CliRunner

from microslip.cli.check import app as check
from microslip.cli.run import app as command
from microslip.describe.reading import parse_joint
from microslip.errors import InputError
from microslip.model.described_mesh import read_described_mesh
from microslip.pipeline.run import run
from microslip.results.store import load_run
from microslip.results.summary import summary

CYCLE = {"cycle": {"pressure": [1e4], "drives": ["load"], "steps": 20}}
FORCED = {"cycle": {"force": [1e4 * 0.005], "drives": ["load"], "steps": 20}}


def loads(folder, port, document=plates_document, **more):
    given = document(folder)
    given |= {"port": {"name": "push"} | port, "load": {"pressure": [1e4]}, "analysis": CYCLE}
    return read_described_mesh(parse_joint(given | more, "push", folder)).structure


@pytest.mark.parametrize("width", ["20 mm", "whole"])
def test_the_resultant_is_area_over_width_against_the_normal(tmp_path, width):
    """``-p A n / w`` on the end of a plate, 20 mm by 5 mm; and no moment about its middle."""
    document = plates_document(tmp_path)
    mesh = document["mesh"] | {"width": width}
    force = "12 kN" if width == "whole" else 12e3 / 0.02
    more = {"mesh": mesh, "preload": document["preload"] | {"force": force}}
    found = loads(tmp_path, {"kind": "pressure", "on": "right"}, **more)
    load = found.loads["push"]
    area = 0.02 * 0.005 / (1.0 if width == "whole" else 0.02)
    x = (plates().points * 1e-3).ravel()[found.free]
    for axis, expected in enumerate((-area, 0.0, 0.0)):
        own = found.free % 3 == axis
        assert load[own].sum() == pytest.approx(expected, rel=1e-10, abs=1e-12 * area)
    along = found.free % 3 == 0
    nodes = found.free[along] // 3
    height = plates().points[nodes, 2] * 1e-3 - 2.5e-3
    assert load[along] @ height == pytest.approx(0.0, abs=1e-12 * area)
    assert np.isfinite(x).all()


def test_an_opposite_surface_is_pulled(tmp_path):
    both = loads(tmp_path, {"kind": "pressure", "on": "head", "opposite": "nut"})
    single = [loads(tmp_path, {"kind": "pressure", "on": each}) for each in ("head", "nut")]
    expected = single[0].loads["push"] - single[1].loads["push"]
    assert np.abs(both.loads["push"] - expected).max() < 1e-15


def test_a_pressure_is_the_force_that_it_amounts_to(tmp_path):
    """On the end face, 5 mm high, along x: the cycles of a force of p h."""
    output = {"name": "tip", "on": "right", "direction": "x"}
    given = section_document(tmp_path) | {"output": output}
    pressed = given | {
        "port": {"name": "push", "kind": "pressure", "on": "right"},
        "load": {"pressure": [1e4]},
        "analysis": CYCLE,
    }
    pushed = given | {
        "port": {"name": "push", "on": "right", "direction": [-1, 0, 0]},
        "load": {"force": [1e4 * 0.005]},
        "analysis": FORCED,
    }
    one, other = (run(parse_joint(each, "push", tmp_path)) for each in (pressed, pushed))
    pairs = zip(one.cycles["load"], other.cycles["load"], strict=True)
    for cycle, like in pairs:
        assert cycle.dissipated == pytest.approx(like.dissipated, rel=1e-8)
        k = one.model.port("output tip")
        assert np.abs(cycle.output[:, k] - like.output[:, k]).max() < 1e-9 * np.ptp(
            like.output[:, k]
        )
    ratio = other.assembly.opening_moment / one.assembly.opening_moment
    assert ratio == pytest.approx(0.005, rel=1e-8)
    assert summary(one)["cycles"][0]["pressure_pa"] == 1e4


@pytest.mark.parametrize(
    ("port", "more", "said"),
    [
        ({"kind": "pressure", "on": "right", "direction": "x"}, {}, "acts along the normal"),
        ({"kind": "pressure"}, {}, "where is the load"),
        (
            {"kind": "pressure", "on": "nowhere"},
            {},
            'port.on = "nowhere": the mesh has no surface of this name',
        ),
        ({"kind": "pressure", "on": "right"}, {"load": {"force": [1.0]}}, "give pressure"),
        ({"kind": "pressure", "on": "right"}, {"output": []}, "name one"),
    ],
)
def test_pressures_that_are_nowhere_are_refused(tmp_path, port, more, said):
    with pytest.raises(InputError, match=said):
        loads(tmp_path, port, **more)


def test_commands_and_figures_know_a_pressure(tmp_path):
    section_document(tmp_path)
    (tmp_path / "joint.toml").write_text(
        """
kind = "mesh"
[mesh]
file = "section.inp"
length_unit = "mm"
modes = 20
[[support]]
on = "left"
[[interface]]
first = "lower_contact"
second = "upper_contact"
friction = 0.3
[[preload]]
on = ["below", "above"]
force = "400 kN/m"
[[port]]
name = "push"
kind = "pressure"
on = "above"
[load]
pressure = "10 kPa"
[[output]]
name = "tip"
on = "right"
direction = "y"
[analysis.cycle]
count = 3
steps = 20
[analysis.response]
count = 21
[analysis.reduced]
amplitudes = 6
"""
    )
    shown = CliRunner().invoke(check, [str(tmp_path / "joint.toml")])
    assert shown.exit_code == 0, shown.output
    assert "1e+04 Pa" in shown.output or "10000 Pa" in shown.output
    out = tmp_path / "out"
    more = ["--out", str(out), "--format", "png", "--export", "uff"]
    done = CliRunner().invoke(command, [str(tmp_path / "joint.toml"), *more])
    assert done.exit_code == 0, done.output
    assert "p, Pa" in done.output
    assert load_run(out).joint.driven.load.unit == "Pa"
    with xr.open_dataset(out / "results.nc", group="cycles_load", engine="h5netcdf") as held:
        assert held["load_pressure"].attrs["units"] == "Pa"
        assert held["pressure"].dims != held["load_pressure"].dims
