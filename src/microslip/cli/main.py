"""Command line: write a joint file, check it, run what it asks for.

A command is a module with a typer `app`, imported when the command is asked for and not before,
so that ``--help`` answers at once.
"""

from __future__ import annotations

from importlib import import_module
from typing import Annotated, Any

import typer
from typer.core import TyperGroup
from typer.main import get_command

from microslip.cli.messages import messages
from microslip.version import __version__

COMMANDS = {
    "reproduce": (
        "microslip.cli.reproduce",
        "Reproduce the paper, figure by figure, beside what it reports.",
    ),
    "check": (
        "microslip.cli.check",
        "Validate a joint file; show what follows from it and what a run will cost.",
    ),
    "run": (
        "microslip.cli.run",
        "Run all analyses that a joint file asks for, and write the results.",
    ),
    "show": (
        "microslip.cli.show",
        "Tables of an earlier run again, and its figures, from its folder.",
    ),
    "compare": (
        "microslip.cli.compare",
        "Results of several runs, side by side and over each other.",
    ),
    "export": (
        "microslip.cli.export",
        "Write the joint model of a joint file, for Python and other programs.",
    ),
    "new": ("microslip.cli.new", "Write a commented input file."),
}
"""Every command: the module it lives in, and the line ``microslip --help`` says of it."""


def load(name: str) -> Any:
    """Command of a name, its module imported."""
    module, _ = COMMANDS[name]
    with messages():
        return get_command(import_module(module).app)


class LazyCommands(TyperGroup):
    """Group that lists its commands from the table and imports the one that is to run."""

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Name, command and remaining words, as typer wants them."""
        name, listed, rest = super().resolve_command(ctx, args)
        return name, listed if name is None else load(name), rest


app = typer.Typer(
    cls=LazyCommands,
    help="Where a frictional joint slips, what it dissipates, and how it responds.",
    no_args_is_help=True,
    add_completion=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _listed() -> None:
    """Stand in for a command where commands are only listed."""


for _name, (_, _line) in COMMANDS.items():
    app.command(_name, help=_line)(_listed)


def main() -> None:
    """Run the command line."""
    app()


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"microslip {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_version, is_eager=True, help="Print the version."),
    ] = False,
) -> None:
    pass
