"""Studies of a population, their rows in a file, one JSON object a line: what is there is kept.

A study says what its cases are, what one of them says, and what is written of all; `answered` does the rest.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterable, Iterator
from itertools import islice
from pathlib import Path
from typing import Any

from lap_joints import joints

Row = dict[str, Any]
"""What one case says."""


def study(doc: str, seeds: list[int], pairs: int, out: str) -> argparse.ArgumentParser:
    """Arguments that every study of a population has, with its own defaults."""
    parser = argparse.ArgumentParser(description=doc.splitlines()[0])
    parser.add_argument("--seeds", type=int, nargs="+", default=seeds)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--first", type=int, default=0, help="number of the first of each")
    parser.add_argument("--pairs", type=int, default=pairs)
    parser.add_argument("--out", type=Path, default=Path(out))
    parser.add_argument("--page", type=Path)
    return parser


def drawn_joints(asked: argparse.Namespace) -> Iterator[tuple[str, int, str]]:
    """Name, seed of its own and text of every lap joint of the populations."""
    for seed in asked.seeds:
        drawn = enumerate(joints(seed, asked.first + asked.count, asked.pairs))
        for number, text in islice(drawn, asked.first, None):
            yield f"{seed}/{number:03d}", 1000 * seed + number, text


def answered(
    asked: argparse.Namespace,
    cases: Iterable[tuple[str, Callable[[], Row]]],
    page: Callable[[dict[str, Row]], str],
    said: Callable[[Row], str] = lambda row: "",
) -> int:
    """Compute the rows that are missing, print the table and write the page; the exit code.

    Parameters
    ----------
    asked : Namespace
        Of `study`.
    cases : iterable of (str, callable)
        Name of each, and what computes its row, ``wall`` seconds among it.
    page : callable
        From all rows, by name, to Markdown; the table begins with its first line that begins with a bar.
    said : callable
        Of a row, behind its name and seconds.
    """
    rows = {row["joint"]: row for row in kept_rows(asked.out)}
    for name, row_of in cases:
        if name in rows:
            continue
        rows[name] = {"joint": name, **row_of()}
        keep_row(asked.out, rows[name])
        print(name, f"{rows[name]['wall']:.1f} s", said(rows[name]), flush=True)
    text = page(rows)
    print(text[text.index("\n|") + 1 :])
    if asked.page:
        asked.page.write_text(text)
    return 0


def kept_rows(file: Path) -> list[Row]:
    """Rows of an earlier run; none where there is no file."""
    if not file.is_file():
        return []
    return [json.loads(line) for line in file.read_text().splitlines()]


def keep_row(file: Path, row: Row) -> None:
    """Add one row."""
    with file.open("a") as out:
        out.write(json.dumps(row) + "\n")
