"""Read a joint file, and answer every mistake in its own words: file, key, value, what is allowed."""

from __future__ import annotations

import difflib
import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from microslip.describe import units
from microslip.describe.excitation import SIGNALS
from microslip.describe.joint import Joint
from microslip.describe.keys import section_of, written_name
from microslip.describe.lap import LapJoint
from microslip.describe.matrices import MatricesJoint
from microslip.describe.mesh import MeshJoint
from microslip.describe.plausible import impossible, questions
from microslip.describe.quantities import NAME, Rule
from microslip.describe.saved_model import ModelJoint
from microslip.describe.toml import read_toml
from microslip.errors import InputError

LISTED = ("port", "output", "preload", "material", "support", "spring", "tie", "interface")
"""Sections that there may be several of."""

JOINTS: dict[str, type[Joint]] = {
    "lap": LapJoint,
    "matrices": MatricesJoint,
    "mesh": MeshJoint,
    "model": ModelJoint,
}
"""Descriptions by the key ``kind`` of their file; a file without it is of the first."""


def load_joint(path: str | Path) -> Joint:
    """Read and validate a joint file.

    Raises
    ------
    InputError
        With one message: file, key, value, and what is allowed.
    """
    file = Path(path)
    return parse_joint(read_toml(file), str(path), file.parent)


def parse_joint(
    document: Mapping[str, Any], source: str = "joint", folder: str | Path = ""
) -> Joint:
    """Validate a joint given as nested mappings, as `tomllib` makes them.

    Files that it names are looked for in `folder`.

    Raises
    ------
    InputError
        Naming `source`, key, value, and what is allowed.

    Examples
    --------
    >>> parse_joint({"beams": {"length": "-1 m"}})
    Traceback (most recent call last):
    ...
    microslip.errors.InputError: joint: 6 problems
      beams.length = "-1 m": must be greater than 0
      beams.thickness is missing: expected a length, for example "12.5 mm"
      beams.overlap_half_length is missing: expected a length, for example "12.5 mm"
      [material] is missing: a section with youngs_modulus, poissons_ratio, density
      [contact] is missing: a section with friction
      ...
    """
    kind = document.get("kind", "lap")
    if not isinstance(kind, str) or kind not in JOINTS:
        said = json.dumps(kind, ensure_ascii=False, default=str)
        known = " or ".join(f'"{name}"' for name in JOINTS)
        raise InputError(_printable(f"{source}: kind = {said}: must be {known}"))
    meant = next((name for name in JOINTS if name in document), None)
    if "kind" not in document and meant is not None and "beams" not in document:
        raise InputError(f'{source}: kind is missing: with [{meant}] it is kind = "{meant}"')
    model = JOINTS[kind]
    try:
        joint = model.model_validate(document, context={"folder": folder})
        problems = _impossible(joint, document)
    except ValidationError as failure:
        errors = failure.errors()
        problems = [_printable(_problem(error, document, model)) for error in errors]
    except ArithmeticError:
        problems = ["some values are too large or too small to compute with: check their units"]
    if problems:
        raise InputError(_joined(source, problems)) from None
    return joint


def parse_lap_joint(
    document: Mapping[str, Any], source: str = "joint", folder: str | Path = ""
) -> LapJoint:
    """The same of a lap joint.

    Raises
    ------
    InputError
        Where it is another joint, or as `parse_joint` does.
    """
    joint = parse_joint(document, source, folder)
    if not isinstance(joint, LapJoint):
        raise InputError(f'{source}: kind must be "lap" here')
    return joint


def _impossible(joint: Joint, document: Mapping[str, Any]) -> list[str]:
    """What cannot be, and before it what is not usual, which may be why."""
    if not isinstance(joint, LapJoint):
        return []
    found = [f"{_written(key.split('.'), document)}: {said}" for key, said in impossible(joint)]
    return [f"{q.where}: {q.reason}; {q.remedy}" for q in questions(joint) if found] + found


def _printable(text: str) -> str:
    """Text whose characters can all be seen: a value may hold one that would begin a new line."""
    return "".join(c if c.isprintable() else f"\\u{ord(c):04x}" for c in text)


