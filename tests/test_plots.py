"""Figures: what they show and that they are there, not how they look."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib import colors
from matplotlib.figure import Figure

from microslip.joint import parse_joint
from microslip.pipeline import LapRun, run_lap_joint
from microslip.plots import FIGURES, overview, save_figures
from microslip.plots.hysteresis import hysteresis_figure
from microslip.plots.prestress import prestress_figure
from microslip.plots.response import response_figure
from microslip.plots.selection import greatest_damping, scientific, spread
from microslip.plots.states import COLOURS, draw_states
from microslip.plots.style import DOUBLE, house_style, new_figure

JOINT = {
    "beams": {"length": "251.5 mm", "thickness": "12.5 mm", "overlap_half_length": "37.5 mm"},
    "material": {"youngs_modulus": "70 GPa", "poissons_ratio": 0.3, "density": "2 g/cm^3"},
    "contact": {"friction": 0.25, "pairs": 51},
    "clamp": {"force": "1 MN/m", "half_length": "25 mm"},
    "damping": {"beta": "0.73 us"},
    "mesh": {"modes": 30},
    "load": {"rho": [0, 2.4], "rho_scale": 0.0023},
    "analysis": {
        "cycle": {"moment_over_clamp_force_length": [1e-3, 4e-3, 1.2e-2], "steps": 60},
        "response": {"from": "170 Hz", "to": "185 Hz", "count": 61},
    },
}


@pytest.fixture(scope="module")
def run() -> LapRun:
    return run_lap_joint(parse_joint(JOINT))


def texts(figure: Figure) -> list[str]:
    """Labels of all axes of a figure that are drawn."""
    shown = [ax for ax in figure.axes if ax.axison]
    return [text for ax in shown for text in (ax.get_xlabel(), ax.get_ylabel())]


def test_every_figure_is_saved_twice(run: LapRun, tmp_path: Path) -> None:
    written = save_figures(run, tmp_path / "figures")
    assert {path.name for path in written} == {f"{n}.{k}" for n in FIGURES for k in ("png", "svg")}
    assert all(path.stat().st_size > 1000 for path in written)
    assert set((tmp_path / "figures").iterdir()) == set(written)


def test_figures_of_missing_data_are_left_out(run: LapRun, tmp_path: Path) -> None:
    written = save_figures(LapRun(joint=run.joint, assembly=run.assembly), tmp_path)
    assert {path.stem for path in written} == {"model", "prestress", "overview"}


def test_one_cycle_is_enough(run: LapRun, tmp_path: Path) -> None:
    one = LapRun(
        joint=run.joint,
        assembly=run.assembly,
        cycles={"moment": run.cycles["moment"][:1], "mode": []},
        moments={"moment": run.moments["moment"][:1], "mode": []},
    )
    names = {path.stem for path in save_figures(one, tmp_path)}
    assert names == set(FIGURES) - {"response"}


def test_structure_without_mesh_has_no_picture(run: LapRun) -> None:
    structure = replace(run.structure, meshes=())
    bare = replace(run, assembly=replace(run.assembly, structure=structure))
    assert FIGURES["model"](bare) is None
    assert overview(bare).axes


def test_axes_are_labelled(run: LapRun) -> None:
    for name, draw in FIGURES.items():
        figure = draw(run)
        assert figure is not None, name
        inner = [ax for ax in figure.axes if ax.axison]
        if inner:
            assert any(label for label in texts(figure)), name
        for ax in inner:
            bottom = ax.get_subplotspec()
            if bottom is None or bottom.is_last_row():
                assert ax.get_xlabel(), name


def test_nothing_is_smaller_than_eight_points(run: LapRun) -> None:
    figure = FIGURES["equivalent"](run)
    assert figure is not None
    for ax in figure.axes:
        for text in (ax.xaxis.label, ax.yaxis.label, *ax.get_xticklabels(), *ax.get_yticklabels()):
            assert text.get_fontsize() >= 8


def test_prestress_curve_has_the_area_of_the_clamp(run: LapRun) -> None:
    """p / (P / 2 L_p) over x / L_p has the area 2 where the pressure carries the clamp force."""
    (curve,) = (
        line
        for line in prestress_figure(run).axes[0].lines
        if str(line.get_label()).startswith("contact")
    )
    x, p = np.asarray(curve.get_xdata(), float), np.asarray(curve.get_ydata(), float)
    h = x[2::2] - x[:-2:2]
    area = (h / 6 * (p[:-2:2] + 4 * p[1::2] + p[2::2])).sum()
    assert area == pytest.approx(2, rel=1e-3)


def test_state_map_shows_the_states(run: LapRun) -> None:
    figure = new_figure(DOUBLE, DOUBLE)
    ax = figure.subplots()
    draw_states(ax, run, "mode", 2)
    (mesh,) = ax.collections
    np.testing.assert_array_equal(
        np.asarray(mesh.get_array()).reshape(60, 51), run.cycles["mode"][2].status[1:]
    )
    face = [mesh.cmap(mesh.norm(state)) for state in (1, 2, 3, 4)]
    assert [colors.to_hex(f) for f in face] == [colors.to_hex(c) for c in COLOURS]


def test_states_keep_apart_in_grey_print() -> None:
    """Relative luminances rise and differ by a tenth at least."""
    grey = [np.dot(colors.to_rgb(c), [0.299, 0.587, 0.114]) for c in COLOURS]
    assert (np.diff(grey) > 0.1).all()


def test_loops_are_normalised_and_enclose_their_damping(run: LapRun) -> None:
    """The area of a loop over its own amplitude is pi gamma_eq but for higher harmonics of q."""
    figure = hysteresis_figure(run)
    assert figure is not None
    lines = figure.axes[0].lines
    shown = spread(run, "mode")
    assert len(lines) == len(shown)
    for line, index in zip(lines, shown, strict=True):
        q, f = np.asarray(line.get_xdata(), float), np.asarray(line.get_ydata(), float)
        assert np.abs(q).max() == pytest.approx(1)
        area = (0.5 * (f[1:] + f[:-1]) * np.diff(q)).sum()
        assert area == pytest.approx(np.pi * run.tables["mode"].gamma_eq[index], rel=0.02)


def test_response_leaves_out_points_without_answer(run: LapRun) -> None:
    flag = np.zeros_like(run.responses[-1].flag)
    flag[20:30] = 1
    changed = replace(run, responses=[replace(run.responses[-1], flag=flag)])
    figure = response_figure(changed)
    assert figure is not None
    curve, crosses = figure.axes[0].lines[0], figure.axes[0].lines[-1]
    x, y = np.asarray(curve.get_xdata(), float), np.asarray(curve.get_ydata(), float)
    hidden = np.isin(x, run.responses[-1].frequency[20:30])
    assert np.isnan(y[hidden]).all()
    assert crosses.get_marker() == "x"
    assert len(np.asarray(crosses.get_xdata())) == 10


def test_frictionless_curve_peaks_at_one(run: LapRun) -> None:
    figure = response_figure(run)
    assert figure is not None
    first = figure.axes[0].lines[0]
    assert np.nanmax(np.asarray(first.get_ydata(), float)) == pytest.approx(1, rel=0.02)


def test_greatest_damping(run: LapRun) -> None:
    gamma = run.tables["mode"].gamma_eq
    assert greatest_damping(run, "mode") == int(np.argmax(gamma))
    assert greatest_damping(run, "mode") in spread(run, "mode")


@pytest.mark.parametrize(
    ("value", "text"), [(2.17e-3, r"2.2\times10^{-3}"), (0.25, "0.25"), (0.0, "0"), (3.0, "3")]
)
def test_numbers_in_labels(value: float, text: str) -> None:
    assert scientific(value) == text


def test_house_style_does_not_leak() -> None:
    before = dict(mpl.rcParams)

    @house_style
    def size() -> float:
        return float(mpl.rcParams["font.size"])

    with mpl.rc_context({"font.size": 20}):
        assert size() == 8
        assert mpl.rcParams["font.size"] == 20
    assert dict(mpl.rcParams) == before


def test_pictures_are_reproducible(run: LapRun, tmp_path: Path) -> None:
    bare = LapRun(joint=run.joint, assembly=run.assembly)
    first = [path.read_bytes() for path in save_figures(bare, tmp_path / "a")]
    second = [path.read_bytes() for path in save_figures(bare, tmp_path / "b")]
    assert first == second
