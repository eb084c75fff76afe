"""What the commands of an ANSYS archive say, put together."""

from __future__ import annotations

import re

import numpy as np

from microslip.model.mesh.ansys.archive import END, Command, widths_of
from microslip.model.mesh.ansys.vocabulary import (
    EXPANSION,
    IDLE_MATERIAL,
    NOTHING,
    PLAIN_MATERIAL,
    SAID_BY_THE_JOINT_FILE,
    SUPPORTS,
)


class Reading:
    """What has been read so far of an archive."""

    def __init__(self) -> None:
        self.routines: dict[int, int] = {}
        self.expands: dict[str, int] = {}
        self.options: dict[int, dict[int, int]] = {}
        self.nodes: dict[int, tuple[float, ...]] = {}
        self.turned: set[int] = set()
        self.elements: list[tuple[Command, int, list[int]]] = []
        self.components: dict[str, tuple[str, list[int]]] = {}
        self.materials: dict[int, dict[str, float]] = {}
        self.held: list[tuple[Command, int, tuple[int, ...]]] = []
        self.passed: dict[str, int] = {}

    def take(self, command: Command) -> None:
        """One command.

        Raises
        ------
        InputError
            Where it is not known, or cannot be what it says.
        """
        known = {
            **{
                "ET": self._type,
                "KEYOP": self._option,
                "KEYOPT": self._option,
                "ETBLOCK": self._types,
            },
            **{"NBLOCK": self._nodes, "EBLOCK": self._elements, "CMBLOCK": self._component},
            **{"MPDATA": self._material, "MP": self._material, "D": self._support, "N": self._end},
        }
        if command.name in known:
            known[command.name](command)
        elif command.name in SAID_BY_THE_JOINT_FILE:
            self.passed.setdefault(command.name, command.line)
        elif command.name not in NOTHING:
            raise command.refuse(
                f"is not understood; {', '.join(sorted(known))} are, and loads and solution are passed over: "
                "write the archive with CDWRITE,DB and without it"
            )

    def _end(self, command: Command) -> None:
        """The command behind the block of nodes; nodes one by one are not written by CDWRITE."""
        if "LOC" not in map(str.upper, command.words):
            raise command.refuse("nodes one by one are not understood: write them as NBLOCK")

    def _type(self, command: Command) -> None:
        self.routines[command.whole(0)] = command.whole(1)

    def _types(self, command: Command) -> None:
        widths = widths_of(command)
        for line, text in command.rows[1:]:
            row = command.integers(line, text, widths)
            if row[0] != END:
                self.routines[row[0]] = row[1]
                options = dict(enumerate(row[2:], start=1))
                self.options.setdefault(row[0], {}).update(options)

    def _option(self, command: Command) -> None:
        self.options.setdefault(command.whole(0), {})[command.whole(1)] = command.whole(2)

    def _nodes(self, command: Command) -> None:
        """Number, two of the solid model where it is said, three coordinates, three turns; zeros left out."""
        widths = widths_of(command)
        whole = 3 if command.word(1) == "SOLID" else 1
        for line, text in command.rows[1:]:
            fields = command.fields(line, text, widths)
            try:
                label = int(fields[0])
                values = [float(field) for field in fields[whole:]]
            except ValueError:
                raise command.refuse(f"{text.strip()!r} is no node", line) from None
            if label == END:
                return
            if label in self.nodes:
                raise command.refuse(f"node {label} is there twice", line)
            place = (*values, 0.0, 0.0, 0.0)[:3]
            if not np.isfinite(place).all():
                raise command.refuse(f"node {label} is nowhere", line)
            self.nodes[label] = place
            if any(values[3:]):
                self.turned.add(label)

    def _elements(self, command: Command) -> None:
        """Material, type, six more, number of nodes, one unused, number; then the nodes."""
        if command.word(1) != "SOLID":
            raise command.refuse("only those in the format SOLID are understood")
        widths = widths_of(command)
        rows = iter(command.rows[1:])
        for line, text in rows:
            row = command.integers(line, text, widths)
            if row[0] == END:
                return
            if len(row) < 12:
                raise command.refuse(f"{text.strip()!r} is no element", line)
            while len(row) < 11 + row[8]:
                line, text = next(rows)
                more = command.integers(line, text, widths)
                if more[0] == END:
                    raise command.refuse(f"element {row[10]} lacks nodes", line)
                row += more
            self.elements.append((command, line, row))

    def _component(self, command: Command) -> None:
        """Numbers of nodes or elements; one below zero is the last of a range."""
        name, kind = command.words[0], command.word(1)
        if kind not in ("NODE", "ELEM", "ELEMENT"):
            raise command.refuse(f"{name}: components are of NODE or ELEM, and not {kind!r}")
        widths = widths_of(command)
        count, found, read = command.whole(2), [], 0
        for line, text in command.rows[1:]:
            for number in command.integers(line, text, widths):
                read += 1
                if number > 0:
                    found.append(number)
                elif number < 0 and found:
                    found.extend(range(found[-1] + 1, 1 - number))
        if read != count:
            raise command.refuse(f"{name}: {count} numbers were announced and {read} are there")
        self.components[name] = ("NODE" if kind == "NODE" else "ELEM", found)

    def _material(self, command: Command) -> None:
        """``MPDATA, R5.0, count, label, material, start, value`` or ``MP, label, material, value``."""
        numbered = re.match(r"R\d", command.word(0)) is not None
        at = 2 if numbered else 0
        label = command.word(at)
        if label in EXPANSION:
            self.expands.setdefault(label, command.line)
        if label in IDLE_MATERIAL:
            return
        if label not in (*PLAIN_MATERIAL, "GXY"):
            raise command.refuse(
                f"{label} is not understood: isotropic materials alone are, {', '.join(PLAIN_MATERIAL)}"
            )
        first = at + (3 if command.name == "MPDATA" else 2)
        others = range(first + 1, len(command.words))
        if any(command.word(k) and command.number(k) for k in others):
            raise command.refuse("values at several temperatures: give those of one")
        self.materials.setdefault(command.whole(at + 1), {})[label] = command.number(first)

    def _support(self, command: Command) -> None:
        """``D, node, component, value``."""
        component = command.word(1)
        if component not in SUPPORTS:
            raise command.refuse(
                f"{component} of a solid is not understood; {', '.join(SUPPORTS)} are"
            )
        if any(command.number(k) != 0 for k in (2, 3) if command.word(k)):
            raise command.refuse(
                "displacements other than zero are loads: the joint file says them"
            )
        further = next(filter(None, command.words[4:]), "")
        if further:
            raise command.refuse(
                f"{further!r}: one node and one component are read of a line; CDWRITE writes a line for each"
            )
        node = command.whole(0)
        if node in self.turned:
            raise command.refuse(
                f"node {node} has directions of its own: supports are along x, y and z"
            )
        self.held.append((command, node, SUPPORTS[component]))
