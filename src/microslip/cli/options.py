"""Arguments and options that more than one command takes, and what their words may be."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from pathlib import Path
from typing import Annotated

import typer

from microslip.errors import InputError

JointFile = Annotated[Path, typer.Argument(metavar="FILE", help="Joint file (TOML).")]
Force = Annotated[bool, typer.Option("--force", help="Replace what is already there.")]
Quiet = Annotated[
    bool, typer.Option("--quiet", help="No progress and no summary; what is wrong is still said.")
]


def listed(option: str, lists: Iterable[str], known: Collection[str]) -> tuple[str, ...]:
    """Words of an option that takes several with commas between and may be given again, each once.

    Raises
    ------
    InputError
        Where one is not known, or there is none.

    Examples
    --------
    >>> listed("--format", ["svg, pdf", "svg"], ("png", "svg", "pdf"))
    ('svg', 'pdf')
    """
    text = ",".join(lists)
    words = tuple(dict.fromkeys(word.strip().lower() for word in text.split(",")))
    if not set(words) <= set(known):
        raise InputError(
            f"{option} {text!r}: must be one or more of {', '.join(known)}, with commas between"
        )
    return words


def at_least_one(option: str, number: int | None) -> int | None:
    """A number of an option, if it is given at all.

    Raises
    ------
    InputError
        Where it is less than one.
    """
    if number is not None and number < 1:
        raise InputError(f"{option} {number}: must be a whole number, 1 or more")
    return number
