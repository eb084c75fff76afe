"""Oldest versions that ``pyproject.toml`` allows, one a line, as pip takes them.

    python tools/oldest.py [EXTRA ...]

Those of the package and of its extras; a package without a lower bound is left out.
"""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path

PROJECT = Path(__file__).parents[1] / "pyproject.toml"
BOUND = re.compile(r"\s*([A-Za-z0-9_.-]+)\s*(?:>=|==)\s*([0-9][0-9a-z.]*)")


def oldest(requirements: list[str]) -> list[str]:
    """Each requirement at its lower bound.

    Examples
    --------
    >>> oldest(["numpy>=1.26", "rich >= 13, <15", "pytest"])
    ['numpy==1.26', 'rich==13']
    """
    bounds = (BOUND.match(one) for one in requirements)
    return [f"{found[1]}=={found[2]}" for found in bounds if found]


def main() -> None:
    """Print them."""
    project = tomllib.loads(PROJECT.read_text("utf-8"))["project"]
    wanted = list(project["dependencies"])
    for extra in sys.argv[1:]:
        wanted += project["optional-dependencies"][extra]
    print("\n".join(oldest(wanted)))


if __name__ == "__main__":
    main()
