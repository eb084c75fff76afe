"""The lap joint by beam theory: what it will be like, in milliseconds and without a mesh.

Two Timoshenko beams, each an axial displacement u, a deflection w and a rotation theta along its own
axis. Where they are in contact the faces that meet move together in the normal direction (sliding),
or in both (stuck):

    w_l = w_u,                                         sliding
    u_l - h_l/2 theta_l = u_u + h_u/2 theta_u          stuck, as well

Supports and loads are those of `microslip.model.lap`: far ends pinned on springs that are spread over
their faces, clamped or free, and equal and opposite end moments. How far the contact reaches is an
estimate: beyond the clamp by `SPREAD` of the thickness.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import scipy.linalg as la

from microslip.brief import Brief
from microslip.describe.lap import WEAKEST_SPRING
from microslip.model.elasticity import Material
from microslip.model.end_loads import CLAMPED, FREE, PINNED
from microslip.model.lap_mesh import LapGeometry
from microslip.typing import Array

SPREAD = 0.35
"""Length of contact beyond the edge of the clamp, over the thickness: of two beams of one material that
are pressed over more than their thickness it hardly depends on anything else."""

SHEAR = 5 / 6
"""Shear correction of a rectangular section."""

ELEMENTS = 16
"""Per piece of a beam: outside the overlap, of the overlap outside the contact, in contact."""

SHORTEST = 0.25
"""Shortest element of a piece that has several, over the thickness; contact that ends nearer to the edge of
the overlap reaches it. Shorter ones say no more, and their rounding hides the softest modes."""

ON_SPRINGS, NOTHING = 0.5, 1e-12
"""Share of the energy in the springs of free ends beyond which a mode does not bend the beams; least square
of a frequency, over the largest, that is none of rounding."""


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
        that moment: at resonance it is this over twice the damping ratio. nan where nothing is beside it.
    """

    sliding_frequency: float
    stuck_frequency: float
    deflection: float
    modal_share: float


@dataclass(frozen=True, repr=False)
class _Frame(Brief):
    """Both beams as one set of degrees of freedom, (u, w, theta) at every node.

    Attributes
    ----------
    stiffness, mass, springs : (n, n) arrays
        The springs, of free ends alone, are part of the first.
    moment, middle : (n,) arrays
        Load of the end moments, and displacement at the middle of the joint.
    held : (s, n) array
        What the supports hold.
    together : list of (lower, upper) node
        In contact.
    beside : list of (node, length, bending stiffness)
        Elements beside the overlap, by their first node.
    """

    stiffness: Array
    mass: Array
    springs: Array
    moment: Array
    middle: Array
    held: Array
    together: list[tuple[int, int]]
    beside: list[tuple[int, float, float]]


def beam_estimate(
    geometry: LapGeometry,
    material: Material | tuple[Material, Material],
    horizontal_spring: float,
    *,
    ends: tuple[str, str] = (PINNED, PINNED),
    weak_spring: float = 0.0,
) -> BeamEstimate:
    """Frequencies and deflection of a lap joint of two beams.

    Parameters
    ----------
    geometry, material, horizontal_spring, ends, weak_spring
        As for `microslip.model.lap.lap_joint_structure`.
    """
    both = (material, material) if isinstance(material, Material) else material
    axial = [
        m.youngs_modulus * h / l
        for m, h, l in zip(both, geometry.thicknesses, geometry.lengths, strict=True)
    ]
    least = WEAKEST_SPRING * max(axial)
    springs = max(horizontal_spring, least), max(weak_spring, least)
    frame = _frame(geometry, both, ends, springs)
    size, halves = len(frame.mass), [0.5 * h for h in geometry.thicknesses]
    sliding, stuck = [*frame.held], []
    for lower, upper in frame.together:
        row = np.zeros(size)
        row[[3 * lower + 1, 3 * upper + 1]] = 1.0, -1.0
        sliding.append(row)
        row = np.zeros(size)
        places = [3 * lower, 3 * lower + 2, 3 * upper, 3 * upper + 2]
        row[places] = 1.0, -halves[0], -1.0, -halves[1]
        stuck.append(row)
    basis = la.null_space(np.array(sliding))
    give = la.solve(basis.T @ frame.stiffness @ basis, basis.T @ frame.moment, assume_a="sym")
    frequency, shape = _mode(frame, basis)
    stuck_frequency, _ = _mode(frame, la.null_space(np.array(sliding + stuck)))
    share = _carried(frame, shape) * abs(frame.moment @ shape) / (2 * np.pi * frequency) ** 2
    deflection = abs(float(frame.middle @ basis @ give))
    return BeamEstimate(frequency, stuck_frequency, deflection, float(share))


