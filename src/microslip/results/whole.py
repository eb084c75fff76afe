"""Units of results that are of a whole structure, and not per metre of its width.

All models are per metre of width; of a structure of width one they hold its forces, moments and energies.
What is said of them then goes through here: units of datasets, keys of the summary, text of tables and
figures.
"""

from __future__ import annotations

import re
from typing import Any

import xarray as xr

UNITS = {
    "kg^0.5 m^0.5 s^-2": "kg^0.5 m s^-2",
    "kg^-0.5 m^0.5": "kg^-0.5",
    "kg^0.5 m^0.5": "kg^0.5 m",
    "kg m/m": "kg m",
    "N m/m": "N m",
    "N/m/m": "N/m",
    "N/m": "N",
    "J/m^2": "J/m^2",
    "J/m²": "J/m²",
    "J/m": "J",
    " per metre of width": "",
}
"""Units per metre of width, and those of the whole; energy per area is what it is."""

KEYS = {"_n_m_per_m": "_n_m", "_n_per_m": "_n", "_j_per_m": "_j"}
"""Ends of keys of the summary, likewise."""

_ANY = re.compile("|".join(map(re.escape, UNITS)))


def in_whole(text: str) -> str:
    """A text with units of the whole.

    Examples
    --------
    >>> in_whole("friction work per cycle (J/m)"), in_whole("12 kN/m"), in_whole("J/m^2")
    ('friction work per cycle (J)', '12 kN', 'J/m^2')
    """
    return _ANY.sub(lambda found: UNITS[found.group()], text)


def whole_summary(found: Any) -> Any:
    """A summary with the keys of the whole.

    Examples
    --------
    >>> whole_summary({"rows": [{"dissipated_energy_j_per_m": 1.0}]})
    {'rows': [{'dissipated_energy_j': 1.0}]}
    """
    if isinstance(found, dict):
        return {_key(key): whole_summary(value) for key, value in found.items()}
    if isinstance(found, list):
        return [whole_summary(value) for value in found]
    return found


def _key(key: str) -> str:
    for end, whole in KEYS.items():
        key = key.replace(end, whole)
    return key


def whole_dataset(group: xr.Dataset) -> xr.Dataset:
    """A group with the units of the whole; areas of pairs are areas."""
    out = group.copy()
    for name, held in out.variables.items():
        for key in ("units", "long_name"):
            if key in held.attrs:
                held.attrs[key] = in_whole(str(held.attrs[key]))
        if name == "area":
            held.attrs["units"] = "m^2"
    return out
