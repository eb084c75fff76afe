"""The option ``--format`` of the commands that draw figures."""

from __future__ import annotations

from typing import Annotated

import typer

from microslip.show.plots.style import FORMATS, USUAL_FORMATS

FigureFormats = Annotated[
    str,
    typer.Option("--format", metavar="LIST", help=f"Formats of figures, of {', '.join(FORMATS)}."),
]

USUAL = ",".join(USUAL_FORMATS)
"""What the option is where it is left out."""
