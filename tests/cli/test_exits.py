"""What the command line ends with: exit codes, the summary for programs, tables again."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys

import command_line
import pytest
from command_line import EXAMPLE, assert_refused
from conftest import description
from rich.console import Console
from typer.testing import CliRunner

from microslip.cli.main import COMMANDS, app
from microslip.describe.reading import parse_joint
from microslip.errors import Failure
from microslip.numerics.execute import workers
from microslip.pipeline.judge import judge
from microslip.pipeline.run import Run
from microslip.pipeline.run import run as run_joint
from microslip.results.files import SUMMARY
from microslip.show.terminal import print_summary
from microslip.show.write import write_results

SMALL = description(
    21, 20, analysis={"cycle": {"moment_over_clamp_force_length": [1e-3, 1e-2], "steps": 40}}
)


command, stages = command_line.command, command_line.stages


@pytest.fixture(scope="module")
def small() -> Run:
    return run_joint(parse_joint(SMALL))


@pytest.fixture
def stored(command, small, tmp_path):
    """A folder with the results of a small joint."""
    write_results(small, tmp_path / "small-output", formats=())
    return tmp_path / "small-output"


# -- exit codes --------------------------------------------------------------------------------

FAILURES = [str(Failure("cycle", "M = 3", "it slides\naway")), "b: no", "c: no"]


@pytest.mark.parametrize("quiet", [[], ["--quiet"]])
@pytest.mark.parametrize(("count", "start"), [(1, "1 thing asked for has"), (3, "3 things asked")])
def test_what_has_no_answer_is_said_and_ends_with_3(command, stages, quiet, count, start):
    stages.failures = FAILURES[:count]
    result = command("run", "joint.toml", *quiet)
    assert result.exit_code == 3
    last = result.stderr.splitlines()[-1]
    assert last.startswith(start)
    assert last.endswith(
        "see failures in joint-output/summary.json: first: cycle, M = 3: it slides away"
    )
    if quiet:
        assert result.stderr == last + "\n"
        assert result.stdout == ""


def test_an_interruption_says_more_than_what_has_no_answer(command, stages):
    stages.failures, stages.interrupted = FAILURES, True
    assert command("run", "joint.toml").exit_code == 130


@pytest.mark.parametrize("name", ["run", "reproduce"])
def test_help_lists_the_exit_codes(command, name):
    said = " ".join(command(name, "--help").stdout.split())
    assert "Exit codes: 0 " in said
    for code in ("1 the", "2 something", "3 something", "130 interrupted"):
        assert f"; {code}" in said


@pytest.mark.parametrize("words", [(), *((name,) for name in COMMANDS), ("new", "lap")])
def test_h_is_help(command, words):
    short, long = command(*words, "-h"), command(*words, "--help")
    assert short.exit_code == 0
    assert short.stdout == long.stdout


def test_the_shell_completes_commands_and_options(command):
    def completed(words: str) -> set[str]:
        done = subprocess.run(
            [
                sys.executable,
                "-c",
                "from microslip.cli.main import app; app(prog_name='microslip')",
            ],
            env={**os.environ, "_MICROSLIP_COMPLETE": "complete_bash"}
            | {"COMP_WORDS": words, "COMP_CWORD": str(len(words.split(" ")) - 1)},
            capture_output=True,
            text=True,
            check=True,
        )
        return set(done.stdout.split())

    assert completed("microslip r") == {"run", "reproduce"}
    assert completed("microslip run --th") == {"--threads"}


# -- for programs ------------------------------------------------------------------------------


@pytest.mark.parametrize("quiet", [[], ["--quiet"]])
def test_json_is_all_there_is_on_stdout(command, stages, quiet):
    stages.failures = ["µ: no"]
    result = command("run", "joint.toml", "--json", *quiet)
    assert result.exit_code == 3
    assert json.loads(result.stdout) == {
        "interrupted": False,
        "failures": ["µ: no"],
        "warnings": [],
    }
    assert ("results are in joint-output" in result.stderr) == (not quiet)


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """A folder with a small joint and the results of `microslip run` of it, what that said, and how
    often the run was judged."""
    place, judged = tmp_path_factory.mktemp("ran"), []
    text = EXAMPLE.read_text().replace("pairs = 201", "pairs = 21").split("[load]")[0]
    text += "[analysis.cycle]\nmoment_over_clamp_force_length = [0.001, 0.01]\nsteps = 40\n"
    (place / "joint.toml").write_text(text)
    words = ["--json", "--threads", "1", "--format", "pdf", "--out", str(place / "joint-output")]
    with pytest.MonkeyPatch.context() as patch:
        for called in ("cli.run", "results.summary", "show.write", "show.plots.overview"):
            patch.setattr(f"microslip.{called}.judge", lambda run: judged.append(run) or judge(run))
        result = CliRunner().invoke(app, ["run", str(place / "joint.toml"), *words])
    return place, result, len(judged)


def test_json_is_the_summary_that_is_stored_of_a_run_judged_once(ran):
    place, result, judged = ran
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout) == json.loads((place / "joint-output" / SUMMARY).read_text())
    assert judged == 1
    pictures = list((place / "joint-output" / "figures").iterdir())
    assert pictures
    assert all(p.read_bytes().startswith(b"%PDF-") for p in pictures)


# -- options -----------------------------------------------------------------------------------


def test_threads_are_limited_while_the_run_lasts(command, stages):
    before = workers()
    assert command("run", "joint.toml", "--threads", "1").exit_code == 0
    assert stages.workers == 1
    assert workers() == before
    assert command("run", "joint.toml", "--force").exit_code == 0
    assert stages.workers == before


@pytest.mark.parametrize("number", ["0", "-2"])
def test_fewer_threads_than_one(command, stages, number):
    assert_refused(command("run", "joint.toml", "--threads", number), f"--threads {number}", "1 or")
    assert stages.runs == 0


@pytest.mark.parametrize(
    ("words", "formats"),
    [
        ([], ("png", "svg")),
        (["--format", "svg,png,pdf"], ("svg", "png", "pdf")),
        (["--format", " PDF "], ("pdf",)),
    ],
)
def test_formats_of_figures(command, stages, words, formats):
    assert command("run", "joint.toml", *words).exit_code == 0
    assert stages.formats == formats


@pytest.mark.parametrize("words", ["jpg", "", "png;svg", "png,"])
def test_formats_that_there_are_not(command, stages, words):
    result = command("run", "joint.toml", "--format", words)
    assert_refused(result, f"--format {words!r}", "png, svg, pdf")
    assert stages.runs == 0


# -- show --------------------------------------------------------------------------------------


def test_show_prints_what_the_run_printed(command, small, stored):
    console = Console(width=80)
    with console.capture() as printed:
        print_summary(small, console)
    result = command("show", stored)
    assert result.exit_code == 0, result.output
    assert result.stdout == printed.get()
    assert "greatest damping" in result.stdout
    assert result.stderr == ""


def test_show_of_a_folder_that_is_none(command, tmp_path):
    (tmp_path / "empty").mkdir()
    (tmp_path / "joint.toml").write_text("")
    for name in ("empty", "joint.toml"):
        assert_refused(command("show", name), name, "summary.json is missing")
    assert_refused(command("show", "none"), "none", "no such folder")


@pytest.mark.parametrize(
    "text", ["", "[]", "3", "{}", '{"title": 3}', "\udcff", '{"title": null, "model": {}}']
)
def test_show_of_a_summary_that_is_none(command, stored, text):
    (stored / SUMMARY).write_bytes(text.encode(errors="surrogateescape"))
    result = command("show", stored)
    assert_refused(result, "summary.json")
    assert result.stdout == ""


def test_show_of_damaged_data(command, stored):
    (stored / "results.nc").write_bytes(b"not netCDF")
    assert_refused(command("show", stored), "results.nc: cannot be read")


def test_show_draws_the_figures_again(command, stored):
    """Those of the run, from what is in its folder alone."""
    result = command("show", stored, "--figures", "--format", "png")
    assert result.exit_code == 0, result.output
    drawn = [path.stem for path in (stored / "figures").iterdir()]
    assert {"overview", "model", "prestress", "hysteresis"} <= set(drawn)


def test_show_writes_files_for_other_programs(command, stored):
    """Into the folder of the run, beside what is there."""
    result = command("show", stored, "--export", "vtk,uff")
    assert result.exit_code == 0, result.output
    assert (stored / "vtk" / "prestress.vtu").is_file()
    assert "for other programs are in" in result.stdout
    assert_refused(command("show", stored, "--export", "stl"), "--export 'stl'", "vtk, uff")


def test_lists_of_an_option_given_twice_add_up(command, stored, tmp_path):
    """As with commas between; the last alone would leave the first out in silence."""
    for folder in ("vtk", "figures"):
        shutil.rmtree(stored / folder, ignore_errors=True)
    result = command("show", stored, "--export", "vtk", "--export", "uff")
    assert result.exit_code == 0, result.output
    assert (stored / "vtk" / "prestress.vtu").is_file()
    result = command("show", stored, "--figures", "--format", "png", "--format", "svg")
    assert result.exit_code == 0, result.output
    assert {path.suffix for path in (stored / "figures").iterdir()} == {".png", ".svg"}


def test_show_opens_the_overview(command, stored, monkeypatch):
    opened = []
    overview = stored / "figures" / "overview.svg"
    overview.parent.mkdir(exist_ok=True)
    overview.write_text("<svg/>")
    monkeypatch.setattr("typer.launch", lambda path: opened.append(path) or 0)
    assert command("show", stored, "--open").exit_code == 0
    assert opened == [str(overview)]
    monkeypatch.setattr("typer.launch", lambda path: 1)
    assert_refused(command("show", stored, "--open"), "no viewer opened it")
    overview.unlink()
    assert_refused(command("show", stored, "--open"), "holds no overview", "--figures")


def test_show_of_a_run_that_was_not_stored(command, stored):
    (stored / "run.h5").unlink()
    assert command("show", stored).exit_code == 0
    assert_refused(command("show", stored, "--figures"), "run.h5 is missing")


# -- resume ------------------------------------------------------------------------------------


def test_resume_takes_what_is_there(command, ran, tmp_path):
    """Nothing is computed twice, and the summary is the same but for its times."""
    shutil.copytree(ran[0], tmp_path, dirs_exist_ok=True)
    first = json.loads((tmp_path / "joint-output" / SUMMARY).read_text())
    result = command("run", "joint.toml", "--resume", "--format", "png")
    assert result.exit_code == 0, result.output
    assert "quasi-static cycles" not in result.stderr
    again = json.loads((tmp_path / "joint-output" / SUMMARY).read_text())
    assert again["cycles"] == first["cycles"]
    text = (tmp_path / "joint.toml").read_text()
    (tmp_path / "joint.toml").write_text(text.replace("friction = 0.25", "friction = 0.3"))
    assert_refused(
        command("run", "joint.toml", "--resume"), "another joint file", "contact.friction = 0.25"
    )


def test_resume_of_nothing(command):
    assert_refused(command("run", "joint.toml", "--resume"), "run.h5 is missing")
