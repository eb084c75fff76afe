"""Errors as one message and an exit code.

A mistake of the user ends with one message on stderr and exit code 2; a computation that fails
with 1; an interrupted one with 130.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import typer

from microslip.errors import InputError, MicroslipError

USER_ERROR, FAILED, INTERRUPTED = 2, 1, 130


@contextmanager
def messages() -> Iterator[None]:
    """Turn errors into one message and an exit code."""
    try:
        yield
    except MicroslipError as error:
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(USER_ERROR if isinstance(error, InputError) else FAILED) from None
    except OSError as error:
        typer.echo(f"error: {error.filename or 'file'}: {error.strerror or error}", err=True)
        raise typer.Exit(FAILED) from None
    except KeyboardInterrupt:
        typer.echo("interrupted before it was finished", err=True)
        raise typer.Exit(INTERRUPTED) from None


def stop_interrupted(folder: object) -> None:
    """Say that a run was interrupted and where what it finished is; leave with its exit code."""
    typer.echo(f"interrupted: what was finished is in {folder}", err=True)
    raise typer.Exit(INTERRUPTED)
