"""From a description to what every analysis starts from: model, prestress, linear states."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from threadpoolctl import threadpool_limits

from microslip.analyses.prepared.joint import PreparedJoint, flexibility_of
from microslip.analyses.prepared.joint_modes import (
    JointMode,
    joint_modes,
    mode_of_structure,
    pick_mode,
)
from microslip.analyses.prepared.prestress import Prestress, opening_load, prestress
from microslip.analyses.prepared.tightening import Tightened, tighten
from microslip.contact.pairs import normal_rows
from microslip.describe.joint import Joint
from microslip.describe.units_of_the_whole import in_whole
from microslip.errors import Caution, ContactError, InputError, ModelError
from microslip.model.damping import RATIOS, FittedDamping, rayleigh_of, rayleigh_through
from microslip.model.flexibility import Flexibility
from microslip.model.imported import Imported
from microslip.model.joint import JointModel, Reducer
from microslip.model.loose import check_balanced
from microslip.model.reactions import with_inertia_loads, with_rates, with_reactions
from microslip.model.states import LinearStates, linear_states
from microslip.model.structure import Structure
from microslip.model.symmetry import with_half_turn
from microslip.pipeline.excitation import Prepared, prepare_histories
from microslip.pipeline.measures import Measures, measures_of
from microslip.pipeline.sources import Source, law_of, source_of
from microslip.typing import Indices


@dataclass(frozen=True, repr=False)
class Assembly:
    """A described joint made ready for every analysis.

    Attributes
    ----------
    joint : Joint
    structure : Structure
    reducer : Reducer
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
    damping : FittedDamping, optional
        What stands for a damping matrix or for damping ratios of modes, where there are any.
    signals : tuple of Prepared
        What loads the joint in each of its histories, read and resampled.
    """

    joint: Joint
    structure: Structure
    reducer: Reducer
    states: LinearStates
    prepared: PreparedJoint
    opening_moment: float
    measures: Measures
    imported: Imported | None = None
    bolts: Tightened | None = None
    damping: FittedDamping | None = None
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
    def prestress(self) -> Prestress:
        """Contact under the clamp alone."""
        return self.prepared.prestress

    @property
    def doubts(self) -> tuple[Caution, ...]:
        """What should be doubted of the files that it came from."""
        if self.imported is None:
            return ()
        fitted = () if self.damping is None else self.damping.cautions
        return (*self.imported.cautions, *fitted, *_soft_contact(self.prepared))

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
    source = source_of(joint)
    structure, drive = source.structure, source.drive
    modes = min(joint.modes_kept, structure.dofs // 4)
    free = source.imported is not None and structure.supports is None
    if free:
        check_balanced(structure, (drive, *source.preload))
    reducer = Reducer(structure, modes, joint.rayleigh, free=free)
    damping = _damped(reducer, source)
    shapes = reducer.modes.shapes
    model = with_reactions(reducer.model(structure.loads), structure, shapes)
    if source.imported is not None:
        model = with_half_turn(model)
    law = law_of(joint, source, model)
    apart = source.with_gaps(model)
    try:
        start, bolts = _prestress(apart, flexibility_of(apart, law), source)
    except (ContactError, InputError) as error:
        raise type(error)(in_whole(str(error)) if joint.whole else str(error)) from None
    if joint.damping_of_modes:
        damping = _through_ratios(joint, joint_modes(model, start, law))
        reducer.rayleigh = damping.alpha, damping.beta
        model = replace(model, rayleigh=reducer.rayleigh)
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
    opening = opening_load(model, start, drive, law.friction)
    _check_loads(joint, opening)
    _check_positions(joint, model)
    _check_scales(opening, mode)
    if source.imported is not None:
        _check_vibrates(joint, mode, states.drifting)
    return Assembly(
        joint=joint,
        structure=structure,
        reducer=reducer,
        states=states,
        prepared=PreparedJoint(model, flexibility, start, law, drive, mode),
        opening_moment=opening,
        measures=measures_of(joint, model, start, law),
        imported=source.imported,
        bolts=bolts,
        damping=damping,
        signals=tuple(
            prepare_histories(
                joint.analysis.history, mode.sliding_frequency, joint.driven.load.parsed
            )
        ),
    )


def _damped(reducer: Reducer, source: Source) -> FittedDamping | None:
    """Give the reduction the damping of a matrix, where there is one."""
    C = None if source.imported is None else source.imported.damping
    if C is None:
        return None
    found = rayleigh_of(C, reducer.modes)
    reducer.rayleigh = (found.alpha, found.beta)
    return found


def _through_ratios(joint: Joint, modes: tuple[JointMode, ...]) -> FittedDamping:
    """The damping that gives modes of the stuck joint their ratios.

    Raises
    ------
    InputError
        Where there is no such mode, or no such damping.
    """
    if not modes:
        raise InputError(f"{RATIOS}: no mode of this joint deforms it")
    try:
        omega = [pick_mode(modes, number).stuck_omega for number, _ in joint.damping_of_modes]
    except ModelError as error:
        raise InputError(f"{RATIOS}: {error}") from None
    if len(set(omega)) < len(omega):
        twice = max(omega, key=omega.count)
        same = [n for (n, _), w in zip(joint.damping_of_modes, omega, strict=True) if w == twice]
        raise InputError(
            f"{RATIOS}: the modes {', '.join(map(str, same))} slide in different shapes and stick in one, of "
            f"{twice / (2 * np.pi):.4g} Hz: give its ratio once (damping.modes)"
        )
    return rayleigh_through(np.array(omega), np.array([r for _, r in joint.damping_of_modes]))


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
        raise InputError(
            f"interface: the preload pulls the sides of the pairs apart ({error}); it would press them "
            "together if their normals were turned round: do they point from the first side to the second, "
            "are the two sides in this order, is B positive where they approach, and does the preload press?"
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
        return bool(prestress(model, turned, source.held).touching.any())
    except ContactError:
        return False


def _check_loads(joint: Joint, opening: float) -> None:
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
                f"{opening:.4g} {said.unit}; lower it, or raise {joint.preload_key}"
            )


def _check_positions(joint: Joint, model: JointModel) -> None:
    """Raise `InputError` where a position lies off the interface by more than half of its length."""
    x = model.position
    half = 0.5 * float(np.ptp(x))
    asked: list[tuple[str, tuple[float, ...] | None]] = [
        (f"analysis.history {entry.label!r}", entry.positions) for entry in joint.analysis.history
    ]
    if joint.analysis.time is not None:
        asked.append(("analysis.time", joint.analysis.time.positions))
    for where, positions in asked:
        for position in positions or ():
            if not x.min() - half <= position <= x.max() + half:
                raise InputError(
                    f"{where}.positions: {position:g} m lies off the interface, which reaches from "
                    f"{x.min():g} to {x.max():g} m"
                )


SOFTER = 1e3
"""Compliance of the contact, over that of the structure at the pairs, that is a matter of units."""


def _soft_contact(prepared: PreparedJoint) -> tuple[Caution, ...]:
    """That the contact is so soft that nothing would be seen of the structure."""
    compliance = prepared.law.compliance
    own = np.diag(prepared.flexibility.W) - compliance
    ratio = float(np.median(compliance)) / float(np.median(own))
    if not ratio > SOFTER:
        return ()
    reason = f"the contact is {ratio:.2g} times softer than the structure at its pairs"
    remedy = "is the stiffness per area, Pa/m, and are the areas right?"
    return (Caution("input", "contact.tangential_stiffness", reason, remedy),)


LOWERED = 1e-3
"""Share by which bonding may lower the frequency of a mode: it never does, but for rounding."""


def _check_vibrates(joint: Joint, mode: JointMode, drifting: float) -> None:
    """Raise `InputError` where a response is asked for in a direction that friction alone holds: the sliding
    joint drifts that way, and no mode of it becomes the stuck one."""
    if joint.analysis.response is None:
        return
    if drifting <= mode.assurance and mode.sliding_omega <= (1 + LOWERED) * mode.stuck_omega:
        return
    raise InputError(
        f"analysis.response: against the port {joint.driven.name!r} friction alone holds the bodies: stuck "
        f"they vibrate at {mode.stuck_frequency:.4g} Hz, and sliding they drift, so that no reduced model is "
        "made of both; take another port, hold the bodies, or ask for cycles alone"
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
