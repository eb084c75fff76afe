"""Sections of a joint file that say what a lap joint is: its parts, and how they are resolved.

What holds for all sections together is in `microslip.describe.lap`.
"""

from __future__ import annotations

from typing import Literal, Self

from pydantic import Field, model_validator

from microslip.describe import units
from microslip.describe.quantities import (
    AreaStiffness,
    ClampPressure,
    Count,
    Density,
    Friction,
    Length,
    LineForce,
    LineStiffness,
    Modulus,
    Number,
    Rate,
    Rule,
    Section,
    Stress,
    Time,
)

EndSupport = Literal["pinned", "clamped", "free"]


class UpperBeam(Section):
    """What the upper beam has of its own, m; the rest is that of the lower one."""

    length: Length | None = Field(default=None, gt=0)
    """Length of the upper beam, where it is another. Its own bending stiffness and share in the
    frequencies."""
    thickness: Length | None = Field(default=None, gt=0)
    """Thickness of the upper beam, where it is another. Its bending stiffness goes with its third
    power."""


class Beams(Section):
    """Two beams and how far they overlap, m: identical, but for what `upper` says."""

    length: Length = Field(gt=0)
    """Length of each beam. Bending stiffness and natural frequencies, and P L, which moments are
    measured by."""
    thickness: Length = Field(gt=0)
    """Thickness of each beam. Bending stiffness goes with its third power, and so do deflection
    and frequencies."""
    overlap_half_length: Length = Field(gt=0)
    """The beams overlap over twice this; at most length/2. Beyond the clamp it is where the
    contact may open, and the moment that opens the joint is in proportion to it."""
    upper: UpperBeam = Field(default_factory=UpperBeam)

    @property
    def lengths(self) -> tuple[float, float]:
        """Of the lower and the upper beam, m."""
        return self.length, self.upper.length or self.length

    @property
    def thicknesses(self) -> tuple[float, float]:
        """Of the lower and the upper beam, m."""
        return self.thickness, self.upper.thickness or self.thickness

    @property
    def identical(self) -> bool:
        """Whether both have the same dimensions."""
        return len(set(self.lengths)) == len(set(self.thicknesses)) == 1

    @model_validator(mode="after")
    def _overlap_fits(self) -> Self:
        for key, length in zip(("length", "upper.length"), self.lengths, strict=True):
            if self.overlap_half_length * 2 > length * (1 + 1e-12):
                raise Rule(
                    "overlap_half_length",
                    f"the beams overlap over twice this; at most half of beams.{key}, "
                    f"{length / 2:g} m, is possible",
                )
        return self


class UpperMaterial(Section):
    """What the material of the upper beam has of its own; the rest is that of the lower one."""

    youngs_modulus: Modulus | None = Field(default=None, gt=0)
    """Modulus of elasticity E of the upper beam, where it is another. Its bending stiffness."""
    poissons_ratio: Number | None = Field(default=None, gt=-1, lt=0.5)
    """Poisson's ratio of the upper beam, where it is another. Its stiffness in plane strain."""
    density: Density | None = Field(default=None, gt=0)
    """Mass per volume of the upper beam, where it is another. Natural frequencies."""


class MaterialInput(Section):
    """Linear isotropic material: of both beams, but for what `upper` says."""

    youngs_modulus: Modulus = Field(gt=0)
    """Modulus of elasticity E. Every stiffness and frequency."""
    poissons_ratio: Number = Field(gt=-1, lt=0.5)
    """Poisson's ratio. Raises the stiffness in plane strain by 1/(1 - nu²), and spreads the
    pressure."""
    density: Density = Field(gt=0)
    """Mass per volume. Natural frequencies; statics and quasi-static cycles do not know it."""
    yield_stress: Stress | None = Field(default=None, gt=0)
    """Stress at which the material yields. Nothing is computed from it: the pressure of the clamp
    and the stresses of the answers are judged by it."""
    plane: Literal["strain", "stress"] = "strain"
    """Wide joint: "strain"; thin sheet: "stress". In plane strain E counts as E/(1 - nu²)."""
    upper: UpperMaterial = Field(default_factory=UpperMaterial)

    @property
    def moduli(self) -> tuple[float, float]:
        """Young's moduli of the lower and the upper beam, Pa."""
        return self.youngs_modulus, self.upper.youngs_modulus or self.youngs_modulus

    @property
    def ratios(self) -> tuple[float, float]:
        """Poisson's ratios of the lower and the upper beam."""
        own = self.upper.poissons_ratio
        return self.poissons_ratio, self.poissons_ratio if own is None else own

    @property
    def densities(self) -> tuple[float, float]:
        """Densities of the lower and the upper beam, kg/m³."""
        return self.density, self.upper.density or self.density

    @property
    def identical(self) -> bool:
        """Whether both beams are of one material."""
        return all(len(set(pair)) == 1 for pair in (self.moduli, self.ratios, self.densities))


