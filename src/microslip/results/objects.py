"""Frozen objects as groups of an HDF5 file, and back: dataclasses, sections of a description, tuples.

A group says the class it came from and holds one member per field: arrays as datasets, numbers and
text as attributes, everything else as groups again. Only classes of modules that are loaded already, or
that belong to this package, are made again: a file cannot run code.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import h5py
import numpy as np
from pydantic import BaseModel

from microslip.errors import InputError
from microslip.registry import resolved

KIND, ORDER, VALUES = "@kind", "@order", "values"
NONE, LIST, TUPLE, NUMBERS, MAPPING = "none", "list", "tuple", "numbers", "mapping"

LARGE = 20_000
"""Fields of more values are stored in single precision, packed."""


def write_object(group: h5py.Group, name: str, value: Any) -> None:
    """Write a value as the member `name` of a group.

    Raises
    ------
    TypeError
        Where it is of a kind that cannot be read again.
    """
    if isinstance(value, np.ndarray):
        _write_array(group, name, value)
    elif isinstance(value, bool | int | float | complex | str | np.generic):
        group.attrs[name] = value
    else:
        member = group.create_group(name)
        kind, parts = _parts(value)
        member.attrs[KIND] = kind
        if kind == MAPPING and parts:
            member.attrs[ORDER] = [key for key, _ in parts]
        for key, part in parts:
            write_object(member, key, part)


def read_object(group: h5py.Group, name: str) -> Any:
    """Read a member that `write_object` wrote.

    Raises
    ------
    InputError
        Where the file holds something else.
    """
    if name in group.attrs:
        return _scalar(group.attrs[name])
    member = group.get(name)
    if isinstance(member, h5py.Dataset):
        return _read_array(member)
    if not isinstance(member, h5py.Group) or KIND not in member.attrs:
        raise InputError(f"{group.file.filename}: {group.name}/{name} cannot be read; run again")
    kind = str(member.attrs[KIND])
    names = [key for key in (*member.attrs, *member) if key not in (KIND, ORDER)]
    parts = {key: read_object(member, key) for key in names}
    if kind == NONE:
        return None
    if kind == MAPPING:
        return {key: parts[key] for key in member.attrs.get(ORDER, ())}
    if kind == NUMBERS:
        return tuple(parts[VALUES].tolist())
    if kind in (LIST, TUPLE):
        ordered = [parts[key] for key in sorted(parts, key=int)]
        return ordered if kind == LIST else tuple(ordered)
    return _made(kind, parts, group)


def _parts(value: Any) -> tuple[str, list[tuple[str, Any]]]:
    """Kind of a value that has parts, and the parts by name."""
    if value is None:
        return NONE, []
    kind = f"{type(value).__module__}:{type(value).__qualname__}"
    if isinstance(value, BaseModel):
        return kind, [(key, getattr(value, key)) for key in type(value).model_fields]
    if is_dataclass(value):
        return kind, [(field.name, getattr(value, field.name)) for field in fields(value)]
    if isinstance(value, tuple) and hasattr(value, "_fields"):
        return kind, list(zip(value._fields, value, strict=True))
    if isinstance(value, tuple) and value and all(type(part) is float for part in value):
        return NUMBERS, [(VALUES, np.array(value))]
    if isinstance(value, list | tuple):
        numbered = [(str(i), part) for i, part in enumerate(value)]
        return (LIST if isinstance(value, list) else TUPLE), numbered
    if isinstance(value, Mapping) and all(isinstance(key, str) for key in value):
        return MAPPING, list(value.items())
    raise TypeError(f"{type(value).__name__} cannot be stored")


def _made(kind: str, parts: Mapping[str, Any], group: h5py.Group) -> Any:
    """An object of the class that a group names, from its fields."""
    module, _, name = kind.partition(":")
    try:
        if module.split(".")[0] != __name__.split(".")[0] and module not in sys.modules:
            raise ImportError(module)
        made = resolved(kind)
        if not isinstance(made, type):
            raise TypeError
        if issubclass(made, BaseModel):
            return made.model_construct(**parts)
        if is_dataclass(made) or (issubclass(made, tuple) and hasattr(made, "_fields")):
            return made(**parts)
        raise TypeError
    except (ImportError, ValueError, AttributeError, TypeError):
        raise InputError(
            f"{group.file.filename}: holds {name or kind!r}, which this version does not know; "
            "run again"
        ) from None


def _write_array(group: h5py.Group, name: str, value: np.ndarray) -> None:
    if value.size <= LARGE:
        group.create_dataset(name, data=value)
        return
    single = {"f": np.float32, "c": np.complex64}.get(value.dtype.kind)
    stored = value if single is None else value.astype(single)
    packed = {"compression": "gzip", "compression_opts": 1, "shuffle": True}
    data = group.create_dataset(name, data=stored, **packed)
    data.attrs["dtype"] = value.dtype.str


def _read_array(data: h5py.Dataset) -> np.ndarray:
    values = np.asarray(data[()])
    return values.astype(data.attrs["dtype"]) if "dtype" in data.attrs else values


def _scalar(value: Any) -> Any:
    return value.item() if isinstance(value, np.generic) else value
