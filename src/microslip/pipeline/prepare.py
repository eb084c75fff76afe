"""From a description to what every analysis starts from: model, prestress, linear states."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from microslip.analyses.prepared.joint import PreparedJoint, flexibility_of
from microslip.analyses.prepared.joint_modes import JointMode, mode_of_structure
from microslip.analyses.prepared.prestress import Prestress, opening_load, prestress
from microslip.contact.law import ContactLaw, contact_law
from microslip.contact.pairs import normal_rows, tangential_rows
from microslip.describe.lap import LapJoint
from microslip.errors import InputError, ModelError
from microslip.model.joint import JointModel, Reducer
from microslip.model.lap import structure_of
from microslip.model.states import LinearStates, linear_states
from microslip.model.structure import Structure
from microslip.pipeline.excitation import Prepared, prepare_histories
from microslip.typing import Array

DRIVE, PRELOAD = "moment", "clamp"
"""Ports of a lap joint that are driven where the file names no other, and held."""


@dataclass(frozen=True, repr=False)
class Assembly:
    """A described joint made ready for every analysis.

    Attributes
    ----------
    joint : LapJoint
    structure : Structure
    reducer : Reducer
    states : LinearStates
        Sliding and stuck mode on every degree of freedom.
    prepared : PreparedJoint
        Ports of its model: the structure's loads, ``sliding`` and ``stuck`` (modal inertia loads).
    opening_moment : float
        Amplitude on the driven port that opens the joint: of the end moment, N m per metre of width.
        Infinite where it holds any.
    signals : tuple of Prepared
        What loads the joint in each of its histories, read and resampled.
    """

    joint: LapJoint
    structure: Structure
    reducer: Reducer
    states: LinearStates
    prepared: PreparedJoint
    opening_moment: float
    signals: tuple[Prepared, ...] = ()

    def __repr__(self) -> str:
        return (
            f"Assembly of {self.joint.title or 'a lap joint'}: {self.model.pairs} contact pairs, "
            f"{len(self.model.omega)} of {self.structure.dofs} degrees of freedom"
        )

    @property
    def model(self) -> JointModel:
        """The joint model."""
        return self.prepared.model

    @property
    def prestress(self) -> Prestress:
        """Contact under the clamp alone."""
        return self.prepared.prestress

    @property
    def mode(self) -> JointMode:
        """Sliding and stuck mode as the analyses take them."""
        return self.prepared.principal()

    @property
    def moment_unit(self) -> float:
        """P L: end moments are reported over it."""
        return self.joint.clamp_force_length

    @property
    def between_states(self) -> float:
        """Half way between the sliding and the stuck circular frequency, rad/s."""
        return 0.5 * (self.mode.sliding_omega + self.mode.stuck_omega)


def prepare(joint: LapJoint) -> PreparedJoint:
    """What every analysis takes of a described joint; about a second for 100 contact pairs.

    Raises
    ------
    ModelError, ContactError
        Where there is no such joint, or the clamp does not close it.
    InputError
        Where the signal of a history cannot be used.

    Examples
    --------
    >>> import microslip
    >>> microslip.prepare(microslip.reference_joint(pairs=21)).drive
    'moment'
    """
    return assemble(joint).prepared


def assemble(joint: LapJoint) -> Assembly:
    """Mesh, matrices, reduction, prestress and linear states of a described joint.

    Raises
    ------
    ModelError, ContactError
        Where there is no such joint, or the clamp does not close it.
    InputError
        Where the signal of a history cannot be used.
    """
    with threadpool_limits(1):
        return _assemble(joint)


def assemble_without_signals(joint: LapJoint) -> Assembly:
    """The same without the signals of its histories, whose files may be gone."""
    silent = joint.model_copy(
        update={"analysis": joint.analysis.model_copy(update={"history": ()})}
    )
    return replace(assemble(silent), joint=joint)


def _assemble(joint: LapJoint) -> Assembly:
    structure, drive = structure_of(joint), drive_of(joint)
    modes = min(joint.mesh.modes, structure.dofs // 4)
    reducer = Reducer(structure, modes, (joint.damping.alpha, joint.damping.beta))
    model = reducer.model(structure.loads)
    law = law_of(joint, model)
    start = prestress(model, flexibility_of(model, law), {PRELOAD: joint.clamp.force})
    pairs = np.flatnonzero(start.touching)
    states = linear_states(structure, pairs, (start.bonded(1), start.bonded(2)), drive)
    model = reducer.with_ports(model, states.ports(structure))
    flexibility = flexibility_of(model, law)
    mode = mode_of_structure(states, structure, model)
    opening = opening_load(model, start, drive)
    _check_loads(joint, opening)
    _check_scales(opening, mode)
    return Assembly(
        joint=joint,
        structure=structure,
        reducer=reducer,
        states=states,
        prepared=PreparedJoint(model, flexibility, start, law, drive, mode),
        opening_moment=opening,
        signals=tuple(
            prepare_histories(
                joint.analysis.history, mode.sliding_frequency, joint.driven.load.parsed
            )
        ),
    )


def drive_of(joint: LapJoint) -> str:
    """Port of the joint model that drives it."""
    return DRIVE if joint.driven_by_end_moments else joint.driven.name


def _check_loads(joint: LapJoint, opening: float) -> None:
    """Raise `InputError` where a load of the file opens the joint."""
    given = [("load", value) for value in joint.load_amplitudes()]
    for entry in joint.analysis.history:
        amplitude = joint.history_load(entry)
        if amplitude is not None:
            given.append((f"analysis.history {entry.label!r}", amplitude))
    said = joint.driven.load
    for where, value in given:
        if value >= opening:
            raise InputError(
                f"{where}: {said.named(value)} opens the joint: the clamp holds less than "
                f"{opening:.4g} {said.unit}; lower it, or raise clamp.force"
            )


def _check_scales(opening: float, mode: JointMode) -> None:
    """Raise `ModelError` where the numbers that all analyses scale with are none; the load that opens
    the joint may be infinite."""
    sliding, stuck = mode.sliding_omega, mode.stuck_omega
    scales = (
        ("the load that opens the joint", opening, opening > 0),
        ("the circular frequency of the sliding state", sliding, 0 < sliding < np.inf),
        ("the circular frequency of the stuck state", stuck, 0 < stuck < np.inf),
    )
    for name, value, usable in scales:
        if not usable:
            raise ModelError(
                f"{name} is {value:g}: check the dimensions, the material and the supports, and "
                "their units"
            )


def friction_of(joint: LapJoint, model: JointModel) -> float | Array:
    """Coefficient of friction: one, or one per pair where it varies along x."""
    mu = joint.contact.friction
    return mu if isinstance(mu, float) else np.array([mu.at(x) for x in model.position])


def law_of(joint: LapJoint, model: JointModel) -> ContactLaw:
    """Friction, and the compliance ``1 / (k area)`` of an elastic contact, m/N."""
    contact = joint.contact
    compliance = np.zeros(2 * model.pairs)
    if contact.law == "elastic" and contact.normal_stiffness:
        compliance[normal_rows()] = 1 / (contact.normal_stiffness * model.area)
    if contact.law == "elastic" and contact.tangential_stiffness:
        compliance[tangential_rows()] = 1 / (contact.tangential_stiffness * model.area)
    return contact_law(model.pairs, friction_of(joint, model), compliance)
