"""The command line: what it writes, what it refuses, and what it never touches."""

from __future__ import annotations

import inspect
import os
import re
import shutil
import subprocess
import sys
from io import StringIO
from pathlib import Path

import command_line
import pytest
from command_line import EXAMPLE, assert_refused
from conftest import ROOT
from rich.console import Console
from wrong_inputs import MEASURED, RIGHT, WRONG, WRONG_SIGNALS, history

from microslip import __version__
from microslip.cli import main
from microslip.cli.main import COMMANDS, load
from microslip.describe.reading import load_joint
from microslip.errors import ContactError
from microslip.pipeline.progress import NullProgress
from microslip.show.progress import LineProgress, RichProgress, progress_on

command, stages = command_line.command, command_line.stages


# -- start -------------------------------------------------------------------------------------


def test_version(command):
    assert command("--version").stdout == f"microslip {__version__}\n"


def test_help_names_the_commands(command):
    text = command("--help").stdout
    assert all(name in text for name in ("new", "check", "run"))


def test_help_imports_nothing_heavy():
    heavy = ["pint", "pydantic", "numba", "skfem", "matplotlib", "xarray", "scipy", "numpy"]
    code = (
        "import sys; from typer.testing import CliRunner; from microslip.cli.main import app; "
        "assert CliRunner().invoke(app, ['--help']).exit_code == 0; "
        f"print([name for name in {heavy} if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_package_runs_as_a_command():
    done = subprocess.run(
        [sys.executable, "-m", "microslip", "--version"], capture_output=True, text=True, check=True
    )
    assert done.stdout == f"microslip {__version__}\n"


@pytest.mark.parametrize("name", COMMANDS)
def test_command_is_listed_with_the_first_line_of_its_own_help(command, name):
    _, line = COMMANDS[name]
    assert inspect.cleandoc(load(name).help) == line
    assert line in re.sub(r"[\s│]+", " ", command("--help").stdout)
    assert line in re.sub(r"[\s│]+", " ", command(name, "--help").stdout)


def test_only_the_command_that_runs_is_imported():
    code = (
        "import sys; from typer.testing import CliRunner; from microslip.cli.main import app; "
        "assert CliRunner().invoke(app, ['new', '--help']).exit_code == 0; "
        "print(sorted(n for n in sys.modules if n.startswith('microslip.cli.')))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    imported = {"main", "messages", "new", "options"}
    assert set(re.findall(r"microslip\.cli\.(\w+)", done.stdout)) == imported


def test_unknown_command_is_refused(command):
    result = command("chek")
    assert result.exit_code == 2
    assert "No such command 'chek'" in result.stderr


def test_interrupted_while_a_command_is_imported(command, monkeypatch):
    def interrupted(module):
        raise KeyboardInterrupt

    monkeypatch.setattr(main, "import_module", interrupted)
    result = command("run", "joint.toml")
    assert result.exit_code == 130
    assert result.stderr == "interrupted before it was finished\n"


# -- new ---------------------------------------------------------------------------------------


def test_new_writes_a_joint_that_loads(command, tmp_path):
    assert command("new", "lap", "mine.toml").exit_code == 0
    assert load_joint(tmp_path / "mine.toml") == load_joint(EXAMPLE)


def test_new_does_not_overwrite(command, tmp_path):
    (tmp_path / "mine.toml").write_text("precious")
    assert_refused(command("new", "lap", "mine.toml"), "mine.toml", "exists already", "--force")
    assert (tmp_path / "mine.toml").read_text() == "precious"
    assert command("new", "lap", "mine.toml", "--force").exit_code == 0
    assert "[beams]" in (tmp_path / "mine.toml").read_text()


@pytest.mark.parametrize("place", ["nowhere/mine.toml", "joint.toml/mine.toml"])
def test_new_in_a_place_that_cannot_be_written(command, place):
    assert_refused(command("new", "lap", place), place, "cannot be written")


def test_new_over_a_folder(command, tmp_path):
    (tmp_path / "folder").mkdir()
    assert_refused(command("new", "lap", "folder", "--force"), "folder")


# -- check -------------------------------------------------------------------------------------


def test_check_shows_what_follows(command):
    result = command("check", "joint.toml")
    assert result.exit_code == 0
    # E'h³/12 = 70e9/0.91 * 0.0125³/12; P/(2 L_p) = 1e6/0.05; L_o/L = 37.5/251.5
    for part in ("12.52 kN", "20 MPa", "0.1491", "201", "estimated time"):
        assert part in result.stdout


def test_check_draws_what_the_file_describes(command, tmp_path):
    result = command("check", "joint.toml", "--out", "pictures")
    assert result.exit_code == 0, result.output
    written = {path.name for path in (tmp_path / "pictures").iterdir()}
    assert written == {"structure.png", "interface_contact.png"}
    assert "are in pictures" in result.stdout


def test_check_draws_also_where_the_preload_does_not_press(command, tmp_path):
    """Normals the wrong way round: the pictures are there before the message."""
    shutil.copytree(ROOT / "examples" / "mesh_plates", tmp_path / "mesh_plates")
    text = (ROOT / "examples" / "mesh_plates.toml").read_text("utf-8")
    pulled = text.replace('force = "600 kN/m"', 'force = "600 kN/m"\ndirection = "z"')
    (tmp_path / "pulled.toml").write_text(pulled)
    result = command("check", "pulled.toml", "--out", "pictures")
    assert result.exit_code == 2
    assert "pulls the sides of the pairs apart" in result.stderr
    assert (tmp_path / "pictures" / "interface_contact.png").is_file()


def test_check_has_no_pictures_of_nodes_without_places(command, tmp_path):
    """Matrices of which nothing says where their nodes are."""
    shutil.copytree(ROOT / "examples" / "matrices_beam", tmp_path / "matrices_beam")
    text = (ROOT / "examples" / "matrices_beam.toml").read_text("utf-8")
    (tmp_path / "bare.toml").write_text(text.replace('nodes = "matrices_beam/nodes.csv"\n', ""))
    result = command("check", "bare.toml", "--out", "pictures")
    assert result.exit_code == 0, result.output
    assert "no pictures: the nodes of the matrices have no coordinates" in result.stdout
    assert not (tmp_path / "pictures").exists()


def test_a_title_is_shown_as_written(command, tmp_path):
    file = tmp_path / "joint.toml"
    file.write_text(file.read_text().replace("Reference lap joint", "Joint [/b] [red]"))
    assert "Joint [/b] [red]" in command("check", "joint.toml").stdout


def test_check_says_that_pairs_were_raised(command, tmp_path):
    file = tmp_path / "joint.toml"
    file.write_text(file.read_text().replace("pairs = 201", "pairs = 50"))
    assert "51  (raised from 50" in command("check", "joint.toml").stdout


def test_check_refuses_more_modes_than_the_mesh_has(command, tmp_path):
    file = tmp_path / "joint.toml"
    coarse = file.read_text().replace("pairs = 201", "pairs = 5")
    file.write_text(coarse + "\n[mesh]\nmodes = 2000\nmax_layer = 1\nrest_size = 10\n")
    assert_refused(command("check", "joint.toml"), "mesh.modes = 2000", "degrees of freedom")


def test_check_names_the_mistake(command, tmp_path):
    file = tmp_path / "joint.toml"
    file.write_text(file.read_text().replace("70 GPa", "70 GHz"))
    assert_refused(
        command("check", "joint.toml"), "joint.toml", "material.youngs_modulus", "70 GHz", "70 GPa"
    )


@pytest.mark.parametrize("wrong", WRONG[:: len(WRONG) // 12], ids=lambda wrong: wrong.name)
@pytest.mark.parametrize("name", ["check", "run"])
def test_wrong_files_end_with_2(command, stages, tmp_path, name, wrong):
    (tmp_path / "joint.toml").write_text(wrong.text(), encoding="utf-8")
    result = command(name, "joint.toml")
    assert_refused(result, "joint.toml: ", *wrong.says)
    assert result.stdout == ""
    assert stages.runs == 0


@pytest.mark.parametrize("wrong", WRONG_SIGNALS[::8], ids=lambda wrong: wrong.name)
def test_wrong_signals_end_with_2(command, tmp_path, wrong):
    (tmp_path / wrong.file).write_bytes(wrong.content)
    text = history(MEASURED, file=f'"{wrong.file}"')(RIGHT) + wrong.keys
    (tmp_path / "joint.toml").write_text(text, encoding="utf-8")
    assert_refused(command("check", "joint.toml"), "'measured'", *wrong.says)


def test_check_of_a_missing_file(command):
    assert_refused(command("check", "none.toml"), "none.toml: no such file")


HISTORY = """
[[analysis.history]]
signal = "measured"
name = "road"
file = "load.csv"
"""


def test_check_reads_the_signals(command, tmp_path):
    """So that a wrong file is found before the run."""
    file = tmp_path / "joint.toml"
    file.write_text(file.read_text() + HISTORY)
    assert_refused(command("check", "joint.toml"), "analysis.history[0].file", "no such file")
    signal = tmp_path / "load.csv"
    signal.write_text("time [s], moment [N*m/m]\n0, 0\n0.5, 1\n0.6, 0\n9, 0\n")
    gap = "line 5: a gap of 8.4 s after 0.6 s"
    assert_refused(command("check", "joint.toml"), "'road'", "load.csv", gap)
    signal.write_text("time [s], moment [N*m/m]\n0, 0\n0.5, 1\n1, 0\n")
    result = command("check", "joint.toml")
    assert result.exit_code == 0
    assert "history 'road'" in result.stdout
    assert re.search(r"about \d+ steps of [\d.]+ µs", result.stdout)


def test_check_refuses_a_signal_without_end(command, tmp_path):
    file = tmp_path / "joint.toml"
    decay = 'signal = "free_decay"\nstart = "mode"\nmodal_amplitude = 1e-3\nduration = "1 year"\n'
    file.write_text(file.read_text() + "[[analysis.history]]\n" + decay)
    assert_refused(command("check", "joint.toml"), "'free_decay'", "at most 5,000,000 are possible")


def test_check_counts_the_steady_states(command, tmp_path):
    file = tmp_path / "joint.toml"
    file.write_text(file.read_text() + '[analysis.time]\nfrequencies = ["170 Hz", "175 Hz"]\n')
    shown = " ".join(command("check", "joint.toml").stdout.split())
    assert "steady states in time 2 frequencies, 170 to 175 Hz, 150 steps per cycle" in shown


def test_check_asks_about_what_is_not_usual_and_judges_the_load(command, tmp_path):
    file = tmp_path / "joint.toml"
    text = file.read_text().replace("2000 kg/m^3", "2 kg/m^3")
    file.write_text(text.replace('["10 N*m/m", "20 N*m/m", "50 N*m/m"]', '"20 kN*m/m"'))
    result = command("check", "joint.toml")
    assert result.exit_code == 0
    density, stress, bent = result.stderr.splitlines()
    assert density.startswith("warning: input, material.density = 2 kg/m^3: usual is 50 kg/m^3 to")
    assert "linear elasticity is left: bending stress 768 MPa" in stress
    assert "small rotations are left" in bent
    shown = " ".join(result.stdout.split())
    assert "bending stress at rest, 6 M/h² 768 MPa" in shown  # 6 20e3/0.0125²


def test_check_judges_by_the_yield_stress(command, tmp_path):
    file = tmp_path / "joint.toml"
    file.write_text(file.read_text().replace("[contact]", 'yield_stress = "80 MPa"\n[contact]'))
    assert "20 MPa, 25% of yield" in command("check", "joint.toml").stdout


@pytest.mark.parametrize("name", ["check", "run"])
def test_more_pairs_than_there_is_memory_for(command, stages, tmp_path, monkeypatch, name):
    monkeypatch.setattr("microslip.pipeline.cost.memory_of_machine", lambda: 8e9)
    file = tmp_path / "joint.toml"
    file.write_text(file.read_text().replace("pairs = 201", "pairs = 5001"))
    assert_refused(command(name, "joint.toml"), "contact.pairs = 5001", "GB", "8 GB", "201")
    assert stages.runs == 0


# -- run ---------------------------------------------------------------------------------------


def test_run_writes_beside_where_it_was_called(command, stages, tmp_path):
    result = command("run", "joint.toml")
    assert result.exit_code == 0, result.output
    assert (tmp_path / "joint-output" / "summary.json").is_file()
    assert "the summary" in result.stdout
    assert "results are in joint-output" in result.stdout
    assert re.fullmatch(
        r"cycles \.\.\. 0 of 2\ncycles \.\.\. 2 of 2, done in [\d.]+ s\n", result.stderr
    )


def test_quiet_run_says_nothing(command, stages):
    assert command("run", "joint.toml", "--quiet").output == ""


@pytest.mark.parametrize("words", [[], ["--quiet"], ["--json"]])
def test_run_warns_before_it_begins_and_of_its_answers(command, stages, tmp_path, words):
    file = tmp_path / "joint.toml"
    file.write_text(file.read_text().replace("2000 kg/m^3", "2 kg/m^3"))
    stages.warnings = ["response: linear elasticity is left"]
    result = command("run", "joint.toml", *words)
    assert result.exit_code == 0
    first = result.stderr.splitlines()[0]
    assert first.startswith("warning: input, material.density = 2 kg/m^3")
    # the tables show them; where there are none, stderr does
    assert ("warning: response: linear elasticity is left" in result.stderr) == bool(words)


def test_out_of_memory_is_a_message(command, stages):
    stages.failure = MemoryError()
    result = command("run", "joint.toml")
    assert result.exit_code == 1
    assert result.stderr.endswith(
        "error: out of memory: take fewer contact pairs, or fewer loads\n"
    )


def test_run_into_a_new_nested_folder(command, stages, tmp_path):
    assert command("run", "joint.toml", "--out", "a/b").exit_code == 0
    assert (tmp_path / "a" / "b" / "summary.json").is_file()


def test_run_into_an_empty_folder(command, stages, tmp_path):
    (tmp_path / "out").mkdir()
    assert command("run", "joint.toml", "--out", "out").exit_code == 0


def test_existing_output_is_not_touched(command, stages, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "summary.json").write_text("precious")
    assert_refused(command("run", "joint.toml", "--out", "out"), "out", "--force")
    assert stages.runs == 0
    assert [p.name for p in (tmp_path / "out").iterdir()] == ["summary.json"]
    assert (tmp_path / "out" / "summary.json").read_text() == "precious"


def test_force_replaces_results_and_nothing_else(command, stages, tmp_path):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "summary.json").write_text("old")
    (tmp_path / "out" / "notes.txt").write_text("precious")
    result = command("run", "joint.toml", "--out", "out", "--force")
    assert result.exit_code == 0
    assert (tmp_path / "out" / "summary.json").read_text() == "{}"
    assert (tmp_path / "out" / "notes.txt").read_text() == "precious"
    assert "left as they were: notes.txt" in result.stderr


@pytest.mark.parametrize("place", ["joint.toml", "joint.toml/out", "joint.toml/a/b"])
@pytest.mark.parametrize("force", [[], ["--force"]])
def test_output_that_is_or_lies_in_a_file(command, stages, place, force):
    assert_refused(command("run", "joint.toml", "--out", place, *force), place)
    assert stages.runs == 0


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write anywhere")
def test_unwritable_output(command, stages, tmp_path):
    (tmp_path / "locked").mkdir(mode=0o500)
    for place in ("locked", "locked/out"):
        assert_refused(command("run", "joint.toml", "--out", place), "cannot be written to")
    assert stages.runs == 0


def test_denied_output(command, stages, monkeypatch):
    def denied(self, *args, **kwargs):
        raise PermissionError(13, "Permission denied", str(self))

    monkeypatch.setattr(Path, "mkdir", denied)
    assert_refused(command("run", "joint.toml"), "joint-output", "Permission denied")
    assert stages.runs == 0


def test_bad_joint_creates_no_output(command, stages, tmp_path):
    (tmp_path / "joint.toml").write_text("[beams]\n")
    assert_refused(command("run", "joint.toml"), "beams.length is missing")
    assert [p.name for p in tmp_path.iterdir()] == ["joint.toml"]


def test_failed_run_leaves_no_empty_folder(command, stages, tmp_path):
    stages.failure = ContactError("contact not solved")
    result = command("run", "joint.toml", "--out", "a/b")
    assert result.exit_code == 1
    assert result.stderr.endswith("\nerror: contact not solved\n")
    assert [p.name for p in tmp_path.iterdir()] == ["joint.toml"]


def test_interrupted_run_keeps_what_is_done(command, stages, tmp_path):
    stages.interrupted = True
    result = command("run", "joint.toml")
    assert result.exit_code == 130
    assert (tmp_path / "joint-output" / "summary.json").is_file()
    assert "interrupted: what was finished is in joint-output" in result.stderr


def test_run_interrupted_before_anything_was_done(command, stages, tmp_path):
    stages.failure = KeyboardInterrupt()
    result = command("run", "joint.toml")
    assert result.exit_code == 130
    assert "interrupted" in result.stderr
    assert [p.name for p in tmp_path.iterdir()] == ["joint.toml"]


def test_bars_follow_the_work():
    screen = StringIO()
    terminal = Console(file=screen, force_terminal=True, width=80)
    with progress_on(terminal) as progress:
        assert isinstance(progress, RichProgress)
        progress.advance()
        progress.start("first", 3)
        progress.advance(2)
        progress.start("second", 1)
        progress.finish()
        progress.finish()
    assert "first" in screen.getvalue()
    assert "3/3" in screen.getvalue()
    assert isinstance(progress_on(terminal, quiet=True), NullProgress)
    assert isinstance(progress_on(Console(file=StringIO())), LineProgress)
