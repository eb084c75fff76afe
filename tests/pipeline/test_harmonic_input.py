"""Harmonic balance from a joint file: what is refused, what is reported, and what it agrees with."""

from __future__ import annotations

import io
from pathlib import Path
from threading import Event

import numpy as np
import pytest
import xarray as xr
from conftest import description
from rich.console import Console

from microslip.analyses.prepared.prestress import opening_load
from microslip.contact.samples import sample_table
from microslip.describe.reading import parse_joint
from microslip.describe.requests import (
    FEWEST_ADAPTIVE,
    SAMPLES_OF_A_HARMONIC,
    HarmonicAnalysis,
)
from microslip.errors import ContactError, InputError
from microslip.numerics import execute
from microslip.pipeline.loads import GENTLE
from microslip.pipeline.progress import NullProgress
from microslip.pipeline.run import Run
from microslip.pipeline.run import run as run_joint
from microslip.results.dataset import dataset
from microslip.results.files import write_dataset
from microslip.results.summary import summary
from microslip.show.plots.harmonic import harmonic_figure
from microslip.show.terminal import print_summary

SCALE = 2.03e-3
JOINT = description(
    21,
    30,
    load={"rho": [0, 2.4], "rho_scale": SCALE},
    analysis={"harmonic": {"frequencies": [170, 176, 179, 182], "harmonics": 3}},
)


def harmonic(change: dict, **sections: dict) -> dict:
    return {**JOINT, **sections, "analysis": {"harmonic": change}}


@pytest.mark.parametrize(
    ("change", "part"),
    [
        ({}, "give a list of frequencies"),
        ({"frequencies": [170, 0]}, "analysis.harmonic.frequencies[1] = 0: must be greater than 0"),
        ({"frequencies": 170}, "analysis.harmonic.frequencies = 170: a branch is followed from"),
        ({"from": 180, "to": 170, "count": 5}, "must be above analysis.harmonic.from, 180 Hz"),
        ({"frequencies": [1, 2], "harmonics": 0}, "whole number from 1 to 101, or"),
        ({"frequencies": [1, 2], "harmonics": 2.5}, "harmonics = 2.5: must be a whole number"),
        (
            {"frequencies": [1, 2], "harmonics": "many"},
            'harmonics = "many": must be a whole number',
        ),
        ({"frequencies": [1, 2], "harmonics": 9, "samples": 35}, "do not resolve 9 harmonics"),
        ({"frequencies": [1, 2], "tolerance": 0.01}, 'is only for harmonics = "adaptive"'),
        ({"frequencies": [1, 2], "stability": 1}, "analysis.harmonic.stability = 1"),
    ],
)
def test_a_wrong_analysis_is_named(change, part):
    with pytest.raises(InputError) as caught:
        parse_joint(harmonic(change), "my.toml")
    message = str(caught.value)
    assert message.startswith("my.toml: ")
    assert part in message
    assert "\n" not in message


def test_it_needs_loads():
    change = {"frequencies": [170, 180]}
    without = {key: value for key, value in harmonic(change).items() if key != "load"}
    with pytest.raises(InputError, match=r"load: the section is missing and analysis\.harmonic"):
        parse_joint(without)
    for rho in (0, 2.4):
        assert parse_joint(harmonic(change, load={"rho": rho})).analysis.harmonic


def test_samples_refused_in_the_file_are_those_the_contact_cycle_refuses():
    least = SAMPLES_OF_A_HARMONIC * FEWEST_ADAPTIVE
    for harmonics in (FEWEST_ADAPTIVE, "adaptive"):
        found = HarmonicAnalysis(frequencies=(1, 2), harmonics=harmonics, samples=least)
        assert sample_table(found.branch_harmonics, least).samples == least
    with pytest.raises(ContactError):
        sample_table(FEWEST_ADAPTIVE, least - 1)


@pytest.fixture(scope="module")
def run() -> Run:
    return run_joint(parse_joint(JOINT))


@pytest.fixture(scope="module")
def found(run: Run) -> dict:
    return summary(run)


def test_every_load_has_its_responses(run, found):
    assert not run.failures
    rows = found["harmonic"]
    assert [row["rho"] for row in rows] == [0] * 4 + [2.4] * 4
    assert [row["frequency_hz"] for row in rows] == [170, 176, 179, 182] * 2
    assert found["rho_scale"] == SCALE
    assert rows[4]["moment_over_clamp_force_length"] == pytest.approx(SCALE * 0.25 / 2.4)
    assert all(row["residual_max"] <= 1e-8 for row in rows)
    assert not any(row["joint_opens"] for row in rows)


def test_energy_of_a_cycle_balances(found):
    for row in found["harmonic"]:
        lost = row["dissipated_energy_j_per_m"] + row["material_damping_j_per_m"]
        spent = row["external_work_j_per_m"] - row["normal_work_j_per_m"]
        assert lost == pytest.approx(spent, rel=1e-6)


def test_without_friction_the_sliding_mode_answers_alone(run, found):
    """``q = f_M M / (omega_sl² - omega² + i omega beta omega_sl²)``; nothing else moves the interface."""
    mode, beta = run.mode, run.joint.damping.beta
    for row in found["harmonic"][:4]:
        omega, omega2 = 2 * np.pi * row["frequency_hz"], mode.sliding_omega**2
        moment = row["moment_over_clamp_force_length"] * run.assembly.moment_unit
        expected = mode.load_on_sliding["moment"] * moment
        expected /= omega2 - omega**2 + 1j * omega * beta * omega2
        answer = row["modal_amplitude"] * np.exp(1j * row["phase_rad"])
        assert answer == pytest.approx(expected, rel=1e-4)
        assert row["dissipated_energy_j_per_m"] == 0
        assert row["walk_m_per_cycle"] == 0


