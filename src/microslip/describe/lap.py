"""What a user may write about a lap joint: validated input models, read from TOML.

A joint file is TOML with one section per thing an engineer knows: the beams, their material, the
contact, the clamp, the supports, what damps, how finely to look, what loads it and what to compute.
Every quantity takes a unit (`microslip.describe.units`); after reading, everything is SI and immutable.
Two-dimensional: forces, moments and stiffnesses are per metre of width.
"""

from __future__ import annotations

import difflib
import json
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_args

from pydantic import BaseModel, BeforeValidator, Field, ValidationError, model_validator

from microslip.describe import units
from microslip.describe.excitation import AnyExcitation, Excitation, LoadedExcitation, check_band
from microslip.describe.quantities import (
    AreaStiffness,
    Count,
    Density,
    Drive,
    Frequencies,
    Frequency,
    Length,
    LineForce,
    LineStiffness,
    Modulus,
    Moments,
    Number,
    OneOrMore,
    Positions,
    Rate,
    Ratios,
    Rhos,
    Rule,
    Section,
    StepsPerCycle,
    Time,
    evenly,
)
from microslip.errors import InputError

if TYPE_CHECKING:
    from typing import Self

    from pydantic.fields import FieldInfo
    from pydantic_core import ErrorDetails

    from microslip.model.elasticity import Material
    from microslip.model.lap_mesh import LapGeometry, MeshControl

PAPER_GREATEST_DAMPING = 2.4
"""The rho at which the paper finds the greatest damping."""

MOST_OF_OPENING = 0.85
"""Largest amplitude of the cycles where the file gives none, over the one that opens the joint."""

FEWEST_ADAPTIVE = 5
"""Harmonics that harmonic balance starts from where it chooses their number."""

SAMPLES_OF_A_HARMONIC = 4
"""Samples per period of the highest harmonic that the contact laws need at least."""

MOST_COLUMNS = 20_000
"""Elements along one beam outside the overlap: more is a slip of the pen."""


def _harmonics(value: Any) -> Any:
    """A number of harmonics, or the word that leaves it open."""
    number = isinstance(value, int) and not isinstance(value, bool)
    if value != "adaptive" and not (number and 1 <= value <= 101):
        raise ValueError('must be a whole number from 1 to 101, or "adaptive"')
    return value


Variant = Literal["printed", "consistent", "refined"]
Drives = Annotated[tuple[Drive, ...], OneOrMore]
Variants = Annotated[tuple[Variant, ...], OneOrMore]
BackboneMethod = Literal["quasi_static", "prescribed", "harmonic"]
BackboneMethods = Annotated[tuple[BackboneMethod, ...], OneOrMore]
ModeNumbers = Annotated[tuple[Annotated[Count, Field(ge=1, le=2000)], ...], OneOrMore]
Harmonics = Annotated[int | Literal["adaptive"], BeforeValidator(_harmonics)]
LoadKind = Literal["moment", "moment_over_clamp_force_length", "rho"]


class Beams(Section):
    """Two identical beams and how far they overlap, m."""

    length: Length = Field(gt=0)
    thickness: Length = Field(gt=0)
    overlap_half_length: Length = Field(gt=0)

    @model_validator(mode="after")
    def _overlap_fits(self) -> Self:
        if self.overlap_half_length * 2 > self.length * (1 + 1e-12):
            raise Rule(
                "overlap_half_length",
                f"the beams overlap over twice this; at most half of beams.length, "
                f"{self.length / 2:g} m, is possible",
            )
        return self


class MaterialInput(Section):
    """Linear isotropic material of both beams."""

    youngs_modulus: Modulus = Field(gt=0)
    poissons_ratio: Number = Field(gt=-1, lt=0.5)
    density: Density = Field(gt=0)
    plane: Literal["strain", "stress"] = "strain"


