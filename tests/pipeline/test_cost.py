"""Cost of a run: sizes that are those of the model, and times that follow what is asked for."""

from __future__ import annotations

import math
import re

import pytest
from conftest import ROOT

from microslip.describe.beam import first_frequency
from microslip.describe.excitation import Sine
from microslip.describe.reading import load_joint
from microslip.errors import InputError
from microslip.model.lap import structure_of
from microslip.pipeline import cost as costing
from microslip.pipeline.cost import (
    base_seconds,
    check_size,
    cycle_seconds,
    degrees_of_freedom,
    harmonic_seconds,
    history_seconds,
    is_spatial,
    memory,
    refined_seconds,
    response_seconds,
    time_seconds,
    total_seconds,
)
from microslip.registry import column

EXAMPLES = ROOT / "examples"
EXAMPLE = EXAMPLES / "lap_joint.toml"


def test_frequency_estimate_is_that_of_one_beam():
    """Pinned at both ends: first root of sin(k l) = 0, l = 428 mm; the joint slides at 174.9 Hz."""
    joint = load_joint(EXAMPLE)
    stiffness, mass, span = 70e9 / 0.91 * 0.0125**3 / 12, 2000 * 0.0125, 0.428
    omega = (math.pi / span) ** 2 * math.sqrt(stiffness / mass)
    assert first_frequency(joint) == pytest.approx(omega / (2 * math.pi))
    assert first_frequency(joint) == pytest.approx(174.9, rel=0.15)


def test_degrees_of_freedom_are_those_of_the_structure():
    joint = load_joint(EXAMPLE)
    joint = joint.model_copy(update={"contact": joint.contact.model_copy(update={"pairs": 21})})
    assert degrees_of_freedom(joint) == structure_of(joint).dofs


def test_cost_grows_with_what_is_asked_for():
    joint = load_joint(EXAMPLE)
    less = joint.model_copy(update={"analysis": joint.analysis.model_copy(update={"cycle": None})})
    assert (
        5
        < total_seconds(less, 10_000)
        < total_seconds(joint, 10_000)
        < total_seconds(joint, 20_000)
    )


def test_histories_cost_their_steps():
    """50,000 steps of 201 pairs: 1000 cycles of 50 steps."""
    joint = load_joint(EXAMPLE)
    assert history_seconds(joint) == 0
    sine = Sine(signal="sine", frequency=300.0, cycles=1000, steps=50, moment=1.0)
    longer = joint.model_copy(
        update={"analysis": joint.analysis.model_copy(update={"history": (sine,)})}
    )
    assert history_seconds(longer) == pytest.approx(8e-9 * 201**2 * 50_000)
    assert total_seconds(longer, 10_000) > total_seconds(joint, 10_000) + 10


def costs(joint):
    return {row.name: cost(joint) for row, cost in column("cost")}


def with_pairs(joint, pairs):
    contact = joint.contact.model_copy(update={"pairs": pairs})
    return joint.model_copy(update={"contact": contact})


@pytest.mark.parametrize("file", sorted(EXAMPLES.glob("*.toml")), ids=lambda file: file.stem)
def test_total_is_the_sum_of_its_parts(file):
    joint = load_joint(file)
    parts = [base_seconds(joint, 10_000), *costs(joint).values()]
    assert total_seconds(joint, 10_000) == pytest.approx(sum(parts), rel=1e-14)


def test_what_is_not_asked_for_costs_nothing():
    for name in ("decay", "harmonic"):
        found = costs(load_joint(EXAMPLES / f"lap_joint_{name}.toml"))
        assert [key for key, cost in found.items() if cost] == [
            "history" if name == "decay" else "harmonic"
        ]


def test_contact_costs_go_with_the_square_of_the_pairs():
    """Of 51 and 201 pairs; a response of the reduced model that is not checked does not know its pairs."""
    time, harmonic = (load_joint(EXAMPLES / f"lap_joint_{n}.toml") for n in ("time", "harmonic"))
    for joint, cost in (
        (time, cycle_seconds),
        (time, time_seconds),
        (harmonic, harmonic_seconds),
    ):
        few, many = (cost(with_pairs(joint, pairs)) for pairs in (51, 201))
        assert many / few == pytest.approx((201 / 51) ** 2, rel=1e-12)
    checked = (response_seconds(with_pairs(time, pairs)) for pairs in (51, 201))
    response = time.analysis.response.model_copy(update={"checks": 0})
    analysis = time.analysis.model_copy(update={"response": response})
    bare = time.model_copy(update={"analysis": analysis})
    few, many = (response_seconds(with_pairs(bare, pairs)) for pairs in (51, 201))
    assert few == many > 0
    few, many = (seconds - few for seconds in checked)
    assert many / few == pytest.approx((201 / 51) ** 2, rel=1e-9)


def test_frictionless_joint_needs_no_refined_table():
    joint = load_joint(EXAMPLE)
    reduced = joint.analysis.reduced.model_copy(update={"variant": ("refined",)})
    joint = joint.model_copy(
        update={"analysis": joint.analysis.model_copy(update={"reduced": reduced})}
    )
    assert refined_seconds(joint) > 0
    contact = joint.contact.model_copy(update={"friction": 0.0})
    assert refined_seconds(joint.model_copy(update={"contact": contact})) == 0


def test_meshes_in_space_cost_what_their_factors_cost():
    """Seconds and bytes before analyses, measured by `benchmarks/scale.py`."""
    joint = load_joint(EXAMPLES / "half_lap_beam.toml")
    assert is_spatial(joint)
    assert not is_spatial(load_joint(EXAMPLE))
    measured = ((7_524, 2.4, 0.43e9), (41_934, 25.0, 1.23e9), (122_826, 150.0, 4.46e9))
    for dofs, seconds, held in measured:
        assert base_seconds(joint, dofs) - base_seconds(joint, 0) == pytest.approx(seconds, rel=0.5)
        assert memory(joint, dofs) == pytest.approx(held, rel=0.5)


def test_what_a_machine_cannot_hold_in_space_is_said_with_what_it_could(monkeypatch):
    joint = load_joint(EXAMPLES / "half_lap_beam.toml")
    monkeypatch.setattr(costing, "memory_of_machine", lambda: 16e9)
    monkeypatch.setattr(costing, "contact_pairs", lambda joint: 30_000)
    fits = r"needs about \d+ GB .* has 16 GB: (\d+) pairs would fit"
    with pytest.raises(InputError, match=fits) as raised:
        check_size(joint, 40_000)
    most = int(re.search(fits, str(raised.value))[1])
    monkeypatch.setattr(costing, "contact_pairs", lambda joint: most)
    assert memory(joint, 40_000) == pytest.approx(16e9, rel=1e-3)
    with pytest.raises(InputError, match="factors of 2000000 degrees of freedom alone take 52 GB"):
        check_size(joint, 2_000_000)
