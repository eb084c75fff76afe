"""Tables on a terminal that is narrower than they are."""

from __future__ import annotations

import io

import pytest
from rich.console import Console
from rich.table import Table

from microslip.show.terminal import _print

NUMBERS = [f"{10.0**k:.8g}" for k in range(9)]


@pytest.mark.parametrize("width", [20, 60, 80, 200])
def test_no_number_and_no_name_is_cut(width):
    table = Table(box=None, title="Time domain")
    for k in range(len(NUMBERS)):
        table.add_column(f"frequency {k},\nHz", justify="right", no_wrap=True)
    table.add_row(*NUMBERS)
    file = io.StringIO()
    _print(table, Console(file=file, width=width))
    shown = file.getvalue()
    assert "…" not in shown
    (row,) = [line for line in shown.splitlines() if NUMBERS[-1] in line]
    assert row.split() == NUMBERS
