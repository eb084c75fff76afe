"""What a joint file says that cannot be, or hardly: one table of ranges, each with its reason.

A number beyond what is possible is an error; one beyond what is usual is a question, asked where the
file is checked and run. Most of them are a unit that was forgotten.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from microslip.describe.beam import first_frequency
from microslip.describe.keys import sections
from microslip.describe.lap import LapJoint
from microslip.describe.units import readable
from microslip.errors import Caution


@dataclass(frozen=True)
class Usual:
    """What is usual, and what is possible, for a number of the joint file.

    Attributes
    ----------
    key : str
        To name, and to change.
    value : callable
        ``(joint) -> float``; None where there is nothing to judge.
    unit : str
        SI unit of the number.
    low, high : float
        What is usual.
    quantity : str
        What the number is, where it is not the key itself.
    most : float
        What reaches it cannot be.
    reason : str
        Why a number beyond `most` cannot be, or one that is not usual should be doubted.
    remedy : str
    """

    key: str
    value: Callable[[LapJoint], float | None]
    unit: str
    low: float
    high: float
    quantity: str = ""
    most: float = math.inf
    reason: str = ""
    remedy: str = "is the unit right? a number without one is SI"


def mean_pressure(joint: LapJoint) -> float:
    """``P / (2 L_p)``, Pa."""
    return joint.clamp.force / (2 * joint.clamp.half_length)


def pairs_across_clamp(joint: LapJoint) -> float:
    """How many contact pairs lie under the clamp."""
    spacing = 2 * joint.beams.overlap_half_length / (joint.contact.pairs_used - 1)
    return 2 * joint.clamp.half_length / spacing


def _smallest_moment(joint: LapJoint) -> float | None:
    moments = joint.load_amplitudes() if joint.driven_by_end_moments else ()
    return min(moments) / joint.clamp_force_length if moments else None


def _ratio_by_beta(joint: LapJoint) -> float:
    return math.pi * first_frequency(joint) * joint.damping.beta


def _ratio_by_alpha(joint: LapJoint) -> float:
    return joint.damping.alpha / (4 * math.pi * first_frequency(joint))


def _yield_strain(joint: LapJoint) -> float | None:
    strength = joint.material.yield_stress
    return None if strength is None else strength / joint.material.youngs_modulus


PREFIXED = ("m", "s", "Pa", "N/m")
"""Units that a message shows with an SI prefix."""

NO_VIBRATION = "with 1 or more the joint creeps back instead of vibrating"

TABLE: tuple[Usual, ...] = (
    Usual("beams.length", lambda j: j.beams.length, "m", 5e-3, 20.0),
    Usual("beams.thickness", lambda j: j.beams.thickness, "m", 1e-4, 0.5),
    Usual("beams.upper.length", lambda j: j.beams.upper.length, "m", 5e-3, 20.0),
    Usual("beams.upper.thickness", lambda j: j.beams.upper.thickness, "m", 1e-4, 0.5),
    Usual(
        "beams.thickness",
        lambda j: j.beams.length / j.beams.thickness,
        "",
        4.0,
        300.0,
        quantity="beams.length over beams.thickness",
        reason="stubby beams do not bend like beams, and very slender ones leave small rotations",
        remedy="are both units right?",
    ),
    Usual("material.youngs_modulus", lambda j: j.material.youngs_modulus, "Pa", 1e8, 1.3e12),
    Usual("material.density", lambda j: j.material.density, "kg/m^3", 50.0, 23_000.0),
    Usual(
        "material.upper.youngs_modulus",
        lambda j: j.material.upper.youngs_modulus,
        "Pa",
        1e8,
        1.3e12,
    ),
    Usual("material.upper.density", lambda j: j.material.upper.density, "kg/m^3", 50.0, 23_000.0),
    Usual(
        "material.poissons_ratio",
        lambda j: j.material.poissons_ratio,
        "",
        0.0,
        0.495,
        reason="near 0.5 a material does not change its volume, and plane strain locks",
        remedy="is this the material?",
    ),
    Usual("material.yield_stress", lambda j: j.material.yield_stress, "Pa", 1e6, 5e9),
    Usual(
        "material.yield_stress",
        _yield_strain,
        "",
        0.0,
        0.05,
        quantity="material.yield_stress over material.youngs_modulus",
        most=1.0,
        reason="a solid yields at some thousandths of its modulus",
        remedy="are both units right?",
    ),
    Usual(
        "contact.friction",
        lambda j: j.friction or None,
        "",
        0.01,
        1.3,
        reason="metals have 0.1 to 0.8",
        remedy="is the number right?",
    ),
    Usual(
        "contact.tangential_stiffness", lambda j: j.contact.tangential_stiffness, "Pa/m", 1e9, 1e17
    ),
    Usual("contact.normal_stiffness", lambda j: j.contact.normal_stiffness, "Pa/m", 1e9, 1e17),
    Usual(
        "contact.pairs",
        pairs_across_clamp,
        "",
        10.0,
        math.inf,
        quantity="the number of pairs across the clamp",
        reason="the pressure and what slips of it are not resolved",
        remedy="raise contact.pairs, or is clamp.half_length right?",
    ),
    Usual("clamp.force", lambda j: j.clamp.force, "N/m", 100.0, 1e9),
    Usual(
        "clamp.half_length",
        lambda j: j.clamp.half_length / j.beams.thickness,
        "",
        0.05,
        math.inf,
        quantity="clamp.half_length over beams.thickness",
        reason="so short a clamp is an edge, and what is pressed yields",
    ),
    Usual(
        "clamp.force",
        lambda j: mean_pressure(j) / j.material.youngs_modulus,
        "",
        1e-9,
        0.01,
        quantity="the mean pressure P/(2 half_length) over material.youngs_modulus",
        most=1.0,
        reason="what is pressed with a hundredth of its modulus yields, with all of it it is gone",
        remedy="are the units of clamp.force, clamp.half_length and material.youngs_modulus right? "
        "the force is per metre of width",
    ),
    Usual(
        "support.horizontal_spring",
        lambda j: j.support.horizontal_spring / j.material.youngs_modulus or None,
        "",
        1e-12,
        100.0,
        quantity="support.horizontal_spring over material.youngs_modulus",
        most=1e3,
        reason="an end so held is clamped already, and one held by less than that is free",
        remedy='is the unit right? an end that does not move at all is "clamped"',
    ),
    Usual(
        "damping.beta",
        _ratio_by_beta,
        "",
        0.0,
        0.1,
        quantity="the damping ratio of the first bending mode",
        most=1.0,
        reason=NO_VIBRATION,
        remedy='metals have 1e-4 to 1e-2: is the unit right, for example "0.73 us"?',
    ),
    Usual(
        "damping.alpha",
        _ratio_by_alpha,
        "",
        0.0,
        0.1,
        quantity="the damping ratio of the first bending mode",
        most=1.0,
        reason=NO_VIBRATION,
        remedy="metals have 1e-4 to 1e-2: is the unit right?",
    ),
    Usual(
        "load",
        _smallest_moment,
        "",
        1e-9,
        math.inf,
        quantity="the smallest M/(P L)",
        reason="nothing slips under so small a moment",
        remedy="is the unit right? moments are per metre of width, N*m/m",
    ),
)
"""Every range. What is usual is wide: it is left by a factor of a thousand more often than by ten."""


def impossible(joint: LapJoint) -> Iterator[tuple[str, str]]:
    """Key, and what is wrong, of everything that cannot be."""
    for row in TABLE:
        value = row.value(joint)
        if value is not None and value >= row.most:
            said = f"{row.quantity} is {value:.3g} and must be below {row.most:g}"
            yield row.key, f"{said}: {row.reason}; {row.remedy}"


def questions(joint: LapJoint) -> tuple[Caution, ...]:
    """Everything in the description of a joint that is possible, and not usual.

    Examples
    --------
    >>> from microslip.describe.reference import reference_joint
    >>> questions(reference_joint())
    ()
    """
    return tuple(
        _question(row, joint, value)
        for row in TABLE
        if (value := row.value(joint)) is not None
        and value < row.most
        and not row.low <= value <= row.high
    )


def _question(row: Usual, joint: LapJoint, value: float) -> Caution:
    seen = f"{row.quantity} is {value:.3g}; " if row.quantity else ""
    low, high = (_shown(bound, row.unit) for bound in (row.low, row.high))
    if math.isinf(row.high):
        usual = f"at least {low} is usual"
    elif row.low == 0:
        usual = f"at most {high} is usual"
    else:
        usual = f"usual is {low} to {high}"
    why = f": {row.reason}" if row.reason else ""
    return Caution("input", _with_value(joint, row.key), f"{seen}{usual}{why}", row.remedy)


def _with_value(joint: LapJoint, key: str) -> str:
    """Key and value, in SI."""
    section, _, name = key.rpartition(".")
    if not section:
        return f"[{name}]"
    path = next(s for s in sections() if s.path == section)
    unit = next(k.unit for k in path.keys if k.name == name)
    return f"{key} = {_shown(getattr(getattr(joint, section), name), unit)}"


def _shown(value: float, unit: str) -> str:
    return readable(value, unit) if unit in PREFIXED else f"{value:g} {unit}".rstrip()
