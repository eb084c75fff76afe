"""The command ``microslip show``: tables of an earlier run again."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from microslip.cli.messages import messages
from microslip.errors import InputError
from microslip.results.files import SUMMARY, load_results
from microslip.show.terminal import print_found

app = typer.Typer(add_completion=False)


@app.command(epilog="Figures are not drawn again: those of the run are in DIR/figures.")
def show(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder that a run wrote.")],
) -> None:
    """Show the tables of an earlier run again, from its folder."""
    console = Console()
    with messages():
        with load_results(folder) as stored, console.capture() as tables:
            try:
                print_found(stored.summary, console)
            except (LookupError, TypeError, AttributeError, ValueError):
                raise InputError(
                    f"{folder / SUMMARY}: not a summary that this version can show; run again"
                ) from None
        typer.echo(tables.get(), nl=False)
