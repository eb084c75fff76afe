"""What a user may write about a joint of which a finite-element mesh is at hand.

The mesh has named sets of nodes and elements and named surfaces; the description says what they are: which
are made of what, held, tied, in contact, pressed, loaded and measured. Plane meshes have everything per metre
of width, as lap joints; of a spatial one all loads and results are divided by its `MeshFile.width`.
`microslip.model.described_mesh` makes the model of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, ClassVar, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from microslip.describe.amplitude import Load
from microslip.describe.bolts import MeshPreload, readable_preload
from microslip.describe.mesh_names import Components, OnNames, Vector
from microslip.describe.named_joint import (
    USUAL_QUANTITY,
    DampingOrRatio,
    check_named,
    driven_of,
)
from microslip.describe.quantities import (
    NAME,
    AreaStiffness,
    Count,
    Density,
    Expansion,
    Friction,
    Length,
    LineStiffness,
    Mass,
    Modulus,
    Number,
    Rule,
    Section,
    list_of_sections,
)
from microslip.describe.requests import Requests, cycles_and_response, holds_requests
from microslip.describe.sources import Source, split_source
from microslip.describe.whole import PressedJoint, WideOutput, WidePort, Width


class MeshFile(Section):
    """The mesh."""

    file: Source
    """File of the mesh: .inp of Abaqus and CalculiX, .cdb of ANSYS, .msh of Gmsh, .vtk or .vtu. Names of
    its sets and surfaces are what everything below refers to."""
    length_unit: Literal["m", "cm", "mm", "um", "in", "ft"] = "m"
    """Unit of length of the file. Coordinates, and what the file says of materials."""
    force_unit: Literal["N", "mN", "uN", "kN", "MN", "lbf"] = "N"
    """Unit of force of the file. Materials of an .inp: E in force/length², density in force s²/length⁴,
    tonnes/mm³ with N and mm."""
    width: Width | None = None
    """Of a spatial structure: "whole" where loads and results are its forces, moments and energies, or a
    width that they are per metre of. Needed in space, not in the plane, where a mesh is 1 m wide."""
    modes: Count = Field(default=60, ge=4, le=2000)
    """Free-interface modes kept dynamic; all others follow statically. More where the load has high
    frequencies."""


class MeshMaterial(Section):
    """What elements are made of, `[[material]]`; left out, the sections and materials of the file."""

    elements: OnNames | None = None
    """Element sets that are made of it; left out, all elements. Every element needs a material."""
    youngs_modulus: Modulus = Field(gt=0)
    """Young's modulus E. All stiffness."""
    poissons_ratio: Number = Field(gt=-1, lt=0.5)
    """Poisson's ratio. Stiffness in the plane-strain state, and pressure beside a clamp."""
    density: Density = Field(gt=0)
    """Density. Frequencies."""
    plane: Literal["strain", "stress"] = "strain"
    """State of a plane mesh. Wide or narrow structures."""
    thermal_expansion: Expansion = Field(default=0.0)
    """Coefficient of linear thermal expansion, for preload.temperature. Bolts of another material than what
    they hold gain or lose force."""


class MeshSupport(Section):
    """What does not move, `[[support]]`, beside the supports of the file."""

    on: OnNames
    """Node sets or surfaces that are held. Mode shapes and frequencies."""
    directions: Components = ("x", "y", "z")
    """Components that are held: "x", "y", "z"; "rx", "ry", "rz" of reference nodes of couplings; left out,
    all displacements. In the plane z is left out."""


