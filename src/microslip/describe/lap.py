"""What a user may write about a lap joint: the sections of its file, validated.

A joint file is TOML with one section per thing an engineer knows: the beams, their material, the
contact, the clamp, the supports, what damps, how finely to look, what loads it and what to compute.
Every quantity takes a unit (`microslip.describe.units`); after reading, everything is SI and immutable.
Two-dimensional: forces, moments and stiffnesses are per metre of width. `microslip.model.lap` makes
the model of it.
"""

from __future__ import annotations

from html import escape
from typing import ClassVar, Literal, Self

from pydantic import Field, model_validator

from microslip.describe import units
from microslip.describe.amplitude import Load, LoadKey
from microslip.describe.driving import check_loads
from microslip.describe.excitation import Excitation
from microslip.describe.joint import Joint, check_cycle_range, check_requests
from microslip.describe.outputs import USUAL, Output, Outputs, check_outputs
from microslip.describe.parts import (
    Beams,
    Clamp,
    Contact,
    Damping,
    MaterialInput,
    MeshInput,
    Support,
)
from microslip.describe.ports import Port, Ports, check_ports
from microslip.describe.quantities import Rule
from microslip.describe.requests import (
    Requests,
    TimeAnalysis,
    cycles_and_response,
    holds_requests,
)

WEAKEST_SPRING = 1e-7
"""Of the axial stiffness of a beam: weaker springs hold the joint at this one's mean position."""

MOST_COLUMNS = 20_000
"""Elements along one beam outside the overlap: more is a slip of the pen."""


