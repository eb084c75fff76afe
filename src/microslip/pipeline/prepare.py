"""From a description to what every analysis starts from: model, prestress, linear states."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from threadpoolctl import threadpool_limits

from microslip.analyses.prepared.joint import PreparedJoint, flexibility_of
from microslip.analyses.prepared.joint_modes import (
    JointMode,
    joint_modes,
    mode_of_structure,
    pick_mode,
)
from microslip.analyses.prepared.prestress import Prestress, opening_load, prestress
from microslip.analyses.prepared.settled import settled
from microslip.analyses.prepared.tightening import Tightened, tighten
from microslip.contact.pairs import normal_rows
from microslip.describe.joint import Joint
from microslip.describe.saved_model import ModelJoint
from microslip.describe.units_of_the_whole import in_whole
from microslip.describe.whole import PressedJoint
from microslip.errors import Caution, ContactError, InputError, ModelError
from microslip.model.damping import RATIOS, GivenDamping, damping_by_matrix, through_ratios
from microslip.model.flexibility import Flexibility
from microslip.model.imported import Imported
from microslip.model.joint import JointModel, Reducer
from microslip.model.loose import check_balanced
from microslip.model.mesh.finite_elements import said_too
from microslip.model.mesh_in_words import names_of_motions
from microslip.model.reactions import with_inertia_loads, with_rates, with_reactions
from microslip.model.states import LinearStates, linear_states
from microslip.model.structure import Structure
from microslip.model.symmetry import with_half_turn
from microslip.pipeline.excitation import Prepared, prepare_histories
from microslip.pipeline.fitness import (
    check_loads,
    check_positions,
    check_pressed,
    check_scales,
    check_slid,
    check_vibrates,
    coupling_said,
    crushed,
    hardly_pressed,
    hardly_tightened,
    not_one_mode,
    slid,
    soft_contact,
    unpressed,
)
from microslip.pipeline.measures import Measures, measures_of
from microslip.pipeline.saved_model import modal_states, modal_structure, read_saved
from microslip.pipeline.sloping import sloping
from microslip.pipeline.sources import Source, law_of, source_of
from microslip.typing import Array, Indices


@dataclass(frozen=True, repr=False)
class Assembly:
    """A described joint made ready for every analysis.

    Attributes
    ----------
    joint : Joint
    structure : Structure
    reduction : Reducer or None
        None of a saved model, whose structure is not known.
    states : LinearStates
        Sliding and stuck mode on every degree of freedom.
    prepared : PreparedJoint
        Ports of its model: the structure's loads, ``sliding`` and ``stuck`` (modal inertia loads).
    opening_moment : float
        Amplitude on the driven port that opens the joint: of the end moment, N m per metre of width.
        Infinite where it holds any.
    measures : Measures
        What positions, pressures and friction are reported by.
    imported : Imported or None
        What the files of matrices hold that it came from, if it did.
    bolts : Tightened, optional
        Bolts that keep their length, where there are any.
    damping : GivenDamping, optional
        What damping matrix or damping ratios of modes say, where there are any.
    signals : tuple of Prepared
        What loads the joint in each of its histories, read and resampled.
    """

    joint: Joint
    structure: Structure
    reduction: Reducer | None
    states: LinearStates
    prepared: PreparedJoint
    opening_moment: float
    measures: Measures
    imported: Imported | None = None
    bolts: Tightened | None = None
    damping: GivenDamping | None = None
    signals: tuple[Prepared, ...] = ()

    def __repr__(self) -> str:
        return (
            f"Assembly of {self.joint.title or self.joint.unnamed}: {self.model.pairs} contact pairs, "
            f"{len(self.model.omega)} of {self.structure.dofs} degrees of freedom"
        )

    @property
    def model(self) -> JointModel:
        """The joint model."""
        return self.prepared.model

    @property
    def reducer(self) -> Reducer:
        """What reduced the structure; raises `ModelError` of a saved model, which has none."""
        if self.reduction is None:
            raise ModelError("a saved model has no structure whose displacements were known")
        return self.reduction

    @property
    def prestress(self) -> Prestress:
        """Contact under the clamp alone."""
        return self.prepared.prestress

    @property
    def doubts(self) -> tuple[Caution, ...]:
        """What should be doubted of the files that it came from."""
        modes = not_one_mode(self.mode)
        if self.imported is None:
            return modes
        given = () if self.damping is None else self.damping.cautions
        return (
            *self.imported.cautions,
            *given,
            *coupling_said(self.prepared),
            *soft_contact(self.prepared),
            *crushed(self.prestress),
            *hardly_pressed(self.joint, self.prestress, self.bolts),
            *slid(self.prepared),
            *sloping(self.prepared),
            *hardly_tightened(self.bolts),
            *modes,
        )

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


def prepare(joint: Joint) -> PreparedJoint:
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


def assemble(joint: Joint) -> Assembly:
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


def assemble_without_signals(joint: Joint) -> Assembly:
    """The same without the signals of its histories, whose files may be gone."""
    silent = joint.model_copy(
        update={"analysis": joint.analysis.model_copy(update={"history": ()})}
    )
    return replace(assemble(silent), joint=joint)


def _assemble(joint: Joint) -> Assembly:
    if isinstance(joint, ModelJoint):
        return _read_back(joint)
    source = source_of(joint)
    structure, drive = source.structure, source.drive
    modes = min(joint.modes_kept, structure.dofs // 4)
    free = source.imported is not None and structure.supports is None
    if free:
        check_balanced(structure, (drive, *source.preload), _unread(source))
    reducer = Reducer(structure, modes, joint.rayleigh, free=free)
    damping = _damped(reducer, source)
    shapes = reducer.modes.shapes
    model = with_reactions(reducer.model(structure.loads), structure, shapes)
    if source.imported is not None:
        model = with_half_turn(model)
    law = law_of(joint, source, model)
    source = source.with_fit(model)
    apart = source.with_gaps(model)
    try:
        check_slid(apart, source.held, law.friction)
        flexibility = flexibility_of(apart, law)
        start, bolts = _prestress(apart, flexibility, source)
        start = replace(start, raised=joint.raised if isinstance(joint, PressedJoint) else None)
        start = settled(apart, flexibility, start, law.friction)
    except (ContactError, InputError) as error:
        said = in_whole(str(error)) if joint.whole else str(error)
        raise type(error)(said + _doubtful_preload(source) + _unread(source)) from None
    if joint.damping_of_modes:
        damping = _through_ratios(joint, joint_modes(model, start, law))
        reducer.rayleigh, reducer.damping = (damping.alpha, damping.beta), damping.matrix
        model = replace(model, rayleigh=reducer.rayleigh, damping=reducer.damping)
    _check_pressed(model, start, source, shapes)
    pairs = np.flatnonzero(start.touching)
    held = start.bonded(1), start.bonded(model.dimension)
    states = linear_states(
        structure, pairs, held, drive, _looked_at(structure, held[1], source), source.drifting
    )
    model = reducer.with_ports(model, states.ports(structure))
    own = {"sliding": states.sliding, "stuck": states.stuck}
    model = with_rates(with_inertia_loads(model, structure, shapes, own), structure)
    model = source.with_gaps(model)
    flexibility = flexibility_of(model, law)
    mode = mode_of_structure(states, structure, model)
    prepared = PreparedJoint(model, flexibility, start, law, drive, mode)
    if damping is not None and source.imported is not None and source.imported.damping is not None:
        damping = replace(damping, off=_off(source.imported.damping, structure, states, model))
    found = _assembly(joint, prepared, structure, states, vibrates=source.imported is not None)
    return replace(found, reduction=reducer, imported=source.imported, bolts=bolts, damping=damping)


def _check_pressed(model: JointModel, start: Prestress, source: Source, shapes: Array) -> None:
    """Raise `InputError` where a part of a joint from files is held by nothing."""
    if source.imported is None:
        return
    motions, meshed = unpressed(model, start), source.imported.meshed
    moved = shapes[:, : len(motions)] @ motions
    check_pressed(motions, () if meshed is None else names_of_motions(meshed, moved))


def _doubtful_preload(source: Source) -> str:
    """Which bolt of a mesh may be the wrong one, for errors."""
    doubts = () if source.imported is None else source.imported.cautions
    return "".join(f"; {d.where}: {d.reason}" for d in doubts if d.where.startswith("preload "))


def _unread(source: Source) -> str:
    """What a mesh has that is not read and may hold the joint, for errors."""
    meshed = None if source.imported is None else source.imported.meshed
    return said_too(None if meshed is None else meshed.mesh)


def _read_back(joint: ModelJoint) -> Assembly:
    """A saved model: prepared already, and a structure as far as its modes are one."""
    prepared = read_saved(joint)
    structure = modal_structure(prepared.model)
    return _assembly(joint, prepared, structure, modal_states(prepared), vibrates=True)


def _assembly(
    joint: Joint,
    prepared: PreparedJoint,
    structure: Structure,
    states: LinearStates,
    *,
    vibrates: bool,
) -> Assembly:
    """What every analysis starts from, held against what the description asks for.

    Raises
    ------
    InputError, ModelError
        Where it cannot do that; `vibrates` says whether the direction of the load may be held by friction
        alone.
    """
    model, start, mode = prepared.model, prepared.prestress, prepared.principal()
    opening = opening_load(model, start, prepared.drive, prepared.law.friction)
    check_loads(joint, opening)
    check_positions(joint, model)
    check_scales(opening, mode)
    if vibrates:
        check_vibrates(joint, mode, states.drifting)
    return Assembly(
        joint=joint,
        structure=structure,
        reduction=None,
        states=states,
        prepared=prepared,
        opening_moment=opening,
        measures=measures_of(joint, model, start, prepared.law),
        signals=tuple(
            prepare_histories(
                joint.analysis.history, mode.sliding_frequency, joint.driven.load.parsed
            )
        ),
    )


def _damped(reducer: Reducer, source: Source) -> GivenDamping | None:
    """Give the reduction the damping of a matrix, where there is one."""
    C = None if source.imported is None else source.imported.damping
    if C is None:
        return None
    found = damping_by_matrix(C, reducer.modes)
    reducer.rayleigh, reducer.damping = (found.alpha, found.beta), found.matrix
    return found


def _off(C: sp.csc_matrix, structure: Structure, states: LinearStates, model: JointModel) -> float:
    """By how much the model misses ``phi^T C phi`` of both linear states on all degrees of freedom."""
    off = []
    for name, shape in (("sliding", states.sliding), ("stuck", states.stuck)):
        own = model.port_modes[:, model.port(name)]
        beyond = shape @ (structure.stiffness @ shape) - own @ (model.omega**2 * own)
        damped = own @ model.damping_matrix() @ own + model.rayleigh[1] * max(beyond, 0.0)
        true = float(shape @ (C @ shape))
        off.append(abs(damped - true) / max(damped, true, 1e-300))
    return float(max(off))


def _through_ratios(joint: Joint, modes: tuple[JointMode, ...]) -> GivenDamping:
    """The damping that gives modes of the stuck joint their ratios.

    Raises
    ------
    InputError
        Where there is no such mode, or two of them are the same.
    """
    if not modes:
        raise InputError(f"{RATIOS}: no mode of this joint deforms it")
    try:
        picked = [pick_mode(modes, number) for number, _ in joint.damping_of_modes]
    except ModelError as error:
        raise InputError(f"{RATIOS}: {error}") from None
    omega = [mode.stuck_omega for mode in picked]
    if len(set(omega)) < len(omega):
        twice = max(omega, key=omega.count)
        same = [n for (n, _), w in zip(joint.damping_of_modes, omega, strict=True) if w == twice]
        raise InputError(
            f"{RATIOS}: the modes {', '.join(map(str, same))} slide in different shapes and stick in one, of "
            f"{twice / (2 * np.pi):.4g} Hz: give its ratio once (damping.modes)"
        )
    ratios = np.array([ratio for _, ratio in joint.damping_of_modes])
    return through_ratios(np.array(omega), ratios, np.column_stack([m.stuck for m in picked]))


LOOKED_AT = 8
"""Modes among which the one is chosen that the load excites most."""


def _looked_at(structure: Structure, bonded: Indices, source: Source) -> int:
    """How many modes of both states are looked at: bodies that drift may do so in all their rigid motions.

    Raises
    ------
    ModelError
        Where so little is left to move that there is none.
    """
    left = structure.dofs - len(bonded)
    if left < FEWEST_FREE:
        raise ModelError(
            f"{structure.dofs} degrees of freedom, of which the pairs that touch hold {len(bonded)} when "
            f"they stick: {left} are left to vibrate, and at least {FEWEST_FREE} are needed; keep more "
            "degrees of freedom, or more modes, in the matrices"
        )
    motions = structure.motions
    if source.imported is None or not source.drifting or motions is None:
        return min(LOOKED_AT, left - 2)
    return min(LOOKED_AT + motions.shape[1], left - 2)


FEWEST_FREE = 4
"""Degrees of freedom that the stuck joint has at least."""


def _prestress(
    model: JointModel, flexibility: Flexibility, source: Source
) -> tuple[Prestress, Tightened | None]:
    """Contact under the preload, and the bolts that keep their length; of a joint from files an error says
    whether the normals are turned.

    Raises
    ------
    InputError
        Where the preload pulls, and would press if the normals pointed the other way.
    ContactError
        Where it presses nothing together either way, or the solver fails.
    """
    plan = None if source.imported is None else source.imported.tightening
    if plan is not None and plan.bolts.names:
        bolts = tighten(model, flexibility, source.held, plan)
        held = {**source.held, **bolts.preload}
        return prestress(model, flexibility, held, plan.bolts.names), bolts
    try:
        return prestress(model, flexibility, source.held), None
    except ContactError as error:
        if source.imported is None or not _presses_turned(model, flexibility, source):
            raise
        way = (
            "do its forces draw the parts together, head and nut towards each other?"
            if source.imported.meshed is not None
            else "do they point from the first side to the second, are the two sides in this order, is B "
            "positive where they approach, and does the preload press?"
        )
        raise InputError(
            f"interface: the preload pulls the sides of the pairs apart ({error}); it would press them "
            f"together if their normals were turned round: {way}"
        ) from None


def _presses_turned(model: JointModel, flexibility: Flexibility, source: Source) -> bool:
    """Whether the preload would press the sides together if all normals were turned round."""
    turn = np.ones(model.dimension * model.pairs)
    turn[normal_rows(model.dimension)] = -1.0
    turned = replace(
        flexibility,
        W=turn[:, None] * flexibility.W * turn,
        R=turn[:, None] * flexibility.R,
        loads_v=turn[:, None] * flexibility.loads_v,
    )
    try:
        with_turned = replace(model, mode_v=turn[:, None] * model.mode_v)
        return bool(prestress(with_turned, turned, source.held).touching.any())
    except ContactError:
        return False
