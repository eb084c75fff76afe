"""Every key of a joint file: unit, default, what is allowed, what it means, where it matters.

All of it is read from the models of the sections, and nothing is written down twice: the first
sentence below a field says what it means, the others where it matters. The file that
`microslip new` writes, the input reference and the messages about mistakes are made of this.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from microslip.describe.excitation import SIGNALS
from microslip.describe.lap import LapJoint
from microslip.describe.profile import Profile
from microslip.describe.units import Kind

LIMITS = ("gt", "ge", "lt", "le", "multiple_of", "min_length", "max_length")
"""Names of the limits that a field may have."""


@dataclass(frozen=True)
class Key:
    """One key of a section, in words.

    Attributes
    ----------
    name : str
        As it is written in the file.
    unit : str
        SI unit; empty where it has none.
    default : str
        As one would write it; empty where the key is needed, ``–`` where it may be left out and
        nothing stands for it.
    allowed : str
        Kind of value and its range.
    meaning, matters : str
        What it is, and what depends on it; empty where the model does not say.
    kind : Kind or None
        How a value of it is read; None where it is no quantity.
    """

    name: str
    unit: str
    default: str
    allowed: str
    meaning: str
    matters: str
    kind: Kind | None = None

    @property
    def needed(self) -> bool:
        """Whether the file must have it."""
        return not self.default


@dataclass(frozen=True)
class SectionKeys:
    """A section of the file and its keys.

    Attributes
    ----------
    path : str
        ``beams``, ``analysis.cycle``; empty for the top of the file.
    meaning : str
        First sentence of what its model says of itself.
    keys : tuple of Key
    signal : str
        Of a history: the kind of signal; else empty.
    listed : bool
        Whether there may be any number of them.
    """

    path: str
    meaning: str
    keys: tuple[Key, ...]
    signal: str = ""
    listed: bool = False

    @property
    def heading(self) -> str:
        """As it is written in the file."""
        if self.listed:
            return f"[[{self.path}]]"
        return f"[{self.path}]" if self.path else ""


@dataclass(frozen=True)
class _Facts:
    """What the type of a field says."""

    base: type | None = None
    kind: Kind | None = None
    words: tuple[str, ...] = ()
    limits: tuple[tuple[str, Any], ...] = ()
    listed: bool = False
    table: bool = False


def sections(model: type[BaseModel] = LapJoint, path: str = "") -> Iterator[SectionKeys]:
    """Every section of a joint file in the order of its model, each kind of history by itself.

    Examples
    --------
    >>> [section.path for section in sections()][:3]
    ['', 'beams', 'beams.upper']
    """
    own = tuple(
        key_of(written_name(name, info), info)
        for name, info in model.model_fields.items()
        if section_of(info) is None and name != "history"
    )
    if own:
        yield SectionKeys(path, _sentences(model.__doc__)[0], own)
    for name, info in model.model_fields.items():
        inner = section_of(info)
        place = f"{path}.{name}" if path else name
        if inner is not None:
            listed = get_origin(info.annotation) is tuple
            for found in sections(inner, place):
                yield replace(found, listed=found.listed or listed)
        elif name == "history":
            for signal, kind in SIGNALS.items():
                for found in sections(kind, place):
                    yield replace(found, signal=signal, listed=True)


def written_name(name: str, info: FieldInfo) -> str:
    """Key of a field as it is written in the file."""
    return info.alias or name


def section_of(info: FieldInfo) -> type[BaseModel] | None:
    """Model of the section that a field holds; None where it holds a value."""
    for choice in (info.annotation, *get_args(info.annotation)):
        if isinstance(choice, type) and issubclass(choice, BaseModel):
            return choice
    return None


def key_of(name: str, info: FieldInfo) -> Key:
    """A field of a section in words.

    Examples
    --------
    >>> key_of("pairs", LapJoint.model_fields["contact"].annotation.model_fields["pairs"]).allowed
    'whole number, 5 to 5001'
    """
    facts = _facts(info.annotation, info.metadata)
    meaning, matters = _sentences(info.description)
    return Key(
        name,
        "" if facts.kind is None else facts.kind.unit,
        _default(info, facts),
        _allowed(facts),
        meaning,
        matters,
        facts.kind,
    )


def _sentences(text: str | None) -> tuple[str, str]:
    """The first sentence without its full stop, and the others."""
    first, _, rest = " ".join((text or "").split()).partition(". ")
    return first.removesuffix("."), rest


def _facts(annotation: Any, metadata: Any = (), found: _Facts | None = None) -> _Facts:
    found = found or _Facts()
    origin = get_origin(annotation)
    if origin is Annotated:
        inner, *more = get_args(annotation)
        found = _facts(inner, more, found)
    elif origin in (Union, UnionType):
        for choice in get_args(annotation):
            if choice is not NoneType:
                found = _facts(choice, (), found)
    elif origin is tuple:
        found = replace(_facts(get_args(annotation)[0], (), found), listed=True)
    elif origin is Literal:
        found = replace(found, words=(*found.words, *get_args(annotation)))
    elif annotation is Profile:
        found = replace(found, table=True)
    elif isinstance(annotation, type):
        found = replace(found, base=annotation)
    for item in metadata:
        if isinstance(item, Kind):
            found = replace(found, kind=item)
        elif isinstance(item, FieldInfo):
            found = _facts(None, item.metadata, found)
        else:
            limits = [(k, v) for k in LIMITS if (v := getattr(item, k, None)) is not None]
            found = replace(found, limits=(*found.limits, *limits))
    return found


def _allowed(facts: _Facts) -> str:
    limits = dict(facts.limits)
    words = " or ".join(f'"{word}"' for word in facts.words)
    number = facts.base in (int, float)
    noun = ""
    if facts.kind is not None:
        noun = "number" if not facts.kind.unit else facts.kind.noun.split(" ", 1)[1]
    elif facts.base is not None and not (facts.words and facts.base is str):
        noun = {int: "whole number", bool: "true or false", str: "text"}.get(facts.base, "")
    text = " or ".join(part for part in (noun, words) if part)
    bounds = _range(limits, facts) if number else _length(limits)
    if facts.listed:
        text = f"one or a list: {text}"
    text = f"{text}, {bounds}" if bounds else text
    return f"{text}; or a table along x" if facts.table else text


def _range(limits: dict[str, Any], facts: _Facts) -> str:
    low, high = limits.get("ge"), limits.get("le")
    parts = []
    if low is not None and high is not None:
        parts.append(f"{_plain(low)} to {_plain(high)}")
    else:
        marks = {"gt": "above", "ge": "at least", "lt": "below", "le": "at most"}
        parts += [f"{word} {_plain(limits[k])}" for k, word in marks.items() if k in limits]
        return " and ".join(parts) + _multiple(limits)
    marks = {"gt": "above", "lt": "below"}
    parts += [f"{word} {_plain(limits[k])}" for k, word in marks.items() if k in limits]
    return ", ".join(parts) + _multiple(limits)


def _multiple(limits: dict[str, Any]) -> str:
    return f", a multiple of {limits['multiple_of']}" if "multiple_of" in limits else ""


def _length(limits: dict[str, Any]) -> str:
    return f"at most {limits['max_length']} characters" if "max_length" in limits else ""


def _plain(limit: float) -> str:
    whole = isinstance(limit, int) or float(limit).is_integer()
    return str(int(limit)) if whole and abs(limit) < 1e7 else f"{limit:g}"


def _default(info: FieldInfo, facts: _Facts) -> str:
    """As one would write it in the file."""
    if info.is_required():
        return ""
    value = info.default
    if value is None or value == ():
        return "–"
    if isinstance(value, float):
        number = f"{value:g}"
        return f'"{number} {facts.kind.unit}"' if facts.kind and facts.kind.unit else number
    return json.dumps(value)
