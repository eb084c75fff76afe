"""The rules of the house are kept by machine: what breaks one is found, and named."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys

import pytest
from conftest import ROOT

LINT_IMPORTS = "from importlinter.cli import lint_imports_command as run; run()"


class Package:
    """A package to plant things in."""

    def __init__(self, place):
        self.place = place
        self.package = place / "src" / "microslip"

    def plant(self, texts):
        """Write modules: text by file."""
        for file, text in texts.items():
            path = self.package / file
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)

    def lint_imports(self):
        """Exit code and output of import-linter."""
        return self._run("-c", LINT_IMPORTS, "--no-logo", "--no-cache")

    def house(self):
        """Exit code and output of the house script."""
        return self._run(ROOT / "tools" / "house.py", "src/microslip")

    def _run(self, *words):
        done = subprocess.run(
            [sys.executable, *map(str, words)],
            cwd=self.place,
            env={**os.environ, "PYTHONPATH": str(self.place / "src"), "COLUMNS": "200"},
            capture_output=True,
            text=True,
        )
        assert done.stderr == ""
        return done.returncode, done.stdout


@pytest.fixture
def copy(tmp_path):
    """The package itself."""
    shutil.copytree(ROOT / "src", tmp_path / "src", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    return Package(tmp_path)


@pytest.fixture
def small(tmp_path):
    """A package of a few empty rooms, in which nothing is wrong."""
    package = Package(tmp_path)
    rooms = ("", "model/", "analyses/", "results/", "show/", "show/plots/")
    package.plant({f"{room}__init__.py": "" for room in rooms})
    package.plant({"version.py": "", "show/plots/style.py": ""})
    return package


# Remove the mark when every room keeps the rules.
@pytest.mark.parametrize("linter", ["lint_imports", "house"])
def test_the_house_keeps_its_rules(copy, linter):
    code, output = getattr(copy, linter)()
    assert code == 0, output


# -- floors and circles ------------------------------------------------------------------------

UP = "import microslip.results.planted\n"


WAYS = {
    "planted": UP,
    "planted_for_types": f"from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    {UP}",
    "planted_inside": f"def late():\n    {UP}",
}


def test_import_that_runs_up(copy):
    """At the top of a module, for the type checker, and inside a function: all count."""
    floors = ("describe", "numerics", "model", "contact", "analyses", "pipeline")
    copy.plant({"results/planted.py": ""})
    copy.plant({f"{floor}/{name}.py": WAYS[name] for floor in floors for name in WAYS})
    code, output = copy.lint_imports()
    assert code == 1
    for floor in floors:
        for name in WAYS:
            assert f"microslip.{floor}.{name} -> microslip.results.planted" in output


def test_import_that_runs_up_through_the_public_face(copy):
    copy.plant({"numerics/planted.py": "from microslip import load_joint\n"})
    code, output = copy.lint_imports()
    assert code == 1
    assert "microslip.numerics.planted -> microslip " in output


def test_rooms_side_by_side_do_not_know_each_other(copy):
    copy.plant({"numerics/planted.py": "import microslip.describe.planted\n"})
    copy.plant({"describe/planted.py": ""})
    code, output = copy.lint_imports()
    assert code == 1
    assert "microslip.numerics.planted -> microslip.describe.planted" in output


def test_description_with_numerics(copy):
    copy.plant({"describe/planted.py": "import numpy\n"})
    code, output = copy.lint_imports()
    assert code == 1
    assert "microslip.describe.planted -> numpy" in output


def test_room_on_no_floor(copy):
    copy.plant({"planted/__init__.py": ""})
    code, output = copy.lint_imports()
    assert code == 1
    assert "- microslip.planted" in output


@pytest.mark.parametrize("folder", ["contact", "show/plots", "analyses/time"])
def test_circle_of_two_modules(copy, folder):
    room = f"microslip.{folder.replace('/', '.')}"
    copy.plant(
        {
            f"{folder}/planted_first.py": f"from {room} import planted_second\n",
            f"{folder}/planted_second.py": f"def late():\n    import {room}.planted_first\n",
        }
    )
    code, output = copy.lint_imports()
    assert code == 1
    assert f"No cycles are allowed in {room}." in output
    assert re.search(r"\.planted_(first -> \.planted_second|second -> \.planted_first)", output)


def test_circle_of_two_folders(copy):
    """Of four modules, none of which is in a circle with another."""
    copy.plant(
        {
            "analyses/planted_a/__init__.py": "",
            "analyses/planted_a/one.py": "import microslip.analyses.planted_b.one\n",
            "analyses/planted_a/two.py": "",
            "analyses/planted_b/__init__.py": "",
            "analyses/planted_b/one.py": "",
            "analyses/planted_b/two.py": "import microslip.analyses.planted_a.two\n",
        }
    )
    code, output = copy.lint_imports()
    assert code == 1
    assert "No cycles are allowed in microslip.analyses." in output
    assert re.search(r"\.planted_(a -> \.planted_b|b -> \.planted_a)", output)


# -- rules of the house script -----------------------------------------------------------------

HIDDEN = {"results/planted.py": "_hidden = 1\n", "results/_planted.py": "anything = 1\n"}
LONG = '"""Long."""\n' + "x = 1\n" * 450


def assert_found(package, file, *parts):
    code, output = package.house()
    assert code == 1
    lines = [line for line in output.splitlines() if f"/{file}:" in line]
    assert len(lines) == 1, output
    for part in parts:
        assert part in lines[0]


def assert_clean(package):
    code, output = package.house()
    assert code == 0, output


def test_what_is_planted_in_the_house_itself_is_found(copy):
    copy.plant(
        {
            **HIDDEN,
            "show/thief.py": "from microslip.results.planted import _hidden\n",
            "model/late.py": "def f():\n    import math\n",
            "model/long.py": LONG,
        }
    )
    code, output = copy.house()
    assert code == 1
    for parts in (
        ("show/thief.py", "private name microslip.results.planted._hidden"),
        ("model/late.py", "imports math inside a function"),
        ("model/long.py", "451 lines"),
    ):
        assert any(all(part in line for part in parts) for line in output.splitlines()), parts


@pytest.mark.parametrize(
    "text",
    [
        "from microslip.results.planted import _hidden\n",
        "from microslip.results import planted\nx = planted._hidden\n",
        "from microslip.results._planted import anything\n",
        "from microslip.results import _planted\n",
        "from ..results.planted import _hidden\n",
        "from numpy import _globals\n",
    ],
)
def test_private_name_of_another_folder(small, text):
    small.plant({**HIDDEN, "show/thief.py": text})
    assert_found(small, "show/thief.py", "private name", "_")


@pytest.mark.parametrize(
    "text",
    [
        "from microslip.results.planted import _hidden\n",
        "from microslip.results import _planted\n",
        "from .planted import _hidden\n",
        "from microslip.version import __version__\n",
        "class A:\n    def f(self):\n        return self._mine._replace(a=1)\n",
    ],
)
def test_private_name_at_home(small, text):
    small.plant({**HIDDEN, "results/mate.py": text})
    assert_clean(small)


@pytest.mark.parametrize(
    "statement",
    ["import math", "from microslip import errors", "importlib.import_module('math')"],
)
def test_import_inside_a_function(small, statement):
    small.plant(
        {"model/planted.py": f"import importlib\n\ndef f():\n    {statement}\n", "errors.py": ""}
    )
    assert_found(small, "model/planted.py", ":4:", "import")


def test_optional_package_inside_a_function(small):
    small.plant({"model/planted.py": "def f():\n    import pint\n    from pyuff import UFF\n"})
    assert_clean(small)


def test_circle_with_the_face_of_the_own_folder(small):
    small.plant({"show/plots/planted.py": "from microslip.show.plots import save_figures\n"})
    assert_found(small, "show/plots/planted.py", "save_figures from microslip.show.plots")
    small.plant({"show/plots/planted.py": "from microslip.show.plots import style\n"})
    assert_clean(small)


def test_long_module(small):
    small.plant({"model/planted.py": LONG})
    assert_found(small, "model/planted.py", "451 lines")


def test_module_just_short_enough(small):
    small.plant({"model/planted.py": LONG.removesuffix("x = 1\n")})
    assert_clean(small)


@pytest.mark.parametrize(
    ("reason", "enough"), [("# Length: one table.\n", True), ("# Length:\n", False)]
)
def test_long_module_with_a_reason(small, reason, enough):
    small.plant({"model/planted.py": LONG.replace("\n", f"\n{reason}", 1)})
    if enough:
        assert_clean(small)
    else:
        assert_found(small, "model/planted.py", "452 lines")


def test_reason_below_the_first_definition_comes_too_late(small):
    small.plant({"model/planted.py": f"def f():\n    pass\n# Length: because.\n{LONG}"})
    assert_found(small, "model/planted.py", "454 lines")


@pytest.mark.parametrize(
    "text",
    [
        "x[0::2]",
        "x[:, 1::2]",
        "x[::d]",
        "x[1::m.dimension]",
        "slice(1, None, 2)",
        "arange(0, n, d)",
    ],
)
def test_stride_over_the_components_of_pairs(small, text):
    small.plant({"analyses/planted.py": f"y = {text}\n"})
    assert_found(small, "analyses/planted.py", "strides by")


@pytest.mark.parametrize("text", ["x[::-1]", "x[::every]", "x[::cycle]", "np.arange(2 - n, 2)"])
def test_other_strides(small, text):
    small.plant({"analyses/planted.py": f"y = {text}\n"})
    assert_clean(small)


@pytest.mark.parametrize(
    "text", ["status == 4", "c.status[k] != 4", "4 == states", "np.abs(status) >= 3"]
)
def test_contact_state_as_a_number(small, text):
    small.plant({"analyses/planted.py": f"y = {text}\n"})
    assert_found(small, "analyses/planted.py", "contact states")


@pytest.mark.parametrize("text", ["len(x) > 4", "status == SEPARATED", "found.status == 0"])
def test_other_comparisons(small, text):
    small.plant({"analyses/planted.py": f"y = {text}\n"})
    assert_clean(small)


def test_no_package_there(small):
    shutil.rmtree(small.package)
    code, output = small.house()
    assert code == 1
    assert "no modules there" in output
