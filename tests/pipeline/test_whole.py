"""A spatial structure without a width: the same numbers times the width, in newtons and joules."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
import xarray as xr
from matplotlib.text import Text
from mesh_files import plates_document
from typer.testing import CliRunner

from microslip.cli.check import app as check
from microslip.cli.compare import app as compare
from microslip.cli.run import app as command
from microslip.cli.show import app as show
from microslip.describe.reading import parse_joint
from microslip.errors import ContactError, Failure, InputError
from microslip.pipeline.outcome import in_units_of
from microslip.pipeline.prepare import assemble
from microslip.pipeline.run import run
from microslip.results.dataset import dataset
from microslip.results.store import load_run
from microslip.results.summary import summary
from microslip.show.figures import draw_figures, figures_of

WIDTH = 0.02
PER_WIDTH = re.compile(r"N/m(?![²^])|J/m(?![²^])|N m/m|per metre|kg m/m|m\^0\.5")

ANALYSES = """
[analysis.cycle]
smallest = 0.02
largest = 0.3
count = 3
steps = 40
[analysis.response]
count = 41
checks = 0
[analysis.reduced]
amplitudes = 6
[analysis.backbone]
methods = ["quasi_static"]
count = 3
steps = 40
"""


def text(width, per):
    scale = 1.0 if per else WIDTH
    unit = "/m" if per else ""
    return f"""
kind = "mesh"
title = "plates"
[mesh]
file = "plates.inp"
length_unit = "mm"
width = "{width}"
modes = 20
[[support]]
on = "left"
[[interface]]
first = "lower_contact"
second = "upper_contact"
friction = 0.3
[[preload]]
name = "bolt"
on = ["head", "nut"]
force = "{12 * scale / WIDTH} kN{unit}"
[damping]
beta = "1 us"
[[port]]
name = "tip"
on = "right"
direction = "z"
[load]
force = ["{50 * scale} N{unit}"]
{ANALYSES}
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("whole")
    plates_document(folder)
    (folder / "whole.toml").write_text(text("whole", False))
    (folder / "width.toml").write_text(text("20 mm", True))
    return folder


def done(folder, name):
    out = folder / f"out_{name}"
    said = CliRunner().invoke(
        command, [str(folder / f"{name}.toml"), "--out", str(out), "--format", "png"]
    )
    assert said.exit_code == 0, said.output
    return out, said.output


@pytest.fixture(scope="module")
def both(folder):
    return {name: done(folder, name) for name in ("whole", "width")}


def test_no_label_of_the_whole_is_per_metre(folder, both):
    out, said = both["whole"]
    assert not PER_WIDTH.search(said.replace(str(Path(out)), "")), said
    shown = CliRunner().invoke(check, [str(folder / "whole.toml")])
    assert shown.exit_code == 0, shown.output
    assert not PER_WIDTH.search(shown.output), shown.output
    again = CliRunner().invoke(show, [str(out)])
    assert not PER_WIDTH.search(again.output), again.output
    found = load_run(out)
    for name, group in dataset(found).subtree_with_keys:
        for variable in group.dataset.variables.values():
            for key in ("units", "long_name"):
                assert not PER_WIDTH.search(str(variable.attrs.get(key, ""))), (name, variable)
    for name, draw in figures_of(found).items():
        for figure in draw_figures(name, draw, found).values():
            for each in figure.findobj(Text):
                assert not PER_WIDTH.search(each.get_text()), (name, each.get_text())


def stored(out):
    """What the summary says of the model, its prestress, cycles and backbone."""
    found = json.loads((out / "summary.json").read_text())
    return {key: found[key] for key in ("model", "prestress", "cycles", "backbone")}


def flat(found, prefix=""):
    """Numbers of a summary by their path."""
    if isinstance(found, dict):
        for key, value in found.items():
            yield from flat(value, f"{prefix}.{key}")
    elif isinstance(found, list):
        for k, value in enumerate(found):
            yield from flat(value, f"{prefix}.{k}")
    elif isinstance(found, float):
        yield prefix, found


