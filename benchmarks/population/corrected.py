"""Method "corrected" on random lap joints, against time integration that knows nothing of it.

python benchmarks/population/corrected.py [--seeds 69 70] [--count 20] [--pairs 41]
    [--out FILE] [--page FILE]

As `auto.py`: the response of every joint under its own load, then steady states at its peak, at the
flanks where it is half as large and at five frequencies at random, after the load was raised from rest or,
where that is on another branch, on the branch shown. Lines in FILE (JSON, one a joint) are not computed
again: stop it at any time, and go on with the same command.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np
from auto import page, row_of
from lap_joints import joints
from resumed import keep_row, kept_rows

HEAD = """# Method "corrected" on lap joints at random

Lap joints of populations that it was not developed on, each under the load that it was drawn with: the
forced response by `method = "corrected"`, defaults, against steady states of time integration at its
peak, its flanks and five frequencies at random, as on [the page of method "auto"](population-auto.md)
(`python benchmarks/population/corrected.py`, {pairs} contact pairs). *Claimed*: the response states an
error of at most 1 %; the rest is *flagged*. A steady state that did not settle within 400 cycles is no
truth, and is counted apart.

"""


def text_of(rows: dict[str, dict]) -> str:
    """The page as Markdown."""
    pairs = sorted({row["pairs"] for row in rows.values()})
    table = page(rows)
    return HEAD.format(pairs=" and ".join(map(str, pairs))) + table[table.index("| |") :]


def main() -> int:
    """Compute what is missing and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, nargs="+", default=[69, 70])
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--pairs", type=int, default=41)
    parser.add_argument("--out", type=Path, default=Path("population-corrected.jsonl"))
    parser.add_argument("--page", type=Path)
    asked = parser.parse_args()
    rows = {row["joint"]: row for row in kept_rows(asked.out)}
    for seed in asked.seeds:
        for number, text in enumerate(joints(seed, asked.count, asked.pairs)):
            name = f"{seed}/{number:03d}"
            if name in rows:
                continue
            rng = np.random.default_rng(1000 * seed + number)
            found = row_of(text, 1.0, rng, "corrected")
            rows[name] = {"joint": name, "pairs": asked.pairs, **found}
            keep_row(asked.out, rows[name])
            print(name, f"{rows[name]['wall']:.1f} s", flush=True)
    text = text_of(rows)
    print(text[text.index("| |") :])
    if asked.page:
        asked.page.write_text(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
