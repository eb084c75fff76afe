"""Lines of an ANSYS archive (``.cdb``, as `CDWRITE` writes it): commands, and blocks of fixed columns.

A command is a line of words with commas. A block has its columns in a Fortran format on the line behind its
command, ``(3i9,6e21.13e3)``, and rows until one that says that it ends, or as many as it has announced.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from microslip.errors import InputError

_FIELDS = re.compile(r"(\d*)([ieg])(\d+)", re.IGNORECASE)

END = -1
"""First number of the row that ends a block."""


@dataclass(frozen=True)
class Command:
    """A command and where it stands.

    Attributes
    ----------
    name : str
        In capitals.
    words : tuple of str
        What stands behind it, between commas.
    file : str
    line : int
    rows : tuple of (int, str)
        Lines of its block with their numbers.
    """

    name: str
    words: tuple[str, ...]
    file: str
    line: int
    rows: tuple[tuple[int, str], ...] = ()

    def word(self, place: int) -> str:
        """A word in capitals; empty where there is none."""
        return self.words[place].upper() if place < len(self.words) else ""

    def refuse(self, said: str, line: int = 0) -> InputError:
        """An error that names file, line and command."""
        return InputError(f"{self.file}: line {line or self.line}: {self.name}: {said}")

    def whole(self, place: int) -> int:
        """A word as a whole number.

        Raises
        ------
        InputError
            Where it is none.
        """
        return int(self._parsed(place, int))

    def number(self, place: int) -> float:
        """A word as a number; raises as `whole`."""
        return float(self._parsed(place, float))

    def _parsed(self, place: int, kind: type[int] | type[float]) -> float:
        try:
            return kind(self.word(place))
        except ValueError:
            raise self.refuse(f"{self.word(place)!r} is no number") from None

    def fields(self, line: int, text: str, widths: tuple[int, ...]) -> list[str]:
        """Columns of a row that are not blank at its end.

        Raises
        ------
        InputError
            Where the row is longer than its columns.
        """
        out: list[str] = []
        start, text = 0, text.rstrip()
        for width in widths:
            if start >= len(text):
                return out
            out.append(text[start : start + width].strip())
            start += width
        if start < len(text):
            raise self.refuse(f"{text[start:].strip()!r} stands beyond the last column", line)
        return out

    def integers(self, line: int, text: str, widths: tuple[int, ...]) -> list[int]:
        """Columns of a row as whole numbers; raises `InputError` where one is none."""
        found = self.fields(line, text, widths)
        try:
            return [int(field) for field in found]
        except ValueError:
            raise self.refuse(f"{text.strip()!r} are no whole numbers", line) from None


BLOCKS = ("NBLOCK", "EBLOCK", "CMBLOCK", "RLBLOCK", "ETBLOCK", "SECBLOCK")
"""Commands with rows behind them."""


def read_archive(path: Path) -> list[Command]:
    """Commands of an archive in their order.

    Raises
    ------
    InputError
        Where the file cannot be read, or a block does not end.
    """
    try:
        lines = path.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror or error}") from error
    return list(_commands(lines, path.name))


def _commands(lines: list[str], file: str) -> Iterator[Command]:
    k = 0
    while k < len(lines):
        text = lines[k].split("!")[0].strip()
        k += 1
        if not text:
            continue
        name, *words = (word.strip() for word in text.split(","))
        command = Command(name.upper(), tuple(words), file, k)
        if command.name in BLOCKS:
            rows = tuple(_rows(command, lines, k))
            k = rows[-1][0] if rows else k
            command = Command(command.name, command.words, file, command.line, rows)
        yield command


def _rows(command: Command, lines: list[str], start: int) -> Iterator[tuple[int, str]]:
    """Rows of a block, its format among them, and the row that ends it."""
    formats = 0
    while start + formats < len(lines) and lines[start + formats].lstrip().startswith("("):
        yield start + formats + 1, lines[start + formats]
        formats += 1
    if not formats:
        raise command.refuse("a format in brackets was expected on the next line")
    for k in range(start + formats, len(lines)):
        text = lines[k]
        if re.match(r"\s*-?\d", text):
            yield k + 1, text
            if text.split()[0] == str(END) and command.name != "CMBLOCK":
                return
            continue
        if command.name == "EBLOCK" or (command.name == "NBLOCK" and not _closes(text)):
            raise command.refuse(f"ends with {text.strip()!r} and not with {END}", k + 1)
        return
    if command.name in ("NBLOCK", "EBLOCK"):
        raise command.refuse("the file ends before it does: is it whole?")


def _closes(text: str) -> bool:
    """Whether a line is the command that ends a block of nodes."""
    return re.match(r"\s*N,.*LOC,\s*-1", text.upper()) is not None


def widths_of(command: Command) -> tuple[int, ...]:
    """Widths of the columns of a block.

    Raises
    ------
    InputError
        Where the format is not understood.

    Examples
    --------
    >>> block = Command("NBLOCK", ("6", "SOLID"), "a.cdb", 7, ((8, "(3i9,2e21.13e3)"),))
    >>> widths_of(block)
    (9, 9, 9, 21, 21)
    """
    line, text = command.rows[0]
    widths: list[int] = []
    for part in text.strip().strip("()").split(","):
        found = _FIELDS.match(part.strip())
        if found is None:
            raise command.refuse(f"the format {text.strip()} is not understood", line)
        widths += [int(found[3])] * int(found[1] or 1)
    return tuple(widths)
