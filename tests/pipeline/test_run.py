"""A run: frozen, short to print, and what an analysis gives of itself."""

from __future__ import annotations

from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest
from conftest import description

from microslip.describe.reading import parse_joint
from microslip.errors import Failure
from microslip.pipeline.notebook import MOST_ROWS, html_page, html_table
from microslip.pipeline.outcome import Outcome, until_interrupted, value_of
from microslip.pipeline.progress import NullProgress
from microslip.pipeline.run import Run, run
from microslip.results.summary import summary

JOINT = description(
    21,
    20,
    title="Joint <b>",
    load={"rho": [0, 0.1, 2.4], "rho_scale": 0.0023},
    analysis={
        "cycle": {"moment_over_clamp_force_length": [1e-3, 4e-3, 1.2e-2], "steps": 60},
        "response": {"from": "170 Hz", "to": "185 Hz", "count": 61, "variants": "consistent"},
    },
)


@pytest.fixture(scope="module")
def found() -> Run:
    return run(parse_joint(JOINT))


def test_a_run_is_frozen_and_gives_what_was_asked_for(found: Run) -> None:
    assert list(found.outcomes) == ["cycle", "response"]
    assert set(found.cycles) == set(found.moments) == set(found.tables) == {"moment", "mode"}
    assert [r.rho for r in found.responses] == [0, 0.1, 2.4]
    assert found.frictionless is not None
    assert found.rho_scale == 0.0023
    assert np.isnan(found.moment_offset)
    assert found.backbones == found.harmonic == found.time_domain == found.histories == ()
    with pytest.raises(FrozenInstanceError):
        found.interrupted = True


def test_a_bare_run_has_nothing_in_it(found: Run) -> None:
    bare = Run(found.assembly)
    assert bare.cycles == bare.moments == bare.tables == {}
    assert bare.responses == ()
    assert bare.frictionless is None
    assert bare.failures == ()


def test_a_load_beyond_the_table_is_a_failure(found: Run) -> None:
    """rho = 0.1 slides far beyond the largest cycle."""
    assert {failure.stage for failure in found.failures} == {"response"}
    assert found.failures[0].where == "consistent, rho = 0.1"
    assert "points have no answer in the table" in found.failures[0].reason


def test_a_run_prints_in_a_few_lines(found: Run) -> None:
    text = repr(found)
    assert text.startswith("Run of Joint <b>\n")
    assert "21 contact pairs" in text
    assert "cycle, response in " in text
    assert f"not solved: {len(found.failures)}: response, consistent" in text
    assert text.count("\n") <= 5
    assert len(text) < 1000
    for outcome in found.outcomes.values():
        assert len(repr(outcome)) < 200
    assert len(repr(found.assembly)) < 200


def test_many_failures_are_counted(found: Run) -> None:
    many = tuple(Failure("response", f"load {k}", "none") for k in range(50))
    shown = repr(replace(found, outcomes={"response": Outcome(None, many)}, interrupted=True))
    assert "not solved: 50: response, load 0: none; response, load 1: none;" in shown
    assert "load 10" not in shown
    assert "interrupted: what was finished is here" in shown


def test_a_notebook_shows_the_summary_escaped(found: Run) -> None:
    page = found._repr_html_()
    assert page.startswith("<h4>Run of Joint &lt;b&gt;</h4>")
    assert "cycles (6)" in page
    assert "response (3)" in page
    assert "response_band (1)" in page
    assert page.count("<table>") == page.count("</table>") == 3


def test_tables_of_a_notebook() -> None:
    rows = [{"name": f"<{k}>", "a_value": k / 3, "none": None} for k in range(MOST_ROWS + 2)]
    table = html_table("some", rows)
    assert table.count("<tr>") == 1 + MOST_ROWS
    assert "<th>a value</th>" in table
    assert "<td>&lt;1&gt;</td><td>0.3333</td><td>–</td>" in table
    assert "and 2 more" in table
    assert html_page("t", {}, {"empty": []}) == "<h4>t</h4><p></p>"


def test_outcomes_print_what_they_are() -> None:
    assert repr(Outcome((1, 2, 3))) == "Outcome(tuple of 3)"
    failed = Outcome(None, (Failure("cycle", "", "no"),), interrupted=True)
    assert repr(failed) == "Outcome(NoneType, 1 not solved, interrupted)"
    assert value_of({"cycle": Outcome(4)}, "cycle") == 4
    assert value_of({}, "cycle") is None


def test_only_ctrl_c_is_swallowed() -> None:
    with until_interrupted() as stop:
        pass
    assert not stop.is_set()
    with pytest.raises(ZeroDivisionError), until_interrupted():
        1 / 0  # noqa: B018


class Pressing(NullProgress):
    """Ctrl-C once a number of steps are done."""

    def __init__(self, after: int) -> None:
        self.left = after

    def advance(self, n: int = 1) -> None:
        self.left -= n
        if self.left < 0:
            raise KeyboardInterrupt


@pytest.mark.parametrize(
    ("after", "cycles", "responses"),
    [(2, {"moment": 2}, 0), (5, {"moment": 3, "mode": 2}, 0), (8, {"moment": 3, "mode": 3}, 2)],
)
def test_what_was_finished_before_ctrl_c_is_kept(
    after: int, cycles: dict[str, int], responses: int
) -> None:
    """One step for the matrices, three for the cycles of each drive, one for each response."""
    halted = run(parse_joint(JOINT), Pressing(after))
    assert halted.interrupted
    assert {drive: len(found) for drive, found in halted.cycles.items()} == cycles
    assert len(halted.responses) == responses
    assert summary(halted)["interrupted"]
