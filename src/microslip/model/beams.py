"""The lap joint by beam theory: what it will be like, in milliseconds and without a mesh.

Two Timoshenko beams, each an axial displacement u, a deflection w and a rotation theta along its own
axis. Where they are in contact the faces that meet move together in the normal direction (sliding),
or in both (stuck):

    w_l = w_u,                                     sliding
    u_l - h/2 theta_l = u_u + h/2 theta_u          stuck, as well

Supports and loads are those of `microslip.model.lap`: w = 0 at both far ends, springs spread over the
end faces, equal and opposite end moments. How far the contact reaches is an estimate: beyond the clamp
by `SPREAD` of the thickness.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy.linalg as la

from microslip.brief import Brief
from microslip.model.elasticity import Material
from microslip.model.lap_mesh import LapGeometry
from microslip.typing import Array

SPREAD = 0.35
"""Length of contact beyond the edge of the clamp, over the thickness: of two beams of one material that
are pressed over more than their thickness it hardly depends on anything else."""

WEAKEST_SPRING = 1e-7
"""Of the axial stiffness of a beam: weaker springs, or none, leave the mean position undetermined."""

SHEAR = 5 / 6
"""Shear correction of a rectangular section."""

ELEMENTS = 16
"""Per piece of a beam: outside the overlap, of the overlap outside the contact, in contact."""


@dataclass(frozen=True, repr=False)
class BeamEstimate(Brief):
    """What beam theory says of a lap joint.

    Attributes
    ----------
    sliding_frequency, stuck_frequency : float
        Of the mode that the end moments drive most, Hz.
    deflection : float
        At the middle of the joint without friction, m per unit end moment (N m/m).
    modal_share : float
        Largest moment beside the overlap that the sliding mode carries of an end moment at rest, over
        that moment: at resonance it is this over twice the damping ratio.
    """

    sliding_frequency: float
    stuck_frequency: float
    deflection: float
    modal_share: float


def beam_estimate(
    geometry: LapGeometry, material: Material, horizontal_spring: float
) -> BeamEstimate:
    """Frequencies and deflection of a lap joint of two beams.

    Parameters
    ----------
    geometry, material
        As for `microslip.model.lap.lap_joint_structure`.
    horizontal_spring : float
        N/m per metre of width, at each far end.
    """
    axial = material.youngs_modulus * geometry.thickness / geometry.length
    spring = max(horizontal_spring, WEAKEST_SPRING * axial)
    stiffness, mass, lower, upper = _beams(geometry, material, spring)
    moment, middle, ties = _loads_and_ties(geometry, lower, upper, len(mass))
    half = geometry.thickness / 2
    stuck = ties.copy()
    for tie in ties[2:]:
        l, u = np.flatnonzero(tie) - 1  # u beside w of each beam
        row = np.zeros(len(mass))
        row[[l, l + 2, u, u + 2]] = 1.0, -half, -1.0, -half
        stuck = np.vstack([stuck, row])
    sliding, shape = _mode(stiffness, mass, moment, ties)
    stuck_frequency, _ = _mode(stiffness, mass, moment, stuck)
    basis = la.null_space(ties)
    bent = basis @ la.solve(basis.T @ stiffness @ basis, basis.T @ moment, assume_a="sym")
    curvature = np.diff(shape[3 * np.arange(len(lower)) + 2]) / np.diff(lower)
    beside = lower[1:] <= -geometry.overlap_half_length * (1 - 1e-9)
    bending = material.plane_modulus() * geometry.thickness**3 / 12
    carried = bending * np.abs(curvature[beside]).max(initial=0.0)
    share = carried * abs(moment @ shape) / (2 * np.pi * sliding) ** 2
    return BeamEstimate(sliding, stuck_frequency, abs(float(middle @ bent)), float(share))


def _mode(stiffness: Array, mass: Array, moment: Array, ties: Array) -> tuple[float, Array]:
    """The mode with the largest static response to the end moments: frequency, Hz, and shape."""
    basis = la.null_space(ties)
    values, shapes = la.eigh(basis.T @ stiffness @ basis, basis.T @ mass @ basis)
    values = np.maximum(values, 1e-12 * values[-1])
    response = np.abs(moment @ basis @ shapes) / values
    k = int(np.argmax(response))
    return float(np.sqrt(values[k]) / (2 * np.pi)), basis @ shapes[:, k]


def _beams(
    geometry: LapGeometry, material: Material, spring: float
) -> tuple[Array, Array, Array, Array]:
    """Stiffness, mass, and the nodes of the lower and the upper beam."""
    g = geometry
    reach = _reach(g)
    marks = [g.overlap_half_length - g.length, -g.overlap_half_length, -reach, reach]
    marks.append(g.overlap_half_length)
    pieces = [
        np.linspace(a, b, ELEMENTS + 1) for a, b in pairwise(marks) if b - a > 1e-9 * g.length
    ]
    lower = np.unique(np.concatenate(pieces).round(15))
    upper = -lower[::-1]
    size = 3 * (len(lower) + len(upper))
    stiffness, mass = np.zeros((size, size)), np.zeros((size, size))
    for offset, x in ((0, lower), (len(lower), upper)):
        for k, length in enumerate(np.diff(x)):
            place = 3 * (offset + k) + np.arange(6)
            own, inertia = timoshenko(length, g.thickness, material)
            stiffness[np.ix_(place, place)] += own
            mass[np.ix_(place, place)] += inertia
    for end in (0, len(lower) + len(upper) - 1):
        stiffness[3 * end, 3 * end] += spring
        stiffness[3 * end + 2, 3 * end + 2] += spring * g.thickness**2 / 12
    return stiffness, mass, lower, upper


def _reach(geometry: LapGeometry) -> float:
    """Half length of the contact under the clamp, m."""
    beyond = geometry.clamp_half_length + SPREAD * geometry.thickness
    return min(geometry.overlap_half_length, beyond)


def _loads_and_ties(
    geometry: LapGeometry, lower: Array, upper: Array, size: int
) -> tuple[Array, Array, Array]:
    """End moments, the deflection at the middle, and what is held: far ends, then w in contact."""
    last = len(lower) + len(upper) - 1
    moment, middle = np.zeros(size), np.zeros(size)
    moment[2], moment[3 * last + 2] = -1.0, 1.0
    rows = np.zeros((2, size))
    rows[0, 1] = rows[1, 3 * last + 1] = 1.0
    tol = 1e-9 * geometry.length
    touching = np.flatnonzero(np.abs(lower) <= _reach(geometry) + tol)
    for k in touching:
        partner = len(lower) + int(np.argmin(np.abs(upper - lower[k])))
        row = np.zeros(size)
        row[3 * k + 1], row[3 * partner + 1] = 1.0, -1.0
        rows = np.vstack([rows, row])
    middle[3 * int(np.argmin(np.abs(lower))) + 1] = 1.0
    return moment, middle, rows


def timoshenko(length: float, thickness: float, material: Material) -> tuple[Array, Array]:
    """Stiffness and consistent mass of a beam element with (u, w, theta) at both ends, per width.

    Exact in statics: bending and shear are in series through ``Phi = 12 E'I / (kappa G h l²)``.

    Examples
    --------
    >>> stiffness, mass = timoshenko(1.0, 0.01, Material(70e9, 0.0, 2000.0))
    >>> tip = np.linalg.solve(stiffness[3:, 3:], [0.0, 1.0, 0.0])[1]  # l³/3EI, and a little shear
    >>> bool(0 < tip * 3 * 70e9 * 0.01**3 / 12 - 1 < 1e-4)
    True
    """
    modulus = material.plane_modulus()
    shear = SHEAR * material.youngs_modulus / (2 * (1 + material.poissons_ratio))
    bending, area, l = modulus * thickness**3 / 12, thickness, length
    phi = 12 * bending / (shear * area * l**2)
    stiffness, mass = np.zeros((6, 6)), np.zeros((6, 6))
    axial, bent = np.ix_([0, 3], [0, 3]), np.ix_([1, 2, 4, 5], [1, 2, 4, 5])
    stiffness[axial] = modulus * area / l * np.array([[1.0, -1.0], [-1.0, 1.0]])
    near, far = (4 + phi) * l**2, (2 - phi) * l**2
    stiffness[bent] = (bending / ((1 + phi) * l**3)) * np.array(
        [
            [12, 6 * l, -12, 6 * l],
            [6 * l, near, -6 * l, far],
            [-12, -6 * l, 12, -6 * l],
            [6 * l, far, -6 * l, near],
        ]
    )
    per_length = material.density * area
    mass[axial] = per_length * l / 6 * np.array([[2.0, 1.0], [1.0, 2.0]])
    mass[bent] = (per_length * l / 420) * np.array(
        [
            [156, 22 * l, 54, -13 * l],
            [22 * l, 4 * l**2, 13 * l, -3 * l**2],
            [54, 13 * l, 156, -22 * l],
            [-13 * l, -3 * l**2, -22 * l, 4 * l**2],
        ]
    )
    rotary = material.density * thickness**3 / 12 / (30 * l)
    mass[bent] += rotary * np.array(
        [
            [36, 3 * l, -36, 3 * l],
            [3 * l, 4 * l**2, -3 * l, -(l**2)],
            [-36, -3 * l, 36, -3 * l],
            [3 * l, -(l**2), -3 * l, 4 * l**2],
        ]
    )
    return stiffness, mass
