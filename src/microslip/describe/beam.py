"""What beam theory says of a described joint, in closed form."""

from __future__ import annotations

import math

from microslip.describe.lap import LapJoint

FIRST = {
    ("pinned", "pinned"): math.pi**2,
    ("clamped", "free"): 3.516015,
    ("clamped", "pinned"): 15.41821,
    ("free", "pinned"): 15.41821,
    ("clamped", "clamped"): 22.37329,
    ("free", "free"): 22.37329,
}
"""``(beta l)²`` of the first bending mode of a uniform beam by its ends, in alphabetical order."""


def plane_moduli(joint: LapJoint) -> tuple[float, float]:
    """``E' = E/(1 - nu²)`` in plane strain, E in plane stress, of the lower and the upper beam, Pa."""
    m = joint.material
    if m.plane == "stress":
        return m.moduli
    lower, upper = (E / (1 - nu**2) for E, nu in zip(m.moduli, m.ratios, strict=True))
    return lower, upper


def bending_stiffnesses(joint: LapJoint) -> tuple[float, float]:
    """``E'h³/12`` of the lower and the upper beam, N m² per metre of width."""
    sizes = zip(plane_moduli(joint), joint.beams.thicknesses, strict=True)
    lower, upper = (modulus * h**3 / 12 for modulus, h in sizes)
    return lower, upper


def span(joint: LapJoint) -> float:
    """Distance of the far ends, m."""
    return sum(joint.beams.lengths) - 2 * joint.beams.overlap_half_length


def first_frequency(joint: LapJoint) -> float:
    """First bending frequency of a uniform beam as long as the joint on its supports, Hz.

    ``f = c/(2 pi) sqrt(E'I / (rho h)) / l²``, ``c = pi²`` where both ends are pinned: what the
    joint would have if it were one beam of a single thickness, within some ten per cent of the sliding
    frequency. Of different beams their compliance and their mass per length are averaged.

    Examples
    --------
    >>> from microslip.describe.reference import reference_joint
    >>> round(first_frequency(reference_joint()), 1)
    191.9
    """
    lengths, thick, metal = joint.beams.lengths, joint.beams.thicknesses, joint.material
    shares = [length / sum(lengths) for length in lengths]
    give = sum(s / EI for s, EI in zip(shares, bending_stiffnesses(joint), strict=True))
    mass = sum(s * rho * h for s, rho, h in zip(shares, metal.densities, thick, strict=True))
    ends = sorted((joint.support.left, joint.support.right))
    factor = FIRST[ends[0], ends[1]] / (2 * math.pi)
    return factor / math.sqrt(give * mass) / span(joint) ** 2


def surface_stress(joint: LapJoint, moment: float) -> float:
    """``6 M / h²``: largest bending stress of the thinner beam under a moment per width, Pa.

    Examples
    --------
    >>> from microslip.describe.reference import reference_joint
    >>> round(surface_stress(reference_joint(), 60.0))
    2304000
    """
    return 6 * moment / min(joint.beams.thicknesses) ** 2
