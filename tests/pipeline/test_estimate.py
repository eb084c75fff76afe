"""What is said of a joint before and after it is computed, and what is doubted of it."""

from __future__ import annotations

import math
import tomllib
from dataclasses import replace

import numpy as np
import pytest
from conftest import ROOT, description, with_value
from rich.console import Console
from wrong_inputs import RIGHT, put, puts

from microslip.contact.pairs import BACKWARD, FORWARD
from microslip.describe.reading import load_joint, parse_joint
from microslip.errors import Caution, InputError
from microslip.model.lap import materials
from microslip.model.stress import sections_outside
from microslip.pipeline import cost, estimate
from microslip.pipeline.cost import check_size, degrees_of_freedom, memory
from microslip.pipeline.judge import judge, motions_of, stress_of
from microslip.pipeline.motions import Motion
from microslip.pipeline.run import Run
from microslip.pipeline.run import run as run_joint
from microslip.results.summary import summary
from microslip.show.plots.overview import overview
from microslip.show.terminal import print_found

CYCLES = {"cycle": {"count": 6, "steps": 40}}


def joint(change=lambda text: text):
    return parse_joint(tomllib.loads(change(RIGHT)))


def said(change) -> list[str]:
    wrong = joint(change)
    return [str(c) for c in estimate.input_cautions(wrong, estimate.estimate(wrong))]


# -- before --------------------------------------------------------------------------------------


@pytest.mark.parametrize("file", sorted((ROOT / "examples").glob("*.toml")), ids=lambda f: f.name)
def test_examples_are_not_doubted(file):
    found = load_joint(file)
    assert estimate.input_doubts(found) == ()


def test_stress_and_pressure_of_the_reference_joint():
    found = estimate.estimate(joint())
    assert found.moment == 50.0
    assert found.stress == pytest.approx(6 * 50 / 0.0125**2)
    assert found.pressure == pytest.approx(1e6 / 0.05)
    assert found.clamp_pairs == pytest.approx(50 / 75 * 200)


def test_stress_at_resonance_without_friction_is_a_bound(run):
    """Of a linear oscillator: the share of the mode over twice its damping ratio."""
    found = estimate.estimate(run.joint)
    zeta = 0.5 * 7.3e-7 * 2 * np.pi * run.mode.sliding_frequency
    linear = run.value("response").frictionless
    assert found.resonant_stress > judge(run).stress
    assert found.resonant_stress / found.stress == pytest.approx(1.25 / (2 * zeta), rel=0.1)
    per_load = judge(run).stress_per_amplitude * linear.peak_amplitude / linear.load
    assert found.resonant_stress / found.moment == pytest.approx(per_load, rel=0.1)
    still = estimate.estimate(joint(put("damping.beta", "0")))
    assert still.resonant_stress == math.inf


def test_the_largest_of_all_moments_counts():
    sine = {"signal": "sine", "frequency": 170, "cycles": 3}
    document = tomllib.loads(RIGHT)
    document["analysis"]["history"] = [
        {**sine, "moment": "70 N*m/m"},
        {**sine, "name": "b", "moment_over_clamp_force_length": 1e-3},
    ]
    assert estimate.largest_moment(parse_joint(document)) == pytest.approx(1e-3 * 1e6 * 0.2515)
    document["analysis"]["history"].append({**sine, "name": "c", "rho": 0.1})
    moment = 1.985e-3 * 0.25 * 1e6 * 0.2515 / 0.1
    assert estimate.largest_moment(parse_joint(document)) == pytest.approx(moment)
    document["load"] = {"moment": [50, 3000]}
    assert estimate.largest_moment(parse_joint(document)) == 3000
    by_rho = joint(lambda t: t.replace("moment = ", "rho = 2 #"))
    assert estimate.largest_moment(by_rho) == pytest.approx(1.985e-3 * 0.25 * 1e6 * 0.2515 / 2)
    document["load"] = {"rho": 0}
    del document["analysis"]["history"]
    assert math.isnan(estimate.largest_moment(parse_joint(document)))


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (
            puts(load__moment='"20 kN*m/m"', material__yield_stress='"250 MPa"'),
            ["linear elasticity is left: bending stress 768 MPa", "material.yield_stress is 250 MPa"],
        ),
        (put("load.moment", '"20 kN*m/m"'), ["bending stress 768 MPa", "0.5% of the modulus"]),
        (put("load.moment", '"20 kN*m/m"'), ["small rotations are left: deflection 32.9 mm"]),
        (
            put("material.yield_stress", '"15 MPa"'),
            ["clamp.force = 1 MN/m", "mean pressure of the clamp is 20 MPa", "the surfaces yield"],
        ),
        (
            puts(analysis__response__from='"300 Hz"', analysis__response__to='"400 Hz"'),
            ["analysis.response from 300 to 400 Hz", "175.4 Hz (sliding) and 187.1 Hz (stuck)"],
        ),
        (
            puts(contact__pairs="1001", analysis__cycle__count="1000"),
            ["cost, contact.pairs = 1001", " h on one core", "GB"],
        ),
    ],
)  # fmt: skip
def test_what_is_doubted_before_a_run(change, says):
    found = "\n".join(said(change))
    for words in says:
        assert words in found


