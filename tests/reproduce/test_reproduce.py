"""The reproduction: trends and calibrated numbers, files, refusals. Quick ones on a coarse joint."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from conftest import ROOT
from typer.testing import CliRunner

from microslip.cli.main import app
from microslip.describe.reading import load_joint
from microslip.errors import ContactError, InputError
from microslip.reproduce import registry, run, settings
from microslip.reproduce.fig11 import case_errors
from microslip.reproduce.fig16 import iterate, slope_at
from microslip.reproduce.gallery import gallery, tables
from microslip.reproduce.maps import response_map
from microslip.reproduce.plate import Number
from microslip.reproduce.published import PAPER
from microslip.reproduce.registry import FIGURES, chosen
from microslip.reproduce.run import reproduce
from microslip.reproduce.settings import QUICK
from microslip.reproduce.study import Study, reference_joint
from microslip.reproduce.variants import (
    CONSISTENT,
    PRINTED,
    REFINED,
    cases,
    equivalent,
    fixed_point_map,
    respond,
    solutions,
)

COARSE = replace(
    QUICK,
    pairs=51,
    meshes=(21, 41),
    smallest=4e-4,  # below it single pairs slip on so coarse a mesh
    amplitudes=12,
    summit=(7e-3, 16e-3, 6),
    prescribed=14,
    cycle_steps=120,
    step_counts=(40, 60, 120),
    frequencies=501,
    time_frequencies=(170.0, 174.0, 175.0, 178.0, 182.0),
    other_frequencies=(170.0, 178.0, 184.0),
    map_rhos=15,
    map_frequencies=101,
    branch_rhos=3,
    branch_frequencies=11,
    checked_rhos=(1.6, 2.4, 5.0),
    marched_cycles=10,
    max_cycles=60,
)
"""A joint of 51 pairs and few points: seconds, not minutes."""


@pytest.fixture(scope="module")
def study():
    return Study(COARSE)


@pytest.fixture(scope="module")
def plates(study):
    """Every figure, drawn from one study."""
    return {name: draw(study) for name, draw in FIGURES.items()}


@pytest.fixture(scope="module")
def trends(plates):
    return {trend.key: trend for plate in plates.values() for trend in plate.trends}


@pytest.fixture(scope="module")
def numbers(plates):
    return {n.key: n.here for plate in plates.values() for n in plate.numbers}


# -- the joint ---------------------------------------------------------------------------------


def test_the_packaged_joint_is_the_example():
    packaged = ROOT / "src" / "microslip" / "templates" / "reference_joint.toml"
    joint, example = load_joint(packaged), load_joint(ROOT / "examples" / "lap_joint.toml")
    for part in ("beams", "material", "contact", "clamp", "support", "damping", "mesh"):
        assert getattr(joint, part) == getattr(example, part)


def test_reference_joint_takes_the_settings():
    joint = reference_joint(COARSE)
    assert joint.contact.pairs == 51
    loads = joint.cycle_amplitudes()
    assert len(loads) == COARSE.amplitudes + COARSE.summit[2]
    assert loads[-1] == pytest.approx(COARSE.largest * joint.opening_ratio)


# -- trends of the paper -----------------------------------------------------------------------


@pytest.mark.parametrize(
    "key",
    [
        "resonance_rises",
        "amplitude_falls_then_rises",
        "gamma_one_peak_moment",
        "gamma_one_peak_mode",
        "gamma_one_peak_friction",
        "k_falls_moment",
        "k_falls_mode",
        "k_falls_friction",
        "k_least_at_resonance",
        "peak_inside_slip_zone",
        "contact_mirrors",
        "locked_in",
        "frictionless_agrees",
        "energies_agree_mode",
        "steeper_from_below",
        "steps_converge",
        "iteration_obeys_theorem",
    ],
)
def test_trend_holds(trends, key):
    assert trends[key].holds, trends[key].numbers


@pytest.mark.parametrize(
    "key",
    ["energies_agree", "states_align", "iteration_converges", "damping_meets_resonance"],
)
def test_trend_that_does_not_come_out_says_why(trends, key):
    """What the paper claims and the computation does not show must not pass unseen."""
    assert not trends[key].holds
    assert trends[key].why


# -- numbers -----------------------------------------------------------------------------------


def test_every_number_of_the_paper_is_there_once(plates):
    given = [number.key for plate in plates.values() for number in plate.numbers]
    assert sorted(given) == sorted(PAPER)


def test_rho_is_calibrated(study, numbers):
    """By construction at 2.4; the time domain, which the calibration has not seen, agrees."""
    assert numbers["best_rho"] == pytest.approx(2.4, abs=0.1)
    peaks = response_map(study, CONSISTENT)
    best = peaks.rho[np.argmin(peaks.height)]
    assert best == pytest.approx(2.4, abs=np.diff(peaks.rho)[0])


def test_contact_under_the_moment_is_the_papers(study, numbers):
    spacing = np.diff(study.position).max()
    assert numbers["receding_end"] == pytest.approx(1.12, abs=spacing)
    assert numbers["growing_end"] == pytest.approx(1.29, abs=spacing)
    assert numbers["prestress_extent"] == pytest.approx(1.18, abs=spacing)


def test_clamp_limits_the_friction(numbers):
    assert numbers["friction_limit"] == pytest.approx(0.25, rel=1e-8)


def test_damping_ratio_of_section_2(numbers):
    assert numbers["damping_ratio"] == pytest.approx(0.5 * 7.3e-7 * 2 * math.pi * 170, rel=1e-12)


def test_each_correction_brings_the_model_nearer(plates):
    """Printed, consistent, refined: worst error over the band, at the load of least damping."""
    errors = plates["fig11"].data["errors_rho_5"]
    worst = [errors[case.key]["worst"] for case in (PRINTED, CONSISTENT, REFINED)]
    assert worst[0] > 5 * worst[1] > 5 * worst[2]


def test_differences_are_plain():
    row = Number("k_saturation", 0.099, "why").row()
    assert row["difference"] == pytest.approx(0.009)
    assert row["difference_percent"] == pytest.approx(10)
    assert Number("k_saturation", None, "why").row()["difference"] is None


# -- reduced models ----------------------------------------------------------------------------


@pytest.mark.parametrize("case", cases(), ids=lambda case: case.key)
def test_answers_are_fixed_points(study, case):
    """What the sweep reports reproduces itself in the map of appendix B, and is among the roots."""
    frequency = np.array([179.0, 186.0])
    load = study.moment(2.4)
    response = respond(study, case, 2.4, frequency)
    assert (response.flag == 0).all()
    for f, contraction in zip(frequency, response.contraction, strict=True):
        g = fixed_point_map(study, case, 2.4, float(f))
        roots = solutions(study, case, 2.4, float(f))
        assert len(roots)
        for root in roots:
            assert g(float(root)) == pytest.approx(root, rel=1e-9)
        slopes = [abs(slope_at(g, float(root))) for root in roots]
        assert min(abs(s - contraction) for s in slopes) < 1e-4
    assert load > 0


def test_equivalent_of_the_consistent_model_is_its_modal_force(study):
    """First row of its equation: the force is what the linear part leaves over."""
    frequency = np.array([172.0, 179.0, 186.0])
    mode, load = study.assembly.mode, study.moment(2.4)
    response = respond(study, CONSISTENT, 2.4, frequency)
    omega = 2 * np.pi * frequency
    linear = mode.sliding_omega**2 * (1 + 1j * omega * study.rayleigh[1]) - omega**2
    force = mode.load_on_sliding["moment"] * load - linear * response.amplitude
    kappa = force / response.amplitude / mode.sliding_omega**2
    np.testing.assert_allclose(equivalent(study, CONSISTENT, 2.4, frequency), kappa, rtol=1e-7)


def test_plain_iteration():
    path, converged = iterate(lambda q: 2 + 0.5 * q)
    assert converged
    assert path[-1] == pytest.approx(4, rel=1e-5)
    assert not iterate(lambda q: 2 - 1.5 * q)[1]


def test_errors_of_a_case_against_its_own_points(study):
    """A model compared with points on its own curve has none."""
    points = study.time_points(2.4, [178.0])
    own = respond(study, CONSISTENT, 2.4, np.array([points[0].steady.frequency]))
    steady = replace(points[0].steady, amplitude=complex(own.amplitude[0]))
    found = case_errors(study, CONSISTENT, 2.4, [replace(points[0], steady=steady)])
    assert found["worst"] < 1e-8


# -- files -------------------------------------------------------------------------------------


def without_times(report):
    return {key: value for key, value in report.items() if key != "timings"}


def test_two_runs_give_the_same_report(tmp_path):
    small = replace(COARSE, pairs=31, amplitudes=8, cycle_steps=60, time_frequencies=(174.0, 178.0))
    texts = []
    for name in "ab":
        result = reproduce(["fig5", "fig9"], tmp_path / name, small)
        assert not result.interrupted
        report = json.loads((tmp_path / name / "reproduction.json").read_text())
        assert set(report["figures"]) == {"fig5", "fig9"}
        texts.append(without_times(report))
    same(*texts)
    assert (tmp_path / "a" / "figures" / "fig9.png").stat().st_size > 10_000


def same(a, b):
    """Equal to 1e-10 relative."""
    assert type(a) is type(b)
    if isinstance(a, dict):
        assert a.keys() == b.keys()
        for key in a:
            same(a[key], b[key])
    elif isinstance(a, list):
        assert len(a) == len(b)
        for x, y in zip(a, b, strict=True):
            same(x, y)
    elif isinstance(a, float):
        assert a == pytest.approx(b, rel=1e-10, abs=1e-300)
    else:
        assert a == b


def test_pages_show_every_figure_number_and_trend(plates):
    report = run._empty_report(COARSE)
    for name, plate in plates.items():
        run._enter(name, plate, report)
    page, numbers = gallery(report), tables(report)
    for name in FIGURES:
        assert f"figures/{name}.png" in page
    for printed in PAPER.values():
        assert printed.what.replace("_", r"\_").replace("|", r"\|") in numbers
    assert numbers.count("does not hold") == sum(not t["holds"] for t in report["trends"].values())


class Drawn:
    """Stands in for a figure."""

    def __init__(self, name, log, failure=None):
        self.name, self.log, self.failure = name, log, failure

    def __call__(self, study):
        from microslip.reproduce.plate import Plate
        from microslip.show.plots.style import new_figure

        self.log.append(self.name)
        if self.failure is not None:
            raise self.failure
        figure = new_figure(1, 1)
        figure.subplots()
        return Plate(figure, f"caption of {self.name}")


@pytest.fixture
def stand_ins(monkeypatch):
    """Replace all figures by empty ones; give failures by name."""
    log: list[str] = []

    def install(**failures):
        for name in FIGURES:
            monkeypatch.setitem(registry.FIGURES, name, Drawn(name, log, failures.get(name)))
        return log

    return install


def test_a_figure_that_fails_does_not_stop_the_others(tmp_path, stand_ins):
    log = stand_ins(fig5=ContactError("it would not solve"))
    result = reproduce(["all"], tmp_path, COARSE)
    assert log == list(FIGURES)
    assert result.report["failures"] == ["fig5: it would not solve"]
    assert set(result.report["figures"]) == set(FIGURES) - {"fig5"}


def test_interruption_keeps_the_figures_done(tmp_path, stand_ins):
    stand_ins(fig6=KeyboardInterrupt())
    result = reproduce(["fig3", "fig5", "fig6", "fig7"], tmp_path, COARSE)
    assert result.interrupted
    report = json.loads((tmp_path / "reproduction.json").read_text())
    assert report["interrupted"]
    assert list(report["figures"]) == ["fig3", "fig5"]
    assert (tmp_path / "figures" / "fig5.png").exists()
    assert not (tmp_path / "figures" / "fig7.png").exists()


# -- command -----------------------------------------------------------------------------------


@pytest.fixture
def command(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(settings, "QUICK", COARSE)
    return lambda *words: CliRunner().invoke(app, ["reproduce", *map(str, words)])


def test_command_writes_the_figures_asked_for(command, tmp_path, stand_ins):
    log = stand_ins()
    done = command("fig9", "fig3", "--quick", "--out", "there")
    assert done.exit_code == 0, done.output
    assert log == ["fig3", "fig9"]
    names = sorted(p.name for p in (tmp_path / "there" / "figures").iterdir())
    assert names == ["fig3.png", "fig3.svg", "fig9.png", "fig9.svg"]


def test_command_does_all_without_a_name(command, stand_ins):
    log = stand_ins()
    assert command("--quick", "--quiet").exit_code == 0
    assert log == list(FIGURES)


def test_unknown_figure_names_those_there_are(command, tmp_path, stand_ins):
    log = stand_ins()
    done = command("fig3", "fig99")
    assert done.exit_code == 2
    assert done.stderr.startswith("error: ")
    assert "'fig99'" in done.stderr
    assert all(name in done.stderr for name in FIGURES)
    assert "Traceback" not in done.output
    assert log == []
    assert list(tmp_path.iterdir()) == []


def test_what_is_there_is_not_overwritten(command, tmp_path, stand_ins):
    log = stand_ins()
    folder = tmp_path / "reproduction"
    folder.mkdir()
    (folder / "mine.txt").write_text("precious")
    done = command("fig3")
    assert done.exit_code == 2
    assert "--force" in done.stderr
    assert log == []
    assert [p.name for p in folder.iterdir()] == ["mine.txt"]
    assert command("fig3", "--force", "--quick").exit_code == 0
    assert (folder / "mine.txt").read_text() == "precious"


def test_failure_and_interruption_show_in_the_exit_code(command, stand_ins):
    stand_ins(fig5=ContactError("it would not solve"))
    done = command("fig3", "fig5", "--quick")
    assert done.exit_code == 3
    assert "it would not solve" in done.stdout
    assert done.stderr.splitlines()[-1] == (
        "1 thing asked for has no answer; see failures in reproduction/reproduction.json: first: "
        "fig5: it would not solve"
    )
    stand_ins(fig5=KeyboardInterrupt())
    done = command("fig3", "fig5", "--quick", "--force")
    assert done.exit_code == 130
    assert "interrupted" in done.stderr


def test_names_come_in_the_papers_order_once():
    assert chosen(["fig16", "fig3", "fig16"]) == ["fig3", "fig16"]
    assert chosen([]) == chosen(["all"]) == list(FIGURES)
    with pytest.raises(InputError, match="fig99"):
        chosen(["fig99"])


# -- complete ----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def quick_report(tmp_path_factory):
    return reproduce(["all"], tmp_path_factory.mktemp("quick"), QUICK).report


@pytest.mark.validate
def test_quick_reproduction_is_complete(quick_report):
    assert set(quick_report["figures"]) == set(FIGURES)
    assert set(quick_report["numbers"]) == set(PAPER)


@pytest.mark.validate
def test_small_amplitude_stiffness_is_the_papers(quick_report, finding):
    off = abs(quick_report["numbers"]["k_saturation"]["here"] - 0.09)
    finding("stiffness of the stuck joint against the paper's 0.09", off, at_most=0.003)


@pytest.mark.validate
def test_quick_reproduction_has_the_trends_of_the_paper(quick_report):
    trends = quick_report["trends"]
    must = ("resonance_rises", "amplitude_falls_then_rises", "gamma_one_peak_mode", "k_saturates")
    for key in (*must, "k_falls_mode", "peak_inside_slip_zone", "energies_agree_mode"):
        assert trends[key]["holds"], (key, trends[key]["numbers"])


@pytest.mark.validate
def test_refined_model_is_within_two_per_cent_where_the_joint_stays_closed(quick_report, finding):
    for rho in ("2.4", "5"):
        errors = quick_report["figures"]["fig11"]["data"][f"errors_rho_{rho}"]
        what = "reproduction: refined model against time integration, rho = 2.4 and 5"
        finding(what, errors[REFINED.key]["worst"], at_most=0.02)


@pytest.mark.validate
def test_time_domain_peaks_match_the_consistent_model(quick_report, finding):
    found = quick_report["figures"]["fig13"]["data"][CONSISTENT.key]["against_time_domain"]
    for rho in ("2.4", "5"):
        finding("reproduction: peak of the consistent model", abs(found[rho]["peak"]), at_most=0.02)
        off = abs(found[rho]["resonance_hz"])
        finding("reproduction: resonance of the consistent model, Hz", off, at_most=0.2)
