"""Bodies drawn by PyVista: where they are, what hides what, what colours stand for."""

from __future__ import annotations

import importlib.util

import numpy as np
import pytest
from conftest import ROOT
from matplotlib import colormaps
from matplotlib.colors import Normalize
from typer.testing import CliRunner

from microslip.cli.main import app
from microslip.errors import InputError
from microslip.show.plots.solid import (
    Camera,
    by_pyvista,
    drawn_by,
    missing,
    picture_of,
)

CUBE = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], float)
SIDES = np.array(
    [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]
)
NO_EDGES = np.zeros((0, 2), int)


@pytest.fixture(scope="module")
def pyvista():
    if importlib.util.find_spec("pyvista") is None or missing():
        pytest.skip(missing())


@pytest.fixture
def asked(monkeypatch):
    """Whether PyVista draws is found out anew."""
    missing.cache_clear()
    monkeypatch.setattr("microslip.show.plots.solid.missing", missing)
    yield
    missing.cache_clear()


drawing = pytest.mark.usefixtures("pyvista")


def camera(toward):
    toward = np.array(toward) / np.linalg.norm(toward)
    right = np.cross([0.0, 0.0, 1.0], toward)
    right /= np.linalg.norm(right)
    return Camera(right, np.cross(toward, right), toward)


def at(picture, place):
    """Colour of the pixel at a place of the picture, channels from 0 to 1."""
    left, right, low, high = picture.extent
    rows, columns = picture.pixels.shape[:2]
    column = int((place[0] - left) / (right - left) * columns)
    row = int((high - place[1]) / (high - low) * rows)
    return picture.pixels[row, column] / 255


@drawing
def test_a_cube_covers_its_shadow():
    """A unit cube seen along n has the projected area abs(n1) + abs(n2) + abs(n3)."""
    seen = camera([0.42, -0.78, 0.52])
    grey = [np.full((6, 3), 0.5)]
    picture = picture_of(CUBE, [SIDES], NO_EDGES, seen, grey, 0.3, mesh=False, pixels=400)
    left, right, low, high = picture.extent
    covered = (picture.pixels[..., 3] / 255).mean() * (right - left) * (high - low)
    assert covered == pytest.approx(np.abs(seen.toward).sum(), rel=0.01)
    flat = np.stack([CUBE @ seen.right, CUBE @ seen.up], axis=1)
    assert (left, low) < tuple(flat.min(axis=0)) < tuple(flat.max(axis=0)) < (right, high)


@drawing
def test_what_passes_through_another_is_hidden_by_the_pixel():
    """Two squares cross at x = 0; sorting faces by their middles would hide one of them everywhere."""
    points = np.array(
        [
            [-1, 0, -1], [1, 0, 1], [1, 1, 1], [-1, 1, -1],
            [-1, 0, 1], [1, 0, -1], [1, 1, -1], [-1, 1, 1],
        ],
        float,
    )  # fmt: skip
    above = Camera(*np.eye(3))
    colours = [np.array([[1.0, 0, 0], [0, 0, 1.0]])]
    loops = [np.array([[0, 1, 2, 3], [4, 5, 6, 7]])]
    picture = picture_of(points, loops, NO_EDGES, above, colours, 0.0, mesh=False, pixels=100)
    assert at(picture, (0.5, 0.5)) == pytest.approx([1, 0, 0, 1], abs=0.01)
    assert at(picture, (-0.5, 0.5)) == pytest.approx([0, 0, 1, 1], abs=0.01)


@drawing
def test_values_between_nodes_have_the_colours_of_the_scale():
    """A quadratic triangle in the plane of the picture: the value x² at its nodes is x² in it."""
    points = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 1, 0], [0, 2, 0], [0, 1, 0]], float)
    around, norm = [np.arange(6)[None]], Normalize(0.0, 4.0)
    picture = picture_of(
        points,
        around,
        NO_EDGES,
        Camera(*np.eye(3)),
        [np.ones((1, 3))],
        0.0,
        points[:, 0] ** 2,
        norm,
        mesh=False,
        pixels=400,
    )
    for x in (0.25, 0.5, 0.75, 1.5):
        # chords of x² between points 1/4 of the side apart, and lines of light: 0.02 of the scale
        near = np.array(colormaps["viridis"](norm(x**2) + np.linspace(-0.02, 0.02, 9)))[:, :3]
        shown = at(picture, (x, 0.2))[:3]
        assert (shown >= near.min(axis=0) * 0.85).all()
        assert (shown <= near.max(axis=0) + 0.02).all()


@drawing
def test_edges_at_rest_are_hidden_by_what_moved():
    """Of a square that moved up, seen from above, only what lies outside of it shows where it was."""
    square = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]], float)
    moved = square + np.array([1.0, 0.0, 1.0])
    loops, ends = [np.arange(4)[None]], np.array([[0, 1], [1, 2], [2, 3], [3, 0]])
    picture = picture_of(
        moved,
        loops,
        ends,
        Camera(*np.eye(3)),
        [np.ones((1, 3))],
        0.0,
        mesh=False,
        at_rest=square,
        pixels=400,
    )
    left, right, _, _ = picture.extent
    assert left < 0 < 3 < right
    assert at(picture, (2.0, 1.0)) == pytest.approx([1, 1, 1, 1], abs=0.02)
    assert at(picture, (0.5, 1.0))[3] == 0
    column = int((0.0 - left) / (right - left) * picture.pixels.shape[1])
    assert picture.pixels[200, column - 2 : column + 3, 3].max() > 50


@pytest.mark.usefixtures("asked")
def test_what_is_missing_is_said(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with drawn_by("auto"):
        assert not by_pyvista()
    file = str(ROOT / "examples" / "mesh_plates.toml")
    refused = CliRunner().invoke(app, ["check", file, "--renderer", "pyvista"])
    assert refused.exit_code == 2
    assert 'pip install "microslip[view]"' in refused.stderr


@pytest.mark.usefixtures("asked")
def test_a_library_of_graphics_that_is_missing_ends_another_process(monkeypatch):
    """VTK ends the process that it cannot draw in."""
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: True)
    monkeypatch.setattr("microslip.show.plots.solid.PROBE", "import os; os.abort()")
    assert "libEGL" in missing()


def test_another_name_is_refused():
    with pytest.raises(InputError, match="auto, matplotlib, pyvista"), drawn_by("povray"):
        pass
