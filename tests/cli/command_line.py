"""A command in a folder of its own, and a computation that only says that it was called.

Test modules take the fixtures by name: a second `conftest` would stand before the one of all tests.
"""

from __future__ import annotations

from types import SimpleNamespace

import pytest
from conftest import ROOT
from typer.testing import CliRunner

from microslip.cli.main import app
from microslip.numerics.execute import workers

EXAMPLE = ROOT / "examples" / "lap_joint.toml"


@pytest.fixture
def command(tmp_path, monkeypatch):
    """Run a command in an empty folder that holds nothing but the example as joint.toml."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "joint.toml").write_text(EXAMPLE.read_text())
    return lambda *words: CliRunner().invoke(app, [str(word) for word in words])


class Stages:
    """Stands in for the computation: a run is what the command line makes of its stages."""

    def __init__(self) -> None:
        self.runs = 0
        self.interrupted = False
        self.failures: list[str] = []
        self.warnings: list[str] = []
        self.formats: tuple[str, ...] = ()
        self.workers = 0
        self.failure: BaseException | None = None

    def run_joint(self, joint, progress, **kept):
        self.runs += 1
        progress.start("cycles", 2)
        progress.advance()
        progress.advance()
        progress.finish()
        if self.failure is not None:
            raise self.failure
        self.workers = workers()
        return SimpleNamespace()

    def judge(self, result):
        return SimpleNamespace()

    def summary(self, result, judged):
        return {
            "interrupted": self.interrupted,
            "failures": self.failures,
            "warnings": self.warnings,
        }

    def write_results(self, result, out_dir, progress, formats, **kept):
        self.formats = formats
        file = out_dir / "summary.json"
        file.write_text("{}")
        return [file]

    def print_found(self, found, console):
        console.print("the summary")


@pytest.fixture
def stages(monkeypatch):
    stages = Stages()
    for name in ("run_joint", "judge", "write_results", "summary", "print_found"):
        monkeypatch.setattr(f"microslip.cli.run.{name}", getattr(stages, name))
    return stages


def assert_refused(result, *parts):
    assert result.exit_code == 2
    assert result.stderr.startswith("error: ")
    assert "Traceback" not in result.output
    for part in parts:
        assert part in result.stderr
