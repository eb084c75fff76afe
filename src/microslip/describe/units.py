"""Quantities as people write them, turned into SI floats at the boundary of the program.

``"12.5 mm"``, ``"70 GPa"``, ``"0.73 us"``, ``"2 g/cm^3"`` or a plain number, which is SI already.
Nothing behind this boundary knows about units. Conversion runs in exact fractions, so a length
written in millimetres is the same float as the one written in metres.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import Any

Dimension = frozenset[tuple[str, Any]]

_NUMBER = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*", re.DOTALL)
_COMMA = re.compile(r"\s*[+-]?\d*,\d")
_NOT_FINITE = re.compile(r"\s*[+-]?(nan|inf(inity)?)\b", re.IGNORECASE)
_PER = re.compile(r"/|\bper\b|(\^|\*\*)-")
_FACTOR = r"(?:1|%|[^\W\d_]+)(?:(?:\^|\*\*)[+-]?\d|[²³])?"
_UNIT = re.compile(rf"{_FACTOR}(?:\s*[*/·\s]\s*{_FACTOR})*")


_WHOLE: ContextVar[bool] = ContextVar("whole", default=False)


@contextmanager
def of_the_whole(whole: bool) -> Iterator[None]:
    """Within it forces, moments and stiffnesses are read as those of a whole structure, if it is one.

    Examples
    --------
    >>> with of_the_whole(True):
    ...     LINE_FORCE.parse("12 kN")
    12000.0
    """
    token = _WHOLE.set(whole)
    try:
        yield
    finally:
        _WHOLE.reset(token)


@dataclass(frozen=True)
class Kind:
    """What a key measures.

    Attributes
    ----------
    noun : str
        As it reads in a message, with its article.
    unit : str
        SI unit of the parsed value; empty where dimensionless.
    example : str
        A value as a user would write it.
    angular : bool
        Whether units of angle per time (rad/s, rpm) may stand for the unit.
    per_width : bool
        Whether it is per metre of width and the unit must say so, because without the width it
        reduces to a unit of something else: N m/m to N, N/m/m to Pa.
    whole : str
        Unit of what is not per metre of width; empty where there is no difference.
    """

    noun: str
    unit: str
    example: str
    angular: bool = False
    per_width: bool = False
    whole: str = ""

    def parse(self, value: Any) -> float:
        """Value in SI units.

        Parameters
        ----------
        value : float, int or str
            A plain number is SI; a string is a number followed by a unit.

        Raises
        ------
        ValueError
            Where the value is not finite, not a number with a unit, or measures something else.

        Examples
        --------
        >>> LENGTH.parse("12.5 mm"), LENGTH.parse(0.0125)
        (0.0125, 0.0125)
        >>> DENSITY.parse("2 g/cm^3")
        2000.0
        """
        if isinstance(value, bool) or not isinstance(value, int | float | str):
            raise ValueError(self.advice())
        if isinstance(value, str):
            return self._parse_text(value)
        return self._finite(value)

    def advice(self) -> str:
        """What to write, with an example."""
        if self.whole and _WHOLE.get():
            noun = self.noun.replace(" per metre of width", "")
            example = self.example.replace('/m"', '"')
            return f"expected {noun}, for example {example}"
        return f"expected {self.noun}, for example {self.example}"

    def _finite(self, value: Any) -> float:
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            raise ValueError(f"must be a finite number: {self.advice()}")
        return number

    def _parse_text(self, text: str) -> float:
        if _NOT_FINITE.match(text):
            raise ValueError(f"must be a finite number: {self.advice()}")
        if _COMMA.match(text):
            raise ValueError(f"numbers have a decimal point, not a comma: {self.advice()}")
        found = _NUMBER.fullmatch(text)
        if found is None:
            raise ValueError(f"not a number with a unit: {self.advice()}")
        number, unit = found.groups()
        plain = self._finite(number)
        if not unit:
            return plain
        factor = self._factor(unit)
        if plain == 0 or not 1e-300 < abs(plain) < 1e300:
            return self._finite(plain * float(factor))
        return self._finite(Fraction(number) * factor)

    def _factor(self, unit: str) -> Fraction:
        factor, dimension, angular = _known_unit(unit)
        if dimension is None:
            raise ValueError(f"{unit!r} is not a known unit: {self.advice()}")
        whole = bool(self.whole) and _WHOLE.get()
        _, expected, _ = _known_unit(self.whole if whole else self.unit)
        if dimension != expected:
            raise ValueError(f"{unit!r} measures something else: {self.advice()}")
        if angular and not self.angular:
            what = "angular frequency" if self.unit else "angle"
            raise ValueError(f"{unit!r} is a unit of {what}: {self.advice()}")
        if self.per_width and not whole and not _PER.search(unit):
            raise ValueError(f"{unit!r} is not per metre of width: {self.advice()}")
        return factor


@lru_cache(maxsize=1)
def _registry() -> Any:
    import pint

    return pint.UnitRegistry(non_int_type=Fraction)


@lru_cache(maxsize=256)
def _known_unit(unit: str) -> tuple[Fraction, Dimension | None, bool]:
    """Factor to SI, dimension (None where unknown) and whether the unit counts angle."""
    unknown = Fraction(0), None, False
    if not unit:
        return Fraction(1), frozenset(), False
    if len(unit) > 40 or not _UNIT.fullmatch(unit):
        return unknown
    registry = _registry()
    try:
        parsed = registry.parse_units(unit)
        base = registry.Quantity(Fraction(1), parsed).to_base_units()
        if registry.Quantity(Fraction(0), parsed).to_base_units().magnitude != 0:
            return unknown  # °C counts from elsewhere, and so is no unit of a change of temperature
        dimension = frozenset(parsed.dimensionality.items())
        return Fraction(base.magnitude), dimension, "radian" in dict(base.unit_items())
    except Exception:  # pint raises whatever its tokenizer and its arithmetic raise
        return unknown


NUMBER = Kind("a plain number", "", "0.25")
LENGTH = Kind("a length", "m", '"12.5 mm"')
MODULUS = Kind("a modulus of elasticity", "Pa", '"70 GPa"')
MASS = Kind("a mass", "kg", '"0.5 kg"')
STRESS = Kind("a stress", "Pa", '"250 MPa"')
DENSITY = Kind("a density", "kg/m^3", '"2 g/cm^3"')
LINE_FORCE = Kind("a force per metre of width", "N/m", '"1 MN/m"', whole="N")
LINE_MOMENT = Kind(
    "a moment per metre of width", "N*m/m", '"150 N*m/m"', per_width=True, whole="N*m"
)
ACCELERATION = Kind("an acceleration", "m/s^2", '"10 m/s^2"')
LINE_STIFFNESS = Kind(
    "a stiffness per metre of width", "N/m/m", '"1e5 N/m/m"', per_width=True, whole="N/m"
)
AREA_STIFFNESS = Kind("a stiffness per area", "Pa/m", '"1e13 Pa/m"')
TEMPERATURE_CHANGE = Kind("a change of temperature", "K", '"40 K"')
EXPANSION = Kind("a coefficient of thermal expansion", "1/K", '"12e-6 1/K"')
TIME = Kind("a time", "s", '"0.73 us"')
RATE = Kind("a rate", "1/s", '"5 1/s"', angular=True)
FREQUENCY = Kind("a frequency in cycles per second", "Hz", '"165 Hz"')

_PREFIXES = {-9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G", 12: "T"}


def readable(value: float, unit: str, digits: int = 4) -> str:
    """Value with an SI prefix that keeps its number between 1 and 1000.

    Examples
    --------
    >>> readable(0.0125, "m"), readable(7e10, "Pa")
    ('12.5 mm', '70 GPa')
    """
    if value == 0 or not math.isfinite(value):
        return f"{value:g} {unit}"
    power = min(max(3 * math.floor(math.log10(abs(value)) / 3 + 1e-12), -9), 12)
    return f"{value / 10.0**power:.{digits}g} {_PREFIXES[power]}{unit}"
