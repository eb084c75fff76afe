"""From a description to what every analysis starts from: model, prestress, linear states."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from microslip.analyses.statics.cycle import Prestress, opening_load, prestress
from microslip.analyses.statics.linear_states import LinearStates, linear_states
from microslip.contact.pairs import normal_rows, tangential_rows
from microslip.describe.excitation import Prepared, prepare_histories
from microslip.describe.lap import LapJoint
from microslip.model.flexibility import Flexibility, static_flexibility, with_compliance
from microslip.model.joint import JointModel, Reducer
from microslip.model.structure import Structure, lap_joint_structure
from microslip.typing import Array


@dataclass(frozen=True, repr=False)
class Assembly:
    """A described joint made ready for every analysis.

    Attributes
    ----------
    joint : LapJoint
    structure : Structure
    reducer : Reducer
    model : JointModel
        Ports: the structure's loads, ``sliding`` and ``stuck`` (modal inertia loads).
    compliance : (d m,) array
        Of the contact itself at every component of v, m/N; zeros where it is exact.
    flexibility : Flexibility
        Static, with the contact compliance.
    prestress : Prestress
    states : LinearStates
    opening_moment : float
        End moment that opens the joint, N m per metre of width.
    signals : tuple of Prepared
        What loads the joint in each of its histories, read and resampled.
    """

    joint: LapJoint
    structure: Structure
    reducer: Reducer
    model: JointModel
    compliance: Array
    flexibility: Flexibility
    prestress: Prestress
    states: LinearStates
    opening_moment: float
    signals: tuple[Prepared, ...] = ()

    def __repr__(self) -> str:
        return (
            f"Assembly of {self.joint.title or 'a lap joint'}: {self.model.pairs} contact pairs, "
            f"{len(self.model.omega)} of {self.structure.dofs} degrees of freedom"
        )

    @property
    def moment_unit(self) -> float:
        """P L: moments are reported over it."""
        return self.joint.clamp.force * self.joint.beams.length

    @property
    def rayleigh(self) -> tuple[float, float]:
        """Alpha (1/s) and beta (s) of the material's damping."""
        return self.joint.damping.alpha, self.joint.damping.beta

    @property
    def between_states(self) -> float:
        """Half way between the sliding and the stuck circular frequency, rad/s."""
        return 0.5 * (self.states.sliding_omega + self.states.stuck_omega)


def prepare(joint: LapJoint) -> Assembly:
    """Mesh, matrices, reduction, prestress and linear states of a described joint.

    Raises
    ------
    ModelError, ContactError
        Where there is no such joint, or the clamp does not close it.
    InputError
        Where the signal of a history cannot be used.
    """
    structure = lap_joint_structure(
        joint.geometry(),
        joint.material_model(),
        joint.mesh_control(),
        horizontal_spring=joint.support.horizontal_spring,
    )
    modes = min(joint.mesh.modes, structure.dofs // 4)
    reducer = Reducer(structure, modes, (joint.damping.alpha, joint.damping.beta))
    model = reducer.model(structure.loads)
    compliance = contact_compliance(joint, model)
    start = prestress(model, contact_flexibility(model, compliance), joint.clamp.force)
    states = linear_states(structure, np.flatnonzero(start.touching), "moment")
    model = reducer.with_ports(model, states.ports(structure))
    flexibility = contact_flexibility(model, compliance)
    return Assembly(
        joint=joint,
        structure=structure,
        reducer=reducer,
        model=model,
        compliance=compliance,
        flexibility=flexibility,
        prestress=start,
        states=states,
        opening_moment=opening_load(model, flexibility, start, "moment"),
        signals=tuple(prepare_histories(joint.analysis.history, states.sliding_frequency)),
    )


def contact_compliance(joint: LapJoint, model: JointModel) -> Array:
    """Compliance ``1 / (k area)`` of an elastic contact at every component of v, m/N."""
    contact = joint.contact
    compliance = np.zeros(2 * model.pairs)
    if contact.law == "elastic" and contact.normal_stiffness:
        compliance[normal_rows()] = 1 / (contact.normal_stiffness * model.area)
    if contact.law == "elastic" and contact.tangential_stiffness:
        compliance[tangential_rows()] = 1 / (contact.tangential_stiffness * model.area)
    return compliance


def contact_flexibility(model: JointModel, compliance: Array) -> Flexibility:
    """Static flexibility of the model behind the compliance of the contact."""
    flexibility = static_flexibility(model)
    return with_compliance(flexibility, compliance) if compliance.any() else flexibility
