"""The command ``microslip compare``: results of several runs, over each other and side by side."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from microslip.cli.figure_formats import USUAL, FigureFormats
from microslip.cli.folders import claimed, report
from microslip.cli.messages import messages
from microslip.cli.options import Force, listed
from microslip.errors import InputError
from microslip.results.comparison import Named, names_of
from microslip.results.store import load_run
from microslip.show.comparison import print_comparison
from microslip.show.plots.comparison import MOST_RUNS, comparison_figures
from microslip.show.plots.style import FORMATS, save

app = typer.Typer(add_completion=False)


@app.command()
def compare(
    folders: Annotated[
        list[Path], typer.Argument(metavar="DIR DIR...", help="Folders that runs wrote.")
    ],
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Draw figures of them all, into this folder."),
    ] = None,
    formats: FigureFormats = USUAL,
    force: Force = False,
) -> None:
    """Results of several runs, side by side and over each other."""
    with messages():
        kinds = listed("--format", formats, FORMATS)
        runs = _runs(folders)
        print_comparison(runs, Console())
        if out is None:
            typer.echo("figures of them: --out DIR")
            return
        figures = comparison_figures(runs)
        if not figures:
            raise InputError(
                f"{out}: nothing to draw: no two of the runs have responses of one output, cycles, "
                "or backbones of one mode"
            )
        with claimed(out, force):
            written = [
                path for name, figure in figures.items() for path in save(figure, out, name, kinds)
            ]
        report(out, written, quiet=False)


def _runs(folders: list[Path]) -> list[Named]:
    """The runs in some folders, with a name for each.

    Raises
    ------
    InputError
        Where there are fewer than two or too many, one is given twice, or holds no run.
    """
    if not 2 <= len(folders) <= MOST_RUNS:
        raise InputError(f"compare takes 2 to {MOST_RUNS} folders of runs; found {len(folders)}")
    names = names_of(folders)
    return [Named(name, load_run(folder)) for name, folder in zip(names, folders, strict=True)]