def _joined(source: str, problems: list[str], shown: int = 5) -> str:
    if len(problems) == 1:
        return f"{source}: {problems[0]}"
    rest = ["..."] if len(problems) > shown else []
    return "\n  ".join([f"{source}: {len(problems)} problems", *problems[:shown], *rest])


def _problem(error: ErrorDetails, document: Mapping[str, Any], joint: type[BaseModel]) -> str:
    """One problem in the words of the joint file."""
    loc, kind = error["loc"], error["type"]
    context: Mapping[str, Any] = error.get("ctx", {})
    cause = context.get("error")
    if isinstance(cause, Rule):
        keys = [int(k) if k.isdigit() else k for k in cause.key.split(".") if k]
        return f"{_written((*loc, *keys), document)}: {cause}"
    if kind == "union_tag_not_found":
        return f"{_written((*loc, 'signal'), document)} is missing: one of {', '.join(SIGNALS)}"
    if kind == "union_tag_invalid":
        return f"{_written((*loc, 'signal'), document)}: must be one of {', '.join(SIGNALS)}"
    if kind == "missing":
        return _missing(loc, joint)
    if kind == "extra_forbidden":
        return _unknown(loc, joint)
    if kind == "model_type":
        return f"{_written(loc, document)}: must be a section, [{_dotted(loc)}]"
    message = str(cause) if cause is not None else allowed(kind, context)
    return f"{_written(loc, document)}: {message}"


_LIMITS = {
    "greater_than": ("greater than", "gt"),
    "greater_than_equal": ("greater than or equal to", "ge"),
    "less_than": ("less than", "lt"),
    "less_than_equal": ("less than or equal to", "le"),
    "multiple_of": ("a multiple of", "multiple_of"),
}
"""Errors of a number beyond a limit: how it reads, and where the limit stands."""

_WORDS = (
    (r"int_\w+", "a whole number"),
    (r"(float|decimal|complex|finite)_\w+", "a finite number"),
    (r"bool_\w+", "true or false"),
    (r"(string|bytes|url)_\w+", 'text in quotation marks, "..."'),
    (r"(tuple|list|set|frozen_set|iterable|iteration)_\w+", "a list of values, [..., ...]"),
    (r"(dict|mapping|model|dataclass|arguments)_\w+", "a section with keys and values"),
    (r"(date|time|timezone)\w*", "a date or a time"),
)
"""Errors of a value of the wrong kind, and the kind that it must be."""


def allowed(kind: str, context: Mapping[str, Any]) -> str:
    """What is allowed where `pydantic` reports an error of a kind, in our words.

    Parameters
    ----------
    kind : str
        Type of the error.
    context : mapping
        Its limits.

    Examples
    --------
    >>> allowed("less_than", {"lt": 0.5}), allowed("int_type", {})
    ('must be less than 0.5', 'must be a whole number')
    """
    if kind in _LIMITS:
        words, key = _LIMITS[kind]
        return f"must be {words} {_plain(context.get(key))}"
    if kind in ("literal_error", "enum"):
        return f"must be {context['expected']}"
    if kind == "string_pattern_mismatch":
        if context["pattern"] == NAME:
            return "must be a letter followed by letters, digits, - and _"
        return f"must match the pattern {context['pattern']}"
    if kind in ("string_too_short", "string_too_long", "too_short", "too_long"):
        return _length(kind, context)
    if kind == "invalid_key":
        return "keys must be text"
    for pattern, noun in _WORDS:
        if re.fullmatch(pattern, kind):
            return f"must be {noun}"
    return "is of a kind that cannot be used here"


def _length(kind: str, context: Mapping[str, Any]) -> str:
    """What is allowed where a text or a list is too short or too long."""
    few = kind.endswith("short")
    count = context["min_length" if few else "max_length"]
    noun = "character" if kind.startswith("string") else "value"
    bound = "at least" if few else "at most"
    return f"must have {bound} {count} {noun}{'' if count == 1 else 's'}"


