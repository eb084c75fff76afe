"""Files that a description names, and what is wanted of them: ``"beam.npz:K"``.

A file may hold several matrices, vectors or tables; the one that is meant stands after a colon.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, ValidationInfo

_NAMED = re.compile(r"(.*\.\w+):([A-Za-z]\w*(?:\.\w+)*)")


def split_source(source: str) -> tuple[str, str]:
    """File, and the name within it; empty where the file holds one thing.

    Examples
    --------
    >>> split_source("C:/models/beam.npz:K"), split_source("beam.sti"), split_source("beam.mat:model.K")
    (('C:/models/beam.npz', 'K'), ('beam.sti', ''), ('beam.mat', 'model.K'))
    """
    found = _NAMED.fullmatch(source)
    return (found[1], found[2]) if found else (source, "")


def _text(value: Any) -> str:
    if not isinstance(value, str) or not value:
        raise ValueError('must be the name of a file, for example "beam.npz:K"')
    return value


def _beside_the_joint_file(source: str, info: ValidationInfo) -> str:
    folder = (info.context or {}).get("folder", "")
    file, name = split_source(source)
    path = Path(folder) / file
    try:
        what = "" if path.is_file() else "is a folder" if path.is_dir() else "no such file"
    except (OSError, ValueError):  # a name that no file can have
        what = "no such file"
    before, colon, after = file.rpartition(":")
    if what == "no such file" and colon and (Path(folder) / before).is_file():
        raise ValueError(
            f"{Path(folder) / before}: {after!r} is no name of a variable, nor of a field of a structure, "
            '"beam.K"'
        )
    if what:
        raise ValueError(f"{path}: {what}")
    whole = path.absolute()  # a stored run is looked at from other places
    return f"{whole}:{name}" if name else str(whole)


Source = Annotated[str, BeforeValidator(_text), AfterValidator(_beside_the_joint_file)]
"""A file beside the joint file, after a colon the name of what is meant in it."""
