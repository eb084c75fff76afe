"""Tables of several runs side by side: what their joint files and what their answers differ in."""

from __future__ import annotations

import math
from collections.abc import Sequence

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from microslip.results.comparison import Named, Quantity, quantities
from microslip.results.differences import differing_keys

DIGITS = ".5g"


def print_comparison(runs: Sequence[Named], console: Console) -> None:
    """Keys that differ, and numbers with their change from the first run.

    Parameters
    ----------
    runs : sequence of Named
    console : rich.console.Console
    """
    if len({each.run.joint.title for each in runs}) > 1:
        for each in runs:
            console.print(f"  {escape(each.label)}", highlight=False, soft_wrap=True)
    keys = differing_keys([each.run.joint for each in runs])
    if keys:
        table = _table("What the joint files say", "key", runs)
        for key, values in keys:
            table.add_row(escape(key), *map(escape, values))
        console.print(table)
    else:
        console.print("The joint files say the same.", highlight=False)
    table = _table("What was found", "", runs, changes=True)
    for row in quantities(runs):
        table.add_row(*_cells(row))
    console.print(table)
    for each in runs:
        missing = len(each.run.failures)
        if missing:
            has = "thing asked for has" if missing == 1 else "things asked for have"
            console.print(
                f"  [yellow]![/yellow] {escape(each.name)}: {missing} {has} no answer",
                highlight=False,
                soft_wrap=True,
            )


def _table(title: str, first: str, runs: Sequence[Named], changes: bool = False) -> Table:
    table = Table(title=title, title_justify="left", box=None, pad_edge=True)
    table.add_column(first)
    for i, each in enumerate(runs):
        least = 9 if changes else None
        table.add_column(escape(each.name), justify="right", min_width=least, overflow="fold")
        if changes and i:
            table.add_column("change", justify="right", no_wrap=True)
    return table


def _cells(row: Quantity) -> list[str]:
    """Name, and of every run its value; from the second run on the change as well."""
    cells = [f"{row.name}, {row.unit}" if row.unit else row.name]
    bounds = row.bounds or (False,) * len(row.values)
    every = zip(row.values, bounds, row.changes(), strict=True)
    for i, (value, bound, change) in enumerate(every):
        cells.append(("≥ " if bound else "") + _value(value))
        if i:
            cells.append("" if math.isnan(change) or bound else _percent(change))
    return [escape(cell) for cell in cells]


def _percent(change: float) -> str:
    """Change in per cent; none where it rounds to nothing."""
    return "0 %" if abs(change) < 5e-4 else f"{100 * change:+.1f} %"


def _value(value: float | str | None) -> str:
    if value is None:
        return "–"
    return value if isinstance(value, str) else format(value, DIGITS)
