"""Types of the keys of a joint file: quantities with units, counts, lists, and their sections."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

from microslip.describe import units
from microslip.describe.profile import Profile, profile_parser


def _coefficient(value: Any) -> float:
    found = units.NUMBER.parse(value)
    if found < 0:
        raise ValueError("must be greater than or equal to 0")
    if found > MOST_FRICTION:
        raise ValueError(f"must be less than or equal to {MOST_FRICTION:g}")
    return found


def _share(value: Any) -> float:
    found = units.NUMBER.parse(value)
    if found < 0:
        raise ValueError("must be greater than or equal to 0")
    return found


def _constant_or_profile(value: Any) -> float | Profile:
    if isinstance(value, list | tuple | Profile):
        return profile_parser(_coefficient, "0.25")(value)
    return _coefficient(value)


def _shape_or_profile(value: Any) -> str | Profile:
    if isinstance(value, list | tuple | Profile):
        return profile_parser(_share, "1.0")(value)
    if value not in CLAMP_SHAPES:
        names = ", ".join(f'"{name}"' for name in CLAMP_SHAPES)
        raise ValueError(f"must be one of {names}, or a table of positions and relative pressures")
    return str(value)


def _one_or_more(value: Any) -> tuple[Any, ...]:
    values = tuple(value) if isinstance(value, list | tuple) else (value,)
    if not 1 <= len(values) <= 1000:
        raise ValueError("must be one value or a list of 1 to 1000")
    return values


def _harmonics(value: Any) -> Any:
    """A number of harmonics, or the word that leaves it open."""
    number = isinstance(value, int) and not isinstance(value, bool)
    if value != "adaptive" and not (number and 1 <= value <= 101):
        raise ValueError('must be a whole number from 1 to 101, or "adaptive"')
    return value


def list_of_sections(most: int, allowed: str) -> BeforeValidator:
    """Reader of a list of sections, of which one ``[section]`` makes a list of one.

    Parameters
    ----------
    most : int
        Sections it may hold.
    allowed : str
        What anything else is told.

    Examples
    --------
    >>> list_of_sections(20, "must be at most 20 sections, [[port]]").func({"name": "tip"})
    ({'name': 'tip'},)
    """

    def listed(value: Any) -> Any:
        if isinstance(value, Mapping):
            return (value,)
        if not isinstance(value, list | tuple) or len(value) > most:
            raise ValueError(allowed)
        return value

    return BeforeValidator(listed)


NAME = "^[A-Za-z][A-Za-z0-9_-]*$"
"""How something that results name may be called: a history, an output, a port."""


@dataclass(frozen=True)
class Held:
    """Limits that the reader of a type holds its numbers to, for what is said of them."""

    ge: float
    le: float


MOST_FRICTION = 2.0
"""Largest coefficient of friction that is believed."""

CLAMP_SHAPES = ("uniform", "parabolic")
"""Distributions of the clamp's pressure that have a name."""

Number = Annotated[float, BeforeValidator(units.NUMBER.parse), units.NUMBER]
Length = Annotated[float, BeforeValidator(units.LENGTH.parse), units.LENGTH]
Modulus = Annotated[float, BeforeValidator(units.MODULUS.parse), units.MODULUS]
Mass = Annotated[float, BeforeValidator(units.MASS.parse), units.MASS]
Stress = Annotated[float, BeforeValidator(units.STRESS.parse), units.STRESS]
Density = Annotated[float, BeforeValidator(units.DENSITY.parse), units.DENSITY]
LineForce = Annotated[float, BeforeValidator(units.LINE_FORCE.parse), units.LINE_FORCE]
Acceleration = Annotated[float, BeforeValidator(units.ACCELERATION.parse), units.ACCELERATION]
LineMoment = Annotated[float, BeforeValidator(units.LINE_MOMENT.parse), units.LINE_MOMENT]
LineStiffness = Annotated[float, BeforeValidator(units.LINE_STIFFNESS.parse), units.LINE_STIFFNESS]
AreaStiffness = Annotated[float, BeforeValidator(units.AREA_STIFFNESS.parse), units.AREA_STIFFNESS]
TemperatureChange = Annotated[
    float, BeforeValidator(units.TEMPERATURE_CHANGE.parse), units.TEMPERATURE_CHANGE
]
Expansion = Annotated[float, BeforeValidator(units.EXPANSION.parse), units.EXPANSION]
Time = Annotated[float, BeforeValidator(units.TIME.parse), units.TIME]
Rate = Annotated[float, BeforeValidator(units.RATE.parse), units.RATE]
Frequency = Annotated[float, BeforeValidator(units.FREQUENCY.parse), units.FREQUENCY]
Friction = Annotated[
    float | Profile,
    BeforeValidator(_constant_or_profile),
    units.NUMBER,
    Held(ge=0.0, le=MOST_FRICTION),
]
ClampPressure = Annotated[
    Literal["uniform", "parabolic"] | Profile, BeforeValidator(_shape_or_profile)
]
Count = Annotated[int, Field(strict=True)]
OneOrMore = BeforeValidator(_one_or_more)
Ratios = Annotated[tuple[Annotated[Number, Field(gt=0)], ...], OneOrMore]
Moments = Annotated[tuple[Annotated[LineMoment, Field(gt=0)], ...], OneOrMore]
Forces = Annotated[tuple[Annotated[LineForce, Field(gt=0)], ...], OneOrMore]
Accelerations = Annotated[tuple[Annotated[Acceleration, Field(gt=0)], ...], OneOrMore]
Pressures = Annotated[tuple[Annotated[Stress, Field(gt=0)], ...], OneOrMore]
Rhos = Annotated[tuple[Annotated[Number, Field(ge=0)], ...], OneOrMore]
Positions = Annotated[tuple[Length, ...], OneOrMore]
Frequencies = Annotated[
    tuple[Annotated[Frequency, Field(gt=0)], ...],
    Field(min_length=1, max_length=10_000),
    OneOrMore,
]
Drive = Literal["load", "moment", "mode"]
Harmonics = Annotated[int | Literal["adaptive"], BeforeValidator(_harmonics)]
StepsPerCycle = Annotated[Count, Field(ge=20, le=100_000)]


class Rule(ValueError):
    """A rule between keys was broken; `key` is the one to change, seen from its model."""

    def __init__(self, key: str, message: str) -> None:
        super().__init__(message)
        self.key = key


class Section(BaseModel):
    """One table of a joint file: immutable, and no key that is not known."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", populate_by_name=True, use_attribute_docstrings=True
    )


def check_distinct(key: str, values: Sequence[str | int]) -> None:
    """Raise `Rule` where a list names one thing twice."""
    if len(set(values)) < len(values):
        raise Rule(key, "names one thing twice")
