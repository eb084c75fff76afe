"""The commands ``microslip new``: input files to start from."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from microslip.cli.messages import messages
from microslip.cli.options import Force
from microslip.describe.template import template
from microslip.errors import InputError

app = typer.Typer(no_args_is_help=True, add_completion=False)


@app.callback()
def new() -> None:
    """Write a commented input file."""


@app.command()
def lap(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="File to write.")],
    force: Force = False,
) -> None:
    """Write a commented joint file: two overlapping beams under a clamp."""
    with messages():
        write_new(file, template("lap"), force)
    typer.echo(f"wrote {file}\nnext: microslip check {file}")


@app.command()
def matrices(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="File to write.")],
    force: Force = False,
) -> None:
    """Write a commented joint file: stiffness and mass matrix of another program."""
    with messages():
        write_new(file, template("matrices"), force)
    typer.echo(f"wrote {file}\nnext: name your files in it, then microslip check {file}")


@app.command()
def mesh(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="File to write.")],
    force: Force = False,
) -> None:
    """Write a commented joint file: a finite-element mesh and what its names are."""
    with messages():
        write_new(file, template("mesh"), force)
    typer.echo(f"wrote {file}\nnext: name your mesh in it, then microslip check {file}")


@app.command()
def model(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="File to write.")],
    force: Force = False,
) -> None:
    """Write a commented joint file: a joint model that microslip export has saved."""
    with messages():
        write_new(file, template("model"), force)
    typer.echo(f"wrote {file}\nnext: name your model in it, then microslip check {file}")


def write_new(file: Path, text: str, force: bool) -> None:
    """Write a file that is not there yet, or is to be replaced.

    Raises
    ------
    InputError
        Where it exists already (unless `force`), or cannot be written.
    """
    try:
        with open(file, "w" if force else "x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError:
        raise InputError(f"{file}: exists already; --force replaces it") from None
    except OSError as error:
        raise InputError(f"{file}: cannot be written: {error.strerror}") from None
