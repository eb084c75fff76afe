"""Whether a joint that is prepared can answer what its description asks for, and what of it is doubtful."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping

import numpy as np

from microslip.analyses.prepared.balance import friction_taken
from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.prepared.joint_modes import JointMode
from microslip.analyses.prepared.prestress import Prestress
from microslip.analyses.prepared.tightening import Tightened
from microslip.contact.pairs import by_pair, normal
from microslip.describe.joint import Joint
from microslip.describe.mesh import MeshJoint
from microslip.describe.units import readable
from microslip.errors import Caution, ContactError, InputError, ModelError
from microslip.model.imported import GAP
from microslip.model.joint import JointModel
from microslip.model.shape_damping import ratio_by_coupling
from microslip.typing import Array


def check_loads(joint: Joint, opening: float) -> None:
    """Raise `InputError` where a load of the file opens the joint."""
    given = [("load", value) for value in joint.load_amplitudes()]
    for entry in joint.analysis.history:
        amplitude = joint.history_load(entry)
        if amplitude is not None:
            given.append((f"analysis.history {entry.label!r}", amplitude))
    said = joint.driven.load
    for where, value in given:
        if opening <= 0:
            raise InputError(
                f"{where}: nothing presses what {said.named(value)} would part together: tighten a bolt "
                "through every part, or support it"
            )
        if value >= opening:
            raise InputError(
                f"{where}: {said.named(value)} opens the joint: the clamp holds less than "
                f"{opening:.4g} {said.unit}; lower it, or raise {joint.preload_key}"
            )


def check_positions(joint: Joint, model: JointModel) -> None:
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


SLIGHTLY = 0.01
"""Share of what friction can hold that a preload may take in silence."""


def check_slid(model: JointModel, preload: Mapping[str, float], friction: Array) -> None:
    """Raise `ContactError` where a preload slides bodies past each other that no friction holds."""
    taken = friction_taken(model, model.amplitudes(preload), friction)
    if taken > 1:
        much = "" if np.isinf(taken) else f", with {taken:.3g} times what friction can hold"
        raise ContactError(
            f"the preload slides bodies past each other{much}: do bolts pull along their axes, across the "
            "contact?"
        )


def slid(prepared: PreparedJoint) -> tuple[Caution, ...]:
    """That a preload slides bodies past each other, which friction alone holds and prestress is without."""
    model = prepared.model
    amplitudes = model.amplitudes(prepared.prestress.preload)
    taken = friction_taken(model, amplitudes, prepared.law.friction)
    if taken <= SLIGHTLY:
        return ()
    reason = (
        f"it slides bodies past each other, with {taken:.0%} of what friction can hold; the prestress, which "
        "is without friction otherwise, has what keeps them in place"
    )
    return (Caution("input", "preload", reason, "do bolts pull along their axes?"),)


PRESSED = 1e-6
"""Of the largest pressure: pairs with less press nothing."""


def unpressed(model: JointModel, start: Prestress) -> Array:
    """Motions of parts which neither a support nor a pair that is pressed holds: columns, of loose modes."""
    loose = model.loose_motions
    if not loose:
        return np.zeros((0, 0))
    moved = by_pair(model.mode_v[:, :loose].T, model.dimension)
    pressed = start.pressure > PRESSED * start.pressure.max(initial=0.0)
    # motions of the joint as a whole move no pair
    _, size, turned = np.linalg.svd(np.linalg.qr(moved.reshape(loose, -1).T, mode="r"))
    own = turned[size > PRESSED * size.max(initial=1e-300)].T
    felt = np.einsum("lk,lmd->kmd", own, moved[:, pressed]).reshape(own.shape[1], -1)
    _, share, mixed = np.linalg.svd(np.linalg.qr(felt.T, mode="r"))
    kept = int((share > PRESSED * size.max(initial=0.0)).sum())
    return np.asarray(own @ mixed[kept:].T)


def check_pressed(motions: Array, names: tuple[str, ...]) -> None:
    """Raise `InputError` where parts have motions of `unpressed`, with their names."""
    count = motions.shape[1]
    if count:
        said = "; ".join(f"{each} ({n})" if n > 1 else each for each, n in Counter(names).items())
        raise InputError(
            f"preload: no support and no contact under pressure holds {said or f'{count} motions of parts'}: "
            "tighten a bolt through every part, or support it"
        )


HARDLY = 0.01
"""Of the largest force of a bolt: one with less is hardly tightened, and contact with less hardly pressed."""


def hardly_pressed(joint: Joint, start: Prestress, bolts: Tightened | None) -> tuple[Caution, ...]:
    """That next to nothing of the forces of bolts and pressures arrives at the contact."""
    if not isinstance(joint, MeshJoint):
        return ()
    forces = {} if bolts is None else {name: force for name, force, _ in bolts.rows}
    given = [
        forces.get(entry.name, start.preload.get(entry.name, 0.0))
        for entry in joint.preload
        if entry.temperature is None
    ]
    largest, r = max(given, default=0.0), start.solution.r
    arrives = float(normal(r, len(r) // len(start.touching)).sum())
    if arrives >= HARDLY * largest:
        return ()
    reason = f"the contact takes {arrives / largest:.2g} of its largest force"
    remedy = "are head and nut of each bolt on the parts that it draws together?"
    return (Caution("input", "preload", reason, remedy),)


def hardly_tightened(bolts: Tightened | None) -> tuple[Caution, ...]:
    """That a bolt has next to no force beside the others."""
    rows = [] if bolts is None else bolts.rows
    largest = max(rows, key=lambda row: row[1], default=None)
    return tuple(
        Caution(
            "input",
            f"preload {name!r}",
            f"has {force / largest[1]:.1%} of the force of {largest[0]!r} when all are tightened",
            "shortening counts from where a bolt is snug when its turn comes, and bolts tightened later take "
            "force away: give forces, or another order",
        )
        for name, force, _ in rows
        if largest is not None and force < HARDLY * largest[1]
    )


SOFTER = 1e3
"""Compliance of the contact, over that of the structure at the pairs, that is a matter of units."""


def crushed(start: Prestress) -> tuple[Caution, ...]:
    """That no surface bears what the preload presses with, as where areas are in other units."""
    largest = float(start.pressure.max(initial=0.0))
    if largest <= HARDEST:
        return ()
    return (
        Caution(
            "input",
            f"preload {', '.join(name for name in start.preload if name != GAP) or 'by interference'}",
            f"the largest pressure in the contact is {readable(largest, 'Pa', 3)}; no metal bears more than "
            f"{readable(HARDEST, 'Pa')}",
            "are the units of length and force right, and the areas of the pairs?",
        ),
    )


HARDEST = 1e10
"""Pressure that no metal bears, Pa: above the hardness of hardened steel."""


def soft_contact(prepared: PreparedJoint) -> tuple[Caution, ...]:
    """That the contact is so soft that nothing would be seen of the structure."""
    compliance = prepared.law.compliance
    own = np.diag(prepared.flexibility.W) - compliance
    ratio = float(np.median(compliance)) / float(np.median(own))
    if not ratio > SOFTER:
        return ()
    reason = f"the contact is {ratio:.2g} times softer than the structure at its pairs"
    remedy = "is the stiffness per area, Pa/m, and are the areas right?"
    return (Caution("input", "contact.tangential_stiffness", reason, remedy),)


COUPLED = 0.02
"""Part of a damping ratio that coupling may change in silence."""


def coupling_said(prepared: PreparedJoint) -> tuple[Caution, ...]:
    """That damping couples the joint's mode to others, so that its own is not what its shape has."""
    model, mode = prepared.model, prepared.principal()
    if model.damping is None:
        return ()
    off = []
    for directions, shape in ((1, mode.sliding), (model.dimension, mode.stuck)):
        held = prepared.prestress.bonded(directions)
        behind = prepared.law.compliance if directions == model.dimension else None
        ratio, coupled = ratio_by_coupling(model, held, shape, behind)
        off.append(abs(coupled / ratio - 1) if ratio > 0 else float(coupled > 0))
    if max(off) <= COUPLED:
        return ()
    return (
        Caution(
            "input",
            "damping",
            f"it couples the joint's mode to others, which changes its ratio by {max(off):.1%}; reduced "
            "models, quasi-static and prescribed backbones take the damping of the shape without that",
            'backbones by method "harmonic", harmonic balance and time integration have all of it',
        ),
    )


