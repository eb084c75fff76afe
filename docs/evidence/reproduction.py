"""Turn the output of ``microslip reproduce all`` into pages of the docs.

Usage: ``python docs/evidence/reproduction.py FOLDER``, the folder that ``reproduce`` wrote.
"""

import json
import shutil
import sys
from pathlib import Path

from microslip.reproduce.gallery import gallery, tables

DOCS = Path(__file__).parents[1]


def main() -> None:
    folder = Path(sys.argv[1])
    report = json.loads((folder / "reproduction.json").read_text(encoding="utf-8"))
    images = DOCS / "images" / "reproduction"
    images.mkdir(parents=True, exist_ok=True)
    for picture in sorted((folder / "figures").glob("*.png")):
        shutil.copy(picture, images)
    page = gallery(report, "images/reproduction")
    (DOCS / "reproduction-gallery.md").write_text(page, encoding="utf-8")
    numbers = "# Numbers, trends, errata and times\n\n" + tables(report)
    (DOCS / "reproduction-numbers.md").write_text(numbers, encoding="utf-8")


if __name__ == "__main__":
    main()