class MeshSpring(Section):
    """Springs to the ground, `[[spring]]`, spread evenly over surfaces or shared by nodes."""

    on: OnNames
    """Surfaces or node sets they are on. Weak springs only hold the place of a body."""
    direction: Literal["x", "y", "z"]
    """Along which they resist. Others are free."""
    stiffness: AreaStiffness | None = Field(default=None, gt=0)
    """Stiffness per area of surfaces; this or total. What opens the joint is computed without them."""
    total: LineStiffness | None = Field(default=None, gt=0)
    """Stiffness of all springs on one name together, per metre of width; of node sets always. Mounts."""

    @model_validator(mode="after")
    def _one_stiffness(self) -> Self:
        if (self.stiffness is None) == (self.total is None):
            raise Rule("stiffness", "give stiffness, per area, or total")
        return self


class MeshMass(Section):
    """A mass that is not in the mesh, `[[mass]]`, beside the point masses of the file."""

    on: str
    """Surface over which it is spread evenly, or node set whose nodes share it. Instruments, a shaker."""
    mass: Mass = Field(gt=0)
    """All of it: in the plane that of one metre of width. Frequencies."""


class MeshTie(Section):
    """Two surfaces that do not move against each other, `[[tie]]`, beside the ties of the file."""

    slave: str
    """Surface that follows. Its nodes are moved onto the master within the tolerance."""
    master: str
    """Surface that it follows. The coarser one."""
    tolerance: Length | None = Field(default=None, ge=0)
    """Distance up to which they are tied; left out, a tenth of a facet. Farther parts stay free."""


class MeshInterface(Section):
    """Two surfaces in contact, or one and a rigid flat, `[[interface]]`."""

    name: str = Field(default="contact", pattern=NAME, max_length=40)
    """What it is called. Tables, results and outputs name it so."""
    first: str
    """One surface. Which comes first does not matter."""
    second: str | None = None
    """The other one; its nodes need not match. Bodies have nodes of their own."""
    flat: Vector | None = None
    """Normal of a rigid flat that the first surface touches instead, towards the body. A test rig, or half of
    what is symmetric."""
    offset: Length = Field(default=0.0)
    """Of the flat from the origin along its normal, in m or with a unit. Where it is."""
    pairs_on: str | None = None
    """Which of the two carries the contact pairs, at its nodes; left out, the finer one. Number of pairs."""
    friction: Friction
    """Coefficient of friction mu, or a table of it along the interface. What slips, and the damping that
    comes of it."""
    gap: Length = Field(default=0.0)
    """Added to the distance that the mesh has, negative where the bodies interfere. Shims and press fits."""
    topography: Source | None = None
    """Table of measured distances that are added as well, CSV or NPZ: columns x, y (and z) and gap, in the
    unit of length of the mesh. Where contact is made, of surfaces that are not flat."""
    reach: Length | None = Field(default=None, gt=0)
    """Distance up to which facets face each other; left out, two facets. Wide gaps."""
    overlap: Length | None = Field(default=None, ge=0)
    """Depth to which the bodies may overlap in the mesh; left out, a twentieth of a facet. Rounding, or meant
    interference."""
    tangential_stiffness: AreaStiffness | None = Field(default=None, gt=0)
    """Of springs in series with friction, per area; left out, rigid. Where the roughness of the surfaces
    gives."""
    normal_stiffness: AreaStiffness | None = Field(default=None, gt=0)
    """The same normal to the surface. Evens out the pressure."""

    @property
    def may_interfere(self) -> bool:
        """Whether bodies may press each other here without a load: known once the mesh is read."""
        return self.gap < 0 or self.topography is not None or self.overlap is not None

    @model_validator(mode="after")
    def _two_sides(self) -> Self:
        if (self.second is None) == (self.flat is None):
            raise Rule("second", "give the second surface, or flat, the normal of a rigid flat")
        if self.flat is None and self.offset != 0:
            raise Rule("offset", "is of a rigid flat: give flat, or remove it")
        if self.flat is not None and self.pairs_on not in (None, self.first):
            raise Rule("pairs_on", "a flat carries no pairs: remove it")
        return self