class Contact(Section):
    """The plane of contact: Coulomb friction, and how finely it is resolved."""

    friction: Friction
    """Coefficient of friction mu, or a table of it along x, [["-20 mm", 0.15], ["20 mm", 0.35]],
    constant beyond its ends. What slips, and the damping that comes of it; metals have 0.1 to
    0.8."""
    pairs: Count = Field(default=201, ge=5, le=5001)
    """Contact pairs over the overlap; an even number is raised by one. Slip at small loads happens
    in a few pairs at the edge of the contact; time grows with the square."""
    law: Literal["exact", "elastic"] = "exact"
    """Rigid ("exact") with Coulomb friction, or with springs in series with it ("elastic").
    Elastic where the roughness of the surfaces is known to give."""
    tangential_stiffness: AreaStiffness | None = Field(default=None, gt=0)
    """Of the springs along the surface, per area; only for law = "elastic", which needs it.
    Stiffness of the joint before it slips."""
    normal_stiffness: AreaStiffness | None = Field(default=None, gt=0)
    """Of the springs normal to the surface, per area; only for law = "elastic", rigid where left
    out. Evens out the pressure."""

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
    """Force that presses the beams together (N/m of width), over ``|x - centre| <= half_length``."""

    force: LineForce = Field(gt=0)
    """Force P that presses the outer faces together, per metre of width. All contact pressure:
    what friction holds and the moment that opens the joint are in proportion to it."""
    half_length: Length = Field(gt=0)
    """The clamp presses over twice this; at most the overlap. Where the contact ends, and so where
    it slips first."""
    centre: Length = Field(default=0.0)
    """Where the middle of the clamp is, from the middle of the overlap. An eccentric clamp opens one
    tip before the other."""
    pressure: ClampPressure = Field(default="uniform")
    """How the force is spread: "uniform", "parabolic" (none at the ends), or a table of distances from
    the centre and relative pressures, as under the head of a bolt. What the contact pressure, and so the
    slip, looks like at the ends of the clamp."""

    @property
    def resultant(self) -> float:
        """Where the clamp force acts, m from the middle of the overlap."""
        if isinstance(self.pressure, str):
            return self.centre
        return self.centre + self.pressure.integral(1) / self.pressure.integral()

    @property
    def edge(self) -> float:
        """Where its right end is, m from the middle of the overlap."""
        return self.centre + self.half_length

    @property
    def symmetric(self) -> bool:
        """Whether it looks the same from both ends."""
        if isinstance(self.pressure, str):
            return self.centre == 0
        x, p = self.pressure.x, self.pressure.values
        return self.centre == 0 and p == p[::-1] and x == tuple(-a for a in x[::-1])

    @model_validator(mode="after")
    def _table_fits(self) -> Self:
        if isinstance(self.pressure, str):
            return self
        ends = self.pressure.x[0], self.pressure.x[-1]
        if max(map(abs, ends)) > self.half_length * (1 + 1e-12):
            raise Rule(
                "pressure",
                f"the table goes from {ends[0]:g} to {ends[1]:g} m and clamp.half_length is "
                f"{self.half_length:g} m: positions are distances from clamp.centre, within it",
            )
        if not self.pressure.integral() > 0:
            raise Rule("pressure", "nothing presses: give a relative pressure above 0 somewhere")
        return self


class Support(Section):
    """What holds the far ends.

    The springs of a pinned end, N/m per metre of width, are spread over its face and so resist its
    turning too, by a twelfth of their stiffness times the thickness squared.
    """

    left: EndSupport = "pinned"
    """What holds the left end: "pinned" at mid-height on horizontal springs, "clamped", or "free".
    Mode shapes and frequencies."""
    right: EndSupport = "pinned"
    """What holds the right end, likewise. Mode shapes and frequencies."""
    horizontal_spring: LineStiffness = Field(default=1e5, ge=0)
    """Stiffness that holds each pinned end horizontally, spread over the end face. Weak springs
    only hold the joint in place; stiff ones raise the frequencies."""


class Damping(Section):
    """Rayleigh damping ``C = alpha M + beta K`` of the material."""

    alpha: Rate = Field(default=0.0, ge=0)
    """Damping in proportion to mass. Its damping ratio at omega is alpha/(2 omega): it damps slow
    motion."""
    beta: Time = Field(default=0.0, ge=0)
    """Damping in proportion to stiffness. Its damping ratio at omega is beta omega/2: 0.73 us are
    4e-4 at 170 Hz; it limits the peaks where friction does little."""


class MeshInput(Section):
    """How fine the mesh is away from the contact, and how many modes stay dynamic."""

    overlap_growth: Number = Field(default=1.3, ge=1, le=3)
    """Ratio of neighbouring layers from the interface outward. Time to assemble; the contact
    hardly feels it."""
    max_layer: Number = Field(default=0.2, gt=0.005, le=1)
    """Largest layer, as a fraction of the thickness. Time to assemble; the contact hardly feels
    it."""
    rest_size: Number = Field(default=0.5, gt=0.005, le=10)
    """Elements far from the overlap, as a fraction of the thickness. Frequencies of high modes."""
    modes: Count = Field(default=60, ge=4, le=2000)
    """Free-interface modes kept dynamic; all others follow statically. More where the load has
    high frequencies."""
