"""What an engineer asks of a joint before it is computed: by beam theory, in a fraction of a second.

Frequencies and deflection are those of two Timoshenko beams (`microslip.model.beams`), within 2 per
cent of the finite elements in the sliding state and 4 per cent in the stuck one for beams of 8 to 40
times their thickness. The stress is ``6 M / h²``. What friction must hold follows from the stuck
joint, a beam of twice the thickness, whose lower half carries the force

    T = 3 M / (4 h)

handed over where it slips. The pressure falls linearly to zero over twice the reach b of the contact
beyond the clamp, so with ``l = T / (mu p)`` the length that slips at each edge is

    sqrt(4 b l)  up to  2 b,     l + b  beyond

which the finite elements exceed by up to a factor of two: the moment itself shifts the pressure.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import singledispatch

from microslip.brief import Brief
from microslip.describe.beam import span, surface_stress
from microslip.describe.joint import Joint
from microslip.describe.lap import LapJoint
from microslip.describe.matrices import MatricesJoint
from microslip.describe.mesh import MeshJoint
from microslip.describe.plausible import mean_pressure, pairs_across_clamp, questions
from microslip.describe.saved_model import ModelJoint
from microslip.describe.units import readable
from microslip.errors import Caution
from microslip.model.beams import SPREAD, beam_estimate
from microslip.model.described_mesh import read_described_mesh
from microslip.model.imported import read_imported
from microslip.model.lap import geometry, materials
from microslip.pipeline.cost import degrees_of_freedom, memory, total_seconds

ELASTIC_STRAIN = 0.005
"""Strain beyond which hardly any structural metal is elastic: judges where no yield stress is given."""

SMALL_ROTATION = 0.1
"""Largest rotation, rad, for which linear kinematics are good to a per cent."""

LONG_RUN = 3600.0
"""Seconds beyond which the time of a run is remarked on."""

OUTSIDE = 0.15
"""Share by which a band may miss the estimated resonances before that is remarked on."""


@dataclass(frozen=True, repr=False)
class Estimate(Brief):
    """What beam theory says of a described joint and its largest load.

    Attributes
    ----------
    sliding_frequency, stuck_frequency : float
        Hz.
    moment : float
        Largest end moment that the file gives, N m per metre of width; nan where it gives none.
    stress : float
        Bending stress of one beam under it at rest, Pa.
    resonant_stress : float
        The same at resonance without friction, with the damping of the material alone, Pa: friction
        leaves less. Infinite where the material does not damp, nan where both beams lie within the overlap.
    deflection : float
        At the middle of the joint under it at rest, without friction, m.
    pressure : float
        Mean pressure of the clamp, Pa.
    clamp_pairs : float
        Contact pairs across the clamp.
    slip_length, slip_pairs : float
        Length that slips at each edge under it at rest, m, and the contact pairs in it.
    degrees_of_freedom : int
    seconds, memory : float
        Of a run, s and bytes.
    """

    sliding_frequency: float
    stuck_frequency: float
    moment: float
    stress: float
    resonant_stress: float
    deflection: float
    pressure: float
    clamp_pairs: float
    slip_length: float
    slip_pairs: float
    degrees_of_freedom: int
    seconds: float
    memory: float


def estimate(joint: LapJoint) -> Estimate:
    """What follows from a description without assembling anything.

    Raises
    ------
    InputError
        Where the signal of a history cannot be used.

    Examples
    --------
    >>> from microslip.describe.reference import reference_joint
    >>> found = estimate(reference_joint(pairs=51))
    >>> round(found.pressure), round(found.sliding_frequency)
    (20000000, 175)
    """
    beams = beam_estimate(
        geometry(joint),
        materials(joint),
        joint.spring_used,
        ends=(joint.support.left, joint.support.right),
        weak_spring=joint.weak_spring,
    )
    moment, omega = largest_moment(joint), 2 * math.pi * beams.sliding_frequency
    ratio = 0.5 * (joint.damping.alpha / omega + joint.damping.beta * omega)
    pressure = mean_pressure(joint)
    slip = slip_length(joint, moment)
    dofs = degrees_of_freedom(joint)
    across = pairs_across_clamp(joint)
    return Estimate(
        sliding_frequency=beams.sliding_frequency,
        stuck_frequency=beams.stuck_frequency,
        moment=moment,
        stress=surface_stress(joint, moment),
        resonant_stress=surface_stress(joint, moment) * beams.modal_share / (2 * ratio)
        if ratio
        else math.inf * moment,
        deflection=beams.deflection * moment,
        pressure=pressure,
        clamp_pairs=across,
        slip_length=slip,
        slip_pairs=slip / (2 * joint.clamp.half_length) * across,
        degrees_of_freedom=dofs,
        seconds=total_seconds(joint, dofs),
        memory=memory(joint, dofs),
    )


def slip_length(joint: LapJoint, moment: float) -> float:
    """Length that slips at each edge of the contact under a moment at rest, m."""
    held = joint.friction * mean_pressure(joint)
    if held == 0:
        return math.inf
    thickness = sum(joint.beams.thicknesses) / 2
    evenly = 0.75 * moment / thickness / held
    reach = SPREAD * thickness
    return math.sqrt(4 * reach * evenly) if evenly < reach else evenly + reach


def largest_moment(joint: LapJoint) -> float:
    """Largest end moment that the file gives, N m per metre of width; nan where it gives none, or
    something else drives the joint."""
    if not joint.driven_by_end_moments:
        return math.nan
    histories = (joint.history_load(entry) for entry in joint.analysis.history)
    moments = [*joint.load_amplitudes(), *(moment or 0.0 for moment in histories)]
    return max((m for m in moments if m > 0), default=math.nan)


def elastic_limit(joint: LapJoint) -> tuple[float, str]:
    """Stress beyond which linear elasticity is left, Pa, and what says so."""
    given = joint.material.yield_stress
    if given is not None:
        return given, f"material.yield_stress is {readable(given, 'Pa')}"
    limit = ELASTIC_STRAIN * min(joint.material.moduli)
    return limit, (
        f"beyond {readable(limit, 'Pa')}, {ELASTIC_STRAIN:.1%} of the modulus, hardly any metal is "
        "elastic; give material.yield_stress to judge by it"
    )


def large_deflection(joint: LapJoint) -> float:
    """Deflection at the middle whose rotations at the ends, 4 w over the span, are not small, m."""
    return SMALL_ROTATION * span(joint) / 4


def overstressed(joint: LapJoint, stage: str, where: str, stress: float) -> list[Caution]:
    """That linear elasticity is left, if it is."""
    limit, why = elastic_limit(joint)
    if not stress > limit:
        return []
    said = f"linear elasticity is left: bending stress {readable(stress, 'Pa', 3)}"
    return [Caution(stage, where, f"{said}; {why}", "lower the load, or take thicker beams")]


def overbent(joint: LapJoint, stage: str, where: str, deflection: float) -> list[Caution]:
    """That rotations are no longer small, if they are not."""
    limit = large_deflection(joint)
    if not deflection > limit:
        return []
    reason = (
        f"small rotations are left: deflection {readable(deflection, 'm', 3)}, where "
        f"{readable(limit, 'm', 3)} turns the ends by {SMALL_ROTATION:g} rad"
    )
    return [
        Caution(stage, where, reason, "lower the load; the model is linear but for the contact")
    ]


def overpressed(joint: LapJoint, stage: str, name: str, pressure: float) -> list[Caution]:
    """That the pressure of the clamp is beyond the yield stress, if one is given and it is."""
    given = joint.material.yield_stress
    if given is None or not pressure > given:
        return []
    reason = (
        f"the {name} is {readable(pressure, 'Pa', 3)} and material.yield_stress is "
        f"{readable(given, 'Pa')}: the surfaces yield"
    )
    where = f"clamp.force = {readable(joint.clamp.force, 'N/m')}"
    return [Caution(stage, where, reason, "lower the force, or spread it over a longer clamp")]


def input_cautions(joint: LapJoint, found: Estimate) -> tuple[Caution, ...]:
    """All that should be doubted before anything is computed.

    Parameters
    ----------
    joint : LapJoint
    found : Estimate
        Of that joint.
    """
    where = f"M = {found.moment:.4g} N m/m at rest"
    return (
        *questions(joint),
        *overstressed(joint, "input", where, found.stress),
        *overbent(joint, "input", where, found.deflection),
        *overpressed(joint, "input", "mean pressure of the clamp", found.pressure),
        *_band(joint, found),
        *_cost(joint, found),
    )


@singledispatch
def input_doubts(joint: Joint) -> tuple[Caution, ...]:
    """All that should be doubted of a description before anything is computed.

    Raises
    ------
    InputError
        Where a file that it names cannot be used.
    """
    raise NotImplementedError(f"nothing is known of {type(joint).__name__}")


@input_doubts.register
def _doubts_of_beams(joint: LapJoint) -> tuple[Caution, ...]:
    return input_cautions(joint, estimate(joint))


@input_doubts.register
def _doubts_of_matrices(joint: MatricesJoint) -> tuple[Caution, ...]:
    dofs = degrees_of_freedom(joint)
    seconds, held = total_seconds(joint, dofs), memory(joint, dofs)
    return (*read_imported(joint).cautions, *_long(joint.interface.pairs, seconds, held))


@input_doubts.register
def _doubts_of_mesh(joint: MeshJoint) -> tuple[Caution, ...]:
    dofs = degrees_of_freedom(joint)
    seconds, held = total_seconds(joint, dofs), memory(joint, dofs)
    return (*read_described_mesh(joint).cautions, *_long(joint.mesh.file, seconds, held))


@input_doubts.register
def _doubts_of_saved(joint: ModelJoint) -> tuple[Caution, ...]:
    dofs = degrees_of_freedom(joint)
    return tuple(_long(joint.model.file, total_seconds(joint, dofs), memory(joint, dofs)))


def _band(joint: LapJoint, found: Estimate) -> list[Caution]:
    """That a given band holds no resonance."""
    asked = joint.analysis.response
    if asked is None or not {"from_", "to"} & asked.model_fields_set:
        return []
    low, high = found.sliding_frequency, found.stuck_frequency
    start, stop = asked.from_ or 0.0, asked.to or math.inf
    if start <= high * (1 + OUTSIDE) and stop >= low * (1 - OUTSIDE):
        return []
    seen = f"{start:g} to {stop:g} Hz"
    reason = f"the resonance is expected between {low:.4g} Hz (sliding) and {high:.4g} Hz (stuck)"
    return [
        Caution("input", f"analysis.response from {seen}", reason, "move the band, or leave it out")
    ]


def _cost(joint: LapJoint, found: Estimate) -> list[Caution]:
    """That a run takes very long."""
    return _long(f"contact.pairs = {joint.contact.pairs}", found.seconds, found.memory)


def _long(where: str, seconds: float, held: float) -> list[Caution]:
    if seconds < LONG_RUN:
        return []
    return [
        Caution(
            "cost",
            where,
            f"the run may take up to {seconds / 3600:.2g} h on one core and {held / 1e9:.2g} GB",
            "the time goes with the square of the number of contact pairs, and with the number of loads, "
            "amplitudes and steps asked for",
        )
    ]
