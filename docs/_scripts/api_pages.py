"""Write the API pages, one a folder, from the folders of the package: no public module is left out.

python docs/_scripts/api_pages.py FOLDER
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Sequence
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
    """Dotted names of the modules of a folder, without those of folders in it."""
    here = sorted(p for p in folder.glob("*.py") if not p.name.startswith("_"))
    return [".".join(p.relative_to(PACKAGE.parent).with_suffix("").parts) for p in here]


def inner_folders(folder: Path) -> list[Path]:
    """Packages in a folder."""
    return sorted(p for p in folder.iterdir() if (p / "__init__.py").is_file())


def page(title: str, said: str, names: list[str], further: Sequence[str] = ()) -> str:
    """Markdown of one folder: a table of its modules, the pages of its folders, then each module."""
    parts = [f"# {title}", *filter(None, [said])]
    if further:
        parts.append("```{toctree}\n:maxdepth: 1\n\n" + "\n".join(further) + "\n```")
    if names:
        listed = "\n".join(f"   {name}" for name in names)
        parts.append(f"```{{eval-rst}}\n.. autosummary::\n\n{listed}\n```")
    for name in names:
        parts.append(f"## {name}\n\n```{{eval-rst}}\n.. automodule:: {name}\n   :members:\n```")
    return "\n\n".join(parts) + "\n"


def write_folder(package: Path, title: str | None, said: str, pages: Path) -> str:
    """Pages of a folder and of those in it; its own has its dotted name, which is returned."""
    name = ".".join(package.relative_to(PACKAGE).parts)
    further = [write_folder(inner, None, "", pages) for inner in inner_folders(package)]
    (pages / f"{name}.md").write_text(page(title or name, said, modules(package), further), "utf-8")
    return name


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
    ground = page("Ground", "Errors, types and the table of analyses.", modules(PACKAGE))
    (folder / "ground.md").write_text(ground, "utf-8")
    for wing, said in WINGS.items():
        write_folder(PACKAGE / wing, wing.capitalize(), said, folder)


if __name__ == "__main__":
    write(Path(sys.argv[1]))