def test_a_band_that_was_not_given_is_not_doubted():
    stiff = puts(material__youngs_modulus='"210 GPa"', beams__thickness='"20 mm"')
    assert not [c for c in said(stiff) if "analysis.response" in c]


def test_more_pairs_than_the_machine_has_memory_for(monkeypatch):
    many = joint(put("contact.pairs", "5001"))
    monkeypatch.setattr(cost, "memory_of_machine", lambda: 16e9)
    with pytest.raises(InputError, match=r"contact.pairs = 5001: needs about \d+ GB .* has 16 GB"):
        check_size(many, degrees_of_freedom(many))
    monkeypatch.setattr(cost, "memory_of_machine", lambda: math.inf)
    check_size(many, degrees_of_freedom(many))


def test_memory_goes_with_pairs_and_with_degrees_of_freedom():
    small = joint(put("contact.pairs", "101"))
    base = memory(small, 0)
    assert memory(small, 2000) - base == pytest.approx(2 * (memory(small, 1000) - base))
    # the columns of the model at all pairs, once, are less than it
    dofs = degrees_of_freedom(small)
    assert memory(small, dofs) > 2 * 101 * dofs * 8


def test_what_friction_cannot_hold_slips_everywhere():
    assert estimate.slip_length(joint(put("contact.friction", "0")), 1.0) == math.inf
    lengths = [estimate.slip_length(joint(), m) for m in (1.0, 10.0, 100.0, 1e3, 1e4)]
    assert lengths == sorted(lengths)
    # beyond the edge the force that is handed over grows by mu p for every length
    step = estimate.slip_length(joint(), 2e4) - lengths[-1]
    assert 0.25 * 20e6 * step == pytest.approx(0.75 * 1e4 / 0.0125)


@pytest.mark.parametrize("thickness", ["12.5 mm", "6 mm"])
def test_slip_zone_is_that_of_the_cycles_within_a_factor(thickness):
    document = description(81, 30)
    document["beams"]["thickness"] = thickness
    document["analysis"] = {
        "cycle": {
            "drives": ["moment"],
            "moment_over_clamp_force_length": [5e-4, 1.5e-3, 5e-3],
            "steps": 40,
        }
    }
    run = run_joint(parse_joint(document))
    for cycle, moment in zip(run.cycles["moment"], run.moments["moment"], strict=True):
        slips = np.isin(cycle.status, (FORWARD, BACKWARD)).any(axis=0)
        length = np.diff(run.model.position).max() * slips.sum() / 2
        assert 0.8 < length / estimate.slip_length(run.joint, moment) < 2.5


# -- after ---------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def run() -> Run:
    document = description(31, 20, load={"moment": [50, 2000]}, analysis={**CYCLES, "response": {}})
    document["analysis"]["response"] = {"variants": ["consistent"]}
    return run_joint(parse_joint(document))


def test_at_rest_the_moment_is_all_there_is(run):
    """The mode's share and the rest add up to 6 M/h², quasi-statically."""
    mode = run.mode
    sections = sections_outside(run.structure, materials(run.joint), run.assembly.states.sliding)
    share = mode.load_on_sliding["moment"] / mode.sliding_omega**2
    still = stress_of(Motion("cycle", "", share * 100.0, 100.0), sections, share)
    assert still == pytest.approx(6 * 100 / 0.0125**2, rel=1e-3)
    # one mode alone, in proportion to its amplitude
    alone = [stress_of(Motion("x", "", q, 0.0), sections, share) for q in (1e-3, 2e-3)]
    assert alone[1] == pytest.approx(2 * alone[0])


