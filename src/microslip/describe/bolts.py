"""What presses a joint from a mesh together: bolts by force or by shortening, pressures, and temperature."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal, Self

from pydantic import Field, model_validator

from microslip.describe import units
from microslip.describe.mesh_names import OnNames, Vector
from microslip.describe.quantities import (
    NAME,
    Count,
    Length,
    LineForce,
    LineStiffness,
    Rule,
    Section,
    Stress,
    TemperatureChange,
)


class MeshPreload(Section):
    """A load that is held through every analysis, `[[preload]]`: a bolt, a pressure, or a temperature.

    Examples
    --------
    >>> MeshPreload(section="shank", force="12 kN/m").keeps_length
    True
    >>> MeshPreload(on=["head", "nut"], force="12 kN/m").keeps_length
    False
    """

    name: str = Field(default="clamp", pattern=NAME, max_length=40)
    """What it is called. Messages and the joint model name it so."""
    on: OnNames | None = None
    """Surfaces or node sets it acts on: two of a bolt that is not in the mesh, head and nut, which it draws
    towards each other; one of a force that has no counterpart, as a weight or a centrifugal force, whose
    direction is given; any number of surfaces of a pressure; element sets of a temperature, where it is not
    all elements. All contact pressure."""
    section: str | None = None
    """Surface inside a bolt that is in the mesh, faces on one side of a flat cut through its shank; instead
    of on. The bolt is shortened there along its axis."""
    force: LineForce | None = Field(default=None, gt=0)
    """Force of the bolt when it has been tightened, or on one place, per metre of width. This, shortening or
    pressure."""
    shortening: Length | None = Field(default=None, gt=0)
    """By how much the bolt is shortened from where it is snug. The force follows, and is reported."""
    pressure: Stress | None = Field(default=None, gt=0)
    """Pressure against the surfaces, as of washers. This, force or shortening."""
    temperature: TemperatureChange | None = None
    """Change of temperature since the parts were put together; instead of those three. What expands more
    than its neighbours presses, or gives way."""
    direction: Vector | None = None
    """Of the force on the first of the two places; left out, towards the second. Where their middles do not
    face each other along the bolt."""
    holds: Literal["force", "length"] | None = None
    """What stays once the bolt is tightened; left out, the length of a bolt with a section, a stiffness or a
    shortening, else the force. A bolt that keeps its length resists vibration as its metal does."""
    stiffness: LineStiffness | None = Field(default=None, gt=0)
    """Of a bolt that is not in the mesh and keeps its length, per metre of width; left out, rigid. How much
    of its force it loses to bolts tightened later."""
    order: Count | None = Field(default=None, ge=1, le=1000)
    """When it is tightened: the same number together, then the next; left out, 1, and of a temperature
    after all others. Forces that earlier bolts end with."""

    @property
    def keeps_length(self) -> bool:
        """Whether its length stays once it is tightened, and not its force."""
        if self.holds is not None:
            return self.holds == "length"
        return any(each is not None for each in (self.section, self.stiffness, self.shortening))

    @property
    def amount(self) -> tuple[str, float]:
        """Unit and value of its force, shortening, pressure or change of temperature."""
        given = (
            ("N/m", self.force),
            ("m", self.shortening),
            ("Pa", self.pressure),
            ("K", self.temperature),
        )
        return next((unit, value) for unit, value in given if value is not None)

    @model_validator(mode="after")
    def _one_amount(self) -> Self:
        given = [self.force, self.shortening, self.pressure, self.temperature]
        if sum(each is not None for each in given) != 1:
            raise Rule("", "give one of force, shortening, a pressure on surfaces, or temperature")
        if self.temperature is not None:
            return self._check_temperature()
        if (self.on is None) == (self.section is None):
            raise Rule("", "give on, two places or surfaces, or section, a cut through the bolt")
        if self.pressure is not None:
            self._check_pressure()
        return self

    @model_validator(mode="after")
    def _fits_a_bolt(self) -> Self:
        if self.pressure is not None or self.temperature is not None:
            return self
        if self.on is not None and len(self.on) == 1:
            return self._check_force()
        if self.on is not None and len(self.on) != 2:
            raise Rule("on", 'a bolt acts between two places: ["head", "nut"]')
        if self.section is not None and self.direction is not None:
            raise Rule("direction", "of a section is its normal: remove it")
        if self.section is not None and self.stiffness is not None:
            raise Rule("stiffness", "of a bolt in the mesh is that of its elements: remove it")
        if self.holds == "force" and self.shortening is not None:
            raise Rule("holds", "what is shortened keeps its length: remove it, or give the force")
        if self.holds == "force" and self.stiffness is not None:
            raise Rule("stiffness", 'is of a bolt that keeps its length: remove holds = "force"')
        return self

    def _check_force(self) -> Self:
        if self.force is None or self.direction is None:
            raise Rule(
                "on",
                'a bolt acts between two places, ["head", "nut"]; a force on one has a direction',
            )
        if self.keeps_length:
            raise Rule("on", 'what keeps its length acts between two places: ["head", "nut"]')
        return self

    def _check_temperature(self) -> Self:
        if self.temperature == 0:
            raise Rule("temperature", "is a change, and 0 changes nothing: remove the preload")
        for key in ("section", "direction", "stiffness", "holds"):
            if getattr(self, key) is not None:
                raise Rule(key, "is of a bolt, and this is a temperature: remove it")
        return self

    def _check_pressure(self) -> None:
        if self.section is not None:
            raise Rule("section", "a pressure acts on surfaces: give on")
        for key in ("direction", "stiffness", "holds"):
            if getattr(self, key) is not None:
                raise Rule(key, "is of a bolt, and this is a pressure: remove it")


def readable_preload(preloads: Iterable[MeshPreload], whole: bool = False) -> str:
    """Preloads in words; `whole` where forces are not per metre of width.

    Examples
    --------
    >>> readable_preload([MeshPreload(on=["head", "nut"], force="12 kN/m")])
    'clamp 12 kN/m'
    """
    said = ((each.name, each.amount) for each in preloads)
    return ", ".join(
        f"{name} {units.readable(value, 'N' if whole and unit == 'N/m' else unit)}"
        for name, (unit, value) in said
    )
