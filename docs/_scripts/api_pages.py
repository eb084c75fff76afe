"""Write the API pages, one a wing, from the folders of the package: no public module is left out.

python docs/_scripts/api_pages.py FOLDER
"""

from __future__ import annotations

import ast
import sys
from pathlib import Path

PACKAGE = Path(__file__).parents[2] / "src" / "microslip"

WINGS = {
    "describe": "What a user may write: validated descriptions, without numerics.",
    "numerics": "Methods that know no joint.",
    "model": "From a description, a mesh or matrices to the joint model.",
    "contact": "Signorini–Coulomb contact: solver, certificate, layout of the pairs.",
    "analyses": "Every analysis of a prepared joint.",
    "pipeline": "From a description to outcomes, and the order in which analyses run.",
    "results": "What a run holds, by name, with dimensions and units.",
    "show": "Terminal, figures, files.",
    "reproduce": "The 2021 paper, figure by figure.",
    "cli": "Commands.",
}
"""Wings in the order of the floors, and what each is for."""


def modules(folder: Path) -> list[str]:
    """Dotted names of the modules of a folder, those of its own folders after them."""
    root = PACKAGE.parent
    here = sorted(p for p in folder.glob("*.py") if not p.name.startswith("_"))
    names = [".".join(p.relative_to(root).with_suffix("").parts) for p in here]
    for inner in sorted(p for p in folder.iterdir() if (p / "__init__.py").is_file()):
        names += modules(inner)
    return names


def page(title: str, said: str, names: list[str]) -> str:
    """Markdown of one wing."""
    listed = "\n".join(f"   {name}" for name in names)
    return (
        f"# {title}\n\n{said}\n\n"
        f"```{{eval-rst}}\n.. autosummary::\n   :toctree: generated\n\n{listed}\n```\n"
    )


def face() -> list[str]:
    """Public names of the package, from its own table."""
    tree = ast.parse((PACKAGE / "__init__.py").read_text("utf-8"))
    for node in tree.body:
        if isinstance(node, ast.Assign) and getattr(node.targets[0], "id", "") == "_HOME":
            home = ast.literal_eval(node.value)
            return [f"microslip.{home[name]}.{name}" for name in sorted(home, key=str.lower)]
    raise SystemExit("the public face has no table of names")


def write(folder: Path) -> None:
    """All pages into a folder, beside its index."""
    folder.mkdir(parents=True, exist_ok=True)
    listed = "\n".join(f"   {name}" for name in face())
    (folder / "face.md").write_text(
        "# Public names\n\nWhat `import microslip` gives: `microslip.cycle`, `microslip.run`, ...\n\n"
        f"```{{eval-rst}}\n.. autosummary::\n\n{listed}\n```\n",
        "utf-8",
    )
    ground = sorted(p for p in PACKAGE.glob("*.py") if not p.name.startswith("_"))
    pages = {"ground": ("Ground", "Errors, types and the table of analyses.", ground)}
    (folder / "ground.md").write_text(
        page(*pages["ground"][:2], [f"microslip.{p.stem}" for p in ground]), "utf-8"
    )
    for wing, said in WINGS.items():
        text = page(wing.capitalize(), said, modules(PACKAGE / wing))
        (folder / f"{wing}.md").write_text(text, "utf-8")


if __name__ == "__main__":
    write(Path(sys.argv[1]))
