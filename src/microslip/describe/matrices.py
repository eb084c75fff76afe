"""What a user may write about a joint of which the finite-element matrices are at hand.

K and M, full or reduced, come from files; supports are in them already. The contact is a table of pairs,
as two nodes and a normal each or with a matrix of their relative displacements. Loads, preload and outputs
are vectors of the degrees of freedom, or a node and a direction. A pair has one normal and, in the plane,
one tangential direction, in space two; everything is per metre of the `Matrices.width`, or of the whole.
`microslip.model.imported` makes the model of it.
"""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from microslip.describe import units
from microslip.describe.amplitude import Load
from microslip.describe.named_joint import (
    USUAL_QUANTITY,
    DampingOrRatio,
    check_named,
    driven_of,
)
from microslip.describe.outputs import AnyQuantityName
from microslip.describe.ports import MovingKind
from microslip.describe.quantities import (
    NAME,
    AreaStiffness,
    Count,
    Friction,
    Length,
    LineForce,
    Rule,
    Section,
    list_of_sections,
)
from microslip.describe.requests import Requests, cycles_and_response, holds_requests
from microslip.describe.sources import Source, split_source
from microslip.describe.whole import PressedJoint, WideOutput, WidePort, Width

LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "in": 0.0254, "ft": 0.3048}
"""Units of length that a file may be in, m."""

FORCES = {"N": 1.0, "mN": 1e-3, "uN": 1e-6, "kN": 1e3, "MN": 1e6, "lbf": 4.4482216152605}
"""Units of force that a file may be in, N."""


class Matrices(Section):
    """Stiffness and mass matrix, as another program wrote them."""

    stiffness: Source
    """File of the stiffness matrix K, after a colon its name in it, "beam.npz:K". Supports are in it; free of
    contact."""
    mass: Source
    """File of the mass matrix M, likewise. Of the same degrees of freedom, in the same order."""
    damping: Source | None = None
    """File of a viscous damping matrix C, likewise, in force s/length; instead of [damping]. The kept modes
    have all of it, what couples them too; the rest is damped in proportion to stiffness."""
    stored: Literal["full", "upper", "lower"] = "full"
    """Which part of K and M the files hold: both triangles, or one of them. Formats that say it themselves
    do not need it."""
    dofs: Source | None = None
    """Table of the degrees of freedom in their order: columns node and direction (x, y, z, rx, ry, rz or 1 to
    6), and x, y, z of the node where they are known; CSV, NPZ, or CalculiX .dof. Needed where something is
    given by nodes."""
    nodes: Source | None = None
    """Table of the nodes, columns node, x, y, and z in space, where the table of the degrees of freedom does
    not have them. What motions without stiffness are called."""
    length_unit: Literal["m", "cm", "mm", "um", "in", "ft"] = "m"
    """Unit of length of K, M, areas, gaps and coordinates. Time is in seconds, so that the mass is in
    force s²/length: tonnes with N and mm."""
    force_unit: Literal["N", "mN", "uN", "kN", "MN", "lbf"] = "N"
    """Unit of force of K and M. Stiffness and mass alike, so no frequency, but every displacement."""
    width: Width = 1.0
    """Width of the structure that the matrices and the areas are of: what is reported, and loads of this
    file, are per metre of it; with "whole" they are the forces, moments and energies themselves. Needed in
    space."""
    motions: Source | None = None
    """Matrix whose columns are motions of the bodies as rigid ones that no support stops, springs do not
    count; left out, the motions without stiffness. Statics of what opens the joint."""
    supports: Source | None = None
    """Matrix of the part of K that springs to the ground add. Only for soft springs that hold the mean
    position."""
    modes: Count = Field(default=60, ge=4, le=2000)
    """Free-interface modes kept dynamic; all others follow statically. More where the load has high
    frequencies."""


class PairTable(Section):
    """The contact pairs: where they are, and what of the motion is their relative displacement."""

    pairs: Source
    """Table of the pairs, CSV or NPZ: columns position along the interface and area; also gap, friction,
    tangential_stiffness and normal_stiffness of each. By nodes: first, second, and nx, ny, in space nz, the
    normal from the first to the second body."""
    relative: Source | None = None
    """Matrix B of the relative displacements v = B x, two rows a pair, in space three: the approach of its
    sides, then the tangential motion of the second over the first. Pairs that do not lie node on node,
    reduced matrices."""
    normal: Source | None = None
    """Matrix of the approach alone, a row a pair; with tangential, instead of relative. Programs that
    store the two apart."""
    tangential: Source | None = None
    """Matrix of the tangential motion of the second side over the first, in space two rows a pair; with
    normal. Likewise."""

    @model_validator(mode="after")
    def _one_map(self) -> Self:
        if self.relative is not None and (self.normal or self.tangential) is not None:
            raise Rule("relative", "is both directions: give it, or normal and tangential")
        if (self.normal is None) != (self.tangential is None):
            key = "normal" if self.normal is None else "tangential"
            raise Rule(key, "normal and tangential are given both or not at all")
        return self

    @property
    def by_nodes(self) -> bool:
        """Whether the table names the nodes of each pair."""
        return self.relative is None and self.normal is None


