"""Units in texts about a structure that is whole, and not per metre of its width."""

from __future__ import annotations

import re

UNITS = {
    "kg^0.5 m^0.5 s^-2": "kg^0.5 m s^-2",
    "kg^-0.5 m^0.5": "kg^-0.5",
    "kg^0.5 m^0.5": "kg^0.5 m",
    "kg m/m": "kg m",
    "g m/m": "g m",
    "m^3/m": "m^3",
    "m³/m": "m³",
    "N m/m": "N m",
    "N*m/m": "N*m",
    "N/m/m": "N/m",
    "N/m": "N",
    "J/m^2": "J/m^2",
    "J/m²": "J/m²",
    "J/m": "J",
    " per metre of width": "",
}
"""Units per metre of width, and those of the whole; energy per area is what it is."""

_ANY = re.compile("(?:" + "|".join(map(re.escape, UNITS)) + ")(?![\\^²³])")


def in_whole(text: str) -> str:
    """A text with units of the whole.

    Examples
    --------
    >>> in_whole("friction work per cycle (J/m)"), in_whole("12 kN/m"), in_whole("J/m^2")
    ('friction work per cycle (J)', '12 kN', 'J/m^2')
    """
    return _ANY.sub(lambda found: UNITS[found.group()], text)