class Place(Section):
    """Something that acts on a set or a surface, or is measured there."""

    on: str | None = None
    """Surface, over which it is spread evenly, or node set, whose nodes share it. Of an output the mean
    there."""
    direction: Vector | None = None
    """"x", "y", "z", or a vector; of moments and rotations in space their axis. None in the plane, where
    these turn counter-clockwise."""


class MeshPort(WidePort, Place):
    """A load that the user names, `[[port]]`."""

    opposite: str | None = None
    """Surface or node set with the opposite load. A pair, such as moments that bend both ends."""

    @model_validator(mode="after")
    def _is_somewhere(self) -> Self:
        if self.kind == "base":
            if self.on is not None or self.opposite is not None:
                raise Rule("on", "a base moves all that holds the joint: give its direction alone")
            if self.direction is None:
                raise Rule("", "which way does the base move? give direction")
        else:
            _check_place(self, self.kind in ("moment", "pressure"), "the load")
            if self.kind == "pressure" and self.direction is not None:
                raise Rule("direction", "a pressure acts along the normal: remove it")
        return self


class MeshOutput(WideOutput, Place):
    """A quantity of the motion, `[[output]]`."""

    interface: str | None = None
    """Interface of a slip or a gap; left out, the nearest. Where several lie close together."""
    at: tuple[Length, ...] | None = None
    """Point whose nearest contact pair a slip or a gap is of: [x, y], or [x, y, z]. In m or with a unit."""

    @model_validator(mode="after")
    def _is_somewhere(self) -> Self:
        if not self.across:
            if self.at is not None or self.interface is not None:
                raise Rule("at", "is for slip and gap: give on and direction")
            turns = self.measured.motion in ("rotation", "reaction moment")
            _check_place(self, turns, "the output")
        elif self.on is not None or self.at is None or len(self.at) not in (2, 3):
            raise Rule("at", f"{self.quantity} is of a contact pair: give its place, [x, y]")
        return self


def _check_place(entry: Place, turns: bool, what: str) -> None:
    """Raise `Rule` unless a place, and a direction where there must be one, are given."""
    if entry.on is None:
        raise Rule("", f"where is {what}? give on, a surface or a node set of the mesh")
    if entry.direction is None and not turns:
        raise Rule("", f"which way is {what}? give direction")


def _listed(what: str) -> tuple[BeforeValidator, ...]:
    return (list_of_sections(100, f"must be at most 100 sections, [[{what}]]"),)


Materials = Annotated[tuple[MeshMaterial, ...], *_listed("material")]
Supports = Annotated[tuple[MeshSupport, ...], *_listed("support")]
Springs = Annotated[tuple[MeshSpring, ...], *_listed("spring")]
Masses = Annotated[tuple[MeshMass, ...], *_listed("mass")]
Ties = Annotated[tuple[MeshTie, ...], *_listed("tie")]
Interfaces = Annotated[tuple[MeshInterface, ...], *_listed("interface"), Field(min_length=1)]
MeshPreloads = Annotated[tuple[MeshPreload, ...], *_listed("preload")]
MeshPorts = Annotated[tuple[MeshPort, ...], *_listed("port"), Field(min_length=1)]
MeshOutputs = Annotated[tuple[MeshOutput, ...], *_listed("output")]