def test_resonance_counts(run):
    found = judge(run)
    top = max(run.responses, key=lambda r: r.peak_amplitude)
    assert found.stress > 6 * 2000 / 0.0125**2
    mode_alone = found.stress_per_amplitude * top.peak_amplitude
    assert found.stress == pytest.approx(mode_alone, abs=1.1 * 6 * 2000 / 0.0125**2)
    assert found.where.startswith(f"response, M = {top.load:.4g} N m/m")
    assert found.deflection == pytest.approx(found.deflection_per_amplitude * top.peak_amplitude)


def test_stress_of_the_mode_is_what_its_inertia_bends(run):
    """Beam theory: sigma = E' h/2 w'' for half a sine over the span is of the same size."""
    found = judge(run)
    span = estimate.span(run.joint)
    sine = (
        run.joint.material.youngs_modulus / 0.91 * 0.0125 / 2 * (np.pi / span) ** 2
    ) * found.deflection_per_amplitude
    assert found.stress_per_amplitude == pytest.approx(sine, rel=0.4)


def test_warnings_are_where_an_engineer_looks(run, capsys):
    doubted = summary(run)
    (stress,) = [w for w in doubted["warnings"] if "linear elasticity is left" in w]
    assert stress.startswith("response, M = 2000 N m/m")
    assert doubted["stress"]["largest_bending_stress_pa"] > 350e6
    assert doubted["stress"]["moment_at_elastic_limit_n"] == pytest.approx(350e6 * 0.0125**2 / 6)
    print_found(doubted, Console(width=100))
    printed = capsys.readouterr().out
    assert stress in printed
    assert "bending stress     " in printed
    foot = overview(run).get_supxlabel()
    assert "linear elasticity is left" in foot


def test_a_gentle_run_is_not_doubted(run):
    gentle = with_value(run, "response", replace(run.value("response"), curves=run.responses[:1]))
    assert not [c for c in judge(gentle).cautions if c.stage == "response"]
    assert overview(gentle).get_supxlabel() == ""


def test_a_yield_stress_below_the_pressure():
    document = description(31, 20, analysis=CYCLES)
    document["material"]["yield_stress"] = "20.3 MPa"
    found = judge(run_joint(parse_joint(document)))
    (pressed,) = [c for c in found.cautions if "pressure" in c.reason]
    assert pressed.stage == "prestress"  # the mean is below, the largest above
    assert "clamp.force = 1 MN/m" in pressed.where
    assert found.pressure > 20.3e6


def test_cycles_asked_for_are_judged_and_tables_are_not():
    """Cycles up to 0.85 of opening are 1.2 GPa; as a table of the response nobody asked for them."""
    both = {**CYCLES, "response": {"variants": ["consistent"]}}
    table = description(31, 20, load={"moment": 1}, analysis=both)
    alone = description(31, 20, analysis=CYCLES)
    assert [m.analysis for m in motions_of(run_joint(parse_joint(table)))] == ["response"]
    found = judge(run_joint(parse_joint(alone)))
    assert {c.stage for c in found.cautions} == {"cycle"}
    assert found.stress == pytest.approx(6 * 0.85 * 37.5e3 / 0.0125**2, rel=0.1)


def test_beams_that_overlap_all_over_have_nothing_beside_the_overlap():
    document = description(31, 20, load={"moment": 5}, analysis={**CYCLES, "response": {}})
    document["beams"]["overlap_half_length"] = "125.75 mm"
    document["analysis"]["response"] = {"variants": ["consistent"], "from": 100, "to": 3000}
    found = judge(run_joint(parse_joint(document)))
    assert np.isnan(found.stress)
    assert found.deflection > 0


def test_a_slip_zone_that_is_not_resolved():
    document = description(
        31, 20, load={"moment": 0.01}, analysis={**CYCLES, "response": {"variants": ["consistent"]}}
    )
    cautions = judge(run_joint(parse_joint(document))).cautions
    assert [c for c in cautions if "contact pairs wide" in c.reason]


def test_a_caution_reads_like_a_failure():
    assert (
        str(Caution("cost", "pairs = 5", "dear", "take fewer"))
        == "cost, pairs = 5: dear; take fewer"
    )
