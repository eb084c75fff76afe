"""Short printing of results: what they hold and how much of it, never thousands of numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from html import escape
from typing import Any

FEW = 4
"""Entries of a tuple or a mapping that are shown one by one."""


def brief(value: Any) -> str:
    """One line for a value of any kind.

    Examples
    --------
    >>> brief(0.1234567), brief((1, 2, 3)), brief({"clamp": 1e6}), brief("cycle")
    ('0.123457', '(1, 2, 3)', '{clamp: 1e+06}', "'cycle'")
    """
    if isinstance(value, bool) or value is None:
        return repr(value)
    if isinstance(value, float | complex):
        return f"{value:.6g}"
    if isinstance(value, int | str):
        return repr(value)
    shape = getattr(value, "shape", None)
    if shape is not None:
        return f"{'x'.join(map(str, shape)) or 'scalar'} {getattr(value, 'dtype', '')}".rstrip()
    if isinstance(value, Mapping):
        if len(value) > FEW:
            return f"{len(value)} entries"
        return "{" + ", ".join(f"{k}: {brief(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list | tuple):
        if len(value) > FEW or any(isinstance(item, Brief) for item in value):
            kinds = {type(item).__name__ for item in value}
            return f"{len(value)} {kinds.pop() if len(kinds) == 1 else 'items'}"
        return "(" + ", ".join(map(brief, value)) + ")"
    return type(value).__name__


class Brief:
    """Base of frozen dataclasses that print as a line, and in a notebook as a small table."""

    def _shown(self) -> list[tuple[str, str]]:
        """Names and short values of the fields."""
        own = [
            (f.name, brief(getattr(self, f.name)))
            for f in fields(self)  # type: ignore[arg-type]
            if f.repr
        ]
        return own

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{n}={v}' for n, v in self._shown())})"

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><th style='text-align:left'>{escape(name)}</th>"
            f"<td style='text-align:left'>{escape(text)}</td></tr>"
            for name, text in self._shown()
        )
        return f"<table><caption>{escape(type(self).__name__)}</caption>{rows}</table>"
