"""The command ``microslip show``: tables and figures of an earlier run again."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from microslip.cli.figure_formats import USUAL, Exports, FigureFormats, Renderer, exports_of
from microslip.cli.messages import messages
from microslip.cli.options import listed
from microslip.errors import InputError
from microslip.results.files import FIGURES, SUMMARY, load_results
from microslip.results.store import load_run
from microslip.show.exports import export, not_exported
from microslip.show.figures import figures_of, left_out, save_figures
from microslip.show.plots.solid import drawn_by
from microslip.show.plots.style import FORMATS
from microslip.show.progress import progress_on
from microslip.show.terminal import print_found

app = typer.Typer(add_completion=False)


@app.command()
def show(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder that a run wrote.")],
    figures: Annotated[
        bool, typer.Option("--figures", help="Draw the figures again, into DIR/figures.")
    ] = False,
    formats: FigureFormats = USUAL,
    renderer: Renderer = "auto",
    exports: Exports = None,
    open_it: Annotated[
        bool, typer.Option("--open", help="Open the overview with the viewer for pictures.")
    ] = False,
) -> None:
    """Tables of an earlier run again, and its figures, from its folder."""
    console = Console()
    with messages(), drawn_by(renderer):
        kinds = listed("--format", formats, FORMATS)
        others = exports_of(exports)
        with load_results(folder) as stored, console.capture() as tables:
            try:
                print_found(stored.summary, console)
            except (LookupError, TypeError, AttributeError, ValueError):
                raise InputError(
                    f"{folder / SUMMARY}: not a summary that this version can show; run again"
                ) from None
        typer.echo(tables.get(), nl=False)
        run = load_run(folder) if figures or others else None
        if figures and run is not None:
            with progress_on(Console(stderr=True), quiet=False) as progress:
                progress.start("figures", len(figures_of(run)))
                written = save_figures(run, folder / FIGURES, progress, kinds)
                progress.finish()
            typer.echo(f"{len(written)} figures are in {folder / FIGURES}")
            for name, reason in left_out(run).items():
                typer.echo(f"no {name}: {reason}")
        if others and run is not None:
            files = export(run, folder, others)
            typer.echo(f"{len(files)} files for other programs are in {folder}")
            for line in not_exported(run, others):
                typer.echo(line, err=True)
        if open_it:
            _open(folder / FIGURES)


def _open(folder: Path) -> None:
    """Open the overview in a folder of figures."""
    found = [path for kind in FORMATS if (path := folder / f"overview.{kind}").is_file()]
    if not found:
        raise InputError(f"{folder}: holds no overview; draw it with --figures")
    if typer.launch(str(found[0])) != 0:
        raise InputError(f"{found[0]}: no viewer opened it; open it by hand")