class Contact(Section):
    """The plane of contact: Coulomb friction, and how finely it is resolved."""

    friction: Number = Field(ge=0, le=2)
    pairs: Count = Field(default=201, ge=5, le=5001)
    law: Literal["exact", "elastic"] = "exact"
    tangential_stiffness: AreaStiffness | None = Field(default=None, gt=0)
    normal_stiffness: AreaStiffness | None = Field(default=None, gt=0)

    @property
    def pairs_used(self) -> int:
        """Number of contact pairs in the mesh: `pairs`, raised by one where even."""
        return self.pairs + 1 - self.pairs % 2

    @model_validator(mode="after")
    def _stiffness_fits_law(self) -> Self:
        if self.law == "elastic" and self.tangential_stiffness is None:
            raise Rule(
                "tangential_stiffness",
                f'law = "elastic" needs it: {units.AREA_STIFFNESS.advice()}',
            )
        for key in ("tangential_stiffness", "normal_stiffness"):
            if self.law == "exact" and getattr(self, key) is not None:
                raise Rule(key, 'is only for law = "elastic": remove it, or change contact.law')
        return self


class Clamp(Section):
    """Force that presses the beams together (N/m of width), spread over ``|x| <= half_length``."""

    force: LineForce = Field(gt=0)
    half_length: Length = Field(gt=0)


class Support(Section):
    """Weak horizontal springs at each far end, N/m per metre of width."""

    horizontal_spring: LineStiffness = Field(default=1e5, ge=0)


class Damping(Section):
    """Rayleigh damping ``C = alpha M + beta K`` of the material."""

    alpha: Rate = Field(default=0.0, ge=0)
    beta: Time = Field(default=0.0, ge=0)


class MeshInput(Section):
    """How fine the mesh is away from the contact, and how many modes stay dynamic."""

    overlap_growth: Number = Field(default=1.3, ge=1, le=3)
    max_layer: Number = Field(default=0.2, gt=0.005, le=1)
    rest_size: Number = Field(default=0.5, gt=0.005, le=10)
    modes: Count = Field(default=60, ge=4, le=2000)


class Load(Section):
    """Amplitudes of the end moment: exactly one of `moment`, its ratio to P L, and `rho`.

    ``rho = C mu P L / M``. The constant C is given by `rho_scale`, or else fixed such that the
    greatest damping falls at ``rho = greatest_damping_at``.
    """

    moment: Moments | None = None
    moment_over_clamp_force_length: Ratios | None = None
    rho: Rhos | None = None
    greatest_damping_at: Number = Field(default=PAPER_GREATEST_DAMPING, gt=0)
    rho_scale: Number | None = Field(default=None, gt=0)

    @property
    def kind(self) -> LoadKind:
        """Which of the three keys gives the load."""
        return next(kind for kind in get_args(LoadKind) if getattr(self, kind) is not None)

    @property
    def values(self) -> tuple[float, ...]:
        """The values of that key."""
        values: tuple[float, ...] = getattr(self, self.kind)
        return values

    @model_validator(mode="after")
    def _one_load(self) -> Self:
        kinds = get_args(LoadKind)
        given = [kind for kind in kinds if getattr(self, kind) is not None]
        if len(given) != 1:
            found = " and ".join(given) if given else "none"
            raise Rule("", f"give exactly one of {', '.join(kinds)}; found {found}")
        for key in ("greatest_damping_at", "rho_scale"):
            if given != ["rho"] and key in self.model_fields_set:
                raise Rule(key, f"only belongs to load.rho, and the load is given by {given[0]}")
        if self.rho_scale is not None and "greatest_damping_at" in self.model_fields_set:
            raise Rule("rho_scale", "fixes what greatest_damping_at would calibrate: give one")
        return self


