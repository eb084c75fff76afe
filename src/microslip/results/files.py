"""Results on disk: ``summary.json`` and ``results.nc``, written in one go and read again."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
import xarray as xr

from microslip.errors import InputError

SUMMARY, DATA, FIGURES = "summary.json", "results.nc", "figures"
"""Names of the files, and of the folder of figures, in the folder of a run."""

SINGLE = (
    *("pressure", "traction", "slip", "gap"),
    *("local_slip", "local_gap", "approach", "rotation", "u_clamp_edge", "lift", "stuck"),
)
"""Contact fields and the like: stored in single precision."""

LONG = 10_000
"""Traces of more values are compressed."""

PACKED = {"zlib": True, "complevel": 1, "shuffle": True}


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary name beside `path` that takes its place once the block has ended well."""
    temporary = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        yield temporary
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def plain(value: Any) -> Any:
    """The same in types that JSON has; numbers that are not finite become None."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [plain(item) for item in value]
    if isinstance(value, bool | np.bool_):
        return bool(value)
    if isinstance(value, int | np.integer):
        return int(value)
    if isinstance(value, float | np.floating):
        return float(value) if math.isfinite(value) else None
    return value


def write_summary(found: Mapping[str, Any], path: Path) -> Path:
    """Write a summary as JSON."""
    text = json.dumps(found, indent=2, ensure_ascii=False, allow_nan=False)
    with replacing(path) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")
    return path


def write_dataset(tree: xr.DataTree, path: Path) -> Path:
    """Write labelled fields as netCDF-4, the contact fields in single precision."""
    encoding: dict[str, dict[str, Any]] = {}
    for node in tree.subtree:
        for name, values in node.data_vars.items():
            if values.ndim >= 2 or values.size > LONG:
                single = {"dtype": "float32"} if name in SINGLE else {}
                encoding.setdefault(node.path, {})[str(name)] = {**PACKED, **single}
    with replacing(path) as temporary:
        tree.to_netcdf(temporary, engine="h5netcdf", encoding=encoding)
    return path


@dataclass(frozen=True, repr=False)
class StoredResults:
    """Results of a run as they lie in a folder; close it, or use it as a context.

    Attributes
    ----------
    folder : Path
    summary : dict
        ``summary.json``.
    data : xarray.DataTree
        ``results.nc``, read from disk as it is looked at.
    """

    folder: Path
    summary: dict[str, Any]
    data: xr.DataTree

    def __repr__(self) -> str:
        groups = ", ".join(self.data.children)
        return f"Results in {self.folder}: {self.summary.get('title') or 'lap joint'}\n  {groups}"

    def close(self) -> None:
        """Let go of the file."""
        self.data.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def load_results(folder: str | Path) -> StoredResults:
    """Open what `microslip.show.write.write_results` wrote.

    Parameters
    ----------
    folder : path
        Of a run: ``--out`` of the command line.

    Raises
    ------
    InputError
        Where it does not hold results that can be read.

    Examples
    --------
    >>> with load_results("lap_joint-output") as found:  # doctest: +SKIP
    ...     found.data["cycles_mode"]["gamma_eq"].max()
    """
    place = Path(folder)
    if not place.exists():
        raise InputError(
            f"{place}: no such folder; `microslip run` writes one beside its joint file"
        )
    for name in (SUMMARY, DATA):
        if not (place / name).is_file():
            raise InputError(f"{place}: holds no results of a run: {name} is missing")
    try:
        found = json.loads((place / SUMMARY).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{place / SUMMARY}: cannot be read: {error}") from None
    try:
        data = xr.open_datatree(place / DATA, engine="h5netcdf")
    except (OSError, ValueError) as error:
        raise InputError(f"{place / DATA}: cannot be read: {error}") from None
    return StoredResults(place, found, data)
