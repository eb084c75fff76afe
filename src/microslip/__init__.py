"""microslip: where a frictional joint slips, what it dissipates, and how it responds."""

from __future__ import annotations

from typing import TYPE_CHECKING

from microslip.version import __version__

if TYPE_CHECKING:
    from microslip.describe.lap import LapJoint, load_joint
    from microslip.pipeline.prepare import prepare
    from microslip.pipeline.run import Run, run


__all__ = ["LapJoint", "Run", "__version__", "load_joint", "prepare", "run"]

_HOME = {
    "LapJoint": "describe.lap",
    "load_joint": "describe.lap",
    "prepare": "pipeline.prepare",
    "Run": "pipeline.run",
    "run": "pipeline.run",
}


def __getattr__(name: str) -> object:
    """Import public names on first use, so that ``microslip --help`` stays quick."""
    if name not in _HOME:
        raise AttributeError(f"module 'microslip' has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(f"microslip.{_HOME[name]}"), name)
