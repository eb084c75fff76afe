"""Outputs through a whole run: derivatives, names, units, and results selected by name."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
import xarray as xr
from conftest import description

from microslip.describe.reading import parse_joint
from microslip.errors import MicroslipError
from microslip.pipeline.outputs import derivative
from microslip.pipeline.run import Run
from microslip.pipeline.run import run as run_joint
from microslip.pipeline.selection import Selection
from microslip.results.dataset import dataset
from microslip.results.files import write_dataset
from microslip.results.summary import summary
from microslip.results.time import waveforms
from microslip.show.plots.energy import energy_figure
from microslip.show.plots.loops import moment_rotation_figure

OUTPUTS = [
    {"name": "lift", "quantity": "deflection"},
    {"name": "speed", "quantity": "velocity"},
    {"name": "shake", "quantity": "acceleration"},
    {"name": "creep", "quantity": "slip", "x": "20 mm"},
]


@pytest.fixture(scope="module")
def run() -> Run:
    document = {
        **description(21, 30),
        "load": {"moment": [20, 50]},
        "output": OUTPUTS,
        "analysis": {
            "cycle": {
                "moment_over_clamp_force_length": [2e-4, 1e-3, 1e-2],
                "steps": 60,
                "drives": ["moment", "mode"],
            },
            "response": {"from": 160, "to": 190, "count": 31, "variants": ["refined"]},
            "reduced": {"amplitudes": 12, "steps": 80},
            "harmonic": {"frequencies": [165, 170], "harmonics": 3, "stability": False},
            "time": {"frequencies": [165], "steps": 80},
            "backbone": {"count": 3, "methods": ["prescribed"]},
            "history": {
                "signal": "sine",
                "frequency": 165,
                "moment": 20,
                "cycles": 3,
                "steps": 60,
            },
        },
    }
    return run_joint(parse_joint(document))


@pytest.fixture(scope="module")
def tree(run: Run) -> xr.DataTree:
    return dataset(run)


@pytest.mark.parametrize("order", [1, 2])
def test_central_differences_converge_with_the_square_of_the_step(order: int) -> None:
    errors = []
    for n in (100, 200):
        t = np.linspace(0, 2 * np.pi, n + 1)
        exact = np.cos(t) if order == 1 else -np.sin(t)
        for periodic in (True, False):
            found = derivative(np.sin(t), t[1], order, periodic=periodic)
            part = slice(None) if periodic else slice(1, -1)
            errors.append(np.abs(found - exact)[part].max())
    assert errors[0] / errors[2] == pytest.approx(4, rel=0.1)
    assert errors[1] / errors[3] == pytest.approx(4, rel=0.1)


def test_rates_of_a_response_are_i_omega_times_its_displacement(run: Run) -> None:
    response = run.response.sel(variant="refined", moment=50)
    omega = 2 * np.pi * response.frequency
    outputs = response.outputs
    assert outputs["speed"] == pytest.approx(1j * omega * outputs["lift"], rel=1e-12)
    assert outputs["shake"] == pytest.approx(-(omega**2) * outputs["lift"], rel=1e-12)


def test_an_output_is_the_port_it_stands_on(run: Run, tree: xr.DataTree) -> None:
    for group, dims in (("time_domain", "point"), ("history/sine", None)):
        node = tree[group]
        found = node["output_value"].sel(output="lift").values
        assert found == pytest.approx(node["lift"].values, abs=1e-15)
        assert dims is None or node["output_value"].dims[0] == dims


def test_waveforms_of_rates_have_the_harmonics_of_their_displacement(
    run: Run, tree: xr.DataTree
) -> None:
    point = run.time_domain.sel(moment=50, frequency=165)
    waves = waveforms(run, point)
    omega = 2 * np.pi * point.steady.frequency
    assert np.ptp(waves["speed"]) == pytest.approx(omega * np.ptp(waves["lift"]), rel=0.02)
    node = tree["time_domain"]["output_harmonics"].isel(harmonic=1, point=0)
    first = node.sel(part="real").values + 1j * node.sel(part="imaginary").values
    assert first[2] == pytest.approx(-(omega**2) * first[0], rel=1e-9)


def test_methods_agree_on_the_deflection(run: Run) -> None:
    """165 Hz is away from resonance: reduced model, harmonic balance and time integration."""
    found = summary(run)
    moment = 20 / run.assembly.moment_unit
    (time,) = (
        r
        for r in found["time_domain"]
        if r["moment_over_clamp_force_length"] == pytest.approx(moment)
    )
    harmonic = next(
        r
        for r in found["harmonic"]
        if r["moment_over_clamp_force_length"] == pytest.approx(moment) and r["frequency_hz"] == 165
    )
    response = run.response.sel(moment=20)
    reduced = 1e3 * abs(np.interp(165, response.frequency, np.abs(response.outputs["lift"])))
    assert harmonic["outputs"]["lift_mm"] == pytest.approx(reduced, rel=0.01)
    assert time["outputs"]["lift_mm"] == pytest.approx(reduced, rel=0.02)
    assert time["phases_deg"]["lift"] == pytest.approx(harmonic["phases_deg"]["lift"], abs=1)


def test_units_of_the_summary_and_of_the_dataset(run: Run, tree: xr.DataTree) -> None:
    found = summary(run)
    keys = ["lift_mm", "speed_mm_per_s", "shake_m_per_s2", "creep_um"]
    assert [output["key"] for output in found["outputs"]] == keys
    assert list(found["response"][0]["peak_outputs"]) == keys
    assert list(found["cycles"][0]["outputs"]) == ["lift_mm", "creep_um"]  # statics knows no rates
    node = tree["response"]
    assert list(node["output_unit"].values) == ["m", "m/s", "m/s^2", "m"]
    per = node["output_per_moment"].values * node["moment"].values[:, None, None, None]
    assert per == pytest.approx(node["output_amplitude"].values)
    row, response = found["response"][0], run.responses[0]
    top = np.abs(response.outputs["lift"]).max() * 1e3
    assert row["peak_outputs"]["lift_mm"] == pytest.approx(top, rel=0.05)


def test_modal_amplitudes_have_their_factor(run: Run, tree: xr.DataTree) -> None:
    """At resonance the factor turns the modal amplitude into the deflection."""
    amplitude = tree["response"]["modal_amplitude"]
    assert amplitude.attrs["per_unit_of"] == "mm of lift"
    response = run.response.sel(moment=50)
    size = amplitude.attrs["per_unit"] * np.abs(response.amplitude)
    assert size[response.peak] == pytest.approx(
        1e3 * np.abs(response.outputs["lift"])[response.peak], rel=0.05
    )


def test_everything_is_written_and_read_again(tree: xr.DataTree, tmp_path) -> None:
    path = write_dataset(tree, tmp_path / "results.nc")
    with xr.open_datatree(path, engine="h5netcdf") as found:
        outputs = found["outputs"]
        assert list(outputs["output"].values) == ["lift", "speed", "shake", "creep"]
        assert float(outputs["x"].sel(output="creep")) == 0.02
        for group in ("response", "harmonic", "time_domain", "backbone", "cycles_moment"):
            assert "output" in found[group].dims


def test_figures_of_loops_and_energy(run: Run) -> None:
    """Area of a drawn moment-rotation loop: the friction work of its cycle."""
    figure = moment_rotation_figure(run)
    assert figure is not None
    whole, _ = figure.axes
    work = {f"{c.amplitude:.4g}": c.dissipated for c in run.cycles["moment"]}
    for line in whole.lines:
        angle, moment = (np.asarray(xy, float) for xy in line.get_data())
        area = 1e-3 * np.sum(0.5 * (moment[1:] + moment[:-1]) * np.diff(angle))
        friction = work[str(line.get_label()).split(" = ")[1].split()[0]]
        assert area == pytest.approx(friction, rel=0.02, abs=1e-6)
    energy = energy_figure(run)
    assert energy is not None
    over_moment, over_output = energy.axes
    assert over_output.get_xlabel() == "amplitude of lift (mm)"
    assert len(over_moment.lines) == 2


def test_selection_says_what_there_is(run: Run) -> None:
    with pytest.raises(MicroslipError, match="say moment too, one of 20, 50"):
        run.response.sel(variant="refined")
    with pytest.raises(MicroslipError, match="none with moment=60, but with 20, 50"):
        run.response.sel(moment=60)
    with pytest.raises(MicroslipError, match="nothing here is selected by 'load', but by variant"):
        run.response.sel(load=20)
    assert run.backbones.sel(mode=1).method == "prescribed"
    assert run.histories.sel(name="sine") is run.histories[0]
    copy = pickle.loads(pickle.dumps(Selection(["a", "bc"], {"length": len})))
    assert copy.sel(length=2) == "bc"
