"""Picture of a vibration: the plates of the example at the peak of their response, by harmonic balance.

python docs/evidence/vibration.py FILE
"""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

from microslip import parse_joint, run
from microslip.show.figures import draw_figures, figures_of
from microslip.show.plots.style import save

EXAMPLES = Path(__file__).parents[2] / "examples"
NAME = "motion_harmonic"
LOAD = "50 N/m"
BAND = {"from": "159.75 Hz", "to": "160.75 Hz", "count": 9, "harmonics": 3, "stability": False}


def main(file: Path) -> None:
    """Draw it."""
    document = tomllib.loads((EXAMPLES / "mesh_plates.toml").read_text("utf-8"))
    document["load"]["force"] = [LOAD]
    document["analysis"] = {"harmonic": BAND}
    found = run(parse_joint(document, folder=EXAMPLES))
    figures = draw_figures(NAME, figures_of(found)[NAME], found)
    save(figures[NAME], file.parent, file.stem, ("png",))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
