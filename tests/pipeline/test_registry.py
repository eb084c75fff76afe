"""One row is an analysis: a toy goes from the input file to the figure without touching a file."""

from __future__ import annotations

import io
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
import xarray as xr
from conftest import description
from matplotlib.figure import Figure
from pydantic import Field
from rich.console import Console

from microslip.cli.check import derived
from microslip.describe.quantities import Number, Section
from microslip.describe.reading import parse_joint
from microslip.describe.requests import Requests
from microslip.errors import Failure, InputError, MicroslipError
from microslip.pipeline.cost import total_seconds
from microslip.pipeline.outcome import Outcome
from microslip.pipeline.prepare import Assembly
from microslip.pipeline.progress import Progress
from microslip.pipeline.run import Run, run
from microslip.registry import ANALYSES, Analysis, column, register, resolved, unregister
from microslip.results.dataset import dataset
from microslip.results.files import load_results
from microslip.results.labels import variable
from microslip.show.plots.style import COLUMN, new_figure
from microslip.show.terminal import print_found, print_summary
from microslip.show.write import write_results

# The toy: what friction can hold, mu times the integral of the pressure. From here ...


class Grip(Section):
    """What friction can hold."""

    share: Number = Field(default=1.0, gt=0, le=1)
    """Share of it that counts. The result is in proportion."""


def run_grip(
    assembly: Assembly, done: Mapping[str, Outcome[Any]], progress: Progress
) -> Outcome[float]:
    progress.start("grip", 1)
    held = assembly.joint.contact.friction * assembly.prestress.pressure @ assembly.model.area
    progress.finish()
    return Outcome(assembly.joint.analysis.grip.share * float(held))


def grip_figure(run: Run) -> Figure:
    figure = new_figure(COLUMN, COLUMN)
    figure.subplots().plot(run.model.position, run.joint.contact.friction * run.prestress.pressure)
    return figure


GRIP = Analysis(
    name="grip",
    section=Grip,
    run=run_grip,
    request=lambda joint: [("grip", f"{joint.analysis.grip.share:g} of it")],
    cost=lambda joint: 1000.0 if joint.analysis.grip is not None else 0.0,
    rows={"grip": lambda run: [{"held_n_per_m": run.value("grip")}]},
    datasets=lambda run: {
        "grip": xr.Dataset({"held": variable((), run.value("grip"), "N/m", "held by friction")})
    },
    table=lambda found: [f"  friction holds {found['grip'][0]['held_n_per_m']:.6g} N/m"],
    figures={"grip": grip_figure},
)

# ... to here it is all that a new analysis takes.

JOINT = description(
    21,
    20,
    title="Joint of a <toy>",
    analysis={"grip": {"share": 0.5}},
)
HELD = 0.5 * 0.25 * 1e6
"""N/m: half of the coefficient of friction times the clamp force."""


@pytest.fixture
def grip() -> Iterator[None]:
    register(GRIP)
    yield
    unregister("grip")


def printed(show: Any, what: object) -> str:
    text = io.StringIO()
    show(what, Console(file=text, width=120))
    return text.getvalue()


@pytest.mark.usefixtures("grip")
def test_a_toy_goes_all_the_way(tmp_path: Path) -> None:
    found = run(parse_joint(JOINT))
    assert found.value("grip") == pytest.approx(HELD, rel=2e-3)
    assert set(found.timings) == {"assemble", "grip", "total"}
    written = {path.name for path in write_results(found, tmp_path)}
    assert {"summary.json", "results.nc", "grip.png", "grip.svg"} <= written
    with load_results(tmp_path) as stored:
        assert stored.summary["grip"] == [{"held_n_per_m": found.value("grip")}]
        assert float(stored.data["grip"]["held"]) == found.value("grip")
        assert "friction holds" in printed(print_found, stored.summary)
        assert json.loads(stored.data.attrs["joint"])["analysis"] == {"grip": {"share": 0.5}}
    assert f"friction holds {found.value('grip'):.6g} N/m" in printed(print_summary, found)
    assert "grip (1)" in found._repr_html_()


@pytest.mark.usefixtures("grip")
def test_a_toy_costs_what_it_says() -> None:
    without = {**JOINT, "analysis": {}}
    dearer = total_seconds(parse_joint(JOINT), 1000) - total_seconds(parse_joint(without), 1000)
    assert dearer == pytest.approx(1000)
    shown = printed(lambda table, console: console.print(table), derived(parse_joint(JOINT)))
    assert "0.5 of it" in shown
    (line,) = (line for line in shown.splitlines() if "estimated time" in line)
    assert int(line.split()[-5]) >= 1000


@pytest.mark.usefixtures("grip")
def test_a_wrong_section_of_a_toy_is_named() -> None:
    with pytest.raises(InputError, match=r"analysis\.grip\.share = 2: must be less than or equal"):
        parse_joint({**JOINT, "analysis": {"grip": {"share": 2}}})


@pytest.mark.usefixtures("grip")
def test_a_toy_that_is_not_asked_for_leaves_empty_rows(tmp_path: Path) -> None:
    found = run(parse_joint({**JOINT, "analysis": {}}))
    assert found.outcomes == {}
    written = write_results(found, tmp_path, formats=("png",))
    assert "grip.png" not in {path.name for path in written}
    assert json.loads((tmp_path / "summary.json").read_text())["grip"] == []


