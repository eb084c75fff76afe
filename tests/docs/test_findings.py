"""The page that `make validate` writes shows what failed as plainly as what held."""

from __future__ import annotations

import pytest
from findings import Finding, Outcome, page_of


def outcome(name, ended, *findings):
    return Outcome(f"tests/test_a.py::{name}", ended, 0.0, findings)


def test_the_worst_of_all_cases_is_shown():
    errors = [Finding("error", value, 0.1, False) for value in (0.02, 0.07, 0.01)]
    page = page_of(outcome(f"test_x[{k}]", "passed", one) for k, one in enumerate(errors))
    assert "| error | 3 | 0.07 | ≤ 0.1 |  |" in page
    assert "3 passed, 0 failed, 0 skipped." in page


def test_what_failed_is_marked():
    low = Finding("rank", 0.5, 0.8, True)
    page = page_of([outcome("test_y", "failed", low), outcome("test_z", "skipped")])
    assert "| rank | 1 | 0.5 | ≥ 0.8 | **fails** |" in page
    assert "| `test_y` | 1 | | | **fails** |" in page
    assert "| `test_z` | 1 | | | skipped |" in page


def test_a_number_that_is_none_does_not_hold(finding):
    with pytest.raises(AssertionError, match="nothing: nan, allowed <= 1"):
        finding("nothing", float("nan"), at_most=1.0)
    with pytest.raises(AssertionError):
        finding("half", 0.5, at_least=1.0)
    with pytest.raises(TypeError, match="one limit"):
        finding("unlimited", 0.5)