class PairContact(Section):
    """Coulomb friction of the pairs, and their stiffness."""

    friction: Friction | None = None
    """Coefficient of friction mu, or a table of it along the interface; left out, the column friction of
    the pairs. What slips, and the damping that comes of it."""
    law: Literal["exact", "elastic"] = "exact"
    """Rigid ("exact") with Coulomb friction, or with springs in series with it ("elastic"). Elastic where
    the roughness of the surfaces is known to give."""
    tangential_stiffness: AreaStiffness | None = Field(default=None, gt=0)
    """Of the springs along the surface, per area; only for law = "elastic", left out the column of the
    pairs. Stiffness of the joint before it slips."""
    normal_stiffness: AreaStiffness | None = Field(default=None, gt=0)
    """Of the springs normal to the surface, per area; likewise, rigid where neither gives it. Evens out the
    pressure."""

    @model_validator(mode="after")
    def _stiffness_fits_law(self) -> Self:
        for key in ("tangential_stiffness", "normal_stiffness"):
            if self.law == "exact" and getattr(self, key) is not None:
                raise Rule(key, 'is only for law = "elastic": remove it, or change contact.law')
        return self


class Vector(Section):
    """Something that acts on the degrees of freedom, or is measured on them."""

    vector: Source | None = None
    """File of the vector of unit loads on the degrees of freedom, after a colon its name in it. What is
    spread over several nodes; a table of node, direction, value will do."""
    node: Count | None = Field(default=None, ge=0)
    """Number of the node it is at, as the table of the degrees of freedom has it; with direction. Instead
    of a vector."""
    direction: Literal["x", "y", "z", "rx", "ry", "rz"] | None = None
    """Along an axis or about it; with node. The sign of what is applied or measured."""

    @property
    def given_by(self) -> str:
        """What says where it is: ``"vector"``, ``"node"``, or nothing."""
        return "vector" if self.vector is not None else "node" if self.node is not None else ""


class Preload(Vector):
    """A load that is held through every analysis, `[[preload]]`: the force of a bolt."""

    name: str = Field(default="clamp", pattern=NAME, max_length=40)
    """What it is called. Python names it so, to hold the joint by another force."""
    force: LineForce = Field(gt=0)
    """Amplitude: times the vector it presses the sides together, per metre of width. All contact
    pressure."""

    @model_validator(mode="after")
    def _is_somewhere(self) -> Self:
        _check_place(self, "the preload")
        return self


class VectorPort(WidePort, Vector):
    """A load that the user names, `[[port]]`."""

    kind: MovingKind = Field(default="force")
    """A moment or a force, or the acceleration of what the joint is fixed to ("base"). Which key of
    [load] gives the amplitude: moment, force, or acceleration."""

    @model_validator(mode="after")
    def _is_somewhere(self) -> Self:
        if self.kind != "base":
            _check_place(self, "the load")
        elif self.node is not None:
            raise Rule("node", "a base moves all that holds the joint: give direction, or a vector")
        elif (self.vector is None) == (self.direction is None):
            raise Rule(
                "", "give direction, or the vector of the inertia load per unit acceleration"
            )
        return self


class VectorOutput(WideOutput, Vector):
    """A quantity of the motion, `[[output]]`."""

    quantity: AnyQuantityName = Field(default="deflection")
    """What is measured. Velocities and accelerations are of a vibration: static cycles have none. Reactions
    are of springs to the ground, where vector or node say what of them moves, or of what was held when the
    matrices were written, by its rows."""
    stiffness_row: Source | None = None
    """Of a reaction: file of K e, the forces on the degrees of freedom when what is held makes its unit
    motion e. For supports that are not in the matrices any more."""
    mass_row: Source | None = None
    """Likewise M e; left out, none of the mass couples to it. With stiffness_row."""
    x: Length | None = None
    """Position along the interface of a slip or a gap: of the nearest pair. Only for these two."""
    pair: Count | None = Field(default=None, ge=1)
    """Row of the pair in its table, from 1, instead of x. Where several pairs have one position."""
    tangent: Literal[1, 2] | None = None
    """Of a slip in space: along the first or the second tangential direction. Slip has two components
    there."""

    @model_validator(mode="after")
    def _is_somewhere(self) -> Self:
        if self.across:
            if self.given_by or (self.x is None) == (self.pair is None):
                raise Rule(
                    "",
                    f"{self.quantity} is of a contact pair: give x alone, its position, or pair, its row",
                )
            if self.tangent is not None and self.quantity != "slip":
                raise Rule("tangent", "is of a slip: remove it")
            self._check_rows()
            return self
        for key in ("x", "pair", "tangent"):
            if getattr(self, key) is not None:
                raise Rule(key, "is for slip and gap: give a vector, or node and direction")
        self._check_rows()
        if self.stiffness_row is not None:
            return self
        _check_place(self, "the output")
        return self

    def _check_rows(self) -> None:
        """Raise `Rule` where rows of what is held are given of something else, or beside a place."""
        for key in ("stiffness_row", "mass_row"):
            if getattr(self, key) is not None and not self.reacts:
                raise Rule(key, "is of a reaction: remove it, or name that quantity")
        if self.mass_row is not None and self.stiffness_row is None:
            raise Rule("mass_row", "goes with stiffness_row")
        if self.stiffness_row is not None and self.given_by:
            raise Rule("stiffness_row", "says what is held: remove vector, node and direction")


