"""What an engineer asks of answers: stress, deflection and pressure, and whether they may be believed.

The sliding mode bends a section at x by ``m(x)`` per modal amplitude q; a load A bends it by what the
mode does not hold of it (mode acceleration):

    | q m(x) + A (s(x) - m(x) Phi^T p / omega²) |

with the phase of q to A in it, and s(x) the bending moment under a unit load at rest: 1 of end
moments. The stress is ``6/h²`` of that, and ``1/h`` of the mode's normal force.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from microslip.brief import Brief
from microslip.describe.lap import LapJoint
from microslip.errors import Caution
from microslip.model.lap import materials
from microslip.model.modes import static_shape
from microslip.model.stress import Sections, deflection, sections_outside
from microslip.pipeline.estimate import (
    elastic_limit,
    estimate,
    input_cautions,
    overbent,
    overpressed,
    overstressed,
    slip_length,
)
from microslip.pipeline.motions import Motion
from microslip.pipeline.run import Run
from microslip.registry import column
from microslip.typing import Array

FEWEST_SLIPPING = 3.0
"""Contact pairs that a slip zone must span for its damping to be resolved."""


@dataclass(frozen=True, repr=False)
class Judgement(Brief):
    """Stresses and deflection of a run, and all that should be doubted of it.

    Attributes
    ----------
    stress : float
        Largest nominal bending stress of all motions, Pa; nan where there is none, or none is known.
    where : str
        Motion that has it; of the largest deflection where no stress is known.
    deflection : float
        Largest deflection, m.
    stress_per_amplitude : float
        Of the sliding mode, Pa per kg^0.5 m^0.5.
    deflection_per_amplitude : float
        Of the sliding mode, m per kg^0.5 m^0.5.
    elastic_limit : float
        Stress that it is judged by, Pa.
    elastic_moment : float
        End moment at rest that reaches it, N m per metre of width; nan where something else drives the
        joint.
    pressure : float
        Largest contact pressure under the clamp alone, Pa.
    cautions : tuple of Caution
    """

    stress: float
    where: str
    deflection: float
    stress_per_amplitude: float
    deflection_per_amplitude: float
    elastic_limit: float
    elastic_moment: float
    pressure: float
    cautions: tuple[Caution, ...]


def judge(run: Run) -> Judgement:
    """Stresses and deflection of a run, and all that should be doubted of it.

    Of a joint whose stresses are not known, as those of foreign matrices, they are nan.
    """
    joint = run.joint
    if isinstance(joint, LapJoint):
        return _judge_beams(run, joint)
    none = np.nan
    cautions = (*run.assembly.doubts, *run.cautions)
    pressure = float(run.prestress.pressure.max())
    return Judgement(none, "", none, none, none, none, none, pressure, cautions)


def _judge_beams(run: Run, joint: LapJoint) -> Judgement:
    """Of a lap joint: its beams bend."""
    mode = run.mode
    shape = run.assembly.states.sliding
    sections = sections_outside(run.structure, materials(joint), shape)
    share = mode.load_on_sliding[run.prepared.drive] / mode.sliding_omega**2
    direct = _moment_at_rest(run, joint)
    bent = deflection(run.structure, shape)
    motions = motions_of(run) if run.structure.meshes else []
    stresses = [stress_of(motion, sections, share, direct) for motion in motions]
    moved = [abs(motion.amplitude) * bent for motion in motions]
    top = int(np.argmax(stresses if len(sections.position) else moved)) if motions else -1
    limit, _ = elastic_limit(joint)
    pressure = float(run.prestress.pressure.max())
    return Judgement(
        stress=stresses[top] if motions else np.nan,
        where=f"{motions[top].analysis}, {motions[top].where}" if motions else "",
        deflection=max(moved, default=np.nan),
        stress_per_amplitude=max(sections.stress, default=np.nan),
        deflection_per_amplitude=bent,
        elastic_limit=limit,
        elastic_moment=limit * min(joint.beams.thicknesses) ** 2 / 6
        if joint.driven_by_end_moments
        else np.nan,
        pressure=pressure,
        cautions=(
            *input_cautions(joint, estimate(joint)),
            *overpressed(joint, "prestress", "largest contact pressure", pressure),
            *run.cautions,
            *_unknown(motions, sections),
            *_worst(run, joint, motions, stresses, moved),
        ),
    )


def motions_of(run: Run) -> list[Motion]:
    """Largest motions of every analysis that found something."""
    return [
        motion
        for row, motions in column("motions")
        if run.value(row.name) is not None
        for motion in motions(run)
    ]


def stress_of(
    motion: Motion, sections: Sections, share: float, direct: Array | float = 1.0
) -> float:
    """Largest nominal bending stress in a motion, Pa; nan without any section beside the overlap.

    Parameters
    ----------
    motion : Motion
    sections : Sections
        Of the sliding mode.
    share : float
        Its static amplitude per unit load, ``Phi^T p / omega²``.
    direct : (k,) array or float
        Bending moment under a unit load at rest.
    """
    q, h = motion.amplitude, sections.thickness
    moment = q * sections.moment + motion.load * (direct - sections.moment * share)
    if not len(h):
        return np.nan
    return float((np.abs(q * sections.force) / h + 6 * np.abs(moment) / h**2).max())


def _moment_at_rest(run: Run, joint: LapJoint) -> Array | float:
    """Bending moment of every section under a unit load on the driven port, without friction, at rest."""
    if joint.driven_by_end_moments:
        return 1.0
    shape = static_shape(run.structure, run.prestress.bonded(1), run.prepared.drive)
    return sections_outside(run.structure, materials(joint), shape).moment


def _unknown(motions: list[Motion], sections: Sections) -> list[Caution]:
    """That nothing is judged by its stress, where the overlap takes up both beams."""
    if not motions or len(sections.position):
        return []
    return [
        Caution(
            motions[0].analysis,
            "",
            "the bending stress is not known: both beams lie within the overlap, where they share the moment",
            "make the beams longer than the overlap; the elastic limit is not looked at",
        )
    ]


def _worst(
    run: Run, joint: LapJoint, motions: list[Motion], stresses: list[float], moved: list[float]
) -> list[Caution]:
    """The worst of each analysis, where it is too much."""
    found: list[Caution] = []
    for analysis in dict.fromkeys(motion.analysis for motion in motions):
        mine = [k for k, motion in enumerate(motions) if motion.analysis == analysis]
        top = max(mine, key=lambda k: (np.nan_to_num(stresses[k]), moved[k]))
        where = motions[top].where
        found += overstressed(joint, analysis, where, stresses[top])
        found += overbent(joint, analysis, where, moved[top])
        found += _unresolved(run, joint, motions[top], stresses[top])
    return found


def _unresolved(run: Run, joint: LapJoint, motion: Motion, stress: float) -> list[Caution]:
    """That so little slips that the contact pairs do not show it."""
    if joint.friction == 0 or not stress > 0 or motion.analysis == "cycle":
        return []
    moment = stress * min(joint.beams.thicknesses) ** 2 / 6
    spacing = float(np.diff(run.model.position).max())
    pairs = slip_length(joint, moment) / spacing
    if pairs >= FEWEST_SLIPPING:
        return []
    return [
        Caution(
            motion.analysis,
            motion.where,
            f"the slip zone is about {pairs:.1f} contact pairs wide: its damping is not resolved",
            f"raise contact.pairs to {joint.contact.pairs_used * FEWEST_SLIPPING / pairs:.0f}, "
            "or raise the load",
        )
    ]
