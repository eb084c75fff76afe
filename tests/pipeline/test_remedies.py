"""What cannot be had says so in words, and what to try; through the command line."""

from __future__ import annotations

import json

import pytest
from mesh_files import section_document
from typer.testing import CliRunner

from microslip.cli.main import app
from microslip.describe.reading import load_joint
from microslip.errors import MicroslipError
from microslip.pipeline.prepare import assemble
from microslip.pipeline.reduced import table_range

CLAMPED = """
[beams]
length = "250 mm"
thickness = "12 mm"
overlap_half_length = "37 mm"
[material]
youngs_modulus = "70 GPa"
poissons_ratio = 0.3
density = "2 g/cm^3"
[contact]
friction = 0.3
pairs = 21
[clamp]
force = "1 MN/m"
half_length = "25 mm"
[support]
left = "clamped"
right = "clamped"
[[port]]
name = "base"
kind = "base"
direction = "y"
[load]
port = "base"
acceleration = 50
[[output]]
name = "middle"
[analysis.response]
count = 11
"""

MODE = "vibrating in this mode opens the joint at no amplitude"


def test_a_joint_that_nothing_opens_has_no_reduced_model(tmp_path):
    (tmp_path / "joint.toml").write_text(CLAMPED)
    checked = CliRunner().invoke(app, ["check", str(tmp_path / "joint.toml")])
    assert checked.exit_code == 0, checked.output
    assert "no reduced model" in checked.output
    with pytest.raises(MicroslipError, match=MODE) as caught:
        table_range(assemble(load_joint(tmp_path / "joint.toml")), None)
    assert "list the amplitudes of cycles under [analysis.cycle]" in str(caught.value)


def toml(value):
    """A value as it stands in a joint file."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {toml(own)}" for key, own in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    return json.dumps(value)


def test_a_part_that_a_bolt_alone_holds_is_not_tightened_to_a_force(tmp_path):
    """The upper beam hangs on a soft bolt: by a shortening it is tightened, by a force it is loose first."""
    bolt = {"on": ["below", "above"], "stiffness": 5e8}
    found = {}
    for key, value in (("force", 4e5), ("shortening", 1e-3)):
        given = section_document(tmp_path) | {"preload": bolt | {key: value}}
        given["analysis"] = {"cycle": {"force": [50.0]}}
        text = "\n".join(f"{name} = {toml(own)}" for name, own in given.items())
        (tmp_path / "joint.toml").write_text(text)
        found[key] = CliRunner().invoke(app, ["check", str(tmp_path / "joint.toml")])
    assert found["shortening"].exit_code == 0, found["shortening"].output
    assert found["force"].exit_code == 1
    assert isinstance(found["force"].exception, SystemExit)
    assert "bolt 'clamp': cannot be tightened to a force" in found["force"].output
    assert "give its shortening in place of its force" in found["force"].output
