"""Whether a mesh has the names that a joint file refers to, asked before anything is made of them."""

from __future__ import annotations

import difflib
from collections.abc import Iterator
from pathlib import Path

from microslip.describe.bolts import MeshPreload
from microslip.describe.mesh import MeshJoint, MeshPort
from microslip.describe.sources import split_source
from microslip.errors import InputError
from microslip.model.mesh.finite_elements import FiniteElementMesh

KINDS = ("surface", "node set", "element set")
"""What names of a mesh may be of, here in this order."""

SURFACE, PLACE, ELEMENTS = ("surface",), ("surface", "node set"), ("element set",)


def check_names(mesh: FiniteElementMesh, joint: MeshJoint) -> None:
    """Raise `InputError` where keys name what the mesh does not have, or has as something else.

    Parameters
    ----------
    mesh : FiniteElementMesh
    joint : MeshJoint
    """
    there = {
        "surface": tuple(mesh.surfaces),
        "node set": tuple(mesh.node_sets),
        "element set": tuple(mesh.element_sets),
    }
    problems = [
        f'{key} = "{name}": {_missing(name, kinds, there)}'
        for key, name, kinds in _named(joint)
        if not any(name in there[kind] for kind in kinds)
    ]
    if problems:
        file = split_source(joint.mesh.file)[0]
        listed = [f"{kind}s: {', '.join(names) or 'none'}" for kind, names in there.items()]
        raise InputError("\n  ".join([*problems, f"{Path(file).name} has", *listed]))


def _missing(name: str, kinds: tuple[str, ...], there: dict[str, tuple[str, ...]]) -> str:
    """That there is none of a name, and what is nearest."""
    asked = " or ".join(kinds)
    for kind in KINDS:
        if name in there[kind]:
            return f"is {_one(kind)}; {_one(asked)} is needed"
    close = difflib.get_close_matches(name, [n for kind in kinds for n in there[kind]], n=1)
    meant = f"; did you mean {close[0]!r}?" if close else ""
    return f"the mesh has no {asked} of this name{meant}"


def _one(kind: str) -> str:
    return f"{'an' if kind.startswith('e') else 'a'} {kind}"


def _named(joint: MeshJoint) -> Iterator[tuple[str, str, tuple[str, ...]]]:
    """Key, name and the kinds that it may be of."""
    sections = (
        ("material", joint.material, {"elements": ELEMENTS}),
        ("support", joint.support, {"on": PLACE}),
        ("spring", joint.spring, {"on": PLACE}),
        ("mass", joint.mass, {"on": PLACE}),
        ("tie", joint.tie, {"slave": SURFACE, "master": SURFACE}),
        ("interface", joint.interface, {"first": SURFACE, "second": SURFACE}),
        ("preload", joint.preload, {"section": SURFACE, "on": PLACE}),
        ("port", joint.port, {"on": PLACE, "opposite": PLACE}),
        ("output", joint.output, {"on": PLACE}),
    )
    for section, entries, keys in sections:
        for k, entry in enumerate(entries):
            index = f"[{k}]" if len(entries) > 1 else ""
            for key, kinds in keys.items():
                value = getattr(entry, key)
                if value is None:
                    continue
                names = (value,) if isinstance(value, str) else value
                for n, name in enumerate(names):
                    place = f"[{n}]" if len(names) > 1 else ""
                    yield f"{section}{index}.{key}{place}", name, _kinds(entry, kinds)


def _kinds(entry: object, usual: tuple[str, ...]) -> tuple[str, ...]:
    """A pressure acts on surfaces, a temperature on elements."""
    if isinstance(entry, MeshPort) and entry.kind == "pressure":
        return SURFACE
    if isinstance(entry, MeshPreload) and entry.pressure is not None:
        return SURFACE
    if isinstance(entry, MeshPreload) and entry.temperature is not None:
        return ELEMENTS
    return usual
