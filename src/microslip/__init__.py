"""microslip: where a frictional joint slips, what it dissipates, and how it responds.

Examples
--------
>>> import microslip
>>> joint = microslip.prepare(microslip.reference_joint(pairs=21))
>>> loop = microslip.cycle(joint, 200.0)  # N m per metre of width
>>> loop.slip.shape
(301, 21)
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from microslip.version import __version__

if TYPE_CHECKING:
    from microslip.analyses.backbone.points import Backbone
    from microslip.analyses.calls import (
        backbone,
        cycle,
        harmonic_response,
        opening_load,
        reduced_response,
        steady_state,
    )
    from microslip.analyses.harmonic.response import HarmonicResponse
    from microslip.analyses.prepared.joint import PreparedJoint, prepare_joint
    from microslip.analyses.prepared.joint_modes import JointMode, joint_modes
    from microslip.analyses.prepared.prestress import Prestress, prestress
    from microslip.analyses.prepared.saved import load_model, save_model
    from microslip.analyses.reduced.response import Response
    from microslip.analyses.statics.cycle import Cycle
    from microslip.analyses.statics.loading import load_path
    from microslip.analyses.time.steady import SteadyState
    from microslip.contact.law import ContactLaw, contact_law
    from microslip.describe.lap import LapJoint
    from microslip.describe.matrices import MatricesJoint
    from microslip.describe.mesh import MeshJoint
    from microslip.describe.reading import load_joint, parse_joint
    from microslip.describe.reference import reference_joint
    from microslip.describe.saved_model import ModelJoint
    from microslip.errors import (
        Caution,
        ContactError,
        Failure,
        InputError,
        JointOpensError,
        MicroslipError,
        ModelError,
    )
    from microslip.pipeline.judge import judge
    from microslip.pipeline.prepare import prepare
    from microslip.pipeline.run import Run, run
    from microslip.registry import ANALYSES, Analysis, register
    from microslip.results.files import load_results
    from microslip.results.store import load_run
    from microslip.show.write import write_results

_HOME = {
    "ANALYSES": "registry",
    "Analysis": "registry",
    "Backbone": "analyses.backbone.points",
    "Caution": "errors",
    "ContactError": "errors",
    "ContactLaw": "contact.law",
    "Cycle": "analyses.statics.cycle",
    "Failure": "errors",
    "HarmonicResponse": "analyses.harmonic.response",
    "InputError": "errors",
    "JointMode": "analyses.prepared.joint_modes",
    "JointOpensError": "errors",
    "LapJoint": "describe.lap",
    "MatricesJoint": "describe.matrices",
    "MeshJoint": "describe.mesh",
    "MicroslipError": "errors",
    "ModelError": "errors",
    "ModelJoint": "describe.saved_model",
    "PreparedJoint": "analyses.prepared.joint",
    "Prestress": "analyses.prepared.prestress",
    "Response": "analyses.reduced.response",
    "Run": "pipeline.run",
    "SteadyState": "analyses.time.steady",
    "backbone": "analyses.calls",
    "contact_law": "contact.law",
    "cycle": "analyses.calls",
    "harmonic_response": "analyses.calls",
    "joint_modes": "analyses.prepared.joint_modes",
    "judge": "pipeline.judge",
    "load_joint": "describe.reading",
    "load_model": "analyses.prepared.saved",
    "load_path": "analyses.statics.loading",
    "load_results": "results.files",
    "load_run": "results.store",
    "opening_load": "analyses.calls",
    "parse_joint": "describe.reading",
    "prepare": "pipeline.prepare",
    "prepare_joint": "analyses.prepared.joint",
    "prestress": "analyses.prepared.prestress",
    "reduced_response": "analyses.calls",
    "reference_joint": "describe.reference",
    "register": "registry",
    "run": "pipeline.run",
    "save_model": "analyses.prepared.saved",
    "steady_state": "analyses.calls",
    "write_results": "show.write",
}
"""Module that every public name lives in."""

__all__ = [*_HOME, "__version__"]


def __getattr__(name: str) -> object:
    """Import public names on first use, so that ``microslip --help`` stays quick."""
    if name not in _HOME:
        raise AttributeError(f"module 'microslip' has no attribute {name!r}")
    return getattr(import_module(f"microslip.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