class CycleAnalysis(Section):
    """Quasi-static cycles: stiffness and damping against amplitude M/(PL)."""

    drives: Drives = ("moment", "mode")
    smallest: Number = Field(default=5e-5, gt=0)
    largest: Number | None = Field(default=None, gt=0)
    count: Count = Field(default=25, ge=2, le=1000)
    moment_over_clamp_force_length: Ratios | None = None
    steps: Count = Field(default=300, ge=20, le=100_000)
    max_cycles: Count = Field(default=6, ge=2, le=1000)
    closure: Number = Field(default=1e-5, gt=0, lt=0.1)

    def amplitudes(self, opening: float = 1.0) -> tuple[float, ...]:
        """M/(PL) of every cycle, ascending; `largest` left out is 0.85 of `opening`.

        Examples
        --------
        >>> CycleAnalysis(smallest=0.001, largest=0.1, count=3).amplitudes()
        (0.001, 0.01, 0.1)
        """
        if self.moment_over_clamp_force_length is not None:
            return tuple(sorted(set(self.moment_over_clamp_force_length)))
        largest = MOST_OF_OPENING * opening if self.largest is None else self.largest
        ratio = largest / self.smallest
        inner = [self.smallest * ratio ** (i / (self.count - 1)) for i in range(1, self.count - 1)]
        return (self.smallest, *inner, largest)

    @model_validator(mode="after")
    def _one_list(self) -> Self:
        _distinct("drives", self.drives)
        range_keys = {"smallest", "largest", "count"} & self.model_fields_set
        if self.moment_over_clamp_force_length is not None and range_keys:
            raise Rule(
                "moment_over_clamp_force_length",
                f"lists the amplitudes: remove {', '.join(sorted(range_keys))}",
            )
        if self.largest is not None and self.largest <= self.smallest:
            raise Rule("largest", f"must be above smallest, {self.smallest:g}")
        return self


class ResponseAnalysis(Section):
    """Frequency response of the reduced model, in Hz."""

    from_: Frequency = Field(default=165.0, gt=0, alias="from")
    to: Frequency = Field(default=190.0, gt=0)
    count: Count = Field(default=501, ge=2, le=1_000_000)
    variants: Variants = ("printed", "consistent", "refined")
    tolerance: Number = Field(default=1e-10, gt=0, lt=0.1)
    max_iterations: Count = Field(default=500, ge=1, le=1_000_000)

    def frequencies(self) -> tuple[float, ...]:
        """Evenly spaced frequencies, Hz.

        Examples
        --------
        >>> ResponseAnalysis(from_=170, to=171, count=3).frequencies()
        (170.0, 170.5, 171.0)
        """
        return evenly(self.from_, self.to, self.count)

    @model_validator(mode="after")
    def _ascending(self) -> Self:
        _distinct("variants", self.variants)
        if self.to <= self.from_:
            raise Rule("to", f"must be above analysis.response.from, {self.from_:g} Hz")
        return self


class ReducedAnalysis(Section):
    """Which reduced models, and how finely the refined one is tabulated."""

    variant: Variants | None = None
    amplitudes: Count = Field(default=48, ge=4, le=1000)
    steps: Count = Field(default=200, ge=60, le=100_000)
    max_cycles: Count = Field(default=4, ge=2, le=1000)
    upper_modes: Count = Field(default=2, ge=0, le=20)

    @model_validator(mode="after")
    def _no_repetition(self) -> Self:
        _distinct("variant", self.variant or ())
        return self


class BackboneAnalysis(Section):
    """Natural frequency and damping ratio of modes of the joint against their amplitude.

    `smallest` and `largest` are fractions of the amplitude at which the inertia of the mode opens
    the joint.
    """

    modes: ModeNumbers = (1,)
    methods: BackboneMethods = ("quasi_static", "prescribed")
    smallest: Number = Field(default=1e-5, gt=0, lt=1)
    largest: Number = Field(default=MOST_OF_OPENING, gt=0, lt=1)
    count: Count = Field(default=30, ge=2, le=1000)
    steps: Count = Field(default=100, ge=20, le=100_000, multiple_of=4)
    max_cycles: Count = Field(default=4, ge=2, le=1000)
    harmonics: Count = Field(default=5, ge=1, le=50)

    @model_validator(mode="after")
    def _ascending(self) -> Self:
        _distinct("methods", self.methods)
        _distinct("modes", self.modes)
        if self.largest <= self.smallest:
            raise Rule("largest", f"must be above analysis.backbone.smallest, {self.smallest:g}")
        return self


