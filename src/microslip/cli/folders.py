"""Folders that a command writes into: never over what is there, and none left behind empty."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import typer

from microslip.errors import InputError


@contextmanager
def claimed(folder: Path, force: bool) -> Iterator[None]:
    """Hold a folder for writing; on leaving, remove what was created for it and stayed empty."""
    created = claim(folder, force)
    try:
        yield
    finally:
        withdraw(created)


def claim(folder: Path, force: bool) -> list[Path]:
    """Make sure results can be written to a folder; the folders created for it, outermost first.

    Raises
    ------
    InputError
        Where it holds files already (unless `force`), is a file, or cannot be written to.
    """
    try:
        missing = [place for place in (folder, *folder.parents) if not place.exists()][::-1]
        if folder.is_dir() and any(folder.iterdir()) and not force:
            raise InputError(
                f"{folder}: holds files already; choose another --out, or --force to replace "
                "the results in it"
            )
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except FileExistsError:
        raise InputError(f"{folder}: is a file; the output must be a folder") from None
    except OSError as error:
        raise InputError(f"{folder}: cannot be written to: {error.strerror}") from None
    return missing


def withdraw(created: list[Path]) -> None:
    """Remove folders created for a run that wrote nothing into them."""
    for place in reversed(created):
        if place.is_dir() and not any(place.iterdir()):
            place.rmdir()


def report(folder: Path, written: list[Path], quiet: bool, *, aside: bool = False) -> None:
    """Say what was written, on stderr where `aside`, and what of an earlier run stands beside it."""
    if not quiet:
        typer.echo(f"results are in {folder}", err=aside)
    mine = {path.resolve() for path in written}
    others = [
        str(path.relative_to(folder))
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.resolve() not in mine
    ]
    if others:
        shown = ", ".join(others[:5]) + (", ..." if len(others) > 5 else "")
        typer.echo(f"note: not from this run and left as they were: {shown}", err=True)
