"""A planar joint as a spatial one: its plane turned, and a third direction that nothing drives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint, flexibility_of
from microslip.analyses.prepared.prestress import prestress
from microslip.contact.law import contact_law
from microslip.contact.pairs import tangential_rows
from microslip.model.joint import JointModel


def lift(pairs: int, angle: float) -> np.ndarray:
    """(3 m, 2 m): normal to normal, the tangential direction to one at an angle with the first axis."""
    one = np.array([[1.0, 0.0], [0.0, np.cos(angle)], [0.0, np.sin(angle)]])
    return np.kron(np.eye(pairs), one)


def spatial_model(model: JointModel, angle: float) -> JointModel:
    """The model with three components a pair; across the plane it yields as along it, by itself."""
    E = lift(model.pairs, angle)
    A = np.kron(np.eye(model.pairs), np.array([[0.0], [-np.sin(angle)], [np.cos(angle)]]))
    own = model.residual[tangential_rows(), tangential_rows()]
    return replace(
        model,
        dimension=3,
        mode_v=E @ model.mode_v,
        residual=E @ model.residual @ E.T + A @ own @ A.T,
        port_v=E @ model.port_v,
        image=None,
        bodies=None if model.bodies is None else replace(model.bodies, v=E @ model.bodies.v),
    )


def spatial_joint(joint: PreparedJoint, angle: float) -> PreparedJoint:
    """The prepared joint of `spatial_model`."""
    model = spatial_model(joint.model, angle)
    given = joint.law.compliance.reshape(-1, 2)
    compliance = np.column_stack([given, given[:, 1]]).ravel()
    law = contact_law(model.pairs, joint.law.friction, compliance, 3)
    flexibility = flexibility_of(model, law)
    start = prestress(model, flexibility, joint.prestress.preload)
    return replace(joint, model=model, flexibility=flexibility, prestress=start, law=law)