class TimeAnalysis(Section):
    """Steady states by time integration with full contact: the truth at a few frequencies."""

    frequencies: Frequencies | None = None
    from_: Frequency | None = Field(default=None, gt=0, alias="from")
    to: Frequency | None = Field(default=None, gt=0)
    count: Count | None = Field(default=None, ge=2, le=10_000)
    steps: StepsPerCycle = 150
    positions: Positions | None = None
    max_cycles: Count = Field(default=400, ge=2, le=100_000)
    tolerance: Number = Field(default=1e-5, gt=0, lt=0.1)
    search: Literal["accelerated", "marched"] = "accelerated"

    def band(self) -> tuple[float, ...]:
        """Frequencies, Hz, ascending.

        Examples
        --------
        >>> TimeAnalysis(from_=170, to=171, count=3).band()
        (170.0, 170.5, 171.0)
        """
        if self.frequencies is not None:
            return tuple(sorted(set(self.frequencies)))
        assert self.from_ is not None
        assert self.to is not None
        assert self.count is not None
        return evenly(self.from_, self.to, self.count)

    @model_validator(mode="after")
    def _one_band(self) -> Self:
        check_band(self.frequencies, (self.from_, self.to, self.count))
        if self.from_ is not None and self.to is not None and self.to <= self.from_:
            raise Rule("to", f"must be above analysis.time.from, {self.from_:g} Hz")
        return self


class HarmonicAnalysis(Section):
    """Periodic responses by harmonic balance, on every branch that the ends of the band lie on."""

    frequencies: Frequencies | None = None
    from_: Frequency | None = Field(default=None, gt=0, alias="from")
    to: Frequency | None = Field(default=None, gt=0)
    count: Count | None = Field(default=None, ge=2, le=10_000)
    harmonics: Harmonics = 5
    tolerance: Number = Field(default=0.03, gt=0, lt=1)
    most: Count = Field(default=21, ge=5, le=101)
    samples: Count | None = Field(default=None, ge=16, le=100_000)
    stability: bool = Field(default=True, strict=True)

    @property
    def branch_harmonics(self) -> int:
        """Harmonics of the branch, from which adaptive ones are raised at each point."""
        return FEWEST_ADAPTIVE if self.harmonics == "adaptive" else self.harmonics

    def band(self) -> tuple[float, ...]:
        """Frequencies, Hz, ascending.

        Examples
        --------
        >>> HarmonicAnalysis(from_=170, to=171, count=3).band()
        (170.0, 170.5, 171.0)
        """
        if self.frequencies is not None:
            return tuple(sorted(set(self.frequencies)))
        assert self.from_ is not None
        assert self.to is not None
        assert self.count is not None
        return evenly(self.from_, self.to, self.count)

    @model_validator(mode="after")
    def _one_band(self) -> Self:
        check_band(self.frequencies, (self.from_, self.to, self.count))
        if self.from_ is not None and self.to is not None and self.to <= self.from_:
            raise Rule("to", f"must be above analysis.harmonic.from, {self.from_:g} Hz")
        if len(self.band()) < 2:
            raise Rule(
                "frequencies",
                "a branch is followed from the first to the last of them: give two or more",
            )
        return self

    @model_validator(mode="after")
    def _resolved(self) -> Self:
        for key in ("tolerance", "most"):
            if self.harmonics != "adaptive" and key in self.model_fields_set:
                raise Rule(
                    key, 'is only for harmonics = "adaptive": remove it, or change harmonics'
                )
        needed = SAMPLES_OF_A_HARMONIC * self.branch_harmonics
        if self.samples is not None and self.samples < needed:
            raise Rule(
                "samples",
                f"per cycle do not resolve {self.branch_harmonics} harmonics: take at least "
                f"{needed}, or fewer harmonics",
            )
        return self


def _entries(value: Any) -> Any:
    """One section [analysis.history] is a list of one."""
    if isinstance(value, Mapping):
        return (value,)
    if not isinstance(value, list | tuple) or len(value) > 1000:
        raise ValueError("must be sections, [[analysis.history]]")
    return value


