"""Method "corrected" on random lap joints, against time integration that knows nothing of it.

python benchmarks/population/corrected.py [--seeds 69 70] [--count 20] [--pairs 41]
    [--out FILE] [--page FILE]

As `auto.py`: the response of every joint under its own load, then steady states at its peak, at the
flanks where it is half as large and at five frequencies at random, after the load was raised from rest or,
where that is on another branch, on the branch shown. Lines in FILE (JSON, one a joint) are not computed
again: stop it at any time, and go on with the same command.
"""

from __future__ import annotations

import sys

from auto import cases_of, page
from resumed import answered, study

HEAD = """# Method "corrected" on lap joints at random

Lap joints of populations that it was not developed on, each under the load that it was drawn with: the
forced response by `method = "corrected"`, defaults, against steady states of time integration at its
peak, its flanks and five frequencies at random, as on [the page of method "auto"](population-auto.md)
(`python benchmarks/population/corrected.py`, {pairs} contact pairs). *Claimed*: the response states an
error of at most 1 %; the rest is *flagged*. A motion that is not steady after 4,000 cycles is no
truth, and is counted apart.

"""


def text_of(rows: dict[str, dict]) -> str:
    """The page as Markdown."""
    pairs = sorted({row["pairs"] for row in rows.values()})
    table = page(rows)
    return HEAD.format(pairs=" and ".join(map(str, pairs))) + table[table.index("| |") :]


def main() -> int:
    """Compute what is missing and print the table."""
    asked = study(__doc__, [69, 70], 41, "population-corrected.jsonl").parse_args()
    return answered(asked, cases_of(asked, "corrected"), text_of)


if __name__ == "__main__":
    sys.exit(main())