def test_the_gentle_load_is_gentle(run):
    """At its resonance, wherever that lies, the joint without friction is far from opening.

    Off resonance the amplitude is that of the oscillator, ``1 / |omega_sl² (1 + i omega beta) -
    omega²|`` over its peak's.
    """
    p, mode = run.prepared, run.mode
    opening = opening_load(p.model, p.prestress, "sliding")
    _, beta = p.model.rayleigh
    for point in run.harmonic[0].points:
        omega = 2 * np.pi * point.frequency
        off = abs(mode.sliding_omega**2 * (1 + 1j * omega * beta) - omega**2)
        inertia = abs(point.amplitude) * off / (beta * mode.sliding_omega)
        assert inertia == pytest.approx(GENTLE * opening, rel=2e-3)


def test_stability_says_what_decays(run, found):
    """Below, at and above the resonance of a response without folds all disturbances decay."""
    assert not found["harmonic_folds"]
    for entry, rows in zip(
        run.harmonic, (found["harmonic"][:4], found["harmonic"][4:]), strict=True
    ):
        for exponents, row in zip(entry.stability, rows, strict=True):
            assert row["stable"] is True
            assert row["growth_rate_per_s"] == exponents.exponents.real.max() < 0


def test_a_moment_and_its_rho_are_one_load(run, found):
    moment = SCALE * 0.25 * run.assembly.moment_unit / 2.4
    change = {**JOINT["analysis"]["harmonic"], "stability": False}
    same = summary(run_joint(parse_joint(harmonic(change, load={"moment": moment}))))
    for one, other in zip(same["harmonic"], found["harmonic"][4:], strict=True):
        assert one["modal_amplitude"] == pytest.approx(other["modal_amplitude"], rel=1e-9)
        assert one["stable"] is None
        assert "rho" not in one
    assert "rho_scale" not in same


def test_dataset_holds_the_summary(run, found, tmp_path: Path):
    tree = dataset(run)
    group = tree["harmonic"]
    rows = found["harmonic"]
    q = group["q_harmonics"].sel(harmonic=1)
    assert np.hypot(*q.values.T) == pytest.approx([row["modal_amplitude"] for row in rows])
    area = run.model.area
    per_pair = (group["dissipation"] * xr.DataArray(area, dims="pair")).sum("pair")
    assert per_pair.values == pytest.approx(
        [row["dissipated_energy_j_per_m"] for row in rows], rel=1e-9, abs=1e-15
    )
    assert all("units" in group[name].attrs for name in group.variables)
    followed = group["branch_frequency"].values
    assert followed.min() == 170
    assert followed.max() == 182
    path = write_dataset(tree, tmp_path / "results.nc")
    with xr.open_dataset(path, group="harmonic", engine="h5netcdf") as stored:
        assert stored["stable"].values.tolist() == [1] * 8


def test_terminal_has_one_line_per_load(run):
    text = io.StringIO()
    print_summary(run, Console(file=text, width=120))
    lines = text.getvalue().splitlines()
    start = next(i for i, line in enumerate(lines) if "Harmonic balance" in line)
    first = [line.split()[0] for line in lines[start + 3 : start + 5]]  # below two of headings
    assert first == ["0", "2.4"]


def test_figure_shows_every_response(run):
    figure = harmonic_figure(run)
    assert figure is not None
    for ax in figure.axes:
        marks = [line for line in ax.lines if line.get_linestyle() == "None"]
        assert sum(len(np.asarray(line.get_xdata())) for line in marks) == 8
    assert harmonic_figure(Run(run.assembly)) is None


class Interrupting(NullProgress):
    """Ctrl-C once a load has been solved at its first frequency."""

    def __init__(self, frequencies: int) -> None:
        self.frequencies = self.left = frequencies
        self.reached = Event()

    def start(self, label: str, total: int) -> None:
        self.left = self.frequencies + 1

    def advance(self, n: int = 1) -> None:
        self.left -= n
        if self.left <= 0:
            self.reached.set()

    def wait(self, pending: object) -> None:
        assert self.reached.wait(60)
        raise KeyboardInterrupt


def test_interrupted_loads_are_kept(monkeypatch: pytest.MonkeyPatch):
    band = [float(f) for f in np.linspace(170, 172, 60)]
    listener = Interrupting(len(band))
    monkeypatch.setattr(execute, "wait", listener.wait)
    monkeypatch.setattr(execute, "workers", lambda: 1)
    document = harmonic(
        {"frequencies": band, "harmonics": 1}, load={"rho": [2.4, 5], "rho_scale": 2e-3}
    )
    halted = run_joint(parse_joint(document), listener)
    assert halted.interrupted
    (kept,) = halted.harmonic
    assert 1 <= len(kept.points) < len(band)
    failures = [str(failure) for failure in halted.failures]
    assert any("stopped before" in text for text in failures)
    assert "harmonic, rho = 5: interrupted before it began" in failures
    assert len(summary(halted)["harmonic"]) == len(kept.points)