@holds_requests
class MeshJoint(PressedJoint):
    """A joint from a finite-element mesh, its loads and the analyses asked for."""

    unnamed: ClassVar[str] = "a joint from a mesh"
    width_in: ClassVar[str] = "mesh"
    modes_key: ClassVar[str] = "mesh.modes"
    pairs_key: ClassVar[str] = "interface: contact pairs"

    kind: Literal["mesh"]
    """What the joint is described by. Which sections the file has: here a mesh and its names, for "lap"
    dimensions."""
    title: str | None = Field(default=None, max_length=200)
    """Name of the joint. Heads tables, figures and the summary."""
    mesh: MeshFile
    material: Materials = Field(default=())
    """What elements are made of, [[material]]; left out, what the file says."""
    support: Supports = Field(default=())
    """What does not move, [[support]]."""
    spring: Springs = Field(default=())
    """Springs to the ground, [[spring]]."""
    mass: Masses = Field(default=())
    """Masses that are not in the mesh, [[mass]]."""
    tie: Ties = Field(default=())
    """Surfaces that are glued, [[tie]]."""
    interface: Interfaces
    """Surfaces in contact, [[interface]]."""
    preload: MeshPreloads = Field(default=())
    """Loads that press the sides together, [[preload]]; left out where bodies interfere: press and shrink
    fits."""
    damping: DampingOrRatio = Field(default_factory=DampingOrRatio)
    port: MeshPorts
    """Loads that [load] may name, [[port]]; where there is one, it drives the joint."""
    load: Load | None = None
    analysis: Requests = Field(default_factory=cycles_and_response)
    output: MeshOutputs = Field(default=())
    """Quantities that are reported, [[output]]; left out, the displacement of the driven port. Tables and
    figures show the first."""

    @property
    def measured(self) -> tuple[MeshOutput, ...]:
        """Quantities that are reported, and where each is."""
        if self.output:
            return self.output
        port = driven_of(self.port, self.load)
        quantity = USUAL_QUANTITY[port.kind]
        output = MeshOutput.model_construct(
            name=quantity, quantity=quantity, on=port.on, direction=port.direction
        )
        return (output,)

    @property
    def modes_kept(self) -> int:
        """Free-interface modes that stay dynamic."""
        return self.mesh.modes

    @property
    def frictionless(self) -> bool:
        """Whether the file says that no contact pair has friction."""
        return all(interface.friction == 0 for interface in self.interface)

    @property
    def files(self) -> tuple[str, ...]:
        """The file of the mesh, and those of measured distances."""
        sources = (self.mesh.file, *(each.topography for each in self.interface))
        return tuple(dict.fromkeys(split_source(each)[0] for each in sources if each is not None))

    def __repr__(self) -> str:
        title = [repr(self.title)] if self.title else []
        facts = (
            f"mesh {self.mesh.file}",
            f"preload {readable_preload(self.preload, self.whole) or 'by interference'}",
            f"analyses: {', '.join(self.analysis.asked) or 'none'}",
        )
        return f"MeshJoint({', '.join((*title, *facts))})"

    __str__ = __repr__

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        check_named(self)
        _interfaces_differ(self.interface, self.output)
        if not (self.preload or any(each.may_interfere for each in self.interface)):
            raise Rule(
                "preload",
                f"missing: sections [[preload]] with {', '.join(MeshPreload.model_fields)}; or an "
                "interface whose bodies interfere, with a negative gap, a topography, or overlap, up to "
                "which they may in the mesh",
            )
        if len(self.material) > 1 and any(m.elements is None for m in self.material):
            raise Rule("material", "of several materials each says its element sets, elements")
        return self


def _interfaces_differ(interfaces: Sequence[MeshInterface], outputs: Sequence[MeshOutput]) -> None:
    """Raise `Rule` where two interfaces share a name or are the same, or an output names none."""
    names: list[str] = []
    for k, interface in enumerate(interfaces):
        if interface.name in names:
            raise Rule(f"interface.{k}.name", f"two interfaces are called {interface.name!r}")
        names.append(interface.name)
        sides = (interface.first, *([] if interface.second is None else [interface.second]))
        if interface.first == interface.second:
            raise Rule(f"interface.{k}.second", "is the first surface: contact is between two")
        if interface.pairs_on is not None and interface.pairs_on not in sides:
            raise Rule(f"interface.{k}.pairs_on", f"must be one of {' and '.join(sides)}")
    for k, output in enumerate(outputs):
        if output.interface is not None and output.interface not in names:
            raise Rule(f"output.{k}.interface", f"there is none; there are {', '.join(names)}")
