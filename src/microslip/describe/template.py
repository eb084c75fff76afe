"""The commented joint file that `microslip new` writes.

``templates/lap.toml`` says which keys stand in it, in which order and with which values; those
after ``#`` are left to their defaults. What every line means is put beside it from the models.
"""

from __future__ import annotations

import re
import textwrap
import tomllib
from collections.abc import Sequence
from importlib import resources
from typing import Any

from microslip.describe.keys import Key, SectionKeys, sections
from microslip.describe.reading import JOINTS

INDENT = 34
"""Column at which comments begin."""

WIDTH = 100

_FREE = re.compile(r"##(.*)")
_HEADING = re.compile(r"(# )?(\[{1,2}([\w.]+)\]{1,2})")
_ENTRY = re.compile(r"(# )?(\w+) = (.+)")


def template(name: str = "lap") -> str:
    """Text of a commented joint file.

    Parameters
    ----------
    name : str
        Of the file in ``microslip/templates``, without its ending.

    Examples
    --------
    >>> print(template().splitlines()[7])
    [beams]                           # Two beams and how far they overlap
    """
    source = resources.files("microslip").joinpath("templates", f"{name}.toml").read_text("utf-8")
    return commented(source)


def commented(source: str) -> str:
    """A joint file with the meaning of every section and key beside it."""
    known = tuple(sections(JOINTS[tomllib.loads(source.replace("##", "#")).get("kind", "lap")]))
    lines: list[str] = []
    place, signal = "", ""
    for line in source.splitlines():
        if free := _FREE.match(line):
            lines.append(f"#{free[1]}")
        elif heading := _HEADING.fullmatch(line):
            place, signal = heading[3], ""
            lines += _beside(line, _meaning(known, place))
        elif entry := _ENTRY.fullmatch(line):
            if place.endswith("history") and entry[2] == "signal":
                signal = entry[3].strip('"')
                lines += _beside(line, _section(known, place, signal).meaning)
            else:
                lines += _beside(line, _said(_key(known, place, entry[2], signal), entry[3]))
        else:
            lines.append(line)
    return "\n".join(lines) + "\n"


def _beside(line: str, text: str) -> list[str]:
    """A line with a comment, which goes on below where it is long."""
    if not text:
        return [line]
    start = max(INDENT, len(line) + 1)
    first, *more = textwrap.wrap(text, WIDTH - start - 2)
    rest = textwrap.wrap(" ".join(more), WIDTH - INDENT - 2) if more else []
    return [f"{line:<{start}}# {first}", *(f"{'':<{INDENT}}# {part}" for part in rest)]


def _meaning(known: Sequence[SectionKeys], place: str) -> str:
    """Of a section; of the table of histories what they have in common."""
    if place.endswith("history"):
        return "Motion over time under a load that changes; any number of these"
    return _section(known, place).meaning.partition(",")[0].replace("`", "")


def _said(key: Key, written: str) -> str:
    """Meaning, range where there is one, and default where another value is written."""
    bounds = key.allowed.partition(", ")[2]
    facts = [bounds] if re.match(r"\d\S* to ", bounds) else []
    if key.default not in ("", "–") and _value(key, key.default) != _value(key, written):
        facts.append(f"default {key.default}")
    return key.meaning + (f" ({'; '.join(facts)})" if facts else "")


def _value(key: Key, text: str) -> Any:
    """What a key is given by a piece of the file, a quantity in SI units."""
    value = tomllib.loads(f"x = {text}")["x"]
    if key.kind is None:
        return value
    return [key.kind.parse(v) for v in value] if isinstance(value, list) else key.kind.parse(value)


def _section(known: Sequence[SectionKeys], place: str, signal: str = "") -> SectionKeys:
    """A section of the file.

    Raises
    ------
    LookupError
        Where there is none.
    """
    for section in known:
        if section.path == place and section.signal == signal:
            return section
    raise LookupError(f"there is no section [{place}]")


def _key(known: Sequence[SectionKeys], place: str, name: str, signal: str) -> Key:
    """A key of a section.

    Raises
    ------
    LookupError
        Where the file names a key that there is not.
    """
    for key in _section(known, place, signal).keys:
        if key.name == name:
            return key
    raise LookupError(f"[{place}] has no key {name!r}")
