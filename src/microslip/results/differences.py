"""Keys of joint files whose values differ, as one would write them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from microslip.describe.joint import Joint
from microslip.describe.keys import sections
from microslip.describe.units import readable
from microslip.describe.units_of_the_whole import in_whole

LONGEST = 28
"""Characters of a value; of longer ones the middle is left out."""

GIVEN = "given"
"""What stands for a whole section that another file does without."""

NOT_COMPARED = "title"

PREFIXED = ("m", "Pa", "N", "N/m", "Hz", "s", "N/m/m")
"""Units that take a prefix."""


def differing_keys(joints: Sequence[Joint]) -> list[tuple[str, tuple[str, ...]]]:
    """Keys whose values differ; the title is not compared.

    Parameters
    ----------
    joints : sequence of Joint

    Returns
    -------
    list of (str, tuple of str)
        Key with its section, ``clamp.force``, and its value in every file: a dash where it is left
        out.

    Examples
    --------
    >>> from microslip import reference_joint
    >>> differing_keys([reference_joint(pairs=21), reference_joint(pairs=51)])
    [('contact.pairs', ('21', '51'))]
    """
    said = [dict(_leaves(joint.model_dump(by_alias=True))) for joint in joints]
    absent = [dict.fromkeys(key for key, value in one.items() if value is None) for one in said]
    for one in said:
        left_out = dict.fromkeys(section for other in absent for section in other)
        one |= {section: GIVEN for section in left_out if any(_in(key, section) for key in one)}
    keys = sorted(dict.fromkeys(key for one in said for key in one), key=_section)
    found = list(zip(said, map(_units, joints), strict=True))
    return [
        (key, tuple(_text(one.get(key), unit.get(_general(key), "")) for one, unit in found))
        for key in keys
        if key != NOT_COMPARED and _differs(key, said, absent)
    ]


def _units(joint: Joint) -> dict[str, str]:
    """Units of the keys of a joint: per metre of width, or of the whole."""
    return {
        f"{section.path}.{key.name}".lstrip("."): in_whole(key.unit) if joint.whole else key.unit
        for section in sections(type(joint))
        for key in section.keys
    }


def _in(key: str, section: str) -> bool:
    """Whether a key lies in a section."""
    return key.startswith((f"{section}.", f"{section}["))


def _section(key: str) -> str:
    """The section at the top that a key lies in."""
    return key.partition(".")[0].partition("[")[0]


def _differs(
    key: str, said: Sequence[Mapping[str, Any]], absent: Sequence[Mapping[str, Any]]
) -> bool:
    """Whether files differ in a key, of those that do not do without its whole section."""
    values = [
        one.get(key)
        for one, sections in zip(said, absent, strict=True)
        if not any(_in(key, section) for section in sections)
    ]
    return any(value != values[0] for value in values)


def _leaves(value: Any, key: str = "") -> Iterator[tuple[str, Any]]:
    """Values that are no sections, by key; entries of a list of sections by their name."""
    if isinstance(value, Mapping):
        for name, part in value.items():
            yield from _leaves(part, f"{key}.{name}" if key else str(name))
    elif isinstance(value, list | tuple) and value and isinstance(value[0], Mapping):
        for i, part in enumerate(value):
            yield from _leaves(part, f"{key}[{part.get('name', i + 1)}]")
    else:
        yield key, None if value in ((), []) else value


def _general(key: str) -> str:
    """A key without the name of the entry: ``output[tip].x`` is a key of ``output``."""
    before, bracket, after = key.partition("[")
    return before + after.partition("]")[2] if bracket else key


def _text(value: Any, unit: str) -> str:
    """A value as one would write it, cut in the middle where it is long."""
    if value is None:
        return "–"
    if isinstance(value, list | tuple):
        text = ", ".join(_text(part, "") for part in value) + (f" {unit}" if unit else "")
    elif isinstance(value, float) and unit in PREFIXED:
        text = readable(value, unit, 6)
    elif isinstance(value, float):
        text = f"{value:.6g} {unit}".strip()
    else:
        text = str(value)
    if len(text) > LONGEST:
        text = f"{text[: LONGEST // 2]} … {text[-LONGEST // 2 + 3 :]}"
    return text
