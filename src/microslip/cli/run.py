"""The command ``microslip run``: everything a joint file asks for, into a folder."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from microslip.cli.folders import claimed, report
from microslip.cli.messages import messages, stop_interrupted
from microslip.cli.options import Force, JointFile, Quiet
from microslip.describe.lap import LapJoint
from microslip.describe.reading import load_joint
from microslip.pipeline.progress import Progress
from microslip.pipeline.run import run as run_joint
from microslip.show.progress import progress_on
from microslip.show.terminal import print_summary
from microslip.show.write import write_results

app = typer.Typer(add_completion=False)


@app.command()
def run(
    file: JointFile,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Output folder; FILE's name with -output."),
    ] = None,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Run all analyses that a joint file asks for, and write the results."""
    folder = out if out is not None else Path(f"{file.stem}-output")
    with messages():
        joint = load_joint(file)
        with (
            claimed(folder, force),
            progress_on(Console(stderr=True), quiet=quiet) as progress,
        ):
            interrupted, written = _compute(joint, folder, progress, quiet)
    report(folder, written, quiet)
    if interrupted:
        stop_interrupted(folder)


def _compute(
    joint: LapJoint, folder: Path, progress: Progress, quiet: bool
) -> tuple[bool, list[Path]]:
    """Run, write and summarise; whether it was interrupted, and the files written."""
    result = run_joint(joint, progress)
    progress.finish()
    written = write_results(result, folder, progress)
    progress.finish()
    if not quiet:
        print_summary(result, Console())
    return bool(result.interrupted), written
