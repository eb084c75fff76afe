"""What is reported and written: content, units, and agreement with independent formulas."""

from __future__ import annotations

import io
import json
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from conftest import description, with_value
from rich.console import Console

from microslip.analyses.prepared.prestress import opening_load
from microslip.analyses.reduced.response import Response
from microslip.contact.fields import contact_extent
from microslip.describe.amplitude import Load
from microslip.describe.reading import parse_joint
from microslip.errors import Failure, InputError
from microslip.numerics import execute
from microslip.pipeline.cycle import DrivenCycles
from microslip.pipeline.loads import frictionless_resonance, frictionless_response
from microslip.pipeline.run import Run
from microslip.pipeline.run import run as run_joint
from microslip.results.dataset import dataset
from microslip.results.files import (
    replacing,
    write_dataset,
    write_summary,
)
from microslip.results.summary import summary
from microslip.show.plots.response import response_figure
from microslip.show.terminal import print_summary
from microslip.show.write import write_results

STEPS = 60
AMPLITUDES = [1e-3, 4e-3, 1.2e-2]
SMALL_JOINT = description(
    51,
    30,
    title="Small joint",
    load={"rho": [0, 2.4], "rho_scale": 0.0023},
    analysis={
        "cycle": {"moment_over_clamp_force_length": AMPLITUDES, "steps": STEPS, "max_cycles": 8},
        "response": {
            "from": "170 Hz",
            "to": "185 Hz",
            "count": 61,
            "variants": ["printed", "consistent", "refined"],
        },
    },
)
"""Few pairs, steps and amplitudes: seconds."""

FIELDS = ("pressure", "traction", "slip", "gap")


def with_responses(run: Run, *curves: Response, **changes: float) -> Run:
    """The same run with other forced responses."""
    return with_value(run, "response", replace(run.value("response"), curves=curves, **changes))


@pytest.fixture(scope="module")
def run() -> Run:
    return run_joint(parse_joint(SMALL_JOINT))


@pytest.fixture(scope="module")
def tree(run: Run) -> xr.DataTree:
    return dataset(run)


@pytest.fixture(scope="module")
def found(run: Run) -> dict:
    return summary(run)


def test_summary_is_plain_json(found: dict) -> None:
    text = json.dumps(found, allow_nan=False)
    assert json.loads(text) == found


def test_summary_has_what_is_asked_first(found: dict, run: Run) -> None:
    model = found["model"]
    assert model["contact_pairs"] == 51
    assert model["dofs"] == run.structure.dofs
    assert model["clamp_force_n_per_m"] == 1e6
    assert 0 < model["sliding_frequency_hz"] < model["stuck_frequency_hz"]
    assert 1 < found["prestress"]["contact_half_length_over_clamp_half_length"] < 1.5
    assert 1 < found["prestress"]["peak_pressure_over_mean_clamp_pressure"] < 1.2
    assert len(found["cycles"]) == 2 * len(AMPLITUDES)
    for row in found["cycles"]:
        assert row["drive"] in ("moment", "mode")
        assert row["unsolved_steps"] == 0
        left, right = row["contact_at_peak_over_clamp_half_length"]
        assert -1.5 - 1e-9 <= left < 0 < right <= 1.5 + 1e-9
    assert [row["variant"] for row in found["response"]] == ["printed", "consistent", "refined"] * 2
    indicator = {
        (row["variant"], row["rho"]): row["error_indicator_at_peak"] for row in found["response"]
    }
    for (variant, rho), estimate in indicator.items():
        if rho:
            assert 0 < indicator["refined", rho] < 0.05
            outside = estimate is None
            assert variant == "refined" or outside or estimate > indicator["refined", rho]


def test_missing_numbers_become_none(run: Run) -> None:
    response = replace(run.responses[0], rho=np.nan)
    joint = run.joint.model_copy(update={"load": Load(moment=(1.0,))})
    by_moment = replace(run, assembly=replace(run.assembly, joint=joint))
    row = summary(with_responses(by_moment, replace(response, flag=np.ones_like(response.flag))))
    assert row["response"][0]["peak_frequency_hz"] is None
    assert row["response"][0]["largest_modal_amplitude"] is None


