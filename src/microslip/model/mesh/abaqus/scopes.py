"""Parts, instances and the assembly of a deck: what a number or a name means in each.

A scope is a part, the assembly, or a deck without either. Numbers and names belong to their scope; the
assembly says ``Instance.Name`` or ``Instance.12`` of what lies in an instance. Names do not mind case.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from microslip.errors import InputError
from microslip.model.mesh.abaqus.deck import Keyword, Row
from microslip.model.mesh.abaqus.vocabulary import Solid
from microslip.typing import Array

NODES, ELEMENTS = "node", "element"
"""What sets are of."""

WHOLE = ""
"""Instance that the scope of the assembly, or of a deck without parts, counts as."""


@dataclass(frozen=True)
class Entry:
    """Data lines of a set, and the instance whose numbers they are, if it is said."""

    rows: tuple[Row, ...]
    generate: bool = False
    instance: str | None = None
    of_elements: str | None = None


@dataclass(frozen=True)
class Element:
    """An element as read."""

    solid: Solid
    nodes: tuple[int, ...]
    where: str
    type: str = ""


@dataclass
class Scope:
    """What is defined in a part, the assembly or a deck without either.

    Attributes
    ----------
    name : str
    nodes : dict of int to (3,) tuple
    elements : dict of int to Element
    points : dict of int to int
        Node of each element MASS.
    sets : dict
        By kind (`NODES`, `ELEMENTS`) and name in capitals: the name as written, and its entries.
    surfaces : dict of str to (str, list of Keyword)
    keywords : dict of str to list of Keyword
        Those that are understood when everything is known.
    """

    name: str
    nodes: dict[int, tuple[float, float, float]] = field(default_factory=dict)
    elements: dict[int, Element] = field(default_factory=dict)
    points: dict[int, int] = field(default_factory=dict)
    sets: dict[str, dict[str, tuple[str, list[Entry]]]] = field(
        default_factory=lambda: {NODES: {}, ELEMENTS: {}}
    )
    surfaces: dict[str, tuple[str, list[Keyword]]] = field(default_factory=dict)
    keywords: dict[str, list[Keyword]] = field(default_factory=dict)

    def add_to_set(self, kind: str, name: str, entry: Entry) -> None:
        """More members of a set."""
        self.sets[kind].setdefault(name.upper(), (name, []))[1].append(entry)

    def keep(self, keyword: Keyword) -> None:
        """A keyword for later."""
        self.keywords.setdefault(keyword.name, []).append(keyword)


@dataclass(frozen=True)
class Instance:
    """A part in its place: turned after it is moved.

    Attributes
    ----------
    name : str
    scope : Scope
    shift : (3,) array
    axis : (2, 3) array or None
        Two points of the axis of the turn.
    angle : float
        Degrees.
    """

    name: str
    scope: Scope
    shift: Array
    axis: Array | None = None
    angle: float = 0.0

    def placed(self, points: Array) -> Array:
        """(n, 3) points of the part in the assembly.

        Examples
        --------
        >>> axis = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
        >>> turned = Instance("one", Scope("part"), np.array([1.0, 0.0, 0.0]), axis, 90.0)
        >>> turned.placed(np.zeros((1, 3))).round(12) + 0.0
        array([[0., 1., 0.]])
        """
        moved = points + self.shift
        if self.axis is None or self.angle == 0.0:
            return np.asarray(moved)
        n = self.axis[1] - self.axis[0]
        n = n / np.linalg.norm(n)
        cross = np.array([[0, -n[2], n[1]], [n[2], 0, -n[0]], [-n[1], n[0], 0]])
        angle = np.deg2rad(self.angle)
        R = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
        return np.asarray((moved - self.axis[0]) @ R.T + self.axis[0])


class Directory:
    """Nodes and elements of the whole model, found by number or by set.

    Parameters
    ----------
    instances : dict of str to Instance
        By name in capitals.
    whole : Scope
        Of the assembly, or of a deck without parts.
    index : dict
        By kind, instance and number: the row in the model.
    """

    def __init__(
        self,
        instances: dict[str, Instance],
        whole: Scope,
        index: dict[str, dict[tuple[str, int], int]],
        nodes_of_element: dict[int, tuple[int, ...]],
    ) -> None:
        self.instances = instances
        self.whole = whole
        self.index = index
        self.nodes_of_element = nodes_of_element

    def scope(self, instance: str) -> Scope:
        """Scope whose names hold in an instance."""
        return self.whole if instance == WHOLE else self.instances[instance].scope

    def split(self, text: str, instance: str) -> tuple[str, str]:
        """Instance and name of ``Instance.Name``; dots may belong to the name."""
        head, _, tail = text.partition(".")
        if instance == WHOLE and tail and head.upper() in self.instances:
            return head.upper(), tail
        return instance, text

    def members(self, kind: str, text: str, instance: str, where: str) -> list[int]:
        """Rows of a number or a set; raises `InputError` with the place where neither is known."""
        instance, text = self.split(text, instance)
        if text.lstrip("+-").isdigit():
            key = instance, int(text)
            if key not in self.index[kind]:
                inside = f" in instance {instance}" if instance else ""
                raise InputError(f"{where}: there is no {kind} {text}{inside}")
            return [self.index[kind][key]]
        return self.of_set(kind, text, instance, where)

    def of_set(self, kind: str, name: str, instance: str, where: str) -> list[int]:
        """Rows of a set, each once, in their order."""
        sets = self.scope(instance).sets[kind]
        if name.upper() not in sets:
            there = ", ".join(written for written, _ in sets.values()) or "none"
            raise InputError(f"{where}: there is no {kind} set {name!r} here; there is {there}")
        out: dict[int, None] = {}
        for entry in sets[name.upper()][1]:
            own = instance if entry.instance is None else entry.instance.upper()
            if own not in self.instances and own != WHOLE:
                raise InputError(f"{where}: there is no instance {entry.instance!r}")
            if entry.of_elements is not None:
                for element in self.of_set(ELEMENTS, entry.of_elements, own, where):
                    out.update(dict.fromkeys(self.nodes_of_element[element]))
            for row in entry.rows:
                out.update(dict.fromkeys(self._row(kind, row, own, entry.generate)))
        return list(out)

    def _row(self, kind: str, row: Row, instance: str, generate: bool) -> list[int]:
        if not generate:
            found: list[int] = []
            for text in row.values:
                if text:
                    found += self.members(kind, text, instance, row.where)
            return found
        first, last = row.whole(0), row.whole(1)
        step = row.whole(2) if len(row.values) > 2 and row.values[2] else 1
        if step <= 0 or last < first or (last - first) % step:
            raise InputError(
                f"{row.where}: GENERATE from {first} to {last} by {step}: the steps must lead "
                "from the first to the last"
            )
        return [
            k
            for n in range(first, last + 1, step)
            for k in self.members(kind, str(n), instance, row.where)
        ]

    def places(self) -> list[str]:
        """Instances, and the whole."""
        return [*self.instances, WHOLE]

    def shown(self, name: str, instance: str) -> str:
        """Name under which the model has what a scope calls `name`."""
        return name if instance == WHOLE else f"{self.instances[instance].name}.{name}"