class Analysis(Section):
    """What to compute; a table left out is not computed."""

    cycle: CycleAnalysis | None = None
    response: ResponseAnalysis | None = None
    reduced: ReducedAnalysis = Field(default_factory=ReducedAnalysis)
    backbone: BackboneAnalysis | None = None
    harmonic: HarmonicAnalysis | None = None
    time: TimeAnalysis | None = None
    history: Annotated[tuple[AnyExcitation, ...], BeforeValidator(_entries)] = ()

    @model_validator(mode="after")
    def _distinct_names(self) -> Self:
        labels = [entry.label for entry in self.history]
        for k, label in enumerate(labels):
            if label in labels[:k]:
                raise Rule(f"history.{k}.name", f"two histories are called {label!r}: give names")
        return self


def _everything() -> Analysis:
    return Analysis(cycle=CycleAnalysis(), response=ResponseAnalysis())


class LapJoint(Section):
    """A lap joint, its loads and the analyses asked for. SI units throughout."""

    title: str | None = Field(default=None, max_length=200)
    beams: Beams
    material: MaterialInput
    contact: Contact
    clamp: Clamp
    support: Support = Field(default_factory=Support)
    damping: Damping = Field(default_factory=Damping)
    mesh: MeshInput = Field(default_factory=MeshInput)
    load: Load | None = None
    analysis: Analysis = Field(default_factory=_everything)

    @property
    def clamp_force_length(self) -> float:
        """P L, N m per metre of width: what amplitudes are measured by."""
        return self.clamp.force * self.beams.length

    @property
    def opening_ratio(self) -> float:
        """M/(PL) at which the clamped joint opens: the contact resultant has reached the tip.

        Equilibrium of one beam under clamp, contact and end moment puts the resultant of the
        contact pressure at ``x = M/P``; it cannot lie beyond the overlap, so ``M < P L_o``.
        """
        return self.beams.overlap_half_length / self.beams.length

    @property
    def variants(self) -> tuple[str, ...]:
        """Reduced models asked for; none where no response is."""
        response, reduced = self.analysis.response, self.analysis.reduced
        if response is None:
            return ()
        return response.variants if reduced.variant is None else reduced.variant

    def cycle_amplitudes(self) -> tuple[float, ...]:
        """M/(PL) of every quasi-static cycle, ascending; none where cycles are not asked for."""
        cycle = self.analysis.cycle
        return () if cycle is None else cycle.amplitudes(self.opening_ratio)

    def load_moments(self) -> tuple[float, ...]:
        """End moments of the loads, N m per metre of width, as far as the file alone tells.

        Loads given by rho need the constant C and give none.
        """
        if self.load is None or self.load.kind == "rho":
            return ()
        scale = 1.0 if self.load.kind == "moment" else self.clamp_force_length
        return tuple(scale * value for value in self.load.values)

    def geometry(self) -> LapGeometry:
        """Dimensions for the mesh."""
        from microslip.model.lap_mesh import LapGeometry

        b = self.beams
        return LapGeometry(b.length, b.thickness, b.overlap_half_length, self.clamp.half_length)

    def material_model(self) -> Material:
        """Material for the assembly."""
        from microslip.model.elasticity import Material

        m = self.material
        return Material(m.youngs_modulus, m.poissons_ratio, m.density, m.plane)

    def mesh_control(self) -> MeshControl:
        """Fineness of the mesh, with the number of contact pairs that is used."""
        from microslip.model.lap_mesh import MeshControl

        m = self.mesh
        return MeshControl(self.contact.pairs_used, m.overlap_growth, m.max_layer, m.rest_size)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        _clamp_fits(self)
        _mesh_is_reasonable(self)
        _response_has_its_inputs(self)
        _variants_are_said_once(self)
        _time_has_its_inputs(self)
        _harmonic_has_its_inputs(self)
        _histories_have_their_inputs(self)
        _positions_are_on_the_overlap(self)
        _joint_stays_closed(self)
        return self


def _distinct(key: str, values: Sequence[str | int]) -> None:
    if len(set(values)) < len(values):
        raise Rule(key, "names one thing twice")


def _clamp_fits(joint: LapJoint) -> None:
    overlap = joint.beams.overlap_half_length
    if joint.clamp.half_length > overlap * (1 + 1e-12):
        raise Rule(
            "clamp.half_length",
            f"the clamp must lie on the overlap: at most beams.overlap_half_length, {overlap:g} m",
        )