@holds_requests
class LapJoint(Joint):
    """A lap joint, its loads and the analyses asked for. SI units throughout.

    Examples
    --------
    >>> LapJoint.model_validate(
    ...     {
    ...         "beams": {"length": "0.25 m", "thickness": "12.5 mm", "overlap_half_length": 0.0375},
    ...         "material": {"youngs_modulus": "70 GPa", "poissons_ratio": 0.3, "density": 2000},
    ...         "contact": {"friction": 0.25},
    ...         "clamp": {"force": "1 MN/m", "half_length": "25 mm"},
    ...         "analysis": {"cycle": {}},
    ...     }
    ... )
    LapJoint(length 250 mm, thickness 12.5 mm, 201 pairs, analyses: cycle)
    """

    unnamed: ClassVar[str] = "a lap joint"
    modes_key: ClassVar[str] = "mesh.modes"
    pairs_key: ClassVar[str] = "contact.pairs"

    kind: Literal["lap"] = "lap"
    """What the joint is described by. Which sections the file has: here dimensions, for "matrices"
    files of a finite element program."""
    title: str | None = Field(default=None, max_length=200)
    """Name of the joint. Heads tables, figures and the summary."""
    beams: Beams
    material: MaterialInput
    contact: Contact
    clamp: Clamp
    support: Support = Field(default_factory=Support)
    damping: Damping = Field(default_factory=Damping)
    mesh: MeshInput = Field(default_factory=MeshInput)
    port: Ports = Field(default=())
    """Loads that [load] may name, [[port]]; left out, there are the end moments alone."""
    load: Load | None = None
    analysis: Requests = Field(default_factory=cycles_and_response)
    output: Outputs = Field(default=())
    """Points whose motion is reported, [[output]]; left out, the deflection of the middle, the
    rotation of the right end, and the slip at the edge of the clamp. Tables and figures show the
    first."""

    @property
    def outputs(self) -> tuple[Output, ...]:
        """Points whose motion is reported; the first is the one that tables and figures show."""
        return self.output or USUAL

    @property
    def ports(self) -> tuple[Port, ...]:
        """Loads that the file names."""
        return self.port

    @property
    def preload_key(self) -> str:
        """Key of the force of the clamp."""
        return "clamp.force"

    @property
    def rayleigh(self) -> tuple[float, float]:
        """alpha and beta of ``C = alpha M + beta K``, 1/s and s."""
        return self.damping.alpha, self.damping.beta

    @property
    def modes_kept(self) -> int:
        """Free-interface modes that stay dynamic."""
        return self.mesh.modes

    @property
    def extents(self) -> dict[str, tuple[float, float]]:
        """Where each beam begins and ends, m from the middle of the overlap."""
        half, (lower, upper) = self.beams.overlap_half_length, self.beams.lengths
        return {"lower": (half - lower, half), "upper": (-half, upper - half)}

    @property
    def clamp_force_length(self) -> float:
        """P L, N m per metre of width: what amplitudes are measured by."""
        return self.clamp.force * self.beams.length

    @property
    def friction(self) -> float:
        """Coefficient of friction, its mean over the overlap where it varies."""
        mu, half = self.contact.friction, self.beams.overlap_half_length
        return mu if isinstance(mu, float) else mu.mean(-half, half)

    @property
    def frictionless(self) -> bool:
        """Whether no contact pair has friction."""
        return self.friction == 0

    @property
    def symmetric(self) -> bool:
        """Whether a half turn about the middle of the overlap takes the structure onto itself."""
        ends = self.support.left == self.support.right
        parts = self.beams.identical, self.material.identical, self.clamp.symmetric
        return ends and all(parts)

    @property
    def opening_ratio(self) -> float:
        """M/(PL) at which the clamped joint opens: the contact resultant has reached the tip.

        Equilibrium of one beam under clamp, contact and end moment puts the resultant of the
        contact pressure at ``x = x_P ± M/P``, x_P where the clamp acts; it cannot lie beyond the
        overlap, so ``M < P (L_o - |x_P|)``.
        """
        reach = self.beams.overlap_half_length - abs(self.clamp.resultant)
        return reach / self.beams.length

    @property
    def weak_spring(self) -> float:
        """Stiffness of springs that only hold the mean position, N/m per metre of width.

        `WEAKEST_SPRING` of a beam's axial stiffness: at free ends along x and y, and at pinned ends
        whose own springs along x are weaker or none. Nothing else depends on it.
        """
        beams = zip(self.material.moduli, self.beams.thicknesses, self.beams.lengths, strict=True)
        return WEAKEST_SPRING * max(E * thickness / length for E, thickness, length in beams)

    @property
    def spring_used(self) -> float:
        """Stiffness of the horizontal springs of the pinned ends in the model."""
        return max(self.support.horizontal_spring, self.weak_spring)

    def cycle_amplitudes(self) -> tuple[float, ...]:
        """Every quasi-static cycle, ascending; none where cycles are not asked for.

        M/(PL) of the end moments; of a named port amplitudes where the file lists them, else over
        the one that opens the joint.
        """
        cycle = self.analysis.cycle
        if cycle is None:
            return ()
        found = cycle.amplitudes(self.opening_ratio if self.driven_by_end_moments else 1.0)
        if self.driven_by_end_moments and cycle.moment is not None:
            return tuple(M / self.clamp_force_length for M in found)
        return found

    @property
    def friction_moment(self) -> float:
        """``mu P L``, N m per metre of width: what rho compares moments with."""
        return self.friction * self.clamp_force_length

    def end_moment(self, key: LoadKey, value: float) -> float:
        """Amplitude that a key gives: of the end moment, N m per metre of width, or as written.

        Parameters
        ----------
        key : {"moment", "moment_over_clamp_force_length", "rho", "force", "acceleration"}
        value : float
            Positive.
        """
        if key == "moment_over_clamp_force_length":
            return value * self.clamp_force_length
        if key == "rho":
            return self.rho_scale * self.friction_moment / value
        return value

    def __repr__(self) -> str:
        title = [repr(self.title)] if self.title else []
        facts = (
            f"length {units.readable(self.beams.length, 'm')}",
            f"thickness {units.readable(self.beams.thickness, 'm')}",
            f"{self.contact.pairs_used} pairs",
            f"analyses: {', '.join(self.analysis.asked) or 'none'}",
        )
        return f"LapJoint({', '.join((*title, *facts))})"

    __str__ = __repr__

    def _repr_html_(self) -> str:
        """Main quantities as a table, for notebooks."""
        rows = "".join(
            f"<tr><td>{escape(name)}</td><td>{escape(value)}</td></tr>"
            for name, value in self._main_quantities()
        )
        return f"<table><caption>{escape(self.title or 'Lap joint')}</caption>{rows}</table>"

    def _main_quantities(self) -> list[tuple[str, str]]:
        readable, m, c = units.readable, self.material, self.contact
        rows = [
            ("length of a beam", readable(self.beams.length, "m")),
            ("thickness of a beam", readable(self.beams.thickness, "m")),
            ("half length of the overlap", readable(self.beams.overlap_half_length, "m")),
            ("Young's modulus", f"{readable(m.youngs_modulus, 'Pa')}, plane {m.plane}"),
            ("Poisson's ratio", f"{m.poissons_ratio:g}"),
            ("density", f"{m.density:g} kg/m³"),
            ("friction", f"{c.friction}"),
            ("contact", f"{c.law}, {c.pairs_used} pairs"),
            ("clamp force", readable(self.clamp.force, "N/m")),
            ("half length of the clamp", readable(self.clamp.half_length, "m")),
        ]
        if self.load is not None:
            values = ", ".join(f"{value:g}" for value in self.load.values)
            unit = f" {self.driven.load.unit}" if self.load.kind == self.driven.load.key else ""
            rows.append((f"load: {self.load.kind}", values + unit))
        return [*rows, ("analyses", ", ".join(self.analysis.asked) or "none")]

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        _clamp_fits(self)
        _ports_are_held(self)
        _mesh_is_reasonable(self)
        check_requests(self)
        _histories_have_their_inputs(self)
        _positions_are_on_the_overlap(self)
        ends = {"left end": self.support.left, "right end": self.support.right}
        check_outputs(self.output, self.extents, self.clamp.edge, ends)
        _joint_stays_closed(self)
        return self


