"""Write the input reference from the models of a joint file: every key, and nothing by hand.

python docs/_scripts/input_reference.py FILE
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

from microslip.describe.joint import Joint
from microslip.describe.keys import Key, SectionKeys, sections
from microslip.describe.matrices import MatricesJoint
from microslip.describe.mesh import MeshJoint
from microslip.describe.plausible import TABLE
from microslip.describe.saved_model import ModelJoint

INTRODUCTION = """\
# Input reference

Every key that a joint file may have, as `microslip new lap FILE` writes them. Both are made from the
models that read the file, so neither can be out of date. What has no default must be given where its
section is; a section that is left out has all its defaults, but an analysis that is left out is not
computed. Quantities are numbers with a unit, `"12.5 mm"`; a number without one is in the unit of the
table. Forces, moments and stiffnesses are per metre of width, and their units must say so:
`"50 N*m/m"`, not `"50 N"`.
"""

HISTORIES = """\
## `[[analysis.history]]`

Motion over time under a load that changes, as many as there are. The key `signal` says which kind of
load it is, and with it which keys there are beside those that all have:
"""


MATRICES = """\
## `kind = "matrices"`

A [joint from matrices](matrices.md) has these sections; `[damping]`, `[load]` and all of `[analysis]` are
those above.
"""

MESH = """\
## `kind = "mesh"`

A [joint from a mesh](meshes-input.md) has these sections; `[damping]`, `[load]` and all of `[analysis]` are
those above.
"""

MODEL = """\
## `kind = "model"`

A [saved joint model](matrices.md#the-joint-model-itself) has these sections; `[load]` and all of `[analysis]`
are those above.
"""

USUAL = """\
## What is usual

Numbers that leave these ranges are questioned when the file is checked and run, and refused where they
cannot be ([What is doubted](judgement.md)).

| key | number | usual | refused from | why |
|---|---|---|---|---|
"""


def usual() -> str:
    """The ranges that numbers are compared with."""
    rows = []
    for row in TABLE:
        bounds = f"{row.low:g} to {row.high:g} {row.unit}".replace(" to inf", " and more")
        most = "" if math.isinf(row.most) else f"{row.most:g}"
        number = row.quantity or "itself"
        rows.append(f"| `{row.key}` | {number} | {bounds.strip()} | {most} | {row.reason} |")
    return USUAL + "\n".join(rows) + "\n"


def table(keys: tuple[Key, ...]) -> list[str]:
    """Rows of Markdown."""
    rows = [
        "| key | unit | default | allowed | meaning | where it matters |",
        "|---|---|---|---|---|---|",
    ]
    for key in keys:
        default = "needed" if key.needed else code(key.default)
        cells = (f"`{key.name}`", key.unit, default, key.allowed, key.meaning, key.matters)
        rows.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return [*rows, ""]


def code(default: str) -> str:
    """A default as code; a dash is one."""
    return default if default == "–" else f"`{default}`"


def page() -> str:
    """The whole reference as Markdown."""
    found = list(sections())
    histories = [section for section in found if section.signal]
    lines = [INTRODUCTION]
    for section in found:
        if not section.signal:
            head = f"## `{section.heading}`" if section.path else "## At the top of the file"
            lines += [head, "", section.meaning.replace("``", "`") + ".", "", *table(section.keys)]
    shared = common(histories)
    lines += [HISTORIES, *table(tuple(k for k in histories[0].keys if k.name in shared))]
    for section in histories:
        own = tuple(k for k in section.keys if k.name not in shared)
        lines += [f'### `signal = "{section.signal}"`', "", section.meaning + ".", "", *table(own)]
    lines += of_kind(MATRICES, MatricesJoint, "matrices", found)
    lines += of_kind(MESH, MeshJoint, "a mesh", found)
    lines += of_kind(MODEL, ModelJoint, "a saved model", found)
    return "\n".join([*lines, usual()])


def of_kind(start: str, joint: type[Joint], noun: str, known: list[SectionKeys]) -> list[str]:
    """What a file of another kind has of its own."""
    shared = {section.keys for section in known}
    own = [section for section in sections(joint) if section.keys not in shared]
    lines = [start]
    for section in own:
        head = (
            f"`{section.heading}` of {noun}" if section.path else f"At the top of a file of {noun}"
        )
        lines += [
            f"### {head}",
            "",
            section.meaning.replace("``", "`") + ".",
            "",
            *table(section.keys),
        ]
    return lines


def common(histories: list[SectionKeys]) -> set[str]:
    """Names of the keys that every kind of history has."""
    names = [{key.name for key in section.keys} for section in histories]
    return set.intersection(*names) - {"signal"}


def write(path: Path) -> None:
    """The page into a file."""
    path.write_text(page(), "utf-8")


if __name__ == "__main__":
    write(Path(sys.argv[1]))
