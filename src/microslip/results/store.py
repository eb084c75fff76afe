"""A run as it was, in ``run.h5``: to draw it again, and to go on where it was interrupted.

The file is written analysis by analysis, as each ends; what was not finished is not there. Beside the
outcomes it holds the description, from which model and prestress are made again: they take a second
and the same bits come out.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import h5py
from threadpoolctl import threadpool_limits

from microslip.describe.joint import Joint
from microslip.errors import InputError
from microslip.pipeline.outcome import Outcome
from microslip.pipeline.prepare import assemble_without_signals
from microslip.pipeline.run import Run
from microslip.registry import ANALYSES
from microslip.results.objects import read_object, write_object
from microslip.version import __version__

STORE = "run.h5"
"""Name of the file in the folder of a run."""

OUTCOMES, CONTENT = "outcomes", "content"


def content(joint: Joint) -> str:
    """Digest of the files that a joint comes from; empty where there are none.

    Raises
    ------
    InputError
        Where one of them is gone.
    """
    digest = hashlib.sha256()
    for name in joint.files:
        try:
            digest.update(Path(name).read_bytes())
        except OSError as error:
            raise InputError(f"{name}: cannot be read: {error.strerror}") from None
    return digest.hexdigest() if joint.files else ""


@dataclass(frozen=True)
class RunStore:
    """The file of one run, opened only while it is written or read.

    Attributes
    ----------
    path : Path
    """

    path: Path

    def begin(self, joint: Joint) -> None:
        """A new file that holds the description and nothing else."""
        with h5py.File(self.path, "w") as file:
            file.attrs["version"] = __version__
            file.attrs[CONTENT] = content(joint)
            write_object(file, "joint", joint)
            file.create_group(OUTCOMES)

    def keep(self, name: str, outcome: Outcome[Any]) -> None:
        """Add what became of one analysis."""
        with h5py.File(self.path, "a") as file:
            outcomes = file[OUTCOMES]
            if name in outcomes:
                del outcomes[name]
            write_object(outcomes, name, outcome)

    def finish(self, run: Run) -> None:
        """Add how long everything took, and whether it came to its end."""
        with h5py.File(self.path, "a") as file:
            for name in ("timings", "interrupted"):
                if name in file:
                    del file[name]
            write_object(file, "timings", dict(run.timings))
            file.attrs["interrupted"] = run.interrupted

    def read(self) -> tuple[Joint, dict[str, Outcome[Any]], dict[str, float], bool]:
        """Description, outcomes in the order in which analyses run, timings, whether interrupted.

        Raises
        ------
        InputError
            Where there is no such file, it was written by another version, or the files that the joint
            comes from are no longer what they were.
        """
        if not self.path.is_file():
            raise InputError(f"{self.path.parent}: holds no stored run: {STORE} is missing")
        try:
            file = h5py.File(self.path, "r")
        except OSError as error:
            raise InputError(f"{self.path}: cannot be read: {error}") from None
        with file:
            version = file.attrs.get("version")
            if version != __version__:
                raise InputError(
                    f"{self.path}: written by version {version}, this is {__version__}; run again"
                )
            joint = read_object(file, "joint")
            if str(file.attrs.get(CONTENT, "")) != content(joint):
                raise InputError(
                    f"{self.path}: the files that the joint comes from have changed since: run again"
                )
            stored = file[OUTCOMES]
            outcomes = {name: read_object(stored, name) for name in ANALYSES if name in stored}
            timings = read_object(file, "timings") if "timings" in file else {}
            return joint, outcomes, timings, bool(file.attrs.get("interrupted", True))


class Keeper:
    """Keeps outcomes as they come; the file is begun with the first, so that a run that fails before
    leaves what is there alone.

    Attributes
    ----------
    begun : bool
        Whether there is a file of this run.
    """

    def __init__(self, store: RunStore, joint: Joint, begun: bool = False) -> None:
        self.store, self.joint, self.begun = store, joint, begun

    def __call__(self, name: str, outcome: Outcome[Any]) -> None:
        """Add what became of one analysis."""
        if not self.begun:
            self.store.begin(self.joint)
            self.begun = True
        self.store.keep(name, outcome)


def finished(folder: str | Path, joint: Joint) -> dict[str, Outcome[Any]]:
    """Analyses that an interrupted run of the same description has finished.

    Raises
    ------
    InputError
        Where the folder holds no run, or one of another description.
    """
    path = Path(folder) / STORE
    stored, outcomes, _, _ = RunStore(path).read()
    if stored.model_dump() != joint.model_dump():
        raise InputError(
            f"{path}: is the run of another joint file, which says: {_difference(stored, joint)}; "
            "choose another --out, or --force to begin again"
        )
    return {name: done for name, done in outcomes.items() if not done.interrupted}


def load_run(folder: str | Path) -> Run:
    """A run from the folder that it was written into, for tables and figures.

    Fields of contact over a cycle were stored in single precision; all else is as it was.

    Parameters
    ----------
    folder : path
        Of a run: ``--out`` of the command line.

    Raises
    ------
    InputError
        Where it holds no run that this version can read.

    Examples
    --------
    >>> run = load_run("lap_joint-output")  # doctest: +SKIP
    >>> run.responses[0].peak_frequency  # doctest: +SKIP
    """
    joint, outcomes, timings, interrupted = RunStore(Path(folder) / STORE).read()
    with threadpool_limits(1):
        assembly = assemble_without_signals(joint)
    return Run(assembly, outcomes, timings, interrupted)


def _difference(one: Joint, other: Joint) -> str:
    """First key in which two descriptions differ, with the value of the first."""
    return _first(one.model_dump(by_alias=True), other.model_dump(by_alias=True), "") or "nothing"


def _first(one: Any, other: Any, key: str) -> str:
    if isinstance(one, Mapping) and isinstance(other, Mapping):
        for name in (*one, *(n for n in other if n not in one)):
            place = f"{key}.{name}" if key else name
            if found := _first(one.get(name), other.get(name), place):
                return found
        return ""
    return "" if one == other else f"{key} = {one}"
