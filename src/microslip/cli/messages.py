"""Errors as one message and an exit code.

A mistake of the user ends with one message on stderr and exit code 2; a computation that fails
with 1; one that ends, but leaves something that was asked for without an answer, with 3; an
interrupted one with 130.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import typer

from microslip.errors import InputError, MicroslipError

FAILED, USER_ERROR, UNANSWERED, INTERRUPTED = 1, 2, 3, 130

EXIT_CODES = (
    "Exit codes: 0 all that was asked for has an answer; 1 the computation failed; 2 something in "
    "the file or the command cannot be used; 3 something asked for has no answer (failures in "
    "{file} say what and why); 130 interrupted."
)
"""For the help of commands that compute, with the name of the file that lists failures."""


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
    except MemoryError:
        typer.echo("error: out of memory: take fewer contact pairs, or fewer loads", err=True)
        raise typer.Exit(FAILED) from None
    except KeyboardInterrupt:
        typer.echo("interrupted before it was finished", err=True)
        raise typer.Exit(INTERRUPTED) from None


def warn(cautions: Iterable[object]) -> None:
    """Say on stderr what should be doubted, a line each."""
    for caution in cautions:
        typer.echo(f"warning: {caution}", err=True)


def stop_interrupted(folder: object) -> None:
    """Say that a run was interrupted and where what it finished is; leave with its exit code."""
    typer.echo(f"interrupted: what was finished is in {folder}", err=True)
    raise typer.Exit(INTERRUPTED)


def stop_unanswered(failures: Sequence[object], file: Path) -> None:
    """Say, where there are any, how much has no answer and which file says why; leave with 3."""
    if not failures:
        return
    count = len(failures)
    has = "thing asked for has" if count == 1 else "things asked for have"
    first = " ".join(str(failures[0]).split())
    typer.echo(f"{count} {has} no answer; see failures in {file}: first: {first}", err=True)
    raise typer.Exit(UNANSWERED)
