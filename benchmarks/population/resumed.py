"""Studies of a population, their rows in a file, one JSON object a line: what is there is kept."""

from __future__ import annotations

import argparse
import json
from collections.abc import Container, Iterator
from pathlib import Path
from typing import Any

from lap_joints import joints


def study(doc: str, seeds: list[int], pairs: int, out: str) -> argparse.ArgumentParser:
    """Arguments that every study of a population has, with its own defaults."""
    parser = argparse.ArgumentParser(description=doc.splitlines()[0])
    parser.add_argument("--seeds", type=int, nargs="+", default=seeds)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--pairs", type=int, default=pairs)
    parser.add_argument("--out", type=Path, default=Path(out))
    parser.add_argument("--page", type=Path)
    return parser


def joints_left(
    asked: argparse.Namespace, rows: Container[str], case: str = ""
) -> Iterator[tuple[str, int, str]]:
    """Name, seed of its own and text of every joint that has no row; a case of it is named behind."""
    for seed in asked.seeds:
        for number, text in enumerate(joints(seed, asked.count, asked.pairs)):
            name = f"{seed}/{number:03d}{case}"
            if name not in rows:
                yield name, 1000 * seed + number, text


def kept_rows(file: Path) -> list[dict[str, Any]]:
    """Rows of an earlier run; none where there is no file."""
    if not file.is_file():
        return []
    return [json.loads(line) for line in file.read_text().splitlines()]


def keep_row(file: Path, row: dict[str, Any]) -> None:
    """Add one row."""
    with file.open("a") as out:
        out.write(json.dumps(row) + "\n")