def _clamp_fits(joint: LapJoint) -> None:
    overlap, clamp = joint.beams.overlap_half_length, joint.clamp
    if clamp.half_length > overlap * (1 + 1e-12):
        raise Rule(
            "clamp.half_length",
            f"the clamp must lie on the overlap: at most beams.overlap_half_length, {overlap:g} m",
        )
    if abs(clamp.centre) + clamp.half_length > overlap * (1 + 1e-12):
        raise Rule(
            "clamp.centre",
            "the clamp must lie on the overlap: at most beams.overlap_half_length less "
            f"clamp.half_length, {overlap - clamp.half_length:.6g} m, to either side",
        )


def _mesh_is_reasonable(joint: LapJoint) -> None:
    beams = zip(("", "upper."), joint.beams.lengths, joint.beams.thicknesses, strict=True)
    for whose, length, thickness in beams:
        rest = length - 2 * joint.beams.overlap_half_length
        columns = rest / (joint.mesh.rest_size * thickness)
        if columns <= MOST_COLUMNS:
            continue
        raise Rule(
            f"beams.{whose}thickness",
            f"the beams would be {columns:.0f} elements long and {MOST_COLUMNS} are allowed: "
            "check beams.length and beams.thickness, or raise mesh.rest_size",
        )


def _histories_have_their_inputs(joint: LapJoint) -> None:
    for k, entry in enumerate(joint.analysis.history):
        key = f"analysis.history.{k}.{entry.load_key}"
        if entry.load_key == "rho" and joint.friction == 0:
            raise Rule(key, "without contact.friction rho is 0: give the moment")
        moment = joint.history_load(entry)
        if moment is not None:
            _holds(joint, key, moment / joint.clamp_force_length)


def _positions_are_on_the_overlap(joint: LapJoint) -> None:
    half = joint.beams.overlap_half_length
    asked: list[tuple[str, TimeAnalysis | Excitation | None]] = [
        ("analysis.time", joint.analysis.time)
    ]
    asked += [(f"analysis.history.{k}", entry) for k, entry in enumerate(joint.analysis.history)]
    for key, entry in asked:
        for x in (entry.positions if entry is not None else None) or ():
            if abs(x) > half * (1 + 1e-9):
                raise Rule(
                    f"{key}.positions",
                    f"{x:g} m lies off the overlap, which is {half:g} m to either side",
                )


def _joint_stays_closed(joint: LapJoint) -> None:
    cycle, load = joint.analysis.cycle, joint.load
    if cycle is not None:
        check_cycle_range(joint)
        key = cycle.listed or "largest"
        _holds(joint, f"analysis.cycle.{key}", max(joint.cycle_amplitudes()))
    moments = joint.load_amplitudes()
    if load is not None and moments:
        _holds(joint, f"load.{load.kind}", max(moments) / joint.clamp_force_length)


def _ports_are_held(joint: LapJoint) -> None:
    support = joint.support
    springs = joint.spring_used == support.horizontal_spring
    check_ports(joint.port, (support.left, support.right), springs)
    analysis = joint.analysis
    check_loads(joint.port, joint.driven, joint.load, analysis.cycle, analysis.history)


def _holds(joint: LapJoint, key: str, ratio: float) -> None:
    """Raise `Rule` where end moments open the joint; what a named port or other supports hold is
    found from the model."""
    if not joint.driven_by_end_moments or "clamped" in (joint.support.left, joint.support.right):
        return
    limit = joint.opening_ratio
    if ratio >= limit:
        raise Rule(
            key,
            f"M/(PL) = {ratio:.4g} opens the joint: the clamp holds less than "
            f"overlap_half_length/length = {limit:.4g}, a moment of "
            f"{limit * joint.clamp_force_length:.4g} N*m/m",
        )
