"""What the README tells a reader to type does what it says."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys

import pytest
from conftest import ROOT
from typer.testing import CliRunner

from microslip.cli.main import app

README = (ROOT / "README.md").read_text("utf-8")
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
QUIET = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "NO_COLOR": "1"}


def typed(text: str) -> list[str]:
    """Indented lines that call microslip, without what is said beside them."""
    found = re.findall(r"^    (microslip .*)$", text, re.MULTILINE)
    return [re.split(r"\s{2,}#", line)[0].strip() for line in found]


def microslip(words: list[str], place) -> subprocess.CompletedProcess[str]:
    """The command line, in a folder."""
    return subprocess.run(
        [sys.executable, "-m", "microslip", *words],
        cwd=place,
        env=QUIET,
        capture_output=True,
        text=True,
    )


@pytest.mark.parametrize("block", re.findall(r"```python\n(.*?)```", README, re.DOTALL))
def test_python_of_the_readme_runs(block):
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", block],
        cwd=ROOT,
        env=QUIET,
        capture_output=True,
        text=True,
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert re.search(r"J/m per cycle, slips up to .* µm\n", done.stdout)
    assert len(re.findall(r"Hz, .* %", done.stdout)) > 5


def test_commands_of_the_readme_run_in_their_order(tmp_path):
    """The joint file is made coarse between them, and the paper is left to its own tests."""
    lines = [line for line in typed(README) if not line.startswith("microslip reproduce")]
    assert [line.split()[1] for line in lines] == ["new", "check", "run", "show"]
    for line in lines:
        done = microslip(shlex.split(line)[1:], tmp_path)
        assert done.returncode == 0, f"{line}: {done.stderr}"
        if line.startswith("microslip new"):
            coarsen(tmp_path / "my.toml")


def coarsen(file):
    """A joint file that is run in seconds: few pairs, few amplitudes, one load and one check of it."""
    text = file.read_text("utf-8")
    few = {"pairs": 31, "count": 12, "steps": 60, "amplitudes": 12, "checks": 1}
    for key, small in few.items():
        text = re.sub(rf"^({key}\s*)=\s*\d+", rf"\1= {small}", text, flags=re.MULTILINE)
    text = re.sub(r'^(moment\s*)=\s*\[".*?"\]', r'\1= ["20 N*m/m"]', text, flags=re.MULTILINE)
    assert 'moment = ["20 N*m/m"]' in text
    file.write_text(text, "utf-8")


COMMANDS = sorted({(page.name, line) for page in PAGES for line in typed(page.read_text("utf-8"))})


@pytest.mark.parametrize(("page", "line"), COMMANDS)
def test_a_command_on_a_page_can_be_typed(page, line):
    """Options are known, and files of the repository are there."""
    words = shlex.split(line)[1:]
    done = CliRunner().invoke(app, [*words, "--help"])
    assert done.exit_code == 0, done.output
    for word in words:
        if word.startswith(("examples/", "docs/")):
            assert (ROOT / word).exists()


def test_targets_of_make_are_there():
    makefile = (ROOT / "Makefile").read_text("utf-8")
    texts = [page.read_text("utf-8") for page in [*PAGES, ROOT / "CONTRIBUTING.md"]]
    named = {name for text in texts for name in re.findall(r"\bmake ([a-z][a-z-]+)\b", text)}
    targets = set(re.findall(r"^([a-z][a-z-]*):", makefile, re.MULTILINE))
    said = {name for text in texts for name in re.findall(r"`make ([a-z-]+)`", text)}
    assert said <= targets
    assert {"demo", "test"} <= named


def test_one_version_everywhere():
    version = re.search(r'^version = "(.*)"', (ROOT / "pyproject.toml").read_text("utf-8"), re.M)[1]
    citation = (ROOT / "CITATION.cff").read_text("utf-8")
    changes = (ROOT / "CHANGELOG.md").read_text("utf-8")
    newest, day = re.search(r"^## \[(\d.*?)\] - (\S+)", changes, re.M).groups()
    assert (version, day) == (newest, re.search(r'date-released: "(.*)"', citation)[1])
    assert re.search(r"^version: (.*)$", citation, re.M)[1] == version
