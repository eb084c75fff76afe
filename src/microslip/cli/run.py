"""The command ``microslip run``: everything a joint file asks for, into a folder."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from microslip.cli.figure_formats import USUAL, Exports, FigureFormats, Renderer, exports_of
from microslip.cli.folders import claimed, report
from microslip.cli.messages import EXIT_CODES, messages, stop_interrupted, stop_unanswered, warn
from microslip.cli.options import Force, JointFile, Quiet, at_least_one, listed
from microslip.describe.reading import load_joint
from microslip.numerics.execute import limited
from microslip.pipeline.cost import check_size, degrees_of_freedom
from microslip.pipeline.estimate import input_doubts
from microslip.pipeline.judge import judge
from microslip.pipeline.run import run as run_joint
from microslip.results.files import SUMMARY
from microslip.results.store import STORE, Keeper, RunStore, finished
from microslip.results.summary import summary
from microslip.show.exports import export, not_exported
from microslip.show.plots.solid import drawn_by
from microslip.show.plots.style import FORMATS
from microslip.show.progress import progress_on
from microslip.show.terminal import print_found
from microslip.show.write import write_results

app = typer.Typer(add_completion=False)


@app.command(epilog=EXIT_CODES.format(file=SUMMARY))
def run(
    file: JointFile,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Output folder; FILE's name with -output."),
    ] = None,
    formats: FigureFormats = USUAL,
    renderer: Renderer = "auto",
    exports: Exports = None,
    threads: Annotated[
        int | None,
        typer.Option(
            "--threads",
            metavar="N",
            help="At most so many threads; one per core where left out, up to 8.",
        ),
    ] = None,
    as_json: Annotated[
        bool, typer.Option("--json", help="The summary as JSON on stdout, and nothing else there.")
    ] = False,
    force: Force = False,
    resume: Annotated[
        bool,
        typer.Option("--resume", help="Go on with an interrupted run of the same file in DIR."),
    ] = False,
    quiet: Quiet = False,
) -> None:
    """Run all analyses that a joint file asks for, and write the results."""
    folder = out if out is not None else Path(f"{file.stem}-output")
    with messages(), drawn_by(renderer):
        kinds = listed("--format", formats, FORMATS)
        others = exports_of(exports)
        most = at_least_one("--threads", threads)
        joint = load_joint(file)
        check_size(joint, degrees_of_freedom(joint))
        doubts = input_doubts(joint)
        warn(doubts)
        done = finished(folder, joint) if resume else {}
        with (
            claimed(folder, force or resume),
            progress_on(Console(stderr=True), quiet=quiet) as progress,
            limited(most),
        ):
            keep = Keeper(RunStore(folder / STORE), joint, begun=resume)
            result = run_joint(joint, progress, done=done, keep=keep)
            progress.finish()
            judged = judge(result)
            found = summary(result, judged)
            store = not keep.begun
            written = write_results(
                result, folder, progress, kinds, found=found, judged=judged, store=store
            )
            if others:
                written += export(result, folder, others)
            progress.finish()
    if as_json or quiet:
        said = set(map(str, doubts))
        warn(warning for warning in found["warnings"] if warning not in said)
    if as_json:
        typer.echo(json.dumps(found, indent=2, ensure_ascii=False, allow_nan=False))
    elif not quiet:
        print_found(found, Console())
    report(folder, written, quiet, aside=as_json)
    for line in not_exported(result, others):
        typer.echo(line, err=True)
    if found["interrupted"]:
        stop_interrupted(folder)
    stop_unanswered(found["failures"], folder / SUMMARY)
