"""The command ``microslip reproduce``: the paper, figure by figure."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from microslip.cli.folders import claimed
from microslip.cli.messages import EXIT_CODES, messages, stop_interrupted, stop_unanswered
from microslip.cli.options import Force, Quiet
from microslip.reproduce import run, settings
from microslip.reproduce.gallery import value
from microslip.reproduce.registry import chosen
from microslip.show.progress import progress_on

app = typer.Typer(add_completion=False)


@app.command(epilog=EXIT_CODES.format(file=run.REPORT))
def reproduce(
    figures: Annotated[
        list[str] | None,
        typer.Argument(metavar="[FIGURE]...", help="fig3, fig5, ... timing, errata; or all."),
    ] = None,
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Output folder.")] = Path(
        "reproduction"
    ),
    quick: Annotated[
        bool, typer.Option("--quick", help="A coarser joint and fewer points.")
    ] = False,
    force: Force = False,
    quiet: Quiet = False,
) -> None:
    """Reproduce the paper, figure by figure, beside what it reports."""
    fineness = settings.QUICK if quick else settings.FULL
    with messages():
        names = chosen(figures or [])
        with (
            claimed(out, force),
            progress_on(Console(stderr=True), quiet=quiet) as progress,
        ):
            result = run.reproduce(names, out, fineness, progress)
    if not quiet:
        _summarise(result, Console())
        typer.echo(f"figures, reproduction.json, gallery.md and numbers.md are in {out}")
    if result.interrupted:
        stop_interrupted(out)
    stop_unanswered(result.report["failures"], out / run.REPORT)


def _summarise(result: run.Reproduction, console: Console) -> None:
    """Numbers paper | here, trends that fail, failures and the time it took."""
    report = result.report
    if report["numbers"]:
        table = Table("quantity", "paper", "here", box=None, pad_edge=True)
        for row in report["numbers"].values():
            unit = f" {row['unit']}" if row["unit"] else ""
            here = value(row["here"]) + (unit if row["here"] is not None else "")
            table.add_row(escape(row["quantity"]), value(row["paper"]) + unit, here)
        console.print(table)
    for row in report["trends"].values():
        mark = "[green]✓[/green]" if row["holds"] else "[bold red]✗[/bold red]"
        console.print(f"  {mark} {escape(row['statement'])}", highlight=False, soft_wrap=True)
    for failure in report["failures"]:
        console.print(f"  [red]not solved:[/red] {escape(failure)}", soft_wrap=True)
    console.print(f"  [dim]{report['timings']['total_s']:.0f} s[/dim]", highlight=False)
