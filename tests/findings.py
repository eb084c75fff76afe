"""What slow validations found, written into the documentation by the command that runs them.

A test says what it compares, what it found and what is allowed with the fixture `finding`; with
`--findings PAGE` the page is written when all tests have run.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple

import pytest

HEAD = """# What validation found

Written by `make validate`, which runs the tests that are too slow for every day. Every row is one quantity
that a test compares with something independent of the code under test: a closed form, a published number,
a second method, an energy balance, the order of a convergence. *Worst* is that of all cases.
"""


class Finding(NamedTuple):
    """One quantity of one test.

    Attributes
    ----------
    what : str
        What is compared with what.
    found : float
    allowed : float
    least : bool
        Whether `allowed` is the least instead of the most.
    """

    what: str
    found: float
    allowed: float
    least: bool


class Outcome(NamedTuple):
    """How one test ended."""

    test: str
    ended: str
    seconds: float
    findings: tuple[Finding, ...]


@pytest.fixture
def finding(record_property: Callable[[str, object], None]) -> Callable[..., None]:
    """Records a quantity, and fails the test where it is beyond what is allowed."""

    def record(
        what: str, found: float, *, at_most: float | None = None, at_least: float | None = None
    ) -> None:
        limits = [limit for limit in (at_most, at_least) if limit is not None]
        if len(limits) != 1:
            raise TypeError("a finding has one limit: at_most or at_least")
        one = Finding(what, float(found), float(limits[0]), at_least is not None)
        record_property("finding", list(one))
        assert holds(one), (
            f"{what}: {found:.3g}, allowed {'>=' if one.least else '<='} {limits[0]:.3g}"
        )

    return record


def holds(one: Finding) -> bool:
    """Whether a finding is within what is allowed; one that is not a number is not."""
    return one.found >= one.allowed if one.least else one.found <= one.allowed


class Findings:
    """Gathers what tests report, in whatever process they ran."""

    def __init__(self, page: Path) -> None:
        self.page = page
        self.outcomes: dict[str, Outcome] = {}

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.when != "call" and report.passed:
            return
        values = [Finding(*value) for name, value in report.user_properties if name == "finding"]
        self.outcomes[report.nodeid] = Outcome(
            report.nodeid, report.outcome, report.duration, tuple(values)
        )

    def pytest_sessionfinish(self, session: pytest.Session, exitstatus: int) -> None:
        if exitstatus == pytest.ExitCode.INTERRUPTED or not self.outcomes:
            return
        self.page.write_text(page_of(self.outcomes.values()))


def page_of(outcomes: Iterable[Outcome]) -> str:
    """The page, in MyST."""
    outcomes = sorted(outcomes, key=lambda one: one.test)
    ended = {
        name: sum(one.ended == name for one in outcomes) for name in ("passed", "failed", "skipped")
    }
    lines = [HEAD, ", ".join(f"{count} {name}" for name, count in ended.items()) + ".\n"]
    for file, group in itertools.groupby(outcomes, key=lambda one: one.test.split("::")[0]):
        lines += [
            f"## `{file}`\n",
            "| compared | cases | worst | allowed | |",
            "|---|---|---|---|---|",
            *_rows(list(group)),
            "",
        ]
    return "\n".join(lines)


def _rows(outcomes: list[Outcome]) -> list[str]:
    rows = []
    by_what: dict[str, list[Finding]] = {}
    for one in itertools.chain.from_iterable(each.findings for each in outcomes):
        by_what.setdefault(one.what, []).append(one)
    for what, found in by_what.items():
        worst = min(found, key=_margin)
        sign, mark = ("≥" if worst.least else "≤"), ("" if holds(worst) else "**fails**")
        rows.append(
            f"| {what} | {len(found)} | {worst.found:.3g} | {sign} {worst.allowed:.3g} | {mark} |"
        )
    for name, each in itertools.groupby(
        [one for one in outcomes if not one.findings or one.ended == "failed"],
        key=lambda one: (one.test.split("::")[-1].split("[")[0], one.ended),
    ):
        test, ended = name
        marked = "**fails**" if ended == "failed" else "holds" if ended == "passed" else ended
        rows.append(f"| `{test}` | {len(list(each))} | | | {marked} |")
    return rows


def _margin(one: Finding) -> float:
    return one.found - one.allowed if one.least else one.allowed - one.found


def pytest_addoption(parser: Any) -> None:
    parser.addoption(
        "--findings", metavar="PAGE", type=Path, help="write what the tests found to this page"
    )


def pytest_configure(config: pytest.Config) -> None:
    page = config.getoption("--findings")
    if page is not None and not hasattr(config, "workerinput"):
        config.pluginmanager.register(Findings(page), "findings-page")
