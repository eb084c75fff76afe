"""Rules of the house that no linter knows: ``python tools/house.py [FOLDER OF THE PACKAGE]``.

Which floor may import which, and that there are no circles, is import-linter's business (contracts
in ``pyproject.toml``). This script reads every module without importing it, prints one line per
place where a rule is broken, ``file:line: what, and what to do``, and exits with 1 if there is any.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

LONGEST = 450
"""Lines of a module that needs no reason at its top, in a comment ``# Length: why``."""

LAZY = {
    "__init__.py": "the public face, imported name by name",
    "cli/main.py": "a command's module is imported when the command is asked for",
}
"""Modules that may import while they run."""

OPTIONAL = {"ansys", "meshio", "pint", "pypardiso", "pyuff", "pyvista", "pyyeti", "vtkmodules"}
"""Packages that may be imported inside a function: slow to import, and rarely needed."""

STRIDES = {
    "contact/pairs.py": "the layout of v and r itself",
    "numerics/fourier.py": "real and imaginary parts, side by side",
    "model/elasticity.py": "x and y of every node",
    "model/interface.py": "corner and middle nodes of a row of elements",
    "show/plots/history.py": "crests and troughs of an envelope, in turn",
}
"""Modules that may stride over arrays by 2 or by the dimension."""

STATES = {"contact/pairs.py": "numbers the contact states"}
"""Modules that may compare contact states with their numbers."""

DIMENSIONS = {"d", "dim", "dimension"}
TUPLES = {"_replace", "_asdict", "_fields", "_make", "_field_defaults"}
"""Underscored names of `NamedTuple` that are public."""

Finding = tuple[int, str]
"""Line, and what is wrong there."""


@dataclass(frozen=True)
class Module:
    """One file of the package.

    Attributes
    ----------
    file : str
        Below the folder of the package: ``contact/pairs.py``.
    name : str
        ``microslip.contact.pairs``.
    folder : str
        The package it lies in: ``microslip.contact``; of an ``__init__.py``, the package itself.
    text : str
    tree : ast.Module
    """

    file: str
    name: str
    folder: str
    text: str
    tree: ast.Module


@dataclass(frozen=True)
class House:
    """All modules, and for each folder the underscored names that its modules define."""

    modules: dict[str, Module]
    private: dict[str, set[str]]

    def home(self, name: str) -> str:
        """Folder that a dotted name of the package lies in; of a foreign one, its own."""
        module = self.modules.get(name)
        return name if module is None else module.folder


def read_house(root: Path) -> House:
    """Every module below a folder that is a package."""
    modules = {}
    private: dict[str, set[str]] = {}
    for path in sorted(root.rglob("*.py")):
        parts = path.relative_to(root.parent).with_suffix("").parts
        package = parts[-1] == "__init__"
        name = ".".join(parts[:-1] if package else parts)
        folder = ".".join(parts[:-1])
        text = path.read_text(encoding="utf-8")
        tree = ast.parse(text, str(path))
        modules[name] = Module(path.relative_to(root).as_posix(), name, folder, text, tree)
        private.setdefault(folder, set()).update(_defined(tree))
    return House(modules, private)


