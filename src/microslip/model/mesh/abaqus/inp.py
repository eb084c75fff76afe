"""Meshes from input decks of Abaqus and CalculiX.

What is read, and what it becomes, is in `docs/meshes.md`; what is not understood is refused with file, line
and keyword.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from microslip.errors import Caution, InputError
from microslip.model.elasticity import Material
from microslip.model.mesh.abaqus.deck import Keyword, Row, read_deck
from microslip.model.mesh.abaqus.materials import lacking_in, material_of
from microslip.model.mesh.abaqus.reading import Deck, Sorter
from microslip.model.mesh.abaqus.scopes import ELEMENTS, NODES, WHOLE, Directory, Instance
from microslip.model.mesh.abaqus.skins import Placed, cautions_of, parted, surfaces_of_sets
from microslip.model.mesh.abaqus.vocabulary import NAMED_SUPPORTS, Solid
from microslip.model.mesh.boundary import boundary, surface_of_nodes
from microslip.model.mesh.finite_elements import (
    Block,
    Coupling,
    Equation,
    FiniteElementMesh,
    Section,
    Surface,
    Tie,
)
from microslip.typing import Indices

FLAT = 1e-9
"""Of the size of a mesh: plane elements may lie so far off z = 0."""


def read_inp(path: Path, *, length: float = 1.0, force: float = 1.0) -> FiniteElementMesh:
    """Mesh, materials, sections and constraints of a deck.

    Parameters
    ----------
    path : Path
    length, force : float
        Units of the deck in m and N: 1e-3 and 1 for millimetres and newtons, with tonnes and MPa.

    Raises
    ------
    InputError
        Where the deck cannot be understood: file, line, keyword, and what is understood.
    """
    return Builder(Sorter().take(read_deck(path)), path.name, length, force).mesh()


class Builder:
    """Makes the mesh of a sorted deck."""

    def __init__(self, deck: Deck, file: str, length: float, force: float) -> None:
        self.deck, self.file = deck, file
        self.length, self.force = length, force
        self.cautions = list(deck.cautions)
        self.lacking: dict[str, str] = {}

    def mesh(self) -> FiniteElementMesh:
        """The mesh."""
        points, node_labels = self._nodes()
        blocks = self._blocks()
        plane = self._dimension(points) == 2
        self.names = Directory(
            self.deck.instances, self.deck.whole, self.index, self.nodes_of_element
        )
        elements = dict(self._sets(ELEMENTS))
        self.solid_sets = {
            k: v[v >= 0] for k, v in elements.items() if (v >= 0).any() or not self._skins(v)
        }
        surfaces = self._with_skins(dict(self._surfaces(blocks)), elements, blocks, points)
        sections, materials = self._sections()
        mesh = FiniteElementMesh(
            points=self.length * (points[:, :2] if plane else points),
            node_labels=node_labels,
            blocks=blocks,
            node_sets=dict(self._sets(NODES)),
            element_sets=self.solid_sets,
            surfaces=surfaces,
            materials=materials,
            lacking=self.lacking,
            sections=sections,
            ties=tuple(self._ties(surfaces)),
            equations=tuple(self._equations()),
            couplings=tuple(self._couplings(surfaces)),
            masses=self._masses(),
            unread=self.deck.unread,
        )
        return replace(mesh, held=self._held(mesh.dimension), cautions=tuple(self.cautions))

    def _placed(self) -> Iterator[tuple[str, Instance]]:
        yield from self.deck.instances.items()
        yield WHOLE, Instance(WHOLE, self.deck.whole, np.zeros(3))

    def _nodes(self) -> tuple[np.ndarray, Indices]:
        index: dict[tuple[str, int], int] = {}
        labels: list[int] = []
        points = []
        for name, instance in self._placed():
            for label in instance.scope.nodes:
                index[name, label] = len(labels)
                labels.append(label)
            if instance.scope.nodes:
                points.append(instance.placed(np.array(list(instance.scope.nodes.values()))))
        if not points:
            raise InputError(
                f"{self.file}: there are no nodes; parts need an instance in the assembly"
            )
        self.index = {NODES: index}
        return np.vstack(points), np.array(labels)

    def _blocks(self) -> tuple[Block, ...]:
        groups: dict[Solid, list[Placed]] = {}
        nodes = self.index[NODES]
        every = [
            Placed(name, label, element, tuple(nodes[name, node] for node in element.nodes))
            for name, instance in self._placed()
            for label, element in instance.scope.elements.items()
        ]
        bodies, skins = parted(every)
        if not bodies:
            raise InputError(f"{self.file}: there are no elements")
        for each in bodies:
            groups.setdefault(replace(each.element.solid, remark=""), []).append(each)
        index: dict[tuple[str, int], int] = {}
        self.nodes_of_element: dict[int, tuple[int, ...]] = {}
        self.planes: list[str | None] = []
        blocks = []
        for solid, members in groups.items():
            for each in members:
                index[each.instance, each.label] = len(self.nodes_of_element)
                self.nodes_of_element[len(self.nodes_of_element)] = each.rows
                self.planes.append(solid.plane)
            labels = np.array([each.label for each in members])
            table = np.array([each.rows for each in members])
            blocks.append(Block(solid.kind, table, labels, solid.formulation))
        # what lies on bodies has numbers below those of the point masses
        self.skins = {-1 - len(nodes) - k: each for k, each in enumerate(skins)}
        for number, each in self.skins.items():
            index[each.instance, each.label] = number
            self.nodes_of_element[number] = each.rows
        self.cautions += cautions_of(skins)
        for name, instance in self._placed():
            for label, node in instance.scope.points.items():
                # point masses have numbers below zero: their node is behind them
                index[name, label] = -1 - nodes[name, node]
                self.nodes_of_element[index[name, label]] = (nodes[name, node],)
        self.index[ELEMENTS] = index
        return tuple(blocks)

    def _dimension(self, points: np.ndarray) -> int:
        if self.planes[0] is None:
            return 3
        if np.abs(points[:, 2]).max() > FLAT * np.ptp(points, axis=0).max():
            raise InputError(f"{self.file}: plane elements (CPS, CPE) lie in the plane z = 0")
        return 2

    def _sets(self, kind: str) -> Iterator[tuple[str, Indices]]:
        for place in self.names.places():
            for name, _ in self.names.scope(place).sets[kind].values():
                rows = self.names.of_set(kind, name, place, f"{self.file}: {kind} set {name!r}")
                yield self.names.shown(name, place), np.array(rows, dtype=np.int64)

    def _surfaces(self, blocks: tuple[Block, ...]) -> Iterator[tuple[str, Surface]]:
        outside = None
        for place in self.names.places():
            for name, keywords in self.names.scope(place).surfaces.values():
                elements, faces = [np.zeros(0, np.int64)], [np.zeros(0, np.int64)]
                nodes: list[int] = []
                for keyword in keywords:
                    by_node = keyword.parameters.get("TYPE", "ELEMENT").upper() == "NODE"
                    for row in keyword.rows:
                        if by_node:
                            nodes += self.names.members(NODES, row.values[0], place, row.where)
                            continue
                        if outside is None:
                            outside, _ = boundary(blocks)
                        part = self._faces(row, place, outside)
                        elements.append(part.elements)
                        faces.append(part.faces)
                if nodes:
                    part = surface_of_nodes(blocks, np.array(nodes))
                    elements.append(part.elements)
                    faces.append(part.faces)
                keys = np.unique(
                    np.column_stack([np.concatenate(elements), np.concatenate(faces)]), axis=0
                )
                yield self.names.shown(name, place), Surface(keys[:, 0], keys[:, 1])

    def _skins(self, rows: Indices) -> list[Placed]:
        return [self.skins[k] for k in rows.tolist() if k in self.skins]

    def _with_skins(
        self,
        surfaces: dict[str, Surface],
        elements: dict[str, Indices],
        blocks: tuple[Block, ...],
        points: np.ndarray,
    ) -> dict[str, Surface]:
        """Surfaces of the deck, and those that sets of elements on bodies name."""
        taken = {name.upper() for name in surfaces}
        named = {
            name: own
            for name, rows in elements.items()
            if name.upper() not in taken and (own := self._skins(rows)) and len(own) == len(rows)
        }
        found, cautions = surfaces_of_sets(blocks, named, points)
        self.cautions += cautions
        return surfaces | found

    def _faces(self, row: Row, place: str, outside: Surface) -> Surface:
        found = np.array(self.names.members(ELEMENTS, row.values[0], place, row.where), np.int64)
        found = found[found >= 0]
        face = row.values[1].upper() if len(row.values) > 1 else ""
        if not face:
            own = np.isin(outside.elements, found)
            return Surface(outside.elements[own], outside.faces[own])
        if not (face[0] == "S" and face[1:].isdigit() and 1 <= int(face[1:]) <= 6):
            raise InputError(f"{row.where}: face {row.values[1]!r}: S1 to S6 are understood")
        return Surface(found, np.full(len(found), int(face[1:]) - 1))

    def _sections(self) -> tuple[tuple[Section, ...], dict[str, Material]]:
        cards = {each["MATERIAL"].parameters["NAME"].upper(): each for each in self.deck.materials}
        sections, materials, thicknesses = [], {}, set()
        for place in self.names.places():
            for keyword in self.names.scope(place).keywords.get("SOLID SECTION", []):
                keyword.only("ELSET", "MATERIAL", "ORIENTATION", "CONTROLS", "STACK DIRECTION")
                name, material = keyword.required("ELSET"), keyword.required("MATERIAL")
                if material.upper() not in cards:
                    there = (
                        ", ".join(e["MATERIAL"].parameters["NAME"] for e in cards.values())
                        or "none"
                    )
                    raise keyword.refuse(f"there is no material {material!r}; there is {there}")
                rows = self.names.of_set(ELEMENTS, name, place, keyword.where)
                on = self._skins(np.array(rows))
                if on:
                    raise keyword.refuse(
                        f"element set {name!r} has {len(on)} elements {on[0].element.type} "
                        f"({on[0].element.where}) beside solid ones: bodies of one dimension alone are "
                        "read. Take them out of the set"
                    )
                planes = {self.planes[k] for k in rows if k >= 0}
                if len(planes) != 1:
                    raise keyword.refuse(
                        f"element set {name!r} has no elements, or of plane stress and strain"
                    )
                plane = planes.pop()
                key = cards[material.upper()]["MATERIAL"].parameters["NAME"]
                key = f"{key} in plane stress" if plane == "stress" else key
                own = cards[material.upper()]
                if lacking := lacking_in(own):
                    # an error where it is used: the joint file may have materials of its own
                    self.lacking[key] = lacking
                else:
                    materials[key] = material_of(own, plane, self.length, self.force, self.cautions)
                thick = keyword.rows[0].number(0, 0.0) if plane and keyword.rows else 0.0
                thicknesses.add(thick)
                written = self.names.scope(place).sets[ELEMENTS][name.upper()][0]
                shown = self.names.shown(written, place)
                sections.append(Section(shown, key, self.length * thick or None))
        if len(thicknesses) > 1:
            raise InputError(f"{self.file}: *SOLID SECTION: plane sections of different thickness")
        if thicknesses - {0.0}:
            self.cautions.append(
                Caution(
                    "mesh", "*SOLID SECTION", "the thickness is not used: all is per metre of width"
                )
            )
        return tuple(sections), materials

    def _masses(self) -> dict[int, float]:
        out: dict[int, float] = {}
        for place in self.names.places():
            for keyword in self.names.scope(place).keywords.get("MASS", []):
                keyword.only("ELSET")
                if not keyword.rows:
                    raise keyword.refuse("the mass is missing")
                for element in self.names.of_set(
                    ELEMENTS, keyword.required("ELSET"), place, keyword.where
                ):
                    if element >= 0 or element in self.skins:
                        raise keyword.refuse(
                            "its element set has elements that are not of type MASS"
                        )
                    node = -1 - element
                    mass = keyword.rows[0].number(0) * self.force / self.length
                    out[node] = out.get(node, 0.0) + mass
        return out

    def _surface_name(self, text: str, place: str, surfaces: dict[str, Surface], where: str) -> str:
        own, name = self.names.split(text, place)
        there = self.names.scope(own).surfaces
        if name.upper() not in there:
            raise InputError(
                f"{where}: there is no surface {text!r}; there is {', '.join(surfaces) or 'none'}"
            )
        return self.names.shown(there[name.upper()][0], own)

    def _ties(self, surfaces: dict[str, Surface]) -> Iterator[Tie]:
        for place in self.names.places():
            for keyword in self.names.scope(place).keywords.get("TIE", []):
                keyword.only("NAME", "POSITION TOLERANCE", "ADJUST", "TYPE", "NO ROTATION")
                given = keyword.parameters.get("POSITION TOLERANCE")
                adjust = keyword.parameters.get("ADJUST", "YES").upper()
                if adjust not in ("YES", "NO"):
                    raise keyword.refuse(f"ADJUST={adjust}: YES and NO are understood")
                head = (
                    Row(keyword.rows[0].file, keyword.line, (given or "",))
                    if keyword.rows
                    else None
                )
                for row in keyword.rows:
                    if len(row.values) < 2:
                        raise InputError(
                            f"{row.where}: a tie names its slave and its master surface"
                        )
                    slave, master = (
                        self._surface_name(text, place, surfaces, row.where)
                        for text in row.values[:2]
                    )
                    name = keyword.parameters.get("NAME") or f"{slave} to {master}"
                    tolerance = None
                    if given and head is not None:
                        tolerance = self.length * head.number(0)
                    where = f"{row.where}: *TIE"
                    yield Tie(name, slave, master, tolerance, where, adjust == "YES")

    def _equations(self) -> Iterator[Equation]:
        for place in self.names.places():
            for keyword in self.names.scope(place).keywords.get("EQUATION", []):
                keyword.only()
                rows = list(keyword.rows)
                while rows:
                    head = rows.pop(0)
                    count = head.whole(0)
                    values: list[str] = []
                    while len(values) < 3 * count and rows:
                        values += [v for v in rows[0].values if v]
                        rows.pop(0)
                    if len(values) != 3 * count:
                        raise InputError(f"{head.where}: {count} terms need {3 * count} values")
                    yield from self._equation(Row(head.file, head.line, tuple(values)), place)

    def _equation(self, row: Row, place: str) -> Iterator[Equation]:
        terms = []
        for k in range(0, len(row.values), 3):
            nodes = self.names.members(NODES, row.values[k], place, row.where)
            terms.append((nodes, row.whole(k + 1) - 1, row.number(k + 2)))
        if any(component not in range(3) for _, component, _ in terms):
            raise InputError(f"{row.where}: *EQUATION: components 1 to 3 are understood")
        count = len(terms[0][0])
        if any(len(nodes) not in (1, count) for nodes, _, _ in terms):
            raise InputError(f"{row.where}: *EQUATION: node sets of different size")
        for i in range(count):
            yield Equation(tuple((nodes[i % len(nodes)], c, f) for nodes, c, f in terms))

    def _couplings(self, surfaces: dict[str, Surface]) -> Iterator[Coupling]:
        for cards in self.deck.couplings:
            head = cards["COUPLING"]
            kinds = [kind for kind in ("KINEMATIC", "DISTRIBUTING") if kind in cards]
            if not kinds:
                raise head.refuse("it needs *KINEMATIC or *DISTRIBUTING behind it")
            reference = self.names.members(NODES, head.required("REF NODE"), WHOLE, head.where)
            if len(reference) != 1:
                raise head.refuse(f"REF NODE names {len(reference)} nodes: it must be one")
            surface = self._surface_name(head.required("SURFACE"), WHOLE, surfaces, head.where)
            components: set[int] = set()
            for row in cards[kinds[0]].rows:
                first = row.whole(0)
                last = row.whole(1) if len(row.values) > 1 and row.values[1] else first
                components |= set(range(first - 1, last))
            name = head.parameters.get("CONSTRAINT NAME") or surface
            chosen = tuple(sorted(components)) or tuple(range(6))
            yield Coupling(
                name, kinds[0].lower(), reference[0], surface, chosen, self._radius(head)
            )

    def _radius(self, head: Keyword) -> float | None:
        """How far from its reference node a coupling reaches, m."""
        given = head.parameters.get("INFLUENCE RADIUS")
        if given is None:
            return None
        radius = self.length * Row(head.file, head.line, (given,)).number(0)
        if not radius > 0:
            raise head.refuse(f"INFLUENCE RADIUS={given}: it must be positive")
        return radius

    def _held(self, dimension: int) -> Indices:
        out: list[tuple[int, int]] = []
        for place in self.names.places():
            for keyword in self.names.scope(place).keywords.get("BOUNDARY", []):
                keyword.only("OP")
                for row in keyword.rows:
                    nodes = self.names.members(NODES, row.values[0], place, row.where)
                    named = row.values[1].upper() if len(row.values) > 1 else ""
                    if named in NAMED_SUPPORTS:
                        components = NAMED_SUPPORTS[named]
                    else:
                        first = row.whole(1)
                        last = row.whole(2) if len(row.values) > 2 and row.values[2] else first
                        components = tuple(range(first - 1, last))
                    if row.number(3, 0.0) != 0:
                        raise InputError(
                            f"{row.where}: *BOUNDARY: displacements other than zero are loads"
                        )
                    allowed = [c for c in components if c < dimension or c >= 3]
                    out += [(node, c) for node in nodes for c in allowed]
        return np.unique(np.array(out, dtype=np.int64).reshape(-1, 2), axis=0)
