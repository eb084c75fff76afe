"""What three checks tell of a response of the refined model, on random lap joints.

python benchmarks/population/checked.py [--seeds 77 78] [--count 20] [--pairs 41] [--out FILE] [--page FILE]

The response of every joint under its own load with the defaults: the refined model, held against the full
joint at its peak and about half power. Then motions of the full joint as in `auto.py`, at the peak, at the
flanks where it is half as large and at five frequencies at random, marched until they are steady. Lines in
FILE (JSON, one a joint) are not computed again.
"""

from __future__ import annotations

import sys

import numpy as np
from auto import ASKED, cases_of
from resumed import answered, study

HEAD = """# What a response of the refined model is held against

Lap joints drawn at random, each under the load that it was drawn with: the forced response with the defaults,
which hold the refined model against motions of the full joint at its peak and about half power
(`python benchmarks/population/checked.py`, {pairs} contact pairs). Beside that its error at other motions of
the full joint: at the peak, where it is half as large, and at five frequencies at random.

| {joints} joints of population {populations} | joints | motions | within 1 % | within 3 % | largest |
|---|---|---|---|---|---|
"""


def kind(row: dict) -> str:
    """What the checks said of a joint."""
    errors = np.abs(row["checks"])
    if not len(errors):
        return "no peak to check"
    if np.isnan(errors).any():
        return "a check without a steady motion"
    return "all checks within 1 %" if errors.max() <= ASKED else "a check beyond 1 %"


def text_of(rows: dict[str, dict]) -> str:
    """The page as Markdown."""
    found = [row for row in rows.values() if "points" in row]
    lines = []
    for name in dict.fromkeys(sorted(map(kind, found))):
        mine = [row for row in found if kind(row) == name]
        errors = np.array([p["error"] for row in mine for p in row["points"] if p["settled"]])
        if not len(errors):
            lines.append(f"| {name} | {len(mine)} | 0 | – | – | – |")
            continue
        shares = " | ".join(f"{100 * np.mean(errors <= limit):.0f} %" for limit in (0.01, 0.03))
        most = f"{100 * errors.max():.0f} %"
        lines.append(f"| {name} | {len(mine)} | {len(errors)} | {shares} | {most} |")
    head = HEAD.format(
        pairs=" and ".join(map(str, sorted({row["pairs"] for row in rows.values()}))),
        joints=len(found),
        populations=", ".join(sorted({name.partition("/")[0] for name in rows})),
    )
    failed = [f"| {name} | {row['failed']} |" for name, row in rows.items() if "failed" in row]
    if failed:
        lines += ["", "| joint | failed |", "|---|---|", *failed]
    return head + "\n".join(lines) + "\n"


def main() -> int:
    """Compute what is missing and print the table."""
    asked = study(__doc__, [77, 78], 41, "population-checked.jsonl").parse_args()
    return answered(asked, cases_of(asked, "reduced"), text_of)


if __name__ == "__main__":
    sys.exit(main())
