"""What beam theory says of a described joint, in closed form."""

from __future__ import annotations

import math

from microslip.describe.lap import LapJoint


def plane_modulus(joint: LapJoint) -> float:
    """``E' = E/(1 - nu²)`` in plane strain, E in plane stress, Pa."""
    m = joint.material
    return m.youngs_modulus if m.plane == "stress" else m.youngs_modulus / (1 - m.poissons_ratio**2)


def bending_stiffness(joint: LapJoint) -> float:
    """``E'h³/12`` of one beam, N m² per metre of width."""
    return plane_modulus(joint) * joint.beams.thickness**3 / 12


def first_frequency(joint: LapJoint) -> float:
    """First bending frequency of a beam as long as the joint on its supports, Hz.

    ``f = pi/2 sqrt(E'I / (rho h)) / (2 (L - L_o))²``: what the joint would have if it were one
    beam of a single thickness, within some ten per cent of the sliding frequency.

    Examples
    --------
    >>> from microslip.describe.reference import reference_joint
    >>> round(first_frequency(reference_joint()), 1)
    191.9
    """
    mass = joint.material.density * joint.beams.thickness
    span = 2 * (joint.beams.length - joint.beams.overlap_half_length)
    return math.pi / 2 * math.sqrt(bending_stiffness(joint) / mass) / span**2


def surface_stress(joint: LapJoint, moment: float) -> float:
    """``6 M / h²``: largest bending stress of one beam under a moment per width, Pa.

    Examples
    --------
    >>> from microslip.describe.reference import reference_joint
    >>> round(surface_stress(reference_joint(), 60.0))
    2304000
    """
    return 6 * moment / joint.beams.thickness**2