LOWERED = 1e-3
"""Share by which bonding may lower the frequency of a mode: it never does, but for rounding."""


HALF = 0.5
"""Assurance below which less than half of the stuck mode is the sliding one."""


def not_one_mode(mode: JointMode) -> tuple[Caution, ...]:
    """That the sliding and the stuck mode are not one mode that bonding stiffens.

    Bonding is a constraint, and no mode of a given order has a lower frequency with it (Rayleigh): a stuck
    mode below its sliding partner is of another order.
    """
    sliding, stuck = mode.sliding_frequency, mode.stuck_frequency
    lower = mode.sliding_omega > (1 + LOWERED) * mode.stuck_omega
    if not lower and mode.assurance >= HALF:
        return ()
    why = "bonding never lowers the frequency of one mode" if lower else "they are mostly two modes"
    return (
        Caution(
            "input",
            "modes of the joint",
            f"slides at {sliding:.4g} Hz and sticks at {stuck:.4g} Hz with an assurance of "
            f"{mode.assurance:.2f}: {why}; k_eq and gamma_eq are of the amplitude of the sliding one "
            "alone, and no frequency and damping of a mode follow from them",
            'take harmonic balance, or backbones by method "harmonic"; or drive a port that excites one mode',
        ),
    )


def check_vibrates(joint: Joint, mode: JointMode, drifting: float) -> None:
    """Raise `InputError` where a response is asked for in a direction that friction alone holds: the sliding
    joint drifts that way, and no mode of it becomes the stuck one."""
    if joint.analysis.response is None:
        return
    if drifting <= mode.assurance and mode.sliding_omega <= (1 + LOWERED) * mode.stuck_omega:
        return
    raise InputError(
        f"analysis.response: against the port {joint.driven.name!r} friction alone holds the bodies: stuck "
        f"they vibrate at {mode.stuck_frequency:.4g} Hz, and sliding they drift, so that no reduced model is "
        "made of both; leave analysis.response out: cycles, backbones, harmonic balance and time "
        "integration need no such model; or take another port, or hold the bodies"
    )


def check_scales(opening: float, mode: JointMode) -> None:
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
