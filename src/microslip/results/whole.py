"""Units of results that are of a whole structure, and not per metre of its width.

All models are per metre of width; of a structure of width one they hold its forces, moments and energies.
What is said of them then goes through here: units of datasets, keys of the summary, text of tables and
figures.
"""

from __future__ import annotations

from typing import Any

import xarray as xr

from microslip.describe.units_of_the_whole import in_whole

KEYS = {"_n_m_per_m": "_n_m", "_n_per_m": "_n", "_j_per_m": "_j"}
"""Ends of keys of the summary, likewise."""


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
