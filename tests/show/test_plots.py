"""Figures: what they show and that they are there, not how they look."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from conftest import description, with_value
from matplotlib import colors
from matplotlib.figure import Figure

from microslip.describe.excitation import SteppedSine, SweptSine
from microslip.describe.reading import parse_joint
from microslip.pipeline.cycle import DrivenCycles
from microslip.pipeline.excitation import sampled_load
from microslip.pipeline.outcome import Outcome
from microslip.pipeline.run import Run
from microslip.pipeline.run import run as run_joint
from microslip.registry import ANALYSES, resolved
from microslip.show.figures import figures_of, save_figures
from microslip.show.plots.dissipation import dissipation_figure, note_cut_tips
from microslip.show.plots.equivalent import equivalent_figure
from microslip.show.plots.history import history_figure
from microslip.show.plots.hysteresis import hysteresis_figure
from microslip.show.plots.model import model_figure
from microslip.show.plots.overview import overview
from microslip.show.plots.prestress import prestress_figure
from microslip.show.plots.response import response_figure
from microslip.show.plots.selection import greatest_damping, scientific, spread
from microslip.show.plots.states import COLOURS, draw_states, states_figure
from microslip.show.plots.steady import steady_figure
from microslip.show.plots.style import DOUBLE, house_style, new_figure
from microslip.show.plots.sweeps import frequency_ticks

JOINT = description(
    51,
    30,
    load={"rho": [0, 2.4], "rho_scale": 0.0023},
    analysis={
        "cycle": {"moment_over_clamp_force_length": [1e-3, 4e-3, 1.2e-2], "steps": 60},
        "response": {
            "from": "170 Hz",
            "to": "185 Hz",
            "count": 61,
            "variants": ["printed", "consistent", "refined"],
        },
    },
)


@pytest.fixture(scope="module")
def run() -> Run:
    return run_joint(parse_joint(JOINT))


def texts(figure: Figure) -> list[str]:
    """Labels of all axes of a figure that are drawn."""
    shown = [ax for ax in figure.axes if ax.axison]
    return [text for ax in shown for text in (ax.get_xlabel(), ax.get_ylabel())]


def test_every_figure_is_saved_twice(run: Run, tmp_path: Path) -> None:
    written = save_figures(run, tmp_path / "figures")
    names = set(figures_of(run))
    assert names == {"model", "prestress", *ANALYSES["cycle"].figures, "response", "overview"}
    assert {path.name for path in written} == {f"{n}.{k}" for n in names for k in ("png", "svg")}
    assert all(path.stat().st_size > 1000 for path in written)
    assert set((tmp_path / "figures").iterdir()) == set(written)


def test_figures_of_missing_data_are_left_out(run: Run, tmp_path: Path) -> None:
    written = save_figures(Run(run.assembly), tmp_path, formats=("png",))
    assert {path.stem for path in written} == {"model", "prestress", "overview"}


def test_one_cycle_is_enough(run: Run, tmp_path: Path) -> None:
    driven = {
        "moment": DrivenCycles(run.cycles["moment"][:1], run.moments["moment"][:1], None),
        "mode": DrivenCycles((), (), None),
    }
    one = Run(run.assembly, {"cycle": Outcome(driven)})
    names = {path.stem for path in save_figures(one, tmp_path, formats=("png",))}
    assert names == {"model", "prestress", *ANALYSES["cycle"].figures, "overview"}


def test_structure_without_mesh_has_no_picture(run: Run) -> None:
    structure = replace(run.structure, meshes=())
    bare = replace(run, assembly=replace(run.assembly, structure=structure))
    assert model_figure(bare) is None
    assert overview(bare).axes


def test_what_was_not_computed_has_no_figure(run: Run) -> None:
    for name in ("time", "backbone", "harmonic"):
        for draw in ANALYSES[name].figures.values():
            assert resolved(draw)(run) is None


def test_axes_are_labelled(run: Run) -> None:
    for name, draw in figures_of(run).items():
        figure = draw(run)
        assert figure is not None, name
        inner = [ax for ax in figure.axes if ax.axison]
        if inner:
            assert any(label for label in texts(figure)), name
        for ax in inner:
            bottom = ax.get_subplotspec()
            if bottom is None or bottom.is_last_row():
                assert ax.get_xlabel(), name


def test_nothing_is_smaller_than_eight_points(run: Run) -> None:
    figure = equivalent_figure(run)
    assert figure is not None
    for ax in figure.axes:
        for text in (ax.xaxis.label, ax.yaxis.label, *ax.get_xticklabels(), *ax.get_yticklabels()):
            assert text.get_fontsize() >= 8


def test_prestress_curve_has_the_area_of_the_clamp(run: Run) -> None:
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


def test_load_beside_the_contact_maps_is_the_load_of_the_cycle(run: Run) -> None:
    figure = states_figure(run)
    assert figure is not None
    curve = figure.axes[0].lines[0]
    theta = np.pi * np.asarray(curve.get_ydata(), float)
    assert np.asarray(curve.get_xdata(), float) == pytest.approx(np.sin(theta), abs=1e-9)
    assert theta[-1] - theta[0] == pytest.approx(2 * np.pi)


def test_what_leaves_the_axes_at_the_tips_is_said(run: Run) -> None:
    figure = dissipation_figure(run)
    assert figure is not None
    ax = figure.axes[0]
    largest = max(np.nanmax(np.asarray(line.get_ydata(), float)) for line in ax.lines[:-2])
    said = ax.get_title(loc="right")
    assert (f"{largest:.2g}" in said) == (largest > ax.get_ylim()[1])
    top = new_figure(DOUBLE, DOUBLE).subplots()
    top.set_ylim(0, 1)
    x = np.linspace(-1.5, 1.5, 7)
    note_cut_tips(top, x, [np.full(7, 0.5), np.array([7, 0, 0, 0, 0, 0, 3.0])])
    assert top.get_title(loc="right").endswith("up to 7")


def test_marks_have_the_colours_of_their_loads_in_the_legend(run: Run) -> None:
    flags = [np.zeros_like(r.flag) for r in run.responses]
    flags[-1][20:30] = 1
    curves = tuple(replace(r, flag=f) for r, f in zip(run.responses, flags, strict=True))
    changed = with_value(run, "response", replace(run.value("response"), curves=curves))
    figure = response_figure(changed)
    assert figure is not None
    (crosses,) = (line for ax in figure.axes for line in ax.lines if line.get_marker() == "x")
    (legend,) = figure.legends
    drawn = [line for line in legend.findobj(mpl.lines.Line2D) if line.get_marker() == "x"]
    assert {line.get_color() for line in drawn} == {crosses.get_color()}


def test_state_map_shows_the_states(run: Run) -> None:
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


def test_loops_are_normalised_and_enclose_their_damping(run: Run) -> None:
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


def test_response_leaves_out_points_without_answer(run: Run) -> None:
    flag = np.zeros_like(run.responses[-1].flag)
    flag[20:30] = 1
    curves = (replace(run.responses[-1], flag=flag),)
    changed = with_value(run, "response", replace(run.value("response"), curves=curves))
    figure = response_figure(changed)
    assert figure is not None
    curve, crosses = figure.axes[0].lines[0], figure.axes[0].lines[-1]
    x, y = np.asarray(curve.get_xdata(), float), np.asarray(curve.get_ydata(), float)
    hidden = np.isin(x, run.responses[-1].frequency[20:30])
    assert np.isnan(y[hidden]).all()
    assert crosses.get_marker() == "x"
    assert len(np.asarray(crosses.get_xdata())) == 10


def test_frictionless_curve_peaks_at_the_deflection_of_its_mode(run: Run) -> None:
    """At resonance the mode is all that moves: its amplitude there, times its own deflection."""
    figure = response_figure(run)
    assert figure is not None
    first = figure.axes[0].lines[0]
    assert run.responses[0].rho == 0
    lift = abs(run.mode.load_on_sliding["lift"])
    expected = 1e3 * lift * np.abs(run.responses[0].amplitude).max() / run.responses[0].load
    assert np.nanmax(np.asarray(first.get_ydata(), float)) == pytest.approx(expected, rel=0.01)


def test_greatest_damping(run: Run) -> None:
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


def test_pictures_are_reproducible(run: Run, tmp_path: Path) -> None:
    bare = Run(run.assembly)
    first = [path.read_bytes() for path in save_figures(bare, tmp_path / "a")]
    second = [path.read_bytes() for path in save_figures(bare, tmp_path / "b")]
    assert first == second


def quarters(figure: Figure) -> list[float]:
    """Share of every quarter of the picture that axes with their labels and legends cover."""
    figure.canvas.draw()
    renderer = figure.canvas.get_renderer()
    x, y = np.meshgrid(np.linspace(0, 1, 60), np.linspace(0, 1, 60))
    inside = np.zeros_like(x, bool)
    for ax in figure.axes:
        box = ax.get_tightbbox(renderer).transformed(figure.transFigure.inverted())
        inside |= (box.x0 <= x) & (x <= box.x1) & (box.y0 <= y) & (y <= box.y1)
    return [float(part.mean()) for half in np.split(inside, 2) for part in np.split(half, 2, 1)]


@pytest.mark.parametrize(
    "left", [(), ("response",), ("cycle",), ("backbone",), ("cycle", "response")]
)
def test_an_overview_has_no_blank_quarter(run: Run, left: tuple[str, ...]) -> None:
    some = replace(
        run, outcomes={name: run.outcomes[name] for name in left if name in run.outcomes}
    )
    assert min(quarters(overview(some))) > 0.25


# -- time domain -------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def timed() -> Run:
    """Two loads and three frequencies, some of which are not steady in time, and a free decay."""
    document = {
        **JOINT,
        "contact": {"friction": 0.25, "pairs": 21},
        "load": {"rho": [2.4, 5], "rho_scale": 0.0023},
        "analysis": {
            "cycle": {"moment_over_clamp_force_length": [1e-3, 4e-3, 1.2e-2], "steps": 60},
            "response": {**JOINT["analysis"]["response"]},
            "time": {"frequencies": [172, 177, 179], "steps": 60, "max_cycles": 9},
            "history": {
                "signal": "free_decay",
                "start": "static",
                "moment_over_clamp_force_length": 3e-3,
                "duration": "0.1 s",
                "name": "let_go",
            },
        },
    }
    return run_joint(parse_joint(document))


def test_time_points_lie_over_their_curves_with_their_marks(timed: Run) -> None:
    """Open circles where steady, open squares where not, amplitude above and phase below."""
    figure = response_figure(timed)
    assert figure is not None
    assert len(figure.axes) == 6
    for ax, of in zip(figure.axes, [np.abs] * 3 + [np.angle] * 3, strict=True):
        for marker, steady in (("o", True), ("s", False)):
            drawn = [
                line
                for line in ax.lines
                if line.get_marker() == marker and line.get_linestyle() == "None"
            ]
            count = sum(len(np.asarray(line.get_xdata())) for line in drawn)
            points = [p for p in timed.time_domain if p.steady.converged == steady]
            assert count == len(points) > 0
            assert all(line.get_markerfacecolor() == "none" for line in drawn)
            x = np.concatenate([np.asarray(line.get_xdata(), float) for line in drawn])
            y = np.concatenate([np.asarray(line.get_ydata(), float) for line in drawn])
            assert sorted(x) == pytest.approx(sorted(p.steady.frequency for p in points))
            if of is np.angle:
                # the middle goes down while the ends turn up
                expected = [180 + np.degrees(of(p.steady.amplitude)) for p in points]
                assert sorted(y) == pytest.approx(sorted(expected), abs=1.0)
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels[-2:] == ["time domain", "time domain, not steady"]


def test_steady_figure_shows_the_point_of_largest_amplitude(timed: Run) -> None:
    """Of the steady ones; its waveforms: load a sine that starts at zero, the deflection against the
    mode's phase."""
    figure = steady_figure(timed)
    assert figure is not None
    states, beside, waves, _ = figure.axes
    steady = [p for p in timed.time_domain if p.steady.converged]
    best = max(steady, key=lambda p: abs(p.steady.amplitude))
    title = figure._suptitle
    assert title is not None
    assert f"{best.steady.frequency:.2f} Hz" in title.get_text()
    assert "not steady" not in title.get_text()
    moment, phase = beside.lines[0].get_data()
    assert np.asarray(moment, float) == pytest.approx(
        np.sin(np.pi * np.asarray(phase, float)), abs=1e-9
    )
    load, deflection, _ = waves.lines
    theta = np.pi * np.asarray(load.get_xdata(), float)
    assert np.asarray(load.get_ydata(), float) == pytest.approx(
        np.sin(theta) / np.abs(np.sin(theta)).max(), abs=1e-9
    )
    wave = np.asarray(deflection.get_ydata(), float)
    fit = np.linalg.lstsq(np.column_stack([np.sin(theta), np.cos(theta)])[:-1], wave[:-1])[0]
    opposite = np.angle(-best.steady.amplitude)
    assert np.arctan2(fit[1], fit[0]) == pytest.approx(opposite, abs=0.02)
    (mesh,) = states.collections
    shown = np.asarray(mesh.get_array())
    counts = [(shown == k).sum() for k in (1, 2, 3, 4)]
    assert counts == [(best.steady.cycle.status[1:] == k).sum() for k in (1, 2, 3, 4)]


