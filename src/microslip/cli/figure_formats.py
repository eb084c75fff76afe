"""The options ``--format``, ``--renderer`` and ``--export`` of the commands that draw and write results."""

from __future__ import annotations

from typing import Annotated

import typer

from microslip.cli.options import listed
from microslip.show.exports import EXPORTS
from microslip.show.plots.solid import RENDERERS
from microslip.show.plots.style import FORMATS, USUAL_FORMATS

FigureFormats = Annotated[
    list[str],
    typer.Option("--format", metavar="LIST", help=f"Formats of figures, of {', '.join(FORMATS)}."),
]

USUAL = [",".join(USUAL_FORMATS)]
"""What the option is where it is left out."""

Renderer = Annotated[
    str,
    typer.Option(
        "--renderer",
        metavar="NAME",
        help="Who draws bodies in space: "
        + "; ".join(f"{name} ({what})" for name, what in RENDERERS.items())
        + ".",
    ),
]

Exports = Annotated[
    list[str] | None,
    typer.Option(
        "--export",
        metavar="LIST",
        help="Also write for other programs, of "
        + ", ".join(f"{name} ({what})" for name, what in EXPORTS.items())
        + ".",
    ),
]


def exports_of(lists: list[str] | None) -> tuple[str, ...]:
    """Formats for other programs that are asked for, in one list or in several.

    Raises
    ------
    InputError
        Where one is not known.
    """
    return listed("--export", lists, EXPORTS) if lists else ()
