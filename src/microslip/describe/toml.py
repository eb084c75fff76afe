"""Read a TOML file, and say in our words which line is none."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import Any

from microslip.errors import InputError

QUOTED = 'text and quantities with a unit stand in quotation marks, "12.5 mm"'

_SAID = (
    (r"Cannot (overwrite|declare|mutate)|[Dd]uplicate|twice", "it is there twice: remove one"),
    (r"Expected '='", f"a key must be followed by = and its value; {QUOTED}"),
    (r"Invalid value", f"the value is missing, or is none: {QUOTED}"),
    (r"table declaration", "the name of a section stands in brackets, [beams]"),
    (r"Expected newline", f"there is more than one thing on the line: {QUOTED}, numbers have a "
     "decimal point, notes begin with #"),
    (r"Unterminated string|Illegal character '\\n'|Expected .*'\\?\"", "a quotation mark is missing"),
    (r"Unclosed array", "a list is not closed: ] is missing"),
    (r"Unclosed inline table", "a section in braces is not closed: } is missing"),
    (r"Unescaped|hex value", "a \\ in text must be written twice, or the text in '...'"),
    (r"[Ii]llegal character|invalid character", "there is a mark that cannot be seen; remove it"),
    (r"Invalid (initial character|statement)", "must be a key, = and its value, or a [section]"),
    (r"date or", "looks like a date and is none"),
)  # fmt: skip
"""What the parser complains of, and what we call it."""

_PLACE = re.compile(r"\(at line (\d+), column \d+\)")

BYTE_ORDER_MARKS = {b"\xff\xfe": "UTF-16", b"\xfe\xff": "UTF-16"}


def read_toml(path: Path) -> dict[str, Any]:
    """Nested mappings of a TOML file.

    Raises
    ------
    InputError
        Where there is no such file, it cannot be read, is no text in UTF-8 or no TOML: names the
        file, the line and what is wrong there.
    """
    text = _text(path)
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as failure:
        raise InputError(f"{path}: not valid TOML: {_where_and_what(failure, text)}") from None
    except RecursionError:
        raise InputError(f"{path}: not valid TOML: brackets within too many brackets") from None
    except ValueError:
        raise InputError(f"{path}: not valid TOML: a number has too many digits") from None


def _text(path: Path) -> str:
    if path.is_dir():
        raise InputError(f"{path}: is a folder; a joint file was expected")
    try:
        content = path.read_bytes()
    except FileNotFoundError:
        hint = f"; `microslip new lap {path}` writes one" if path.suffix == ".toml" else ""
        raise InputError(f"{path}: no such file{hint}") from None
    except OSError as failure:
        raise InputError(f"{path}: cannot be read: {failure.strerror}") from None
    except ValueError:  # a name that no file can have
        raise InputError(f"{str(path)!r}: no such file") from None
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as failure:
        line = content[: failure.start].count(b"\n") + 1
        written = BYTE_ORDER_MARKS.get(content[:2], "another encoding")
        raise InputError(
            f"{path}: not UTF-8 text (line {line}): it seems to be in {written}; save it as UTF-8"
        ) from None


def _where_and_what(failure: tomllib.TOMLDecodeError, text: str) -> str:
    complaint = str(failure)
    said = (words for pattern, words in _SAID if re.search(pattern, complaint))
    what = next(said, "this cannot be understood")
    lines = text.split("\n")
    place = _PLACE.search(complaint)
    number = int(place[1]) if place is not None else len(text.rstrip().split("\n"))
    line = lines[number - 1].strip()
    shown = line if len(line) <= 60 else line[:57] + "..."
    seen = "".join(c if c.isprintable() else f"\\u{ord(c):04x}" for c in shown)
    return f"line {number}, {seen}: {what}"
