"""Every example is run: with few pairs and points, and all that it asks for."""

from __future__ import annotations

import shutil
import tomllib

import pytest
from conftest import ROOT

from microslip import parse_joint, run
from microslip.show.figures import draw_figures, figures_of

EXAMPLES = sorted((ROOT / "examples").glob("*.toml"))
COARSE = {
    "cycle": {"count": 6, "steps": 60},
    "response": {"count": 51, "points": 8},
    "reduced": {"amplitudes": 12},
    "harmonic": {"count": 5, "harmonics": 3},
    "backbone": {"count": 3},
    "time": {"count": 2, "steps": 40},
}
"""What is made smaller of each analysis, where it is asked for."""

IN_SPACE = {
    "cycle": {"count": 2, "steps": 60},
    "response": COARSE["response"] | {"checks": 1},
    "reduced": {"amplitudes": 6, "steps": 60},
    "backbone": {"count": 2, "steps": 60},
}
"""The same of a mesh, whose contact steps take ten times as long; held against one motion, not three."""


def coarse(document):
    """An example that takes seconds; of a history only the steps are fewer."""
    if document.get("kind", "lap") == "lap":
        document["contact"]["pairs"] = 21
    smaller = COARSE | (IN_SPACE if document.get("kind") == "mesh" else {})
    for name, asked in document["analysis"].items():
        for entry in asked if isinstance(asked, list) else [asked]:
            entry |= smaller.get(name, {"steps": 30})
    return document


SLOW = ("bolted_plates", "extruded_joint", "flange_sector", "half_lap_beam")
"""Half a minute to two minutes each; the plates with one bolt stand for them."""


@pytest.mark.parametrize(
    "file",
    [
        pytest.param(file, marks=[pytest.mark.validate] * (file.stem in SLOW), id=file.stem)
        for file in EXAMPLES
    ],
)
def test_example_runs_and_every_figure_is_drawn(file, tmp_path):
    for signal in file.parent.glob("blow.*"):
        shutil.copy(signal, tmp_path)
    for folder in (path for path in file.parent.iterdir() if path.is_dir()):
        shutil.copytree(folder, tmp_path / folder.name)
    document = coarse(tomllib.loads(file.read_text("utf-8")))
    found = run(parse_joint(document, folder=tmp_path))
    asked = {name for name, value in document["analysis"].items() if value is not None}
    assert asked <= set(found.outcomes)
    assert all(found.value(name) is not None for name in asked)
    for name, draw in figures_of(found).items():
        for figure in draw_figures(name, draw, found).values():
            assert figure.axes
