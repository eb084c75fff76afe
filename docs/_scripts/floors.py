"""Draw the floors of the house from the contract that the linter holds, and the modules on each.

    python docs/_scripts/floors.py PICTURE

Floors are read from ``[tool.importlinter]`` in pyproject.toml, rooms from the folders of the package.
"""

from __future__ import annotations

import sys
import textwrap
import tomllib
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.patches import FancyBboxPatch

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "src" / "microslip"

SAID = {
    "cli": "one file a command",
    "reproduce": "the paper, figure by figure",
    "show": "terminal, figures, files of a run",
    "results": "names, dimensions, units; rows and datasets",
    "pipeline": "from a description to outcomes",
    "analyses": "prepared joint in, frozen result or failure out",
    "contact": "Signorini and Coulomb, certified",
    "model": "structure or matrices to the joint model",
    "describe": "what a user may write",
    "numerics": "knows no joint",
}
"""What each floor is for."""

INK, PAPER, EDGE, SOFT = "#1f2933", "#f4f1ea", "#7b8794", "#52606d"


def floors() -> list[list[str]]:
    """Rooms of every floor, top floor first."""
    with (ROOT / "pyproject.toml").open("rb") as file:
        contracts = tomllib.load(file)["tool"]["importlinter"]["contracts"]
    layers = next(c["layers"] for c in contracts if c["name"].startswith("Floors"))
    return [[room.strip(" ()") for room in layer.replace("|", ":").split(":")] for layer in layers]


def rooms(name: str) -> list[str]:
    """Modules of a room; those of a folder inside it behind the folder's name."""
    folder = PACKAGE / name
    if not folder.is_dir():
        return []
    found = [p.stem for p in sorted(folder.glob("*.py")) if p.stem != "__init__"]
    for inner in sorted(p for p in folder.iterdir() if (p / "__init__.py").is_file()):
        modules = [p.stem for p in sorted(inner.glob("*.py")) if p.stem != "__init__"]
        found.append(f"{inner.name}/ " + " ".join(modules))
    return found


def text_of(name: str, width: int) -> list[str]:
    """Lines that list what is in a room."""
    lines: list[str] = []
    plain = [room for room in rooms(name) if "/" not in room]
    if len(plain) > 26:
        plain = [*plain[:22], f"and {len(plain) - 22} more"]
    if plain:
        lines += textwrap.wrap("  ".join(plain), width, break_on_hyphens=False)
    for inner in (room for room in rooms(name) if "/" in room):
        lines += textwrap.wrap(inner, width, subsequent_indent="    ")
    return lines


def draw(path: Path) -> None:
    """Floors as boxes, the top one first; what stands side by side knows nothing of each other."""
    line, gap, head, width = 0.165, 0.13, 0.36, 10.0
    drawn = []
    for floor in floors():
        named = [name for name in floor if (PACKAGE / name).is_dir()]
        if named:
            share = 118 // len(named) - (3 if len(named) > 1 else 0)
            drawn.append([(name, text_of(name, share)) for name in named])
        elif any((PACKAGE / f"{name}.py").is_file() for name in floor) and "__main__" not in floor:
            drawn.append([("ground", ["  ".join(floor)])])
    heights = [head + line * max(len(lines) for _, lines in floor) + 0.1 for floor in drawn]
    total = sum(heights) + gap * (len(heights) + 1)
    figure, axes = plt.subplots(figsize=(width, total))
    axes.set(xlim=(0, width), ylim=(0, total))
    axes.axis("off")
    figure.subplots_adjust(0, 0, 1, 1)
    y = total - gap
    for floor, height in zip(drawn, heights, strict=True):
        wide = (width - gap * (len(floor) + 1)) / len(floor)
        for k, (name, lines) in enumerate(floor):
            x = gap + k * (wide + gap)
            axes.add_patch(
                FancyBboxPatch(
                    (x, y - height),
                    wide,
                    height,
                    boxstyle="round,pad=0,rounding_size=0.06",
                    facecolor=PAPER,
                    edgecolor=EDGE,
                    linewidth=0.8,
                )
            )
            axes.text(x + 0.12, y - 0.09, name, weight="bold", size=11, va="top", color=INK)
            axes.text(
                x + wide - 0.12, y - 0.11, SAID.get(name, "errors, types, the table of analyses"),
                size=9, va="top", ha="right", color=SOFT, style="italic",
            )  # fmt: skip
            for i, text in enumerate(lines):
                axes.text(
                    x + 0.12, y - head - i * line, text, size=7.6, va="top", color=INK,
                    family="monospace",
                )  # fmt: skip
        y -= height + gap
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)
    plt.close(figure)


if __name__ == "__main__":
    draw(Path(sys.argv[1]))