def test_a_state_that_is_not_steady_is_not_called_so(timed: Run) -> None:
    points = tuple(p for p in timed.time_domain if not p.steady.converged)
    figure = steady_figure(with_value(timed, "time", points))
    assert figure is not None
    assert figure._suptitle.get_text().startswith("not steady: cycle ")


def test_time_domain_stiffness_lies_beside_the_tables(timed: Run) -> None:
    figure = equivalent_figure(timed)
    assert figure is not None
    (drawn,) = (line for line in figure.axes[0].lines if "steady states" in str(line.get_label()))
    steady = [p for p in timed.time_domain if p.steady.converged]
    assert np.asarray(drawn.get_xdata(), float) == pytest.approx(
        [1e3 * abs(timed.mode.load_on_sliding["lift"] * p.steady.amplitude) for p in steady]
    )


def test_history_figure_has_motion_envelope_and_energies(timed: Run) -> None:
    (history,) = timed.histories
    figure = history_figure(timed, history)
    motion, slip, energies = figure.axes
    deflection = np.asarray(motion.lines[0].get_ydata(), float)
    assert deflection == pytest.approx(1e3 * history.output[:, timed.model.port("lift")])
    envelope = np.concatenate([np.asarray(line.get_ydata(), float) for line in motion.lines[1:]])
    assert np.abs(envelope).max() <= np.abs(deflection).max() * (1 + 1e-3)
    assert np.asarray(slip.lines[0].get_ydata(), float) == pytest.approx(1e6 * history.slip[:, 0])
    ends = {
        str(line.get_label()): np.asarray(line.get_ydata(), float)[-1] for line in energies.lines
    }
    assert ends["work of the load"] == pytest.approx(
        sum(value for name, value in ends.items() if name != "work of the load"), rel=1e-9
    )
    assert energies.get_xlabel() == "time (s)"
    assert "ended early" not in figure._suptitle.get_text()
    early = history_figure(timed, replace(history, failure="opened"))
    assert "ended early" in early._suptitle.get_text()


