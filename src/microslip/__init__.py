"""microslip: where a frictional joint slips, what it dissipates, and how it responds."""

from __future__ import annotations

from typing import TYPE_CHECKING

from microslip.version import __version__

if TYPE_CHECKING:
    from microslip.describe.lap import LapJoint
    from microslip.describe.reading import load_joint
    from microslip.pipeline.run import LapRun, assemble_joint, run_lap_joint


__all__ = ["LapJoint", "LapRun", "__version__", "assemble_joint", "load_joint", "run_lap_joint"]

_HOME = {
    "LapJoint": "describe.lap",
    "load_joint": "describe.reading",
    "LapRun": "pipeline.run",
    "assemble_joint": "pipeline.run",
    "run_lap_joint": "pipeline.run",
}


def __getattr__(name: str) -> object:
    """Import public names on first use, so that ``microslip --help`` stays quick."""
    if name not in _HOME:
        raise AttributeError(f"module 'microslip' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"microslip.{_HOME[name]}"), name)