def test_with_moments_nothing_is_said_of_rho(run: Run) -> None:
    curves = [replace(response, rho=np.nan) for response in run.responses]
    joint = run.joint.model_copy(update={"load": Load(moment=(1.0,))})
    by_moment = replace(run, assembly=replace(run.assembly, joint=joint))
    by_moment = with_responses(by_moment, *curves)
    assert "rho" not in json.dumps(summary(by_moment)).replace("threshold", "")
    group = dataset(by_moment)["response"]
    assert "rho" not in group.coords
    assert "rho_scale" not in group.attrs
    text = io.StringIO()
    print_summary(by_moment, Console(file=text, width=120))
    assert "rho" not in text.getvalue()


def test_summary_without_analyses(run: Run) -> None:
    bare = Run(run.assembly)
    found = summary(bare)
    assert found["cycles"] == []
    assert found["response"] == []
    assert set(dataset(bare).children) == {"model", "prestress", "outputs"}


def test_response_over_frictionless_is_one_without_friction(found: dict, run: Run) -> None:
    """Of every model; to what the points of a coarse band miss of a sharp peak."""
    rows = [row for row in found["response"] if row["rho"] == 0]
    ratios = [row["peak_amplitude_over_frictionless"] for row in rows]
    assert ratios == pytest.approx([ratios[0]] * 3, rel=1e-9)
    assert 0.9 < ratios[0] <= 1
    frequency, amplitude = frictionless_resonance(run.assembly, rows[0]["moment_n"])
    fine = np.linspace(frequency - 0.5, frequency + 0.5, 1001)
    exact = frictionless_response(run.assembly, fine, rows[0]["moment_n"]).peak_amplitude
    assert exact == pytest.approx(amplitude, rel=1e-5)


def test_a_peak_at_the_edge_is_none(run: Run) -> None:
    """A band that ends below the resonance: said in the summary, the terminal and the figure."""
    cut = slice(0, 12)
    response = run.responses[-1]
    cut_off = replace(
        response,
        **{
            name: getattr(response, name)[cut]
            for name in ("frequency", "amplitude", "iterations", "contraction", "flag")
        },
        error_indicator=response.error_indicator[cut],
        outputs={name: values[cut] for name, values in response.outputs.items()},
    )
    assert cut_off.peak_at_edge
    edged = with_responses(run, cut_off)
    row = summary(edged)["response"][0]
    assert row["peak_at_edge"] is True
    assert row["peak_frequency_hz"] is None
    assert row["peak_modal_amplitude"] is None
    assert row["largest_at_hz"] == response.frequency[11]
    text = io.StringIO()
    print_summary(edged, Console(file=text, width=120))
    assert f"none, rises to {response.frequency[11]:.5g}" in text.getvalue()
    figure = response_figure(edged)
    assert figure is not None
    labels = [entry.get_text() for entry in figure.legends[0].get_texts()]
    assert "no peak in the band" in labels


def test_summary_counts_points_without_answer(run: Run) -> None:
    flag = np.zeros_like(run.responses[-1].flag)
    flag[10:14] = 1
    (row,) = summary(with_responses(run, replace(run.responses[-1], flag=flag)))["response"]
    assert row["unconverged_points"] == 4
    assert row["unconverged_from_hz"] == pytest.approx(run.responses[-1].frequency[10])
    assert row["unconverged_to_hz"] == pytest.approx(run.responses[-1].frequency[13])


def test_peak_beside_a_gap_is_marked(run: Run) -> None:
    """The true peak may lie in the gap: what is reported is a lower bound."""
    response = replace(run.responses[0], flag=np.zeros_like(run.responses[0].flag))
    (row,) = summary(with_responses(run, response))["response"]
    assert not row["peak_beside_unconverged"]
    response.flag[response.peak] = 1
    (row,) = summary(with_responses(run, response))["response"]
    assert row["peak_beside_unconverged"]


