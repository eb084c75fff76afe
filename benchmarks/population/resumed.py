"""Rows of a population study in a file, one JSON object a line: what is there is not computed again."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any


def kept_rows(file: Path) -> list[dict[str, Any]]:
    """Rows of an earlier run; none where there is no file."""
    if not file.is_file():
        return []
    return [json.loads(line) for line in file.read_text().splitlines()]


def keep_row(file: Path, row: dict[str, Any]) -> None:
    """Add one row."""
    with file.open("a") as out:
        out.write(json.dumps(row) + "\n")
