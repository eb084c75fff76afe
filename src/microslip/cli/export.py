"""The command ``microslip export``: the joint model of a joint file, in a file of its own."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from microslip.analyses.prepared.saved import SUFFIX, save_model
from microslip.cli.messages import messages, warn
from microslip.cli.options import Force, JointFile
from microslip.describe.reading import load_joint
from microslip.errors import InputError
from microslip.pipeline.prepare import assemble_without_signals

app = typer.Typer(no_args_is_help=True, add_completion=False)


@app.command()
def export(
    file: JointFile,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", metavar="FILE.npz", help="File to write; beside the joint file when left out."
        ),
    ] = None,
    force: Force = False,
) -> None:
    """Write the joint model of a joint file, for Python and other programs."""
    with messages():
        target = file.with_suffix(SUFFIX) if out is None else out
        if target.suffix.lower() != SUFFIX:
            raise InputError(f"--out {target}: a joint model is a file {SUFFIX}")
        if target.exists() and not force:
            raise InputError(f"{target}: exists already; --force replaces it")
        joint = load_joint(file)
        if target.resolve() in {Path(name).resolve() for name in joint.files}:
            raise InputError(f"{target}: {file} reads this file; give another with --out")
        assembly = assemble_without_signals(joint)
        warn(assembly.doubts)
        save_model(assembly.prepared, target, per="whole" if joint.whole else "width")
    typer.echo(
        f"wrote {target}: {assembly.model.pairs} pairs, {len(assembly.model.omega)} modes\n"
        f'next: microslip.load_model("{target}") in Python, or a joint file with kind = "model": microslip '
        "new model writes one"
    )