def test_no_answer_anywhere_has_no_peak(run: Run) -> None:
    flag = np.ones_like(run.responses[-1].flag)
    (row,) = summary(with_responses(run, replace(run.responses[-1], flag=flag)))["response"]
    assert row["peak_frequency_hz"] is None
    assert row["peak_modal_amplitude"] is None


def test_contact_extent_leaves_out_the_tips() -> None:
    x = np.linspace(-1, 1, 9)
    touching = np.array([1, 0, 0, 1, 1, 1, 0, 0, 1], dtype=bool)
    assert contact_extent(x, touching) == (-0.25, 0.25)
    assert np.isnan(contact_extent(x, np.zeros(9, dtype=bool))).all()


def test_everything_has_unit_and_long_name(tree: xr.DataTree) -> None:
    for node in tree.subtree:
        for name, variable in node.variables.items():
            assert variable.attrs.get("units"), (node.path, name)
            assert variable.attrs.get("long_name"), (node.path, name)


@pytest.mark.parametrize("drive", ["moment", "mode"])
def test_dissipated_energy_is_the_integral_of_its_distribution(
    tree: xr.DataTree, found: dict, drive: str
) -> None:
    """Integral over x by Simpson's rule, independent of the areas of the pairs."""
    group = tree[f"cycles_{drive}"]
    d, x = group["dissipation"].values, group["x"].values
    h = x[2::2] - x[:-2:2]
    integral = (h / 6 * (d[:, :-2:2] + 4 * d[:, 1::2] + d[:, 2::2])).sum(axis=1)
    reported = [r["dissipated_energy_j_per_m"] for r in found["cycles"] if r["drive"] == drive]
    np.testing.assert_allclose(integral, reported, rtol=1e-12)


@pytest.mark.parametrize("drive", ["moment", "mode"])
def test_traction_is_inside_the_friction_cone(tree: xr.DataTree, drive: str) -> None:
    group = tree[f"cycles_{drive}"]
    p, f = group["pressure"].values, group["traction"].values
    friction = SMALL_JOINT["contact"]["friction"]
    assert (np.abs(f) <= friction * p * (1 + 1e-9) + 1e-9 * p.max()).all()


@pytest.mark.parametrize(("state", "sign"), [(2, -1.0), (3, 1.0)])
def test_slip_goes_against_the_traction(tree: xr.DataTree, state: int, sign: float) -> None:
    """Forward slip has f = -mu p on the upper body, and slip that grows."""
    group = tree["cycles_mode"]
    slipping = group["state"].values[:, 1:] == state
    p, f = group["pressure"].values, group["traction"].values
    assert slipping.any()
    np.testing.assert_allclose(
        f[:, 1:][slipping], sign * 0.25 * p[:, 1:][slipping], atol=1e-9 * p.max()
    )
    moved = np.diff(group["slip"].values, axis=1)[slipping]
    assert (-sign * moved >= -1e-9 * np.abs(moved).max()).all()


def test_gap_and_pressure_exclude_each_other(tree: xr.DataTree) -> None:
    group = tree["cycles_mode"]
    gap, p = group["gap"].values, group["pressure"].values
    open_ = group["state"].values == 4
    assert open_.any()
    assert (gap[:, 1:][open_[:, 1:]] >= -1e-12).all()
    assert np.abs(p[open_]).max() <= 1e-9 * p.max()
    assert np.abs(gap[~open_]).max() <= 1e-9 * gap.max()


def test_pressure_carries_the_clamp_force(tree: xr.DataTree) -> None:
    """Vertical equilibrium of one beam, which its support hardly takes part in."""
    area = tree["model"]["area"].values
    total = tree["prestress"]["pressure"].values @ area
    assert total == pytest.approx(1e6, rel=1e-3)


def test_loop_work_is_friction_work(tree: xr.DataTree, found: dict) -> None:
    """Energy balance: the area of the stored loop f(q) is what friction dissipates."""
    group = tree["cycles_mode"]
    q, f = group["q"].values, group["f"].values
    area = (0.5 * (f[:, 1:] + f[:, :-1]) * np.diff(q, axis=1)).sum(axis=1)
    reported = [r["dissipated_energy_j_per_m"] for r in found["cycles"] if r["drive"] == "mode"]
    np.testing.assert_allclose(area, reported, rtol=1e-3)