def _mesh_is_reasonable(joint: LapJoint) -> None:
    rest = joint.beams.length - 2 * joint.beams.overlap_half_length
    columns = rest / (joint.mesh.rest_size * joint.beams.thickness)
    if columns > MOST_COLUMNS:
        raise Rule(
            "beams.thickness",
            f"the beams would be {columns:.0f} elements long and {MOST_COLUMNS} are allowed: "
            "check beams.length and beams.thickness, or raise mesh.rest_size",
        )


def _response_has_its_inputs(joint: LapJoint) -> None:
    if joint.analysis.response is not None and joint.analysis.cycle is None:
        raise Rule(
            "analysis.response",
            "is computed from the cycles: add a section [analysis.cycle]; it may be empty",
        )
    if joint.analysis.response is not None and joint.load is None:
        raise Rule(
            "load",
            "the section is missing and analysis.response needs it: write for example [load] "
            "with rho = 2.4, or leave analysis.response out",
        )
    if joint.load is not None and joint.contact.friction == 0 and any(joint.load.rho or ()):
        raise Rule(
            "load.rho", "without contact.friction rho is 0: give the moment, or some friction"
        )


def _variants_are_said_once(joint: LapJoint) -> None:
    response, reduced = joint.analysis.response, joint.analysis.reduced
    if reduced.variant is None:
        return
    if response is None:
        raise Rule(
            "analysis.reduced.variant",
            "is for the forced response: add a section [analysis.response]; it may be empty",
        )
    if "variants" in response.model_fields_set:
        raise Rule(
            "analysis.reduced.variant",
            "the variants are in analysis.response.variants already: remove one of the two",
        )


def _time_has_its_inputs(joint: LapJoint) -> None:
    if joint.analysis.time is not None and joint.analysis.response is None:
        raise Rule(
            "analysis.time",
            "starts from the reduced model: add a section [analysis.response]; it may be empty",
        )


def _harmonic_has_its_inputs(joint: LapJoint) -> None:
    load, analysis = joint.load, joint.analysis
    if analysis.harmonic is None:
        return
    if load is None:
        raise Rule(
            "load",
            "the section is missing and analysis.harmonic needs it: write for example [load] "
            'with moment = "50 N*m/m"',
        )
    if load.rho is None or analysis.response is not None or not any(load.rho):
        return
    if load.rho_scale is None:
        raise Rule("load.rho", "needs load.rho_scale, or analysis.response, which calibrates it")


def _histories_have_their_inputs(joint: LapJoint) -> None:
    load = joint.load
    for k, entry in enumerate(joint.analysis.history):
        key = f"analysis.history.{k}"
        if not isinstance(entry, LoadedExcitation) or entry.load_key is None:
            continue
        if entry.rho is None:
            size = joint.clamp_force_length if entry.moment is not None else 1.0
            amplitude = entry.moment or entry.moment_over_clamp_force_length
            assert amplitude is not None
            _holds(joint, f"{key}.{entry.load_key}", amplitude / size)
        elif joint.contact.friction == 0:
            raise Rule(f"{key}.rho", "without contact.friction rho is 0: give the moment")
        elif load is None or load.rho is None:
            raise Rule(f"{key}.rho", "needs the constant of load.rho: give load.rho, or the moment")
        elif load.rho_scale is None and joint.analysis.response is None:
            raise Rule(
                f"{key}.rho", "needs load.rho_scale, or analysis.response, which calibrates it"
            )


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
        amplitudes = joint.cycle_amplitudes()
        if amplitudes[-1] < amplitudes[0]:
            raise Rule(
                "analysis.cycle.smallest",
                f"must be below the largest amplitude, by default {MOST_OF_OPENING:g} of the one "
                f"that opens the joint: {amplitudes[-1]:.4g}",
            )
        listed = cycle.moment_over_clamp_force_length is not None
        key = "moment_over_clamp_force_length" if listed else "largest"
        _holds(joint, f"analysis.cycle.{key}", max(joint.cycle_amplitudes()))
    if load is None:
        return
    if load.kind != "rho":
        size = joint.clamp_force_length
        _holds(joint, f"load.{load.kind}", max(joint.load_moments()) / size)
    elif load.rho_scale is not None and any(load.values):
        smallest = min(rho for rho in load.values if rho > 0)
        _holds(joint, "load.rho", load.rho_scale * joint.contact.friction / smallest)


