"""The command ``microslip reproduce``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from rich.console import Console

    from microslip.reproduce.run import Reproduction


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
    force: Annotated[bool, typer.Option("--force", help="Replace what is already there.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress and no summary.")] = False,
) -> None:
    """Reproduce the paper, figure by figure, beside what it reports."""
    from rich.console import Console

    from microslip.cli.main import FAILED, INTERRUPTED, _claim, _messages, _withdraw
    from microslip.pipeline.progress import progress_on

    with _messages():
        from microslip.reproduce.registry import chosen
        from microslip.reproduce.run import reproduce as compute
        from microslip.reproduce.settings import FULL, QUICK

        names = chosen(figures or [])
        created = _claim(out, force)
        try:
            with progress_on(Console(stderr=True), quiet=quiet) as progress:
                result = compute(names, out, QUICK if quick else FULL, progress)
        finally:
            _withdraw(created)
    if not quiet:
        _summarise(result, Console())
        typer.echo(f"figures, reproduction.json, gallery.md and numbers.md are in {out}")
    if result.interrupted:
        typer.echo(f"interrupted: what was finished is in {out}", err=True)
        raise typer.Exit(INTERRUPTED)
    if len(result.report["figures"]) < len(names):
        raise typer.Exit(FAILED)


def _summarise(result: Reproduction, console: Console) -> None:
    """Numbers paper | here, trends that fail, failures and the time it took."""
    from rich.markup import escape
    from rich.table import Table

    from microslip.reproduce.gallery import value

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
