"""Pictures of the documentation: draw those again that are older than what they show.

    python tools/pictures.py            those that are stale, or were never stamped
    python tools/pictures.py --check    says which are, and ends with 1 where there is any
    python tools/pictures.py NAME ...   these recipes of docs/images/recipes.toml

A recipe with ``needs`` is left out where that package is not installed.

``docs/images/stamps.json`` keeps for every recipe a digest of what its pictures are made from: the
version of the package, the joint file without its comments, and the code that draws, without
its comments and docstrings. It also keeps the frequencies and the opening moment of
the joint, which a test computes again, and a digest of each picture.
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import importlib.util
import json
import shutil
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from microslip.registry import ANALYSES

ROOT = Path(__file__).parents[1]
IMAGES = ROOT / "docs" / "images"
RECIPES = IMAGES / "recipes.toml"
STAMPS = IMAGES / "stamps.json"
PACKAGE = ROOT / "src" / "microslip"
PLOTS = "microslip.show.plots"
GENERATED = "generated"
"""Folder of pictures that the build of the documentation draws itself."""

UNANSWERED = 3
"""Exit code of a command whose results are there, with something left unanswered."""


@dataclass(frozen=True)
class Recipe:
    """Pictures that are made together.

    Attributes
    ----------
    name : str
    joint : str
        Joint file; empty where commands make the pictures.
    figures : dict of str to str
        Figure of the run by picture.
    commands : list of list of str
        Arguments of Python.
    inputs : list of str
        Files and folders of Python files that the commands draw from.
    pictures : list of str
        Below ``docs/images``.
    needs : str
        A package that draws them and need not be there.
    """

    name: str
    joint: str = ""
    figures: dict[str, str] = field(default_factory=dict)
    commands: list[list[str]] = field(default_factory=list)
    inputs: list[str] = field(default_factory=list)
    pictures: list[str] = field(default_factory=list)
    needs: str = ""

    @property
    def files(self) -> list[str]:
        """All pictures."""
        return [*self.figures, *self.pictures]


def recipes() -> dict[str, Recipe]:
    """All recipes by name."""
    found = tomllib.loads(RECIPES.read_text("utf-8"))
    return {name: Recipe(name, **entry) for name, entry in found.items()}


def stamps() -> dict[str, Any]:
    """What pictures were made from when they were made."""
    return json.loads(STAMPS.read_text("utf-8")) if STAMPS.is_file() else {}


def meaning(path: Path) -> str:
    """Content of a file, without what changes nothing: comments, docstrings, layout."""
    if path.suffix == ".toml":
        found = tomllib.loads(path.read_text("utf-8"))
        return json.dumps(found, sort_keys=True, default=str)
    if path.suffix == ".py":
        tree = ast.parse(path.read_text("utf-8"))
        for node in ast.walk(tree):
            body = getattr(node, "body", None)
            if isinstance(body, list):
                kept = [one for one in body if not _is_text(one)]
                node.body = kept  # type: ignore[attr-defined]
        return ast.dump(tree)
    return hashlib.sha256(path.read_bytes()).hexdigest()


def _is_text(node: ast.AST) -> bool:
    """Whether a statement is a bare string."""
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)


def drawing_modules(figure: str) -> set[Path]:
    """Modules of ``show/plots`` that draw a figure of a run: its own, and all that it imports there."""
    named = {name: at for row in ANALYSES.values() for name, at in row.figures.items()}
    home = next((at for name, at in named.items() if f"{figure}_".startswith(f"{name}_")), "")
    module = str(home).split(":")[0].rsplit(".", 1)[-1] or figure
    waiting, found = [module], set[Path]()
    while waiting:
        path = PACKAGE / "show" / "plots" / f"{waiting.pop()}.py"
        if path in found or not path.is_file():
            continue
        found.add(path)
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith(PLOTS + "."):
                waiting.append(str(node.module).rsplit(".", 1)[1])
    return found


def sources(recipe: Recipe) -> Iterator[Path]:
    """Files whose change makes the pictures stale."""
    if recipe.joint:
        yield ROOT / recipe.joint
    for figure in recipe.figures.values():
        yield from sorted(drawing_modules(figure))
    for entry in recipe.inputs:
        path = ROOT / entry
        yield from sorted(path.rglob("*.py")) if path.is_dir() else [path]


def digest(recipe: Recipe) -> str:
    """Of all that the pictures are made from."""
    version = (PACKAGE / "version.py").read_text("utf-8")
    parts = [version, json.dumps([recipe.figures, recipe.commands, recipe.pictures])]
    parts += [f"{path.relative_to(ROOT)}\n{meaning(path)}" for path in sources(recipe)]
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()[:16]


def stale() -> dict[str, str]:
    """Why pictures are not what their recipe would make of them now, by recipe.

    Also pictures without a recipe, by file.
    """
    kept, found = stamps(), dict[str, str]()
    known = recipes()
    for name, recipe in known.items():
        missing = [file for file in recipe.files if not (IMAGES / file).is_file()]
        if missing:
            found[name] = f"missing: {', '.join(missing)}"
        elif name not in kept:
            found[name] = UNSTAMPED
        elif kept[name]["made_from"] != digest(recipe):
            found[name] = "older than the joint file or the code that draws"
        elif any(_hash(IMAGES / file) != kept[name]["pictures"].get(file) for file in recipe.files):
            found[name] = "not the picture that its recipe made"
    made = {file for recipe in known.values() for file in recipe.files}
    for path in sorted(IMAGES.rglob("*.png")):
        file = path.relative_to(IMAGES).as_posix()
        if file not in made and not file.startswith(GENERATED):
            found[file] = "has no recipe"
    return found


UNSTAMPED = "not drawn since pictures are stamped"


def _hash(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()[:16]


def make(recipe: Recipe) -> dict[str, Any]:
    """Make the pictures of a recipe, and give their stamp."""
    facts: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as place:
        out = Path(place) / "out"
        if recipe.joint:
            words = ["-m", "microslip", "run", recipe.joint, "--out", str(out)]
            _python([*words, "--format", "png", "--renderer", "matplotlib"])
            facts = facts_of(json.loads((out / "summary.json").read_text("utf-8")))
            for file, figure in recipe.figures.items():
                target = IMAGES / file
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(out / "figures" / f"{figure}.png", target)
        for words in recipe.commands:
            _python([word.replace("{out}", str(out)) for word in words])
    return {
        "made_from": digest(recipe),
        "joint": facts,
        "pictures": {file: _hash(IMAGES / file) for file in recipe.files},
    }


def facts_of(summary: dict[str, Any]) -> dict[str, float]:
    """What every analysis of a lap joint stands on, from the summary of a run; nothing of other joints."""
    model = summary["model"]
    keys = (
        "sliding_frequency_hz",
        "stuck_frequency_hz",
        "opening_moment_over_clamp_force_length",
    )
    return {key: model[key] for key in keys} if set(keys) <= set(model) else {}


def _python(words: list[str]) -> None:
    done = subprocess.run([sys.executable, *words], cwd=ROOT, check=False)
    if done.returncode not in (0, UNANSWERED):
        raise SystemExit(f"{' '.join(words)}: ended with {done.returncode}")


def main() -> None:
    """Draw what is stale, or say what is."""
    parser = argparse.ArgumentParser(description="Pictures of the documentation.")
    parser.add_argument("names", nargs="*", help="Recipes to make whether stale or not.")
    parser.add_argument("--check", action="store_true", help="Only say which are stale.")
    wanted = parser.parse_args()
    old = stale()
    for name, reason in old.items():
        print(f"docs/images: {name}: {reason}")
    if wanted.check:
        sys.exit(1 if old else 0)
    known = recipes()
    for name in wanted.names or [name for name in known if name in old]:
        needs = known[name].needs
        if needs and importlib.util.find_spec(needs) is None:
            print(f"left out {name}: {needs} is not installed")
            continue
        print(f"drawing {name} ...", flush=True)
        kept = {**stamps(), name: make(known[name])}
        STAMPS.write_text(json.dumps(kept, indent=1, sort_keys=True) + "\n", "utf-8")


if __name__ == "__main__":
    main()