def test_numbers_of_the_whole_are_those_per_metre_times_the_width(both):
    whole, width = (dict(flat(stored(both[name][0]))) for name in ("whole", "width"))
    scaled = 0
    for path, value in width.items():
        if "timings" in path or "seconds" in path or "residual" in path or "closure" in path:
            continue
        other = re.sub(r"_([nj])_per_m\b", r"_\1", path)
        if other != path or path.endswith(".load"):
            scaled += 1
            assert whole[other] == pytest.approx(WIDTH * value, rel=1e-6, abs=1e-12), path
        elif "modal" not in path and "amplitude" not in path and path in whole:
            assert whole[path] == pytest.approx(value, rel=1e-6, abs=1e-12), path
    assert scaled > 10


def test_datasets_of_the_whole_have_its_energies(both):
    for group, name, unit in (
        ("cycles_load", "dissipated_energy", "J"),
        ("backbone", "dissipated_energy", "J"),
        ("model", "contact_force", "N"),
    ):
        found = {}
        for kind in ("whole", "width"):
            with xr.open_dataset(
                both[kind][0] / "results.nc", group=group, engine="h5netcdf"
            ) as held:
                found[kind] = held[name].load()
        assert found["whole"].attrs["units"] == unit
        assert found["whole"].values.ravel() == pytest.approx(
            WIDTH * found["width"].values.ravel(), rel=1e-5
        )


def test_units_must_be_those_of_the_whole(folder):
    for change, said in (
        ({"force": "600 kN/m"}, "expected a force, for example"),
        ({"force": "12 kN", "stiffness": "1e10 N/m/m"}, "expected a stiffness, for example"),
    ):
        document = plates_document(folder) | {"analysis": {"cycle": {"force": [10.0]}}}
        document["mesh"] = document["mesh"] | {"width": "whole"}
        document["preload"] = document["preload"] | change
        with pytest.raises(InputError, match=said):
            parse_joint(document, "whole", folder)
    document = plates_document(folder)
    document["preload"] = document["preload"] | {"force": "12 kN"}
    with pytest.raises(InputError, match="measures something else"):
        parse_joint(document, "width", folder)


def test_what_is_in_memory_says_the_same(folder):
    document = plates_document(folder) | {"analysis": {"cycle": {"force": [1.0], "steps": 20}}}
    document["mesh"] = document["mesh"] | {"width": "whole"}
    document["preload"] = document["preload"] | {"force": "12 kN"}
    found = run(parse_joint(document, "whole", folder))
    assert "contact_force_n" in summary(found)["model"]
    assert found.joint.driven.load.named(2.0) == "F = 2 N"


def test_comparison_of_the_whole_says_newtons(folder, both):
    """Keys, loads and what opens the joint; per metre of width beside it, nothing is matched."""
    stiffer = (folder / "whole.toml").read_text().replace('"12.0 kN"', '"13 kN"')
    (folder / "other.toml").write_text(stiffer)
    out, _ = done(folder, "other")
    same = CliRunner().invoke(compare, [str(both["whole"][0]), str(out)])
    assert same.exit_code == 0, same.output
    assert not PER_WIDTH.search(same.output), same.output
    assert "opening force, N" in same.output
    assert "F = 1 N" in same.output  # 50 N/m on 20 mm
    assert re.search(r"preload\[bolt\]\.force\s+12 kN\s+13 kN", same.output)
    apart = CliRunner().invoke(compare, [str(both["whole"][0]), str(both["width"][0])])
    assert "peak, F = 1 N, Hz" in apart.output
    assert "peak, F = 50 N/m, Hz" in apart.output


def test_errors_and_failures_of_the_whole_say_newtons(folder):
    """A bolt that a later one loosens, and a point that opens."""
    document = plates_document(folder) | {"analysis": {"cycle": {"force": [1.0]}}}
    document["mesh"] = document["mesh"] | {"width": "whole"}
    first = {"name": "one", "on": ["head", "nut"], "force": "100 N", "stiffness": "1e9 N/m"}
    second = first | {"name": "two", "force": "50 kN", "order": 2}
    joint = parse_joint(document | {"preload": [first, second]}, "whole", folder)
    with pytest.raises(ContactError, match=r"push with [\d.e+]+ N;"):
        assemble(joint)
    said = Failure("time", "F = 2 N", "which carried 3 N/m one step before, 2 N/m² beside it")
    assert in_units_of(joint, said).reason == "which carried 3 N one step before, 2 N/m² beside it"