def _holds(joint: LapJoint, key: str, ratio: float) -> None:
    limit = joint.opening_ratio
    if ratio >= limit:
        raise Rule(
            key,
            f"M/(PL) = {ratio:.4g} opens the joint: the clamp holds less than "
            f"overlap_half_length/length = {limit:.4g}, a moment of "
            f"{limit * joint.clamp_force_length:.4g} N*m/m",
        )


def load_joint(path: str | Path) -> LapJoint:
    """Read and validate a joint file.

    Raises
    ------
    InputError
        With one message: file, key, value, and what is allowed.
    """
    file = Path(path)
    return parse_joint(_read_toml(file), str(path), file.parent)


def parse_joint(
    document: Mapping[str, Any], source: str = "joint", folder: str | Path = ""
) -> LapJoint:
    """Validate a joint given as nested mappings, as `tomllib` makes them.

    Files that it names are looked for in `folder`.

    Raises
    ------
    InputError
        Naming `source`, key, value, and what is allowed.

    Examples
    --------
    >>> parse_joint({"beams": {"length": "-1 m"}})
    Traceback (most recent call last):
    ...
    microslip.errors.InputError: joint: 6 problems
      beams.length = "-1 m": must be greater than 0
      beams.thickness is missing: expected a length, for example "12.5 mm"
      beams.overlap_half_length is missing: expected a length, for example "12.5 mm"
      [material] is missing: a section with youngs_modulus, poissons_ratio, density
      [contact] is missing: a section with friction
      ...
    """
    try:
        return LapJoint.model_validate(document, context={"folder": folder})
    except ValidationError as failure:
        problems = [_describe(error, document) for error in failure.errors()]
    raise InputError(_joined(source, problems)) from None


def _read_toml(path: Path) -> dict[str, Any]:
    if path.is_dir():
        raise InputError(f"{path}: is a folder; a joint file was expected")
    try:
        return tomllib.loads(path.read_bytes().decode())
    except FileNotFoundError:
        hint = f"; `microslip new lap {path}` writes one" if path.suffix == ".toml" else ""
        raise InputError(f"{path}: no such file{hint}") from None
    except UnicodeDecodeError as failure:
        raise InputError(f"{path}: not UTF-8 text (byte {failure.start})") from None
    except tomllib.TOMLDecodeError as failure:
        raise InputError(f"{path}: not valid TOML: {failure}") from None
    except (OSError, ValueError) as failure:
        reason = getattr(failure, "strerror", None) or failure
        raise InputError(f"{path}: cannot be read: {reason}") from None


def _joined(source: str, problems: list[str], shown: int = 5) -> str:
    if len(problems) == 1:
        return f"{source}: {problems[0]}"
    rest = ["..."] if len(problems) > shown else []
    return "\n  ".join([f"{source}: {len(problems)} problems", *problems[:shown], *rest])


def _describe(error: ErrorDetails, document: Mapping[str, Any]) -> str:
    """One problem in the words of the joint file."""
    loc, kind = error["loc"], error["type"]
    context: Mapping[str, Any] = error.get("ctx", {})
    cause = context.get("error")
    if isinstance(cause, Rule):
        keys = [int(k) if k.isdigit() else k for k in cause.key.split(".") if k]
        return f"{_written((*loc, *keys), document)}: {cause}"
    if kind == "union_tag_not_found":
        return f"{_written((*loc, 'signal'), document)} is missing: one of {', '.join(_signals())}"
    if kind == "union_tag_invalid":
        return f"{_written((*loc, 'signal'), document)}: must be one of {', '.join(_signals())}"
    if kind == "missing":
        return _missing(loc)
    if kind == "extra_forbidden":
        return _unknown(loc)
    if kind == "model_type":
        return f"{_written(loc, document)}: must be a section, [{_dotted(loc)}]"
    message = str(cause) if cause is not None else error["msg"]
    for start in ("Input should be ", "Value should have "):
        message = message.replace(start, "must be " if start.startswith("I") else "must have ")
    return f"{_written(loc, document)}: {message}"