def _plain(limit: Any) -> str:
    """A limit as one writes it: whole numbers without a point."""
    if isinstance(limit, float) and limit.is_integer() and abs(limit) < 1e7:
        return str(int(limit))
    return str(limit)


def _dotted(loc: Sequence[int | str]) -> str:
    """A location as a path of keys in the file."""
    keys = (part for n, part in enumerate(loc) if not _is_kind(loc, n))
    parts = (f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys)
    return "".join(parts).removeprefix(".")


def _is_kind(loc: Sequence[int | str], n: int) -> bool:
    """Whether a part of a location is no key but the kind of signal of the history before it."""
    return n >= 2 and loc[n - 2] == "history" and loc[n] in SIGNALS


def _written(loc: Sequence[int | str], document: Mapping[str, Any]) -> str:
    """Key and value as the user wrote them."""
    value: Any = document
    key = ""
    for n, part in enumerate(loc):
        if isinstance(part, int):
            if isinstance(value, list | tuple):
                key += f"[{part}]"
                value = value[part]
        elif not _is_kind(loc, n):
            key += f".{part}" if key else part
            value = value.get(part) if isinstance(value, Mapping) else None
    if value is None:
        return key
    if isinstance(value, Mapping):
        if loc[0] not in LISTED:
            return f"[{key}]"
        entries = document.get(str(loc[0]))
        several = isinstance(entries, list) and len(entries) > 1
        return key if several else f"[[{loc[0]}]]"
    text = json.dumps(value, ensure_ascii=False, default=str)
    return f"{key} = {text if len(text) <= 60 else text[:57] + '...'}"


def _model_at(loc: Sequence[int | str], joint: type[BaseModel]) -> type[BaseModel] | None:
    """Model of the section of a joint's file at a location."""
    model = joint
    for n, part in enumerate(loc):
        if isinstance(part, int) or part == "history":
            continue
        if _is_kind(loc, n):
            model = SIGNALS[str(part)]
            continue
        found = _field(model, part)
        section = None if found is None else section_of(found)
        if section is None:
            return None
        model = section
    return model


def _field(model: type[BaseModel], key: int | str) -> FieldInfo | None:
    return {written_name(name, info): info for name, info in model.model_fields.items()}.get(
        str(key)
    )


def _keys(model: type[BaseModel], *, required: bool = False) -> list[str]:
    return [
        written_name(name, info)
        for name, info in model.model_fields.items()
        if info.is_required() or not required
    ]


def _missing(loc: Sequence[int | str], joint: type[BaseModel]) -> str:
    model = _model_at(loc[:-1], joint)
    info = None if model is None else _field(model, loc[-1])
    section = None if info is None else section_of(info)
    if section is not None:
        needed = ", ".join(_keys(section, required=True) or _keys(section))
        return f"[{_dotted(loc)}] is missing: a section with {needed}"
    kinds = [item for item in (info.metadata if info else []) if isinstance(item, units.Kind)]
    advice = f": {kinds[0].advice()}" if kinds else ""
    return f"{_dotted(loc)} is missing{advice}"


def _unknown(loc: Sequence[int | str], joint: type[BaseModel]) -> str:
    key, place = str(loc[-1]), _dotted(loc[:-1])
    model = _model_at(loc[:-1], joint) or joint
    known = _keys(model)
    part = [name for name in known if key in name.split("_")]
    close = part or difflib.get_close_matches(key, known, n=1, cutoff=0.5)
    where = f"in [{place}]" if place else "at the top of the file"
    if close:
        return f"{_dotted(loc)} is not a known key; the nearest {where} is {close[0]!r}"
    homes = [name for name, info in joint.model_fields.items() if _has(info, key)]
    if homes:
        return f"{_dotted(loc)} is not a known key {where}; it belongs in [{homes[0]}]"
    return f"{_dotted(loc)} is not a known key; {where} there are {', '.join(known)}"


def _has(info: FieldInfo, key: str) -> bool:
    section = section_of(info)
    return section is not None and key in _keys(section)