@pytest.mark.parametrize("drive", ["moment", "mode"])
def test_equivalent_stiffness_and_damping_by_fft(
    tree: xr.DataTree, found: dict, drive: str
) -> None:
    group = tree[f"cycles_{drive}"]
    Q = np.fft.fft(group["q"].values[:, :-1], axis=1)[:, 1]
    F = np.fft.fft(group["f"].values[:, :-1], axis=1)[:, 1]
    omega = 2 * np.pi * found["model"]["sliding_frequency_hz"]
    kappa = F / Q / omega**2
    rows = [r for r in found["cycles"] if r["drive"] == drive]
    np.testing.assert_allclose(kappa.real, [r["k_eq"] for r in rows], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(kappa.imag, [r["gamma_eq"] for r in rows], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(
        2 * np.abs(Q) / STEPS, [r["modal_amplitude"] for r in rows], rtol=1e-12
    )


def test_tables_repeat_the_cycles(tree: xr.DataTree) -> None:
    tables = tree["tables"].dataset
    for drive in ("moment", "mode"):
        for name in ("k_eq", "gamma_eq", "modal_amplitude", "dissipated_energy"):
            row = tables[name].sel(drive=drive).values
            np.testing.assert_array_equal(row, tree[f"cycles_{drive}"][name].values)
    np.testing.assert_allclose(tables["moment_over_clamp_force_length"], AMPLITUDES)


def test_tables_keep_a_place_for_failed_cycles(run: Run) -> None:
    mode = run.value("cycle")["mode"]
    fewer = DrivenCycles(mode.cycles[1:], mode.moments[1:], mode.table)
    driven = {**run.value("cycle"), "mode": fewer}
    tables = dataset(with_value(run, "cycle", driven))["tables"].dataset
    assert np.isnan(tables["k_eq"].sel(drive="mode").values).tolist() == [True, False, False]
    assert np.isfinite(tables["k_eq"].sel(drive="moment").values).all()


def test_response_as_complex_number(tree: xr.DataTree, run: Run) -> None:
    group = tree["response"]
    value = group["modal_amplitude"].values * np.exp(1j * group["phase"].values)
    np.testing.assert_allclose(value, [r.amplitude for r in run.responses], rtol=1e-12)


def test_file_opens_group_by_group(run: Run, tree: xr.DataTree, tmp_path: Path) -> None:
    path = write_dataset(tree, tmp_path / "results.nc")
    with xr.open_dataset(path, engine="h5netcdf", group="cycles_mode") as cycles:
        assert dict(cycles.sizes) == {"cycle": 3, "step": STEPS + 1, "pair": 51, "output": 3}
        for name in FIELDS:
            assert cycles[name].dtype == np.float32
            original = tree["cycles_mode"][name].values
            np.testing.assert_allclose(
                cycles[name].values, original, rtol=1e-6, atol=1e-6 * np.abs(original).max()
            )
        assert cycles["q"].dtype == np.float64
        assert cycles["state"].attrs["flag_meanings"].split()[3] == "separation"
    with xr.open_datatree(path, engine="h5netcdf") as whole:
        assert set(whole.children) == {
            "model",
            "prestress",
            "outputs",
            "cycles_moment",
            "cycles_mode",
            "tables",
            "response",
        }
        assert list(whole["response"]["variant"].values) == ["printed", "consistent", "refined"] * 2
        assert parse_joint(json.loads(whole.attrs["joint"])) == run.joint


def test_replacing_keeps_the_old_file_on_failure(tmp_path: Path) -> None:
    path = tmp_path / "file.txt"
    path.write_text("old")

    def write_badly() -> None:
        with replacing(path) as temporary:
            temporary.write_text("half")
            raise RuntimeError("disk full")

    with pytest.raises(RuntimeError, match="disk full"):
        write_badly()
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["file.txt"]


def test_replacing_replaces(tmp_path: Path) -> None:
    path = tmp_path / "file.txt"
    path.write_text("old")
    with replacing(path) as temporary:
        temporary.write_text("new")
        assert path.read_text() == "old"
    assert path.read_text() == "new"
    assert [p.name for p in tmp_path.iterdir()] == ["file.txt"]


class Listener:
    """Progress that keeps count."""

    def __init__(self) -> None:
        self.total = self.done = self.finished = 0

    def start(self, label: str, total: int) -> None:
        self.total += total

    def advance(self, n: int = 1) -> None:
        self.done += n

    def finish(self) -> None:
        self.finished += 1


def test_write_results_writes_all_and_can_do_it_again(run: Run, tmp_path: Path) -> None:
    bare = Run(run.assembly)
    listener = Listener()
    first = write_results(bare, tmp_path / "out", listener)
    second = write_results(bare, tmp_path / "out")
    assert first == second
    assert all(path.stat().st_size > 0 for path in first)
    assert {path.name for path in first} >= {"summary.json", "results.nc", "model.png"}
    assert listener.done == listener.total
    assert listener.finished == 1
    on_disk = {path for path in (tmp_path / "out").rglob("*") if path.is_file()}
    assert on_disk == set(first)


def test_summary_on_disk(run: Run, found: dict, tmp_path: Path) -> None:
    path = write_summary(found, tmp_path / "summary.json")
    assert json.loads(path.read_text(encoding="utf-8")) == found


def test_printed_summary_says_what_matters(run: Run, found: dict) -> None:
    out = io.StringIO()
    failure = Failure("cycle", "mode-driven, M/(PL) = 0.1", "[the joint opens]")
    cycle = replace(run.outcomes["cycle"], failures=(failure,))
    response = replace(run.outcomes["response"], failures=())
    failed = replace(run, outcomes={**run.outcomes, "cycle": cycle, "response": response})
    print_summary(failed, Console(file=out, width=120))
    text = out.getvalue()
    assert f"{found['model']['sliding_frequency_hz']:.2f} Hz sliding" in text
    best = max(row["gamma_eq"] for row in found["cycles"] if row["drive"] == "mode")
    assert f"gamma_eq {best:.4f}" in text
    assert "1 not solved" in text
    assert "[the joint opens]" in text
    assert "consistent" in text


def test_printed_summary_without_analyses(run: Run) -> None:
    out = io.StringIO()
    print_summary(Run(run.assembly), Console(file=out))
    assert "Hz stuck" in out.getvalue()
    assert "Forced response" not in out.getvalue()


# -- time domain -------------------------------------------------------------------------------

LOAD = {"drive": "moment", "moment_over_clamp_force_length": 4e-4}
TIMED_JOINT = {
    **SMALL_JOINT,
    "contact": {"friction": 0.25, "pairs": 21},
    "load": {"rho": [2.4, 5], "rho_scale": 0.0023},
    "analysis": {
        "cycle": {"moment_over_clamp_force_length": AMPLITUDES, "steps": STEPS, "drives": "mode"},
        "response": {"from": "170 Hz", "to": "185 Hz", "count": 61, "variants": "consistent"},
        "time": {
            "frequencies": ["172 Hz", "179 Hz"],
            "steps": 60,
            "max_cycles": 9,
            "tolerance": 1e-5,
            "positions": ["25 mm", "0 mm", "-25 mm"],
        },
        "history": [
            {"signal": "sine", "frequency": "175 Hz", "cycles": 4.5, "steps": 60, **LOAD},
            {
                "signal": "stepped_sine",
                "frequencies": [176, 178],
                "cycles": 8,
                "rho": 2.4,
                "drive": "mode",
            },
            {
                "signal": "free_decay",
                "start": "static",
                "duration": "0.05 s",
                "moment_over_clamp_force_length": 3e-3,
                "field_samples": 0,
            },
            {
                "signal": "free_decay",
                "name": "after_steady",
                "start": "steady",
                "frequency": "178 Hz",
                "steps": 60,
                "duration": "0.02 s",
                **LOAD,
            },
        ],
    },
}


@pytest.fixture(scope="module")
def timed(tmp_path_factory: pytest.TempPathFactory) -> Run:
    folder = tmp_path_factory.mktemp("signal")
    (folder / "load.csv").write_text("time [ms], moment [N*m/m]\n0, 0\n10, 100\n20, 0\n30, 0\n")
    document = json.loads(json.dumps(TIMED_JOINT))
    document["analysis"]["history"].append({"signal": "measured", "file": "load.csv", "scale": 2})
    return run_joint(parse_joint(document, folder=folder))


@pytest.fixture(scope="module")
def timed_tree(timed: Run) -> xr.DataTree:
    return dataset(timed)


def test_time_domain_rows_hold_what_is_promised(timed: Run) -> None:
    rows = summary(timed)["time_domain"]
    assert [(row["rho"], row["frequency_hz"]) for row in rows] == [
        (2.4, 172.0),
        (2.4, 179.0),
        (5.0, 172.0),
        (5.0, 179.0),
    ]
    promised = (
        "rho moment_over_clamp_force_length frequency_hz modal_amplitude phase_rad "
        "dissipated_energy_j_per_m cycles residual_max unsolved_steps seconds"
    )
    for row in rows:
        assert set(promised.split()) <= set(row)
        assert row["unsolved_steps"] == 0
        assert row["residual_max"] <= 1e-8
        assert -np.pi < row["phase_rad"] < 0
        if row["converged"]:  # else the energy that is stored changes over a cycle
            lost = row["dissipated_energy_j_per_m"] + row["material_damping_j_per_m"]
            gained = row["external_work_j_per_m"]
            assert lost + row["normal_work_j_per_m"] == pytest.approx(gained, rel=5e-3)
    assert sum(row["converged"] for row in rows) >= 2


def test_steady_states_not_reached_are_marked_and_named(timed: Run) -> None:
    rows = summary(timed)["time_domain"]
    late = [row for row in rows if not row["converged"]]

    assert 0 < len(late) < len(rows)
    for row in late:
        (failure,) = (
            f
            for f in map(str, timed.failures)
            if f"rho = {row['rho']:g}, {row['frequency_hz']:g} Hz: not steady after" in f
        )
        assert f"{row['cycles']} cycles, last change {row['last_change']:.1e}" in failure
        assert row["last_change"] > 1e-5
    flags = dataset(timed)["time_domain"]["converged"].values
    assert flags.tolist() == [int(row["converged"]) for row in rows]
    out = io.StringIO()
    print_summary(timed, Console(file=out, width=120))
    assert f"{late[0]['cycles']}, not steady" in out.getvalue()


def test_time_domain_waves_and_harmonics_agree(timed: Run, timed_tree: xr.DataTree) -> None:
    group = timed_tree["time_domain"]
    theta, q, load = (group[name].values for name in ("theta", "q", "load"))
    assert load == pytest.approx(group["moment"].values[:, None] * np.sin(theta), abs=1e-9)
    Q = group["q_harmonics"].values @ np.array([1, 1j])
    order = group["harmonic"].values[None, 1:, None]
    rebuilt = Q[:, :1].real + np.imag(Q[:, 1:, None] * np.exp(1j * order * theta[:, None])).sum(1)
    rows = summary(timed)["time_domain"]
    steady = np.array([row["converged"] for row in rows])  # others do not repeat
    np.testing.assert_allclose(rebuilt[steady, :-1], q[steady, :-1], atol=2e-3 * np.abs(q).max())
    np.testing.assert_allclose(
        np.abs(Q[:, 1]), group["modal_amplitude"].values, rtol=1e-7
    )  # 60 of 240 samples
    np.testing.assert_allclose(group["k_eq"].values, [r["k_eq"] for r in rows])


def test_time_domain_contact_obeys_its_laws(timed_tree: xr.DataTree) -> None:
    group = timed_tree["time_domain"]
    p, f, state = (group[name].values for name in ("pressure", "traction", "state"))
    assert p.shape == (4, 61, 21)
    assert (np.abs(f) <= 0.25 * p * (1 + 1e-9) + 1e-9 * p.max()).all()
    assert np.abs(p[state == 4]).max() <= 1e-9 * p.max()
    position, x = group["position"].values, group["x"].values
    assert position == pytest.approx([0.025, 0, -0.025], abs=0.002)
    for k, place in enumerate(position):
        pair = int(np.argmin(np.abs(x - place)))
        np.testing.assert_array_equal(group["local_slip"].values[..., k], group["slip"][..., pair])
        np.testing.assert_array_equal(group["local_gap"].values[..., k], group["gap"][..., pair])
    h = x[2::2] - x[:-2:2]
    d = group["dissipation"].values
    integral = (h / 6 * (d[:, :-2:2] + 4 * d[:, 1::2] + d[:, 2::2])).sum(axis=1)
    np.testing.assert_allclose(integral, group["dissipated_energy"].values, rtol=1e-12)


def test_everything_of_the_time_domain_has_unit_and_long_name(timed_tree: xr.DataTree) -> None:
    test_everything_has_unit_and_long_name(timed_tree)


def test_histories_are_in_the_summary(timed: Run) -> None:
    rows = summary(timed)["history"]
    names = ["sine", "stepped_sine", "free_decay", "after_steady", "measured"]
    assert [row["name"] for row in rows] == names
    for row in rows:
        assert row["complete"]
        assert row["failure"] is None
        assert row["steps"] == row["steps_asked"]
        lost = (
            row["dissipated_energy_j_per_m"]
            + row["material_damping_j_per_m"]
            + row["normal_work_j_per_m"]
            + row["scheme_loss_j_per_m"]
        )
        assert row["external_work_j_per_m"] == pytest.approx(
            lost + row["mechanical_energy_change_j_per_m"]
        )
    sine, dwell, let_go, after, measured = rows
    assert sine["duration_s"] == pytest.approx(4.5 / 175, abs=sine["time_step_s"])
    assert sine["moment_over_clamp_force_length"] == pytest.approx(4e-4, rel=1e-3)
    assert measured["peak_load"] == pytest.approx(200, rel=0.02)
    assert dwell["moment_over_clamp_force_length"] is None
    assert let_go["first_amplitude"] > let_go["last_amplitude"]
    assert let_go["last_damping_ratio"] > 0
    # the sticking joint is the stiffer one: small decays are faster
    assert let_go["last_frequency_hz"] > let_go["first_frequency_hz"]
    assert after["external_work_j_per_m"] == 0


def test_histories_by_name_in_the_tree(timed: Run, timed_tree: xr.DataTree) -> None:
    assert set(timed_tree["history"].children) == {h.name for h in timed.histories}
    decay = timed_tree["history/free_decay"]
    assert decay["load"].values[0] == pytest.approx(3e-3 * 251.5e3)
    assert not decay["load"].values[1:].any()
    assert decay["pressure"].shape == (0, 21)
    sine = timed_tree["history/sine"]
    assert sine["pressure"].shape[1] == 21
    assert sine["field_time"].values[-1] == pytest.approx(sine["time"].values[-1])
    assert sine["local_slip"].shape == (len(sine["time"]), 1)
    dwell = timed_tree["history/stepped_sine"]
    assert dwell["dwell_frequency"].values.tolist() == [176, 178]
    assert np.isfinite(dwell["dwell_amplitude"].values).all()


def test_mode_driven_history_is_as_close_to_opening(timed: Run) -> None:
    """The load of the mode over its opening load is that of the end moments over theirs."""
    a, p = timed.assembly, timed.prepared
    (history,) = (h for h in timed.histories if h.drive == "mode")
    moment = 0.0023 * 0.25 * a.moment_unit / 2.4
    opening = opening_load(p.model, p.prestress, "sliding")
    assert np.abs(history.load).max() / opening == pytest.approx(
        moment / a.opening_moment, rel=1e-3
    )


def test_time_domain_on_disk(timed: Run, timed_tree: xr.DataTree, tmp_path: Path) -> None:
    path = write_dataset(timed_tree, tmp_path / "results.nc")
    with xr.open_dataset(path, engine="h5netcdf", group="time_domain") as found:
        assert found["traction"].dtype == np.float32
        assert found["q"].dtype == np.float64
        assert found["state"].dtype == np.int8
    with xr.open_dataset(path, engine="h5netcdf", group="history/sine") as found:
        assert found["local_slip"].dtype == np.float32
        np.testing.assert_array_equal(found["q"], timed_tree["history/sine"]["q"])
        assert found.attrs["complete"] == 1


def test_histories_are_printed(timed: Run) -> None:
    out = io.StringIO()
    first = replace(timed.histories[0], failure="the joint opens at t = 1 s")
    changed = with_value(timed, "history", (first, *timed.histories[1:]))
    print_summary(changed, Console(file=out, width=100))
    assert "sine, ended early" in out.getvalue()
    assert "after_steady" in out.getvalue()


class Interrupting:
    """Waits until a history has moved, then acts as Ctrl-C would."""

    def __init__(self) -> None:
        self.moved = threading.Event()

    def start(self, label: str, total: int) -> None:
        pass

    def advance(self, n: int = 1) -> None:
        self.moved.set()

    def finish(self) -> None:
        pass

    def wait(self, pending: object) -> None:
        assert self.moved.wait(60)
        raise KeyboardInterrupt


def test_interrupted_histories_are_kept(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    listener = Interrupting()
    monkeypatch.setattr(execute, "wait", listener.wait)
    long = {"signal": "sine", "frequency": "175 Hz", "cycles": 4000, "steps": 60, **LOAD}
    many = [{**long, "name": f"number_{k}"} for k in range(execute.workers() + 1)]
    document = {**TIMED_JOINT, "analysis": {"history": many}}
    found = run_joint(parse_joint(document), listener)
    assert found.interrupted
    assert 1 <= len(found.histories) < len(many)
    failures = [str(failure) for failure in found.failures]
    assert f"history, {many[-1]['name']!r}: interrupted before it began" in failures
    for history in found.histories:
        assert not history.complete
        assert len(history.time) < 4000 * 60
        expected = f"history, {history.name!r}: interrupted at t = {history.time[-1]:.6g} s"
        assert expected in failures
    assert not summary(found)["history"][0]["complete"]
    write_dataset(dataset(found), tmp_path / "results.nc")


def test_a_signal_that_cannot_be_used_ends_the_run_early(tmp_path: Path) -> None:
    file = tmp_path / "load.csv"
    file.write_text("time [s], moment [N*m/m]\n0, 0\n0.1, nan\n0.2, 0\n")
    measured = {"signal": "measured", "file": str(file)}
    document = {**TIMED_JOINT, "analysis": {"history": measured}}
    with pytest.raises(InputError, match=r"'measured': signal .*line 3 \(time 0\.1\): 'nan'"):
        run_joint(parse_joint(document))
    file.write_text("time [s], moment [N*m/m]\n0, 0\n0.1, 1\n0.2, 0\n")
    document = {**TIMED_JOINT, "analysis": {"history": {**measured, "time_step": "1 ms"}}}
    with pytest.raises(InputError, match=r"'measured'\.time_step: gives 5\.\d+ steps per cycle"):
        run_joint(parse_joint(document))


def test_a_history_that_opens_the_joint_is_named(tmp_path: Path) -> None:
    strong = {"signal": "sine", "frequency": "172 Hz", "cycles": 30, "steps": 60}
    document = {
        **TIMED_JOINT,
        "analysis": {"history": {**strong, "moment_over_clamp_force_length": 0.145}},
    }
    found = run_joint(parse_joint(document))
    (failure,) = map(str, found.failures)
    assert failure.startswith("history, 'sine': the joint opens at t = ")
    assert "last pair to separate" in failure
    (row,) = summary(found)["history"]
    assert not row["complete"]
    assert row["failure"] in failure
