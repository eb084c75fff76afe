"""A saved joint model as what all analyses start from: read once, with a structure as far as it has one.

Of the structure that the model comes from its free-interface modes are left,

    M = 1,   K = diag(omega²),   B = mode_v,   p = port_modes,

on which sliding and stuck mode, loads and slips are what they were. Shapes, places and the displacements of
nodes are not known.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import scipy.sparse as sp

from microslip.analyses.prepared.joint import PreparedJoint, with_principal_mode
from microslip.analyses.prepared.joint_modes import drifting
from microslip.analyses.prepared.saved import load_with_units
from microslip.describe.saved_model import ModelJoint
from microslip.errors import InputError
from microslip.model.described import Stamps, stamps
from microslip.model.interface import Interface
from microslip.model.joint import JointModel
from microslip.model.states import LinearStates
from microslip.model.structure import Structure

MODAL = ("sliding", "stuck")
"""Ports of the modes that the load excites most."""


def read_saved(joint: ModelJoint) -> PreparedJoint:
    """The prepared joint of a file, driven by the port that the joint file names.

    As long as that is the port that it was saved for it is the same to the last bit; for another one the
    modes are those of the joint model that this one excites most.

    Raises
    ------
    InputError
        Where the file cannot be used (`microslip.analyses.prepared.saved.load_model`), is of another
        width, or has no port of a name.
    """
    path = joint.files[0]
    prepared, per = _loaded(path, stamps(joint.files))
    if (per == "whole") != joint.whole:
        there = 'of the whole structure: write width = "whole"'
        raise InputError(
            f"model.width: {path} is {there if per == 'whole' else 'per metre of width: remove the key'}"
        )
    model = prepared.model
    named = [(f"port {port.name!r}", port.name) for port in joint.port]
    named += [(f"output {output.name!r}", output.port) for output in joint.outputs]
    for where, port in named:
        if port not in model.ports:
            raise InputError(
                f"{where}: {path} has no port {port!r}; it has {', '.join(sorted(model.ports))}"
            )
    drive = joint.driven.name
    if drive == prepared.drive and prepared.mode is not None:
        return prepared
    bare = replace(prepared.with_model(without_ports(model, MODAL)), drive=drive, mode=None)
    # ports of reactions are no loads, and those of the mode in the file are all that there are
    loads = None if prepared.mode is None else {*prepared.mode.load_on_sliding, drive}
    return with_principal_mode(bare, loads)


@lru_cache(maxsize=4)
def _loaded(path: str, stamp: Stamps) -> tuple[PreparedJoint, str]:
    """The file as it is; kept until it changes."""
    return load_with_units(path)


def without_ports(model: JointModel, names: tuple[str, ...]) -> JointModel:
    """A joint model without some of its ports; those that it does not have are no matter."""
    kept = [k for k, name in enumerate(model.ports) if name not in names]
    bodies = model.bodies
    return replace(
        model,
        ports=tuple(model.ports[k] for k in kept),
        port_modes=model.port_modes[:, kept],
        port_v=model.port_v[:, kept],
        port_port=model.port_port[np.ix_(kept, kept)],
        bodies=None if bodies is None else replace(bodies, ports=bodies.ports[kept]),
    )


def modal_structure(model: JointModel) -> Structure:
    """The free-interface modes of a joint model as a structure."""
    k = len(model.omega)
    return Structure(
        stiffness=sp.csc_matrix(sp.diags(model.omega**2)),
        mass=sp.identity(k, format="csc"),
        interface=Interface(
            position=model.position,
            area=model.area,
            relative=sp.csr_matrix(model.mode_v),
            dimension=model.dimension,
            image=model.image,
        ),
        loads={name: model.port_modes[:, j] for j, name in enumerate(model.ports)},
        free=np.arange(k),
    )


def modal_states(prepared: PreparedJoint) -> LinearStates:
    """Sliding and stuck mode of a prepared joint, in its free-interface modes."""
    mode = prepared.principal()
    return LinearStates(
        sliding=mode.sliding,
        stuck=mode.stuck,
        sliding_omega=mode.sliding_omega,
        stuck_omega=mode.stuck_omega,
        overlap=mode.overlap,
        pairs=np.flatnonzero(prepared.prestress.touching),
        drifting=drifting(prepared.model, prepared.prestress, prepared.law, mode.stuck),
    )
