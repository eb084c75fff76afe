"""Meshes of ANSYS: archives ``.cdb``, as `CDWRITE` writes them.

Read are nodes, solid elements, components, isotropic materials and supports. Loads, contact and what belongs
to a solution are passed over, with a word, since the joint file says them; other commands are refused.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from microslip.errors import Caution, InputError
from microslip.model.elasticity import Material
from microslip.model.mesh.ansys.archive import Command, read_archive
from microslip.model.mesh.ansys.elements import (
    CONTACT,
    LETTERS,
    PLANES,
    ROUTINES,
    Routine,
    formulation,
    shape_of,
)
from microslip.model.mesh.ansys.reading import Reading
from microslip.model.mesh.boundary import surface_of_nodes
from microslip.model.mesh.finite_elements import Block, FiniteElementMesh, Section, Surface
from microslip.typing import Indices

ENDING = ".cdb"

FLAT = 1e-9
"""Of the size of a mesh: plane elements may lie so far off z = 0."""


def read_cdb(path: Path, *, length: float = 1.0, force: float = 1.0) -> FiniteElementMesh:
    """Mesh, materials, components and supports of an ANSYS archive.

    Components of nodes are node sets, and surfaces of the outside faces all of whose corners they have; those
    of elements are element sets, as is every material, ``MATERIAL 1``.

    Parameters
    ----------
    path : Path
    length, force : float
        Units of the archive in m and N.

    Raises
    ------
    InputError
        Where it cannot be understood: file, line, command, and what is understood.
    """
    reading = Reading()
    for command in read_archive(path):
        reading.take(command)
    return _Builder(reading, path.name, length, force).mesh()


class _Member(NamedTuple):
    """An element: its number, rows of the points, and the number of its material."""

    label: int
    nodes: tuple[int, ...]
    material: int


class _Builder:
    """Makes the mesh of what was read."""

    def __init__(self, read: Reading, file: str, length: float, force: float) -> None:
        self.read, self.file, self.length, self.force = read, file, length, force
        self.cautions: list[Caution] = []

    def mesh(self) -> FiniteElementMesh:
        """The mesh of all that was read."""
        if not self.read.nodes:
            raise InputError(f"{self.file}: there are no nodes; a block NBLOCK was expected")
        rows = {label: k for k, label in enumerate(self.read.nodes)}
        groups, planes = self._groups(rows)
        blocks, places, materials = self._blocks(groups)
        points = np.array(list(self.read.nodes.values()))
        flat = "" not in planes
        if flat and len(planes) > 1:
            raise InputError(f"{self.file}: elements in plane stress and in plane strain")
        if not flat and len(planes) > 1:
            raise InputError(f"{self.file}: plane elements and solid ones in one model")
        if flat and np.abs(points[:, 2]).max() > FLAT * np.ptp(points, axis=0).max():
            raise InputError(f"{self.file}: plane elements must lie in the plane z = 0")
        node_sets, element_sets = self._sets(rows, places)
        owned = {f"MATERIAL {number}": found for number, found in materials.items()}
        surfaces = self._surfaces(blocks, node_sets)
        if self.read.passed:
            said = ", ".join(f"{name} (line {line})" for name, line in self.read.passed.items())
            self.cautions.append(
                Caution("mesh", said, "not used", "the joint file says loads and contact")
            )
        if self.read.expands:
            said = ", ".join(f"{label} (line {line})" for label, line in self.read.expands.items())
            remedy = "give thermal_expansion in [[material]] if temperatures change"
            self.cautions.append(Caution("mesh", said, "not used", remedy))
        return FiniteElementMesh(
            points=self.length * (points[:, :2] if flat else points),
            node_labels=np.array(list(self.read.nodes)),
            blocks=blocks,
            node_sets=node_sets,
            element_sets={**owned, **element_sets},
            surfaces=surfaces,
            materials={
                name: self._made_of(int(name.split()[1]), next(iter(planes)))
                for name in owned
                if int(name.split()[1]) in self.read.materials
            },
            sections=tuple(
                Section(name, name) for name in owned if int(name.split()[1]) in self.read.materials
            ),
            held=self._held(rows, 2 if flat else 3),
            cautions=tuple(self.cautions),
        )

    def _groups(self, rows: dict[int, int]) -> tuple[dict[str, list[_Member]], set[str]]:
        """Elements by their shape, and the planes that they are in."""
        groups: dict[str, list[_Member]] = {}
        planes: set[str] = set()
        remarks: dict[str, int] = {}
        contact = 0
        for command, line, row in self.read.elements:
            number = self._routine(command, line, row)
            if number in CONTACT:
                contact += 1
                continue
            routine = ROUTINES[number]
            planes.add(self._plane(command, line, routine, row[1], number))
            kind, nodes = self._shaped(command, line, routine, row, number)
            missing = [node for node in nodes if node not in rows]
            if missing:
                raise command.refuse(
                    f"element {row[10]} has the node {missing[0]}, which is not there", line
                )
            member = _Member(row[10], tuple(rows[node] for node in nodes), row[0])
            groups.setdefault(kind, []).append(member)
            if routine.remark:
                remarks[routine.remark] = remarks.get(routine.remark, 0) + 1
        if not groups:
            raise InputError(f"{self.file}: there are no elements; a block EBLOCK was expected")
        for remark, count in remarks.items():
            self.cautions.append(Caution("mesh", f"{count} elements", remark))
        if contact:
            remedy = "the joint file names the surfaces"
            self.cautions.append(Caution("mesh", f"{contact} contact elements", "not used", remedy))
        return groups, planes

    def _routine(self, command: Command, line: int, row: list[int]) -> int:
        """Number of the element type; raises `InputError` where it is not understood."""
        number = self.read.routines.get(row[1])
        if number is None:
            raise command.refuse(f"element {row[10]} is of type {row[1]}, which no ET names", line)
        if number not in CONTACT and number not in ROUTINES:
            known = ", ".join(map(str, ROUTINES))
            raise command.refuse(
                f"element {row[10]} is an element {number}, which is not understood; those are {known}",
                line,
            )
        return number

    def _shaped(
        self, command: Command, line: int, routine: Routine, row: list[int], number: int
    ) -> tuple[str, list[int]]:
        """Name of the `ElementType` and numbers of its nodes; raises `InputError` where there is none."""
        nodes = self._nodes_of(command, line, routine, row, number)
        shape = shape_of(routine, nodes)
        if shape is None:
            raise command.refuse(
                f"element {row[10]} has no shape that is understood: bricks, wedges, tetrahedra, "
                "quadrilaterals and triangles are, with all nodes on their sides",
                line,
            )
        by_letter = dict(zip(LETTERS, nodes, strict=False))
        return shape.kind, [by_letter[letter] for letter in shape.nodes]

    def _blocks(
        self, groups: dict[str, list[_Member]]
    ) -> tuple[tuple[Block, ...], dict[int, int], dict[int, Indices]]:
        """Blocks, places of the elements by number, and those of each material."""
        blocks: list[Block] = []
        places: dict[int, int] = {}
        materials: dict[int, list[int]] = {}
        for kind, members in groups.items():
            for member in members:
                if member.label in places:
                    raise InputError(f"{self.file}: element {member.label} is there twice")
                materials.setdefault(member.material, []).append(len(places))
                places[member.label] = len(places)
            labels = np.array([member.label for member in members])
            table = np.array([member.nodes for member in members])
            blocks.append(Block(kind, table, labels, formulation(kind)))
        return tuple(blocks), places, {n: np.array(own) for n, own in materials.items()}

    def _plane(self, command: Command, line: int, routine: Routine, own: int, number: int) -> str:
        """Plane stress or strain, empty of a solid; raises `InputError` where a key option is not known."""
        options = self.read.options.get(own, {})
        for key, value in options.items():
            if key == routine.plane or (key == 1 and number == 183):
                continue
            allowed = (routine.options or {}).get(key, (0,))
            if value not in allowed:
                raise command.refuse(
                    f"key option {key} = {value} of element {number} is not understood", line
                )
        if not routine.plane:
            return ""
        value = options.get(routine.plane, 0)
        if value not in PLANES:
            raise command.refuse(
                f"element {number} with key option {routine.plane} = {value}: plane stress, 0, and plane "
                "strain, 2, are understood",
                line,
            )
        return PLANES[value]

    def _nodes_of(
        self, command: Command, line: int, routine: Routine, row: list[int], number: int
    ) -> tuple[int, ...]:
        """Numbers of the nodes of an element; six of a triangle of its own as those of a quadrilateral."""
        nodes = tuple(row[11 : 11 + row[8]])
        if number == 183 and self.read.options.get(row[1], {}).get(1) == 1 and len(nodes) == 6:
            i, j, k, m, n, p = nodes
            nodes = (i, j, k, k, m, n, k, p)
        if len(nodes) != routine.size:
            raise command.refuse(
                f"element {row[10]} has {len(nodes)} nodes, and element {number} has {routine.size}",
                line,
            )
        return nodes

    def _sets(
        self, rows: dict[int, int], places: dict[int, int]
    ) -> tuple[dict[str, Indices], dict[str, Indices]]:
        """Components of nodes and of elements; those of contact elements alone are empty and left out."""
        sets: dict[str, dict[str, Indices]] = {"NODE": {}, "ELEM": {}}
        for name, (kind, numbers) in self.read.components.items():
            there = rows if kind == "NODE" else places
            found = [there[number] for number in numbers if number in there]
            if kind == "NODE" and len(found) < len(numbers):
                raise InputError(f"{self.file}: CMBLOCK {name} has nodes that are not there")
            if found:
                sets[kind][name] = np.array(sorted(found))
        return sets["NODE"], sets["ELEM"]

    def _surfaces(
        self, blocks: tuple[Block, ...], node_sets: dict[str, Indices]
    ) -> dict[str, Surface]:
        """Outside faces of the components of nodes that have any."""
        found = {name: surface_of_nodes(blocks, nodes) for name, nodes in node_sets.items()}
        return {name: surface for name, surface in found.items() if len(surface.elements)}

    def _made_of(self, number: int, plane: str) -> Material:
        """A material in SI units.

        Raises
        ------
        InputError
            Where something of it is missing or cannot be.
        """
        own, where = self.read.materials[number], f"{self.file}: material {number}"
        poisson = own.get("PRXY", own.get("NUXY"))
        for name, value in (("EX", own.get("EX")), ("PRXY", poisson), ("DENS", own.get("DENS"))):
            if value is None:
                raise InputError(f"{where} has no {name}")
        assert poisson is not None
        E, rho = own["EX"] * self.force / self.length**2, own["DENS"] * self.force / self.length**4
        if not (E > 0 and -1 < poisson < 0.5 and rho > 0):
            raise InputError(
                f"{where}: E = {E:g} Pa, nu = {poisson:g}, {rho:g} kg/m³: E > 0, -1 < nu < 0.5 and a "
                "positive density are possible"
            )
        shear = own.get("GXY")
        if shear is not None and abs(2 * (1 + poisson) * shear / own["EX"] - 1) > 1e-3:
            raise InputError(
                f"{where}: GXY is not EX/(2 + 2 PRXY): isotropic materials alone are understood"
            )
        return Material(E, poisson, rho, plane or "strain")

    def _held(self, rows: dict[int, int], dimension: int) -> Indices:
        """Row of the points and component of every support."""
        out = []
        for command, node, components in self.read.held:
            if node not in rows:
                raise command.refuse(f"node {node} is not there")
            out += [(rows[node], c) for c in components if c < dimension]
        return np.unique(np.array(out, dtype=np.int64).reshape(-1, 2), axis=0)