def _defined(tree: ast.Module) -> Iterator[str]:
    """Underscored names that a module gives to functions, classes, variables and attributes."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            found = node.name
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            found = node.id
        elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            found = node.attr
        else:
            continue
        if _is_private(found):
            yield found


def _is_private(name: str) -> bool:
    return name.startswith("_") and not name.endswith("__")


def _imports(module: Module) -> Iterator[tuple[ast.Import | ast.ImportFrom, str, str]]:
    """Statement, module it names, and name it takes from that module (empty: the module)."""
    for node in ast.walk(module.tree):
        if isinstance(node, ast.Import):
            yield from ((node, alias.name, "") for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            source = _absolute(node, module)
            yield from ((node, source, alias.name) for alias in node.names)


def _absolute(node: ast.ImportFrom, module: Module) -> str:
    if node.level == 0:
        return node.module or ""
    above = module.folder.split(".")
    base = above[: len(above) - node.level + 1]
    return ".".join([*base, node.module] if node.module else base)


# -- rules -------------------------------------------------------------------------------------


def private_names(module: Module, house: House) -> Iterator[Finding]:
    """A name with an underscore belongs to the folder of the module that defines it."""
    for node, source, name in _imports(module):
        whole = f"{source}.{name}" if name else source
        hidden = next((part for part in whole.split(".") if _is_private(part)), None)
        if hidden is not None and _owner(whole, hidden, house) != module.folder:
            yield node.lineno, f"imports the private name {whole}: make it public, or stay away"
    known = house.private[module.folder] | TUPLES
    for use in ast.walk(module.tree):
        if (
            isinstance(use, ast.Attribute)
            and _is_private(use.attr)
            and use.attr not in known
            and _last(use.value) not in ("self", "cls")
        ):
            yield use.lineno, f"uses the private name {ast.unparse(use)} of another folder"


def _owner(whole: str, hidden: str, house: House) -> str:
    """Folder of the module, or of the place in it, that a private name belongs to."""
    parts = whole.split(".")
    before = ".".join(parts[: parts.index(hidden)])
    return house.home(before)


def imports_in_functions(module: Module, house: House) -> Iterator[Finding]:
    """What a module needs stands at its top, where readers and import-linter look for it."""
    if module.file in LAZY:
        return
    inside: set[int] = set()
    for function in ast.walk(module.tree):
        if isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef):
            inside.update(id(node) for node in ast.walk(function))
    lines = {
        (node.lineno, source)
        for node, source, _ in _imports(module)
        if id(node) in inside and source.split(".")[0] not in OPTIONAL
    }
    for line, source in sorted(lines):
        yield line, f"imports {source} inside a function: import it at the top"
    for call in ast.walk(module.tree):
        if isinstance(call, ast.Call) and _last(call.func) in ("import_module", "__import__"):
            yield call.lineno, "imports a module by its name while it runs: import it at the top"


def circles_with_a_face(module: Module, house: House) -> Iterator[Finding]:
    """A module does not import from the ``__init__.py`` above it, which may import the module."""
    for node, source, name in _imports(module):
        above = module.name == source or module.name.startswith(f"{source}.")
        if above and f"{source}.{name}" not in house.modules:
            what = f"{name} from {source}" if name else source
            yield node.lineno, f"imports {what}, in which it lies: import the module that has it"


def length(module: Module, house: House) -> Iterator[Finding]:
    """A file is one idea; a long one says at its top why it is long."""
    lines = module.text.splitlines()
    if len(lines) <= LONGEST:
        return
    definitions = (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)
    first = next((n.lineno for n in module.tree.body if isinstance(n, definitions)), len(lines))
    if not any(line.partition("# Length:")[2].strip() for line in lines[:first]):
        yield (
            len(lines),
            f"{len(lines)} lines, more than {LONGEST}: split it, or say at its top '# Length: why'",
        )


def strides(module: Module, house: House) -> Iterator[Finding]:
    """Only `contact.pairs` knows where normal and tangential components stand."""
    if module.file in STRIDES:
        return
    for node in ast.walk(module.tree):
        if isinstance(node, ast.Slice):
            step = node.step
        elif isinstance(node, ast.Call) and _last(node.func) in ("slice", "range", "arange"):
            step = node.args[2] if len(node.args) > 2 else None
        else:
            continue
        if step is not None and _counts_components(step):
            yield (
                node.lineno,
                f"strides by {ast.unparse(step)} ({ast.unparse(node)}): take normal(), "
                "tangential(), ... of contact.pairs",
            )


def _counts_components(step: ast.expr) -> bool:
    if isinstance(step, ast.Constant):
        return step.value == 2
    return _last(step) in DIMENSIONS


def state_numbers(module: Module, house: House) -> Iterator[Finding]:
    """Contact states are compared with their names."""
    if module.file in STATES:
        return
    for node in ast.walk(module.tree):
        if isinstance(node, ast.Compare):
            sides = [node.left, *node.comparators]
            numbers = [s for s in sides if isinstance(s, ast.Constant) and s.value in (1, 2, 3, 4)]
            if numbers and any(_names_states(side) for side in sides):
                yield (
                    node.lineno,
                    f"compares contact states with a number ({ast.unparse(node)}): take STICK, "
                    "SEPARATED, touches(), ... of contact.pairs",
                )


def _names_states(side: ast.expr) -> bool:
    if isinstance(side, ast.Subscript):
        return _names_states(side.value)
    if isinstance(side, ast.Call):
        return any(map(_names_states, [side.func, *side.args]))
    name = _last(side)
    return "status" in name or name in ("state", "states")


def _last(node: ast.expr) -> str:
    """``c`` of ``a.b.c``; empty for what is not a name."""
    if isinstance(node, ast.Attribute):
        return node.attr
    return node.id if isinstance(node, ast.Name) else ""


RULES: tuple[Callable[[Module, House], Iterator[Finding]], ...] = (
    private_names,
    imports_in_functions,
    circles_with_a_face,
    length,
    strides,
    state_numbers,
)


def main(words: list[str]) -> int:
    """Print every finding; 1 where there is one."""
    root = Path(words[0] if words else "src/microslip")
    house = read_house(root)
    if not house.modules:
        print(f"{root}: no modules there")
        return 1
    count = 0
    for module in house.modules.values():
        findings = sorted({found for rule in RULES for found in rule(module, house)})
        for line, what in findings:
            print(f"{root / module.file}:{line}: {what}")
        count += len(findings)
    print(f"{len(house.modules)} modules, {count} findings")
    return 1 if count else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
