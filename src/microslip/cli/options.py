"""Arguments and options that more than one command takes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

JointFile = Annotated[Path, typer.Argument(metavar="FILE", help="Joint file (TOML).")]
Force = Annotated[bool, typer.Option("--force", help="Replace what is already there.")]
Quiet = Annotated[bool, typer.Option("--quiet", help="No progress and no summary.")]