def _check_place(entry: Vector, what: str) -> None:
    """Raise `Rule` unless a vector, or node and direction, say where something is."""
    if entry.vector is not None and (entry.node is not None or entry.direction is not None):
        raise Rule("vector", f"says where {what} is: remove node and direction")
    if entry.vector is None and (entry.node is None or entry.direction is None):
        raise Rule("", f"where is {what}? give a vector, or node and direction")


Preloads = Annotated[
    tuple[Preload, ...],
    list_of_sections(50, "must be at most 50 sections, [[preload]]"),
]
VectorPorts = Annotated[
    tuple[VectorPort, ...],
    list_of_sections(20, "must be at most 20 sections, [[port]]"),
    Field(min_length=1),
]
VectorOutputs = Annotated[
    tuple[VectorOutput, ...], list_of_sections(100, "must be at most 100 sections, [[output]]")
]


@holds_requests
class MatricesJoint(PressedJoint):
    """A joint from finite-element matrices, its loads and the analyses asked for."""

    unnamed: ClassVar[str] = "a joint from matrices"
    width_in: ClassVar[str] = "matrices"

    kind: Literal["matrices"]
    """What the joint is described by. Which sections the file has: here files of matrices, for "lap"
    dimensions."""
    title: str | None = Field(default=None, max_length=200)
    """Name of the joint. Heads tables, figures and the summary."""
    matrices: Matrices
    interface: PairTable
    contact: PairContact = Field(default_factory=PairContact)
    preload: Preloads = Field(default=())
    """Loads that press the sides together, [[preload]]; left out where pairs have a negative gap."""
    damping: DampingOrRatio = Field(default_factory=DampingOrRatio)
    port: VectorPorts
    """Loads that [load] may name, [[port]]; where there is one, it drives the joint."""
    load: Load | None = None
    analysis: Requests = Field(default_factory=cycles_and_response)
    output: VectorOutputs = Field(default=())
    """Quantities that are reported, [[output]]; left out, the displacement of the driven port. Tables and
    figures show the first."""

    @property
    def measured(self) -> tuple[VectorOutput, ...]:
        """Quantities that are reported, and where each is."""
        if self.output:
            return self.output
        port = driven_of(self.port, self.load)
        quantity = USUAL_QUANTITY[port.kind]
        place = {key: getattr(port, key) for key in ("vector", "node", "direction")}
        given = {"name": quantity, "quantity": quantity} | place
        return (VectorOutput.model_construct(**given),)

    @property
    def modes_kept(self) -> int:
        """Free-interface modes that stay dynamic."""
        return self.matrices.modes

    @property
    def frictionless(self) -> bool:
        """Whether the file says that no contact pair has friction."""
        return self.contact.friction == 0

    @property
    def files(self) -> tuple[str, ...]:
        """Every file that the joint comes from, each once."""
        m, pairs = self.matrices, self.interface
        given = (
            *(m.stiffness, m.mass, m.damping, m.dofs, m.nodes, m.motions, m.supports),
            *(pairs.pairs, pairs.relative, pairs.normal, pairs.tangential),
            *(each.vector for each in (*self.preload, *self.port, *self.measured)),
            *(row for each in self.measured for row in (each.stiffness_row, each.mass_row)),
        )
        sources = (source for source in given if source is not None)
        return tuple(dict.fromkeys(split_source(source)[0] for source in sources))

    def __repr__(self) -> str:
        title = [repr(self.title)] if self.title else []
        unit = "N" if self.whole else "N/m"
        force = units.readable(sum(each.force for each in self.preload), unit)
        facts = (
            f"K {self.matrices.stiffness}",
            f"preload {force if self.preload else 'by interference'}",
            f"analyses: {', '.join(self.analysis.asked) or 'none'}",
        )
        return f"MatricesJoint({', '.join((*title, *facts))})"

    __str__ = __repr__

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        check_named(self)
        _reactions_are_known(self)
        if self.matrices.damping is not None and self.damping.model_fields_set:
            raise Rule("damping", "is in matrices.damping already: remove one of the two")
        return self


def _reactions_are_known(joint: MatricesJoint) -> None:
    """Raise `Rule` where nothing says what a reaction is of."""
    for k, output in enumerate(joint.output):
        if not output.reacts:
            continue
        if output.stiffness_row is None and joint.matrices.supports is None:
            raise Rule(
                f"output.{k}",
                "supports are in the matrices: give its stiffness_row, or matrices.supports for the reaction "
                "of springs",
            )
        if output.stiffness_row is not None and joint.driven.kind == "base":
            raise Rule(
                f"output.{k}",
                "under the motion of a base what is held has inertia of its own, which the matrices do not "
                "have: drive it by a force, or give springs, matrices.supports",
            )