def _dotted(loc: Sequence[int | str]) -> str:
    """A location as a path; the kind of signal in it is left out."""
    parts = (f"[{p}]" if isinstance(p, int) else f".{p}" for p in loc if p not in _signals())
    return "".join(parts).removeprefix(".")


def _signals() -> dict[str, type[Excitation]]:
    """Kinds of signal and their sections; a location in a file holds the kind as well."""
    union, _ = get_args(AnyExcitation)
    return {get_args(c.model_fields["signal"].annotation)[0]: c for c in get_args(union)}


def _is_tag(part: str, value: Any) -> bool:
    return isinstance(value, Mapping) and value.get("signal") == part and part not in value


def _written(loc: Sequence[int | str], document: Mapping[str, Any]) -> str:
    """Key and value as the user wrote them."""
    value: Any = document
    key = ""
    for part in loc:
        if isinstance(part, int):
            if isinstance(value, list | tuple):
                key += f"[{part}]"
                value = value[part]
        elif not _is_tag(part, value):
            key += f".{part}" if key else part
            value = value.get(part) if isinstance(value, Mapping) else None
    if value is None:
        return key
    if isinstance(value, Mapping):
        return f"[{key}]"
    text = json.dumps(value, ensure_ascii=False, default=str)
    return f"{key} = {text if len(text) <= 60 else text[:57] + '...'}"


def _model_at(loc: Sequence[int | str]) -> type[BaseModel] | None:
    """Model of the section at a location."""
    model: type[BaseModel] = LapJoint
    for part in loc:
        if isinstance(part, int) or part == "history":
            continue
        found = _field(model, part)
        section = _signals().get(part) if found is None else _section(found)
        if section is None:
            return None
        model = section
    return model


def _field(model: type[BaseModel], key: int | str) -> FieldInfo | None:
    return {info.alias or name: info for name, info in model.model_fields.items()}.get(str(key))


def _section(info: FieldInfo) -> type[BaseModel] | None:
    for choice in (info.annotation, *get_args(info.annotation)):
        if isinstance(choice, type) and issubclass(choice, BaseModel):
            return choice
    return None


def _keys(model: type[BaseModel], *, required: bool = False) -> list[str]:
    return [
        info.alias or name
        for name, info in model.model_fields.items()
        if info.is_required() or not required
    ]


def _missing(loc: Sequence[int | str]) -> str:
    model = _model_at(loc[:-1])
    info = None if model is None else _field(model, loc[-1])
    section = None if info is None else _section(info)
    if section is not None:
        needed = ", ".join(_keys(section, required=True))
        return f"[{_dotted(loc)}] is missing: a section with {needed}"
    kinds = [item for item in (info.metadata if info else []) if isinstance(item, units.Kind)]
    advice = f": {kinds[0].advice()}" if kinds else ""
    return f"{_dotted(loc)} is missing{advice}"


def _unknown(loc: Sequence[int | str]) -> str:
    key, place = str(loc[-1]), _dotted(loc[:-1])
    model = _model_at(loc[:-1]) or LapJoint
    known = _keys(model)
    close = difflib.get_close_matches(key, known, n=1, cutoff=0.5)
    where = f"in [{place}]" if place else "at the top of the file"
    if close:
        return f"{_dotted(loc)} is not a known key; the nearest {where} is {close[0]!r}"
    homes = [name for name, info in LapJoint.model_fields.items() if _has(info, key)]
    if homes:
        return f"{_dotted(loc)} is not a known key {where}; it belongs in [{homes[0]}]"
    return f"{_dotted(loc)} is not a known key; {where} there are {', '.join(known)}"


def _has(info: FieldInfo, key: str) -> bool:
    section = _section(info)
    return section is not None and key in _keys(section)