def test_long_histories_are_drawn_as_bands(timed: Run) -> None:
    (history,) = timed.histories
    figure = history_figure(timed, replace(history, cycle_steps=8))
    (band,) = figure.axes[1].collections
    y = band.get_paths()[0].vertices[:, 1]
    slip = 1e6 * history.slip[: len(history.slip) // 8 * 8, 0]
    assert y.max() == pytest.approx(slip.max())
    assert y.min() == pytest.approx(slip.min())


def test_every_history_has_a_figure_of_its_name(timed: Run, tmp_path: Path) -> None:
    bare = Run(timed.assembly, {"history": timed.outcomes["history"]})
    written = save_figures(bare, tmp_path, formats=("png",))
    assert {path.stem for path in written} == {"model", "prestress", "overview", "history_let_go"}


def test_the_overview_of_a_decay_shows_it(timed: Run) -> None:
    figure = overview(Run(timed.assembly, {"history": timed.outcomes["history"]}))
    assert "let_go" in figure.axes[-1].get_title(loc="left")
    assert min(quarters(figure)) > 0.25


def test_one_step_history_is_drawn(timed: Run) -> None:
    (history,) = timed.histories
    short = replace(
        history,
        time=history.time[:1],
        load=history.load[:1],
        output=history.output[:1],
        slip=history.slip[:1],
        gap=history.gap[:1],
    )
    assert history_figure(timed, short).axes


# -- sweeps ------------------------------------------------------------------------------------


@pytest.mark.parametrize("law", ["linear", "log"])
@pytest.mark.parametrize(("low", "high"), [(165.0, 190.0), (190.0, 165.0)])
def test_frequency_axis_of_a_sweep_is_the_slope_of_its_phase(
    law: str, low: float, high: float
) -> None:
    """Zeros of the load lie half a turn apart: their distance tells the frequency between them."""
    entry = SweptSine(
        **{
            "signal": "swept_sine",
            "from": low,
            "to": high,
            "duration": 1,
            "moment": 1,
            "sweep": law,
        }
    )
    dt = 1e-5
    load = sampled_load(entry, 1.0, dt)
    k = np.flatnonzero(np.diff(np.sign(load[1:])) != 0) + 1
    zero = dt * (k + load[k] / (load[k] - load[k + 1]))
    time, frequency = frequency_ticks(entry)
    assert len(time) >= 3
    measured = np.interp(time, 0.5 * (zero[1:] + zero[:-1]), 0.5 / np.diff(zero))
    inside = (time > 0.02) & (time < 0.98)
    assert frequency[inside] == pytest.approx(measured[inside], rel=1e-3)


def test_frequency_axis_of_a_stepped_sine_is_that_of_each_dwell() -> None:
    entry = SteppedSine(signal="stepped_sine", frequencies=[100, 50], cycles=10, moment=1)
    time, frequency = frequency_ticks(entry)
    assert frequency.tolist() == [100, 50]
    assert time == pytest.approx([0.05, 0.2])


def test_a_free_decay_has_no_frequency_axis(timed: Run) -> None:
    (history,) = timed.histories
    assert not history_figure(timed, history).axes[0].child_axes
