"""Vibrations of a structure as files and as pictures: what they hold is what the analyses found."""

from __future__ import annotations

from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
from conftest import with_value
from matplotlib.collections import PolyCollection
from mesh_files import plates_document

from microslip.analyses.time.point import TimePoint
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import steady_state
from microslip.describe.reading import parse_joint
from microslip.pipeline.run import run as run_joint
from microslip.pipeline.vibration import largest_vibrations
from microslip.results.vtk import steps_of, write_vtk
from microslip.show.figures import draw_figures, figures_of
from microslip.show.plots.motions import lag

LOAD = 20.0
"""At the tip, N per metre of width."""


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Plates in space shaken below resonance, by harmonic balance and in time."""
    folder = tmp_path_factory.mktemp("plates")
    document = plates_document(folder)
    document["load"] = {"force": [LOAD]}
    document["analysis"] = {
        "harmonic": {"frequencies": [153.0, 154.0], "harmonics": 3, "stability": False}
    }
    found = run_joint(parse_joint(document, "mesh", folder))
    scheme = time_scheme(found.prepared, 1 / (154.0 * 100), frequency=154.0)
    steady = steady_state(scheme, 154.0, LOAD)
    assert steady.converged
    return with_value(found, "time", (TimePoint(np.nan, 0.3, steady),))


@pytest.fixture(scope="module")
def vtk(run, tmp_path_factory):
    folder = tmp_path_factory.mktemp("vtk")
    return folder, write_vtk(run, folder)


def series(folder, name):
    """Phases of a series, and its files."""
    listed = ElementTree.parse(folder / name).getroot().findall(".//DataSet")
    return np.array([float(e.get("timestep")) for e in listed]), [
        meshio.read(folder / e.get("file")) for e in listed
    ]


def test_every_file_is_listed(vtk):
    folder, written = vtk
    assert set(written) == {p for p in folder.rglob("*") if p.is_file()}


def test_the_peak_of_harmonic_balance_moves_the_tip_as_its_output_says(run, vtk):
    (entry,) = run.harmonic
    point = max(entry.points, key=lambda p: abs(p.amplitude))
    theta, files = series(vtk[0] / "harmonic", "motion.pvd")
    tip = run.geometry.forces(run.structure.loads["tip"])
    found = [(each.point_data["displacement"] * tip).sum() for each in files]
    Y = point.output[:, run.model.port("tip")]
    y = Y[0].real + (np.exp(1j * np.outer(theta, np.arange(1, len(Y)))) @ Y[1:]).imag
    assert found == pytest.approx(y, abs=1e-9 * np.abs(y).max())
    assert theta[[0, -1]] == pytest.approx([0, 2 * np.pi])


@pytest.mark.parametrize("analysis", ["harmonic", "time"])
def test_contact_over_a_vibration(run, vtk, analysis):
    """Friction work over the faces is that of all pairs; what does not touch has no pressure."""
    theta, files = series(vtk[0] / analysis, "contact_contact.pvd")
    vibration = largest_vibrations(run)[analysis]
    assert theta == pytest.approx(vibration.theta[steps_of(vibration)])
    (surface,) = run.geometry.surfaces
    for found in files[::12]:
        state, pressure = found.point_data["state"], found.point_data["pressure"]
        if analysis == "time":  # harmonics approach it
            assert np.abs(pressure[state == 4]).max(initial=0.0) == 0
        at = [int(np.argmin(np.linalg.norm(surface.points - x, axis=1))) for x in found.points]
        work = found.point_data["dissipation"] @ run.model.area[at]
        assert work == pytest.approx(vibration.friction_work.sum(), rel=1e-9)


def test_pictures_of_vibrations(run):
    """Both turns in one scale of colours, the larger of them as large as a picture may have it."""
    for name, method in (("motion_harmonic", "harmonic balance"), ("motion_time", "time")):
        figures = draw_figures(name, figures_of(run)[name], run)
        figure = figures[name]
        said = figure.get_suptitle()
        assert said.startswith(method)
        assert "154.00 Hz" in said
        shown = [
            c
            for ax in figure.axes
            for c in ax.collections
            if isinstance(c, PolyCollection) and c.get_array() is not None
        ]
        tops = [float(np.max(c.get_array())) for c in shown]
        assert max(tops) <= shown[0].norm.vmax * (1 + 1e-12)
        assert max(tops) > 0.9 * shown[0].norm.vmax
        assert min(tops) > 0.5 * max(tops)


def test_when_a_motion_turns_is_said_against_the_load():
    assert lag(0.5 * np.pi) == "with the load"
    assert lag(np.pi) == "90° after the load"
    assert lag(0.0) == "90° before the load"
