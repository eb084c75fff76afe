"""What cannot be had says so in words, and what to try; through the command line."""

from __future__ import annotations

import json

from mesh_files import section_document
from typer.testing import CliRunner

from microslip.cli.main import app


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
