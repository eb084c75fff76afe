"""The refined model held against the full joint: where, by how much it is off, and what is said of it."""

from dataclasses import replace

import numpy as np
import pytest
from coupled_joint import coupled_document

import microslip
from microslip.analyses.reduced.response import Check, Response
from microslip.analyses.reduced.sweep import CONVERGED, OUTSIDE
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import steady_state
from microslip.pipeline.checked import checked_at, not_as_in_time, worst_of
from microslip.results.summary import summary
from microslip.show.tables import response_table


def responses(moment, **response):
    document = coupled_document(21, load={"moment": [f"{moment:g} N*m/m"]})
    analysis = {"response": {"count": 61, **response}, "reduced": {"amplitudes": 16, "steps": 100}}
    return microslip.run(microslip.parse_joint({**document, "analysis": analysis}))


@pytest.fixture(scope="module")
def done():
    return responses(30.0)


def bell(size):
    n = len(size)
    return Response(
        variant="refined",
        drive="prescribed",
        rho=np.nan,
        load=1.0,
        friction=0.3,
        frequency=np.arange(1.0, n + 1),
        amplitude=np.asarray(size, complex),
        iterations=np.ones(n, int),
        contraction=np.zeros(n),
        flag=np.full(n, CONVERGED),
    )


def test_the_peak_and_both_sides_are_checked(done):
    (curve,) = done.responses
    size = np.abs([check.modelled for check in curve.checks])
    assert len(size) == 3
    assert size[1] == pytest.approx(np.abs(curve.amplitude).max(), rel=1e-12)
    assert (size[[0, 2]] <= np.sqrt(0.5) * size[1]).all()


def test_checks_are_motions_of_the_full_joint(done):
    """With other steps, sought until they are steady; as close as the check says that it knows them."""
    (curve,) = done.responses
    for check in curve.checks:
        scheme = time_scheme(done.prepared, 1 / (240 * check.frequency), frequency=check.frequency)
        truth = steady_state(scheme, check.frequency, curve.load)
        off = abs(check.modelled) / abs(truth.amplitude) - 1
        assert check.error == pytest.approx(off, abs=3e-3 + check.doubt)
    assert sum(check.doubt < 1e-3 for check in curve.checks) >= 2


def test_what_is_off_is_said_with_a_remedy(done):
    (curve,) = done.responses
    off = np.array([abs(check.error) for check in curve.checks])
    assert (off > 0.01).any(), "a joint on which the table errs by per cents"
    said = [c for c in done.cautions if "held against time integration" in c.reason]
    assert len(said) == 1
    assert f"{worst_of(curve):+.1%}" in said[0].reason
    assert 'method = "corrected"' in said[0].remedy


def test_a_joint_that_sticks_is_as_its_model():
    (curve,) = responses(1e-3).responses
    assert len(curve.checks) == 3
    assert abs(worst_of(curve)) < 0.01


def test_none_where_none_is_wanted_or_the_model_is_put_right():
    assert not responses(1e-3, checks=0).responses[0].checks
    (curve,) = responses(1e-3, method="corrected", corrections=7).responses
    assert not curve.checks


def test_the_peak_alone():
    assert checked_at(bell([1, 2, 9, 10, 5, 1]), 1) == [3]


def test_no_check_without_a_peak():
    assert checked_at(bell([1, 2, 3]), 3) == []
    missing = bell([1, 2, 9, 10, 5, 1])
    missing.flag[4] = OUTSIDE
    assert checked_at(missing, 3) == []
    assert checked_at(replace(missing, flag=np.full(6, OUTSIDE)), 3) == []


def test_a_motion_that_creeps_is_said_with_what_the_check_is_worth():
    curve = replace(bell([1, 10, 1]), checks=(Check(2.0, 10 + 0j, 9.9 + 0j, 0.03),))
    (said,) = not_as_in_time("refined, F = 1 N", curve)
    assert "creeping" in said.reason
    assert "2 Hz, its amplitude known to 3%" in said.reason


def test_a_motion_that_is_not_steady_is_said():
    curve = replace(
        bell([1, 10, 1]), checks=(Check(2.0, 10 + 0j, 0j, np.nan), Check(3.0, 1 + 0j, 1 + 0j, 0.0))
    )
    assert worst_of(curve) == 0
    (said,) = not_as_in_time("refined, F = 1 N", curve)
    assert "no steady motion" in said.reason
    assert "2 Hz" in said.reason


def test_the_table_says_at_how_many_frequencies_the_model_was_held(done):
    (curve,) = done.responses
    lost = replace(curve.checks[1], amplitude=0j, doubt=np.nan)
    some = replace(curve, checks=(curve.checks[0], lost, curve.checks[2]))
    shown = []
    for each in (curve, some):
        outcome = done.outcomes["response"]
        outcome = replace(outcome, value=replace(outcome.value, curves=(each,)))
        run = replace(done, outcomes={**done.outcomes, "response": outcome})
        table = next(iter(response_table(summary(run))))
        (column,) = (own for own in table.columns if own.header == "off by")
        shown += column.cells
    assert shown[0].endswith("%")
    assert shown[1].endswith("% (2 of 3)")