def _mode(frame: _Frame, basis: Array) -> tuple[float, Array]:
    """The mode with the largest static response to the end moments: frequency, Hz, and shape.

    Not one that only moves the beams on weak springs (`ON_SPRINGS`).
    """
    stiffness, mass = (basis.T @ M @ basis for M in (frame.stiffness, frame.mass))
    values, shapes = la.eigh(stiffness, mass)
    drawn = np.einsum("ij,ij->j", shapes, basis.T @ frame.springs @ basis @ shapes)
    bends = (values > NOTHING * values[-1]) & (drawn <= ON_SPRINGS * values)
    response = np.where(bends, np.abs(frame.moment @ basis @ shapes), 0.0)
    values = np.maximum(values, NOTHING * values[-1])
    k = int(np.argmax(response / values))
    return float(np.sqrt(values[k]) / (2 * np.pi)), basis @ shapes[:, k]


def _carried(frame: _Frame, shape: Array) -> float:
    """Largest bending moment of a shape in the beams beside the overlap; nan where nothing is."""
    turns = shape[2::3]
    moments = [EI * abs(turns[k + 1] - turns[k]) / length for k, length, EI in frame.beside]
    return float(max(moments, default=np.nan))


def _frame(
    g: LapGeometry,
    materials: tuple[Material, Material],
    ends: tuple[str, str],
    stiffnesses: tuple[float, float],
) -> _Frame:
    """Both beams on their supports; `stiffnesses` are of the springs of a pinned end, and of a free one."""
    least = SHORTEST * min(g.thicknesses)
    half, (left, right) = g.overlap_half_length, _contact(g, least)
    shared = [-half, left, right, half]
    nodes = (
        _nodes([half - g.lengths[0], *shared], least),
        _nodes([*shared, g.lengths[1] - half], least),
    )
    count = len(nodes[0])
    size = 3 * (count + len(nodes[1]))
    stiffness, mass, springs = (np.zeros((size, size)) for _ in range(3))
    beside = []
    tol = 1e-9 * max(g.lengths)
    sizes = zip((0, count), nodes, g.thicknesses, materials, strict=True)
    for offset, x, thickness, material in sizes:
        for k, length in enumerate(np.diff(x)):
            place = 3 * (offset + k) + np.arange(6)
            own, inertia = timoshenko(length, thickness, material)
            stiffness[np.ix_(place, place)] += own
            mass[np.ix_(place, place)] += inertia
            if abs(0.5 * (x[k] + x[k + 1])) > half + tol:
                bending = material.plane_modulus() * thickness**3 / 12
                beside.append((offset + k, float(length), bending))
    moment, middle, held = np.zeros(size), np.zeros(size), []
    far = (0, count + len(nodes[1]) - 1)
    for end, kind, thickness, sign in zip(far, ends, g.thicknesses, (-1.0, 1.0), strict=True):
        moment[3 * end + 2] = sign
        spring = {PINNED: stiffnesses[0], FREE: stiffnesses[1], CLAMPED: 0.0}[kind]
        across = spring if kind == FREE else 0.0
        own = np.array([spring, across, spring * thickness**2 / 12])
        place = 3 * end + np.arange(3)
        stiffness[place, place] += own
        if kind == FREE:
            springs[place, place] += own
        for component in {PINNED: (1,), CLAMPED: (0, 1, 2), FREE: ()}[kind]:
            held.append(np.eye(1, size, 3 * end + component)[0])
    touching = np.flatnonzero((nodes[0] >= left - tol) & (nodes[0] <= right + tol))
    partners = [count + int(np.argmin(np.abs(nodes[1] - nodes[0][k]))) for k in touching]
    middle[3 * int(np.argmin(np.abs(nodes[0]))) + 1] = 1.0
    together = list(zip(map(int, touching), partners, strict=True))
    fixed = np.array(held).reshape(-1, size)
    return _Frame(stiffness, mass, springs, moment, middle, fixed, together, beside)


def _nodes(marks: list[float], least: float) -> Array:
    """Nodes from mark to mark, `ELEMENTS` in between or as many as are no shorter than `least`."""
    tol = 1e-9 * (marks[-1] - marks[0])
    pieces = [
        np.linspace(a, b, min(max(int((b - a) / least), 1), ELEMENTS) + 1)
        for a, b in pairwise(marks)
        if b - a > tol
    ]
    return np.unique(np.concatenate(pieces).round(15))


def _contact(g: LapGeometry, least: float) -> tuple[float, float]:
    """Ends of the contact under the clamp, m; the edge of the overlap where that is nearer than `least`."""
    reach = g.clamp_half_length + SPREAD * sum(g.thicknesses) / 2
    half = g.overlap_half_length
    left, right = g.clamp_centre - reach, g.clamp_centre + reach
    return (
        -half if left + half < least else left,
        half if half - right < least else right,
    )


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
