"""Input decks of Abaqus and CalculiX as keywords with their lines, before they mean anything."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

from microslip.errors import InputError

DEEPEST = 8
"""Files that may include one another."""


@dataclass(frozen=True)
class Row:
    """One data line: file, line number and its values."""

    file: str
    line: int
    values: tuple[str, ...]

    @property
    def where(self) -> str:
        """``deck.inp:12``."""
        return f"{self.file}:{self.line}"

    def number(self, k: int, default: float | None = None) -> float:
        """Value k as a number; raises `InputError` naming file, line and value."""
        text = self.values[k] if k < len(self.values) else ""
        if not text and default is not None:
            return default
        try:
            return float(text.upper().replace("D", "E"))
        except ValueError:
            raise InputError(
                f"{self.where}: value {k + 1} is {text!r}: it must be a number"
            ) from None

    def whole(self, k: int) -> int:
        """Value k as a whole number; raises `InputError` naming file, line and value."""
        text = self.values[k] if k < len(self.values) else ""
        try:
            return int(text)
        except ValueError:
            raise InputError(
                f"{self.where}: value {k + 1} is {text!r}: it must be a whole number"
            ) from None


@dataclass
class Keyword:
    """A keyword, its parameters and its data lines.

    Attributes
    ----------
    name : str
        In capitals, without the star and with single spaces.
    parameters : dict
        Names in capitals; values as written, empty for flags.
    """

    name: str
    file: str
    line: int
    parameters: dict[str, str]
    rows: list[Row] = field(default_factory=list)

    @property
    def where(self) -> str:
        """``deck.inp:12: *NODE``, the start of every message about it."""
        return f"{self.file}:{self.line}: *{self.name}"

    def required(self, parameter: str) -> str:
        """Value of a parameter; raises `InputError` where it is missing."""
        if not self.parameters.get(parameter):
            raise InputError(f"{self.where}: the parameter {parameter} is missing")
        return self.parameters[parameter]

    def only(self, *known: str) -> None:
        """Raise `InputError` for the first parameter that is none of the known ones."""
        for parameter in self.parameters:
            if parameter not in known:
                raise InputError(
                    f"{self.where}: the parameter {parameter} is not understood; known are "
                    f"{', '.join(known) or 'none'}"
                )

    def refuse(self, reason: str) -> InputError:
        """An error about this keyword."""
        return InputError(f"{self.where}: {reason}")


def read_deck(path: Path) -> list[Keyword]:
    """Keywords of a deck in their order, included files in their places.

    Raises
    ------
    InputError
        Where a file cannot be read, or data stands before the first keyword.
    """
    out: list[Keyword] = []
    for file, line, text in _lines(path, 0):
        if text.startswith("*"):
            out.append(_keyword(file, line, text))
            continue
        values = tuple(value.strip() for value in text.split(","))
        if not out:
            raise InputError(f"{file}:{line}: a data line before any keyword: {text[:40]!r}")
        out[-1].rows.append(Row(file, line, values))
    if not out:
        raise InputError(f"{path.name}: no keyword in it; is this an Abaqus or CalculiX deck?")
    return out


def _lines(path: Path, depth: int) -> Iterator[tuple[str, int, str]]:
    """File, number and text of each line that says something; keyword lines are joined."""
    if depth > DEEPEST:
        raise InputError(f"{path.name}: more than {DEEPEST} files include one another")
    try:
        text = path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from error
    pending, start = "", 0
    for number, raw in enumerate(text.splitlines(), 1):
        line = raw.strip()
        if not line or line.startswith("**"):
            continue
        if pending:
            line = pending + line
            pending = ""
        else:
            start = number
        if line.startswith("*") and line.endswith(","):
            pending = line
            continue
        if line.startswith("*") and _keyword(path.name, start, line).name == "INCLUDE":
            wanted = _keyword(path.name, start, line).required("INPUT")
            yield from _lines(path.parent / wanted, depth + 1)
            continue
        yield path.name, start, line
    if pending:
        yield path.name, start, pending.rstrip(",")


def _keyword(file: str, line: int, text: str) -> Keyword:
    first, *rest = text[1:].split(",")
    parameters = {}
    for part in rest:
        name, _, value = part.partition("=")
        if name.strip():
            parameters[" ".join(name.upper().split())] = value.strip().strip("\"'")
    return Keyword(" ".join(first.upper().split()), file, line, parameters)