def test_nothing_is_left_of_a_toy() -> None:
    before = list(ANALYSES)
    register(GRIP)
    assert list(ANALYSES) == [*before, "grip"]
    unregister("grip")
    assert list(ANALYSES) == before
    with pytest.raises(InputError, match="grip"):
        parse_joint(JOINT)


@pytest.mark.parametrize(
    ("row", "part"),
    [
        (Analysis("cycle", Grip, run_grip), "one of this name already"),
        (Analysis("grip", Grip, run_grip, rows={"cycles": list}), "'cycles' among its rows"),
        (Analysis("grip", Grip, run_grip, figures={"response": list}), "'response' among its fig"),
        (Analysis("grip", Grip, run_grip, after=("wear",)), "comes after 'wear', which is not"),
    ],
)
def test_a_row_that_does_not_fit_is_refused(row: Analysis, part: str) -> None:
    before = dict(ANALYSES)
    with pytest.raises(MicroslipError, match=part):
        register(row)
    assert before == ANALYSES
    assert "grip" not in Requests.model_fields


def test_what_others_need_stays() -> None:
    with pytest.raises(MicroslipError, match="takes its outcome"):
        unregister("response")
    with pytest.raises(MicroslipError, match="none of this name"):
        unregister("grip")


# -- how a run treats what an analysis does ----------------------------------------------------


def run_with(analyse: Any, after: tuple[str, ...] = ("grip",)) -> Run:
    """A run in which a second toy comes after the first."""
    register(GRIP)
    register(Analysis("other", Grip, analyse, after=after, label="others"))
    try:
        return run(parse_joint({**JOINT, "analysis": {"grip": {}, "other": {}}}))
    finally:
        unregister("other")
        unregister("grip")


def test_an_analysis_gets_what_it_comes_after_and_nothing_else() -> None:
    seen = {}

    def look(assembly: Assembly, done: Mapping[str, Outcome[Any]], progress: Progress) -> None:
        seen.update(done)

    found = run_with(look)
    assert seen == {"grip": found.outcomes["grip"]}
    assert "other" not in found.outcomes
    seen.clear()
    run_with(look, after=())
    assert seen == {}


def test_an_error_is_a_failure_and_the_rest_is_kept() -> None:
    def fail(*_: object) -> Outcome[None]:
        raise MicroslipError("it does not hold")

    found = run_with(fail)
    assert found.failures == (Failure("other", "", "it does not hold"),)
    assert found.value("grip") > 0
    assert found.value("other") is None
    assert set(found.timings) == {"assemble", "grip", "others", "total"}


def test_a_mistake_in_the_input_ends_the_run() -> None:
    def refuse(*_: object) -> Outcome[None]:
        raise InputError("analysis.other: no")

    with pytest.raises(InputError, match=r"analysis\.other: no"):
        run_with(refuse)


def test_an_interruption_ends_the_run_and_keeps_what_there_is() -> None:
    def interrupt(*_: object) -> Outcome[None]:
        raise KeyboardInterrupt

    found = run_with(interrupt)
    assert found.interrupted
    assert found.value("grip") > 0
    assert found.failures == ()


def test_parts_of_an_analysis_are_timed_under_its_label() -> None:
    found = run_with(lambda *_: Outcome(1, timings={"first": 1.0, "second": 2.0}))
    assert found.timings["others_first"] == 1.0
    assert found.timings["others_second"] == 2.0
    parts = sum(value for name, value in found.timings.items() if name != "total")
    assert found.timings["total"] == pytest.approx(parts)


def test_two_analyses_cannot_share_a_group() -> None:
    row = Analysis("grip", Grip, run_grip, datasets=lambda run: {"model": xr.Dataset()})
    register(row)
    try:
        found = run(parse_joint(JOINT))
        with pytest.raises(MicroslipError, match="there is a group 'model' already"):
            dataset(found)
    finally:
        unregister("grip")


# -- the table ---------------------------------------------------------------------------------

FLOORS = {
    "section": "describe",
    "run": "pipeline",
    "request": "pipeline",
    "cost": "pipeline",
    "motions": "pipeline",
    "rows": "results",
    "datasets": "results",
    "table": "show",
    "figures": "show.plots",
}


@pytest.mark.parametrize("what", FLOORS)
@pytest.mark.parametrize("row", ANALYSES.values(), ids=lambda row: row.name)
def test_every_reference_is_there_and_on_its_floor(row: Analysis, what: str) -> None:
    found = getattr(row, what)
    references = found.values() if isinstance(found, Mapping) else [found]
    for reference in references:
        if reference is not None:
            assert reference.startswith(f"microslip.{FLOORS[what]}.")
            assert resolved(reference) is not None


def test_every_section_of_the_file_has_its_analysis() -> None:
    assert set(Requests.model_fields) == set(ANALYSES)


def test_analyses_come_after_what_they_take() -> None:
    names = list(ANALYSES)
    for row in ANALYSES.values():
        assert all(names.index(other) < names.index(row.name) for other in row.after)


def test_a_column_skips_what_an_analysis_does_not_have() -> None:
    assert [row.name for row, _ in column("table")] == [n for n in ANALYSES if n != "reduced"]
