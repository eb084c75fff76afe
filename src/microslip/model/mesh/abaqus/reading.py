"""Keywords of a deck sorted into scopes: nodes, elements and sets; the rest is kept for later."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from microslip.errors import Caution, InputError
from microslip.model.mesh.abaqus.deck import Keyword, Row
from microslip.model.mesh.abaqus.scopes import ELEMENTS, NODES, Element, Entry, Instance, Scope
from microslip.model.mesh.abaqus.vocabulary import (
    FROM_JOINT_FILE,
    INSTEAD,
    INSTEAD_OF_ELEMENTS,
    KNOWN,
    SILENT,
    SKINS,
    SOLIDS,
    USUAL_OF_DISTRIBUTING,
)
from microslip.model.mesh.element_types import TYPES
from microslip.typing import Array

LATER = {"SOLID SECTION", "MASS", "TIE", "EQUATION", "BOUNDARY"}
"""Understood when all names are known."""


@dataclass
class Deck:
    """A deck sorted.

    Attributes
    ----------
    whole : Scope
        The assembly, or the deck without parts.
    parts : dict of str to Scope
    instances : dict of str to Instance
    materials : list of (Keyword, Keyword or None, Keyword or None)
        ``*MATERIAL``, ``*ELASTIC``, ``*DENSITY``, ``*EXPANSION``.
    couplings : list of (Keyword, Keyword or None)
        ``*COUPLING`` and what says its kind.
    cautions : list of Caution
    step_supports : list of str
        Where steps have supports.
    """

    whole: Scope
    parts: dict[str, Scope] = field(default_factory=dict)
    instances: dict[str, Instance] = field(default_factory=dict)
    materials: list[dict[str, Keyword]] = field(default_factory=list)
    couplings: list[dict[str, Keyword]] = field(default_factory=list)
    cautions: list[Caution] = field(default_factory=list)
    step_supports: list[str] = field(default_factory=list)

    @property
    def unread(self) -> str:
        """What is not read that may hold something; empty where there is nothing."""
        if not self.step_supports:
            return ""
        return f"{STEP_SUPPORTS} ({_listed(self.step_supports)}): {SUPPORTS_INSTEAD}"


def _listed(places: list[str]) -> str:
    more = f" and {len(places) - 3} more" if len(places) > 3 else ""
    return ", ".join(places[:3]) + more


def _holds(keyword: Keyword) -> bool:
    """Whether a ``*BOUNDARY`` of a step adds supports: no motions, nothing taken away."""
    moves = any(len(row.values) > 3 and row.number(3, 0.0) != 0 for row in keyword.rows)
    added = keyword.parameters.get("OP", "MOD").upper() == "MOD"
    return added and not moves and not set(keyword.parameters) - {"OP"}


STEP_SUPPORTS = "supports inside *STEP are not read where several steps have some, or they move"
SUPPORTS_INSTEAD = "write them before the first *STEP, or give [[support]]"


class Sorter:
    """Takes the keywords of a deck one after the other."""

    def __init__(self) -> None:
        self.deck = Deck(Scope("assembly"))
        self.scope = self.deck.whole
        self.system: tuple[Array, Array] | None = None
        self.remarks: dict[str, list[str]] = {}
        self.in_instance = False

    def take(self, keywords: list[Keyword]) -> Deck:
        """Sort all keywords.

        Raises
        ------
        InputError
            For the first keyword or parameter that is not understood.
        """
        in_step, supports = False, list[list[Keyword]]()
        for keyword in keywords:
            if keyword.name == "STEP":
                in_step = True
                supports.append([])
                self._remark(
                    "loads and procedures of steps are not used: the joint file says them",
                    keyword.where,
                )
            if in_step:
                in_step = keyword.name != "END STEP"
                if keyword.name == "BOUNDARY":
                    supports[-1].append(keyword)
                continue
            self._one(keyword)
        self._supports_of_steps([each for each in supports if each])
        for reason, places in self.remarks.items():
            self.deck.cautions.append(Caution("mesh", _listed(places), reason))
        if self.deck.step_supports:
            where = _listed(self.deck.step_supports)
            self.deck.cautions.append(Caution("mesh", where, STEP_SUPPORTS, SUPPORTS_INSTEAD))
        return self.deck

    def _supports_of_steps(self, steps: list[list[Keyword]]) -> None:
        """Take the supports of a step where no other has any; which of several hold nobody says."""
        if len(steps) == 1 and all(map(_holds, steps[0])):
            for keyword in steps[0]:
                self.deck.whole.keep(keyword)
                self._remark("supports of the only *STEP that has any are taken", keyword.where)
        else:
            self.deck.step_supports += [keyword.where for step in steps for keyword in step]

    def _remark(self, reason: str, where: str) -> None:
        self.remarks.setdefault(reason, []).append(where)

    def _one(self, keyword: Keyword) -> None:
        name = keyword.name
        if self.in_instance and name != "END INSTANCE":
            raise keyword.refuse(
                "it stands inside an *INSTANCE: put it into the part or the assembly"
            )
        self.in_instance = name == "INSTANCE"
        known = {
            "NODE": self._nodes,
            "ELEMENT": self._elements,
            "NSET": self._node_set,
            "ELSET": self._element_set,
            "SURFACE": self._surface,
            "SYSTEM": self._system,
            "PART": self._part,
            "ASSEMBLY": self._assembly,
            "INSTANCE": self._instance,
            "MATERIAL": self._material,
            "ELASTIC": self._of_material,
            "DENSITY": self._of_material,
            "EXPANSION": self._of_material,
            "COUPLING": self._coupling,
            "KINEMATIC": self._of_coupling,
            "DISTRIBUTING": self._of_coupling,
        }
        if name in known:
            known[name](keyword)
        elif name in LATER:
            self.scope.keep(keyword)
        elif name in FROM_JOINT_FILE:
            self._remark(
                "not used: the joint file says contact, friction and damping", keyword.where
            )
        elif name in SILENT:
            if name in ("END PART", "END ASSEMBLY"):
                self.scope, self.system = self.deck.whole, None
        else:
            raise keyword.refuse(
                INSTEAD.get(name, f"this keyword is not understood; those are {KNOWN}")
            )

    def _part(self, keyword: Keyword) -> None:
        keyword.only("NAME")
        name = keyword.required("NAME")
        if name.upper() in self.deck.parts:
            raise keyword.refuse(f"there is a part {name!r} already")
        self.scope = self.deck.parts[name.upper()] = Scope(name)
        self.system = None

    def _assembly(self, keyword: Keyword) -> None:
        keyword.only("NAME")
        self.scope, self.system = self.deck.whole, None

    def _instance(self, keyword: Keyword) -> None:
        keyword.only("NAME", "PART")
        name, part = keyword.required("NAME"), keyword.required("PART")
        if part.upper() not in self.deck.parts:
            there = ", ".join(scope.name for scope in self.deck.parts.values()) or "none"
            raise keyword.refuse(f"there is no part {part!r}; there is {there}")
        if name.upper() in self.deck.instances:
            raise keyword.refuse(f"there is an instance {name!r} already")
        shift, axis, angle = np.zeros(3), None, 0.0
        if len(keyword.rows) > 2:
            raise keyword.refuse("at most two lines: a translation, and a rotation")
        if keyword.rows:
            shift = np.array([keyword.rows[0].number(k, 0.0) for k in range(3)])
        if len(keyword.rows) == 2:
            row = keyword.rows[1]
            axis = np.array([row.number(k) for k in range(6)]).reshape(2, 3)
            angle = row.number(6)
            if not np.linalg.norm(axis[1] - axis[0]) > 0:
                raise InputError(
                    f"{row.where}: the two points of the axis of rotation are the same"
                )
        scope = self.deck.parts[part.upper()]
        self.deck.instances[name.upper()] = Instance(name, scope, shift, axis, angle)

    def _system(self, keyword: Keyword) -> None:
        keyword.only()
        if not keyword.rows:
            self.system = None
            return
        first = keyword.rows[0]
        origin = np.array([first.number(k, 0.0) for k in range(3)])
        if len(first.values) <= 3:
            self.system = origin, np.eye(3)
            return
        x = np.array([first.number(k, 0.0) for k in range(3, 6)]) - origin
        if len(keyword.rows) > 1:
            second = keyword.rows[1]
            in_plane = np.array([second.number(k, 0.0) for k in range(3)]) - origin
            z = np.cross(x, in_plane)
        else:
            z = np.array([0.0, 0.0, 1.0])
            z = z - (z @ x) / (x @ x) * x if x @ x > 0 else z
        if not (np.linalg.norm(x) > 0 and np.linalg.norm(z) > 0):
            raise keyword.refuse("its three points lie on one line")
        x, z = x / np.linalg.norm(x), z / np.linalg.norm(z)
        self.system = origin, np.column_stack([x, np.cross(z, x), z])

    def _nodes(self, keyword: Keyword) -> None:
        keyword.only("NSET", "SYSTEM")
        kind = keyword.parameters.get("SYSTEM", "R").upper()
        if kind not in ("R", "C"):
            raise keyword.refuse(f"SYSTEM={kind}: rectangular (R) or cylindrical (C) is understood")
        for row in keyword.rows:
            label = row.whole(0)
            x = np.array([row.number(k, 0.0) for k in range(1, 4)])
            if kind == "C":
                angle = np.deg2rad(x[1])
                x = np.array([x[0] * np.cos(angle), x[0] * np.sin(angle), x[2]])
            if self.system is not None:
                x = self.system[0] + self.system[1] @ x
            if label in self.scope.nodes:
                raise InputError(f"{row.where}: node {label} is given twice")
            self.scope.nodes[label] = (float(x[0]), float(x[1]), float(x[2]))
        if "NSET" in keyword.parameters:
            rows = tuple(Row(r.file, r.line, r.values[:1]) for r in keyword.rows)
            self.scope.add_to_set(NODES, keyword.required("NSET"), Entry(rows))

    def _elements(self, keyword: Keyword) -> None:
        keyword.only("TYPE", "ELSET", "INPUT")
        kind = keyword.required("TYPE").upper()
        if kind != "MASS" and kind not in SOLIDS and kind not in SKINS:
            instead = INSTEAD_OF_ELEMENTS.get(kind)
            raise keyword.refuse(
                f"elements of type {kind} are not understood; "
                + (instead or f"those are {', '.join(SOLIDS)}, MASS")
            )
        solid = SOLIDS.get(kind) or SKINS.get(kind)
        count = 1 if solid is None else TYPES[solid.kind].size
        if solid is not None and solid.remark:
            self._remark(f"{kind}: {solid.remark}", keyword.where)
        heads, values, start = [], [], None
        for row in keyword.rows:
            start = start or row
            values += [text for text in row.values if text]
            if len(values) < count + 1:
                continue
            if len(values) > count + 1:
                raise InputError(
                    f"{row.where}: {len(values) - 1} nodes for an element {kind} of {count} nodes"
                )
            numbers = Row(start.file, start.line, tuple(values))
            label, *nodes = (numbers.whole(k) for k in range(count + 1))
            if label in self.scope.elements or label in self.scope.points:
                raise InputError(f"{start.where}: element {label} is given twice")
            missing = [node for node in nodes if node not in self.scope.nodes]
            if missing:
                raise InputError(f"{start.where}: element {label}: there is no node {missing[0]}")
            if solid is None:
                self.scope.points[label] = nodes[0]
            else:
                self.scope.elements[label] = Element(solid, tuple(nodes), start.where, kind)
            heads.append(Row(start.file, start.line, (str(label),)))
            values, start = [], None
        if start is not None:
            raise InputError(
                f"{start.where}: an element {kind} has {count} nodes, and {len(values) - 1} are given"
            )
        if "ELSET" in keyword.parameters:
            self.scope.add_to_set(ELEMENTS, keyword.required("ELSET"), Entry(tuple(heads)))

    def _node_set(self, keyword: Keyword) -> None:
        keyword.only("NSET", "NAME", "GENERATE", "INSTANCE", "INTERNAL", "UNSORTED", "ELSET")
        self._set(keyword, NODES, keyword.parameters.get("NSET") or keyword.required("NAME"))

    def _element_set(self, keyword: Keyword) -> None:
        keyword.only("ELSET", "NAME", "GENERATE", "INSTANCE", "INTERNAL", "UNSORTED")
        self._set(keyword, ELEMENTS, keyword.parameters.get("ELSET") or keyword.required("NAME"))

    def _set(self, keyword: Keyword, kind: str, name: str) -> None:
        of_elements = keyword.parameters.get("ELSET") if kind == NODES else None
        entry = Entry(
            tuple(keyword.rows),
            "GENERATE" in keyword.parameters,
            keyword.parameters.get("INSTANCE"),
            of_elements,
        )
        self.scope.add_to_set(kind, name, entry)

    def _surface(self, keyword: Keyword) -> None:
        keyword.only("NAME", "TYPE", "INTERNAL")
        name, kind = keyword.required("NAME"), keyword.parameters.get("TYPE", "ELEMENT").upper()
        if kind not in ("ELEMENT", "NODE"):
            raise keyword.refuse(f"TYPE={kind}: ELEMENT and NODE are understood")
        self.scope.surfaces.setdefault(name.upper(), (name, []))[1].append(keyword)

    def _material(self, keyword: Keyword) -> None:
        keyword.only("NAME")
        keyword.required("NAME")
        self.deck.materials.append({keyword.name: keyword})

    def _of_material(self, keyword: Keyword) -> None:
        if not self.deck.materials:
            raise keyword.refuse("it stands before any *MATERIAL")
        self.deck.materials[-1][keyword.name] = keyword

    def _coupling(self, keyword: Keyword) -> None:
        keyword.only("CONSTRAINT NAME", "REF NODE", "SURFACE", "INFLUENCE RADIUS")
        self.deck.couplings.append({keyword.name: keyword})

    def _of_coupling(self, keyword: Keyword) -> None:
        usual = USUAL_OF_DISTRIBUTING if keyword.name == "DISTRIBUTING" else {}
        keyword.only(*usual)
        for parameter, value in usual.items():
            given = keyword.parameters.get(parameter, value)
            if given.upper() != value:
                raise keyword.refuse(f"{parameter}={given}: {value} alone is understood")
        if not self.deck.couplings or len(self.deck.couplings[-1]) > 1:
            raise keyword.refuse("it stands behind no *COUPLING")
        self.deck.couplings[-1][keyword.name] = keyword
