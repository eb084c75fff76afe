"""Results as a notebook shows them: a heading, a few facts, and the rows of the summary."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from typing import Any

MOST_ROWS = 12
"""Rows of a table that are shown; the rest is counted."""


def html_page(
    title: str, facts: Mapping[str, str], tables: Mapping[str, Sequence[Mapping[str, Any]]]
) -> str:
    """Facts, and one table per key that has rows.

    Parameters
    ----------
    title : str
    facts : mapping of str to str
    tables : mapping of str to sequence of mapping
        Rows of the same keys; numbers are shown with four digits.

    Examples
    --------
    >>> html_page("A & B", {"pairs": "201"}, {})
    '<h4>A &amp; B</h4><p>pairs: 201</p>'
    """
    lines = "<br>".join(f"{escape(name)}: {escape(fact)}" for name, fact in facts.items())
    body = "".join(html_table(name, rows) for name, rows in tables.items() if rows)
    return f"<h4>{escape(title)}</h4><p>{lines}</p>{body}"


def html_table(name: str, rows: Sequence[Mapping[str, Any]]) -> str:
    """Rows under the keys of the first, in a block that opens."""
    keys = list(rows[0])
    head = "".join(f"<th>{escape(key.replace('_', ' '))}</th>" for key in keys)
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(_cell(row.get(key)))}</td>" for key in keys) + "</tr>"
        for row in rows[:MOST_ROWS]
    )
    rest = f"<p>and {len(rows) - MOST_ROWS} more</p>" if len(rows) > MOST_ROWS else ""
    return (
        f"<details><summary>{escape(name)} ({len(rows)})</summary>"
        f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>{rest}</details>"
    )


def _cell(value: Any) -> str:
    if value is None:
        return "–"
    if isinstance(value, float):
        return f"{value:.4g}"
    if isinstance(value, list | tuple):
        return ", ".join(map(_cell, value))
    return str(value)
