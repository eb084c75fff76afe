"""Whether reactions can balance what a preload does on motions that nothing else holds: linear programs.

Motions of bodies that no support holds do no elastic work: whatever loads do on them, reactions within the
cones of friction must do, those of contact without friction along the normals alone.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.optimize import linprog

from microslip.contact.pairs import by_pair, normal_rows
from microslip.model.flexibility import Flexibility
from microslip.model.joint import JointModel
from microslip.typing import Array

ROUNDING = 1e-6
"""Of the largest singular value: directions with a smaller one are rounding. Rigid motions that come from
eigenvectors, or were fitted to reduced coordinates, are known to the root of the machine's."""

SLIDING = 0.2
"""Share of a motion along the normals of the pairs up to which it slides the bodies past each other."""

FLAT = 1e-5
"""The same up to which no pressure resists it: what is more is a slope, however gentle."""

ACROSS = 1e-6
"""Share of a load's work on motions that slide, up to which what it does on those that part is none."""

FACETS = 16
"""Edges of the pyramid that stands for a round cone of friction, on it."""

AROUND = 64
"""Edges of the pyramid around a round cone."""

SOLVED, UNBOUNDED = 0, 3
"""Outcomes of a linear program."""


PULLED = "the preload pulls bodies apart: no pressure between them balances it, and no support does"
"""What is said of loads for which `parts_bodies`."""


def pulled_apart(model: JointModel, amplitudes: Array) -> bool:
    """Whether loads do work on motions that part bodies, which no support and no pressure balances.

    Of the motions that no support holds (`microslip.model.loose`).

    Parameters
    ----------
    model : JointModel
    amplitudes : (p,) array
        Of all ports.
    """
    loose = model.loose_motions
    work = amplitudes @ model.port_modes[:loose].T
    size = float(
        (np.abs(amplitudes) * np.abs(model.port_modes).max(axis=0, initial=0.0)).max(initial=0.0)
    )
    return parts_bodies(model.mode_v[:, :loose], model.dimension, work, size)


def parts_bodies(motions_v: Array, dimension: int, work: Array, scale: float) -> bool:
    """Whether no pressure balances the work of loads on motions that part bodies.

    Those of the motions that part the sides of pairs are asked, by a linear program: the least that is left
    of the work of the loads by any reactions ``r_n >= 0``. Motions that slide are left to friction.

    Parameters
    ----------
    motions_v : (d m, l) array
        Relative displacements of the motions, which nothing else holds.
    dimension : int
    work : (l,) array
        Of the loads.
    scale : float
        Size of the sums that work comes from: what is less by far is rounding.
    """
    parting, _ = opening_motions(motions_v, dimension)
    given = work @ parting
    size = np.abs(given).max(initial=0.0)
    if not size > ROUNDING * scale:
        return False
    pressed = (motions_v @ parting)[normal_rows(dimension)].T
    pressed /= np.abs(pressed).max()
    some = np.eye(len(given))
    found = linprog(
        np.r_[np.zeros(pressed.shape[1]), np.ones(2 * len(given))],
        A_eq=np.hstack([pressed, some, -some]),
        b_eq=given / size,
        bounds=(0, None),
        method="highs",
    )
    return bool(found.status == SOLVED and found.fun > ACROSS)


def friction_taken(model: JointModel, amplitudes: Array, friction: Array | float) -> float:
    """Share of what friction can hold that loads take by sliding bodies past each other (limit analysis).

    With ``g_p`` and ``g_s`` the work of the loads on motions that part the bodies and on those that slide
    them, it is 1/t of the largest t for which reactions within the cones of friction do the work
    ``g_p`` and ``t g_s``. Above 1 no friction holds the bodies, infinite where no pressure balances loads.
    Round cones are taken up to 0.13 % too wide.

    Parameters
    ----------
    model : JointModel
    amplitudes : (p,) array
        Of all ports.
    friction : (m,) array or float
        Coefficient of every pair.
    """
    found = _sliding(model, amplitudes)
    if found is None:
        return 0.0
    basis, work, slid = found
    motions = model.mode_v[:, : len(basis)]
    unit = np.abs(work).max()
    wider = np.broadcast_to(friction, model.pairs) / np.cos(np.pi / AROUND)
    cones = within_cones(motions @ basis, wider, model.dimension, AROUND)
    found = linprog(
        np.r_[np.zeros(cones.shape[1]), -1.0],
        A_eq=np.hstack([cones / np.abs(cones).max(), -slid[:, None] / unit]),
        b_eq=(work - slid) / unit,
        bounds=(0, None),
        method="highs",
    )
    if found.status == UNBOUNDED:
        return 0.0
    return float(1 / found.x[-1]) if found.status == SOLVED and found.x[-1] > 0 else np.inf


def leans(model: JointModel, amplitudes: Array, least: float = SLIDING) -> bool:
    """Whether loads do work on motions that slide bodies past each other along slopes, gentle ones as a rule.

    As the force that presses a taper into its seat: pressure may balance it, friction takes most of it.

    Parameters
    ----------
    model : JointModel
    amplitudes : (p,) array
        Of all ports.
    least : float
        Share of the motions along the normals up to which slopes count, see `opening_motions`.
    """
    gentle = _sliding(model, amplitudes, least)
    if gentle is None:
        return False
    level = _sliding(model, amplitudes, FLAT)
    left = 0.0 if level is None else float(np.abs(level[2]).max())
    return float(np.abs(gentle[2]).max()) > left + ACROSS * float(np.abs(gentle[1]).max())


def without_slide(
    model: JointModel, amplitudes: Array, loads_q: Array, least: float = SLIDING
) -> Array:
    """Loads on the coordinates of equilibrium without their work on motions that slide bodies.

    Without friction nothing holds these motions: they stay where they are (inertia relief).

    Parameters
    ----------
    model : JointModel
    amplitudes : (p,) array
        Of all ports.
    loads_q : (e,) array
        What they are on the coordinates, of which the first belong to the motions that nothing holds.
    least : float
        See `opening_motions`.
    """
    found = _sliding(model, amplitudes, least)
    if found is None:
        return loads_q
    basis, _, slid = found
    out = loads_q.copy()
    out[: len(basis)] -= np.linalg.lstsq(basis.T, slid, rcond=None)[0]
    return out


def without_sliding(
    model: JointModel, flexibility: Flexibility, least: float
) -> tuple[Flexibility, Array]:
    """A flexibility in which loose motions that slide bodies past each other stay at zero.

    Without friction only the springs that keep a place would hold them, against pressures that lean by
    rounding.

    Parameters
    ----------
    model : JointModel
    flexibility : Flexibility
        Static.
    least : float
        Share of a motion along the normals from which on it stays free, see `opening_motions`.

    Returns
    -------
    Flexibility
        With fewer coordinates z; loads on ports as before.
    (e, f) array
        C, ``q = C z``, orthonormal columns.
    """
    loose, e = model.loose_motions, len(flexibility.stiffness)
    if not loose:
        return flexibility, np.eye(e)
    parting, sliding = _against_each_other(model, least)
    if not sliding.shape[1]:
        return flexibility, np.eye(e)
    free = np.linalg.qr(parting)[0]
    C = np.zeros((e, free.shape[1] + e - loose))
    C[:loose, : free.shape[1]] = free
    C[loose:, free.shape[1] :] = np.eye(e - loose)
    fewer = replace(
        flexibility,
        R=np.ascontiguousarray(flexibility.R @ C),
        stiffness=(flexibility.stiffness[:, None] * C**2).sum(axis=0),
        loads_q=C.T @ flexibility.loads_q,
    )
    return fewer, C


def _against_each_other(model: JointModel, least: float) -> tuple[Array, Array]:
    """`opening_motions` of the loose motions; none where they move pairs by rounding."""
    v = model.mode_v[:, : model.loose_motions]
    if np.abs(v).max(initial=0.0) <= ROUNDING * np.abs(model.mode_v).max(initial=0.0):
        v = np.zeros_like(v)
    return opening_motions(v, model.dimension, least)


def unheld(
    model: JointModel,
    flexibility: Flexibility,
    loads_q: Array,
    r: Array,
    q: Array,
    friction: Array | float,
) -> float:
    """What is missing to equilibrium along motions that slide bodies, over what friction can do there.

    Parameters
    ----------
    model : JointModel
    flexibility : Flexibility
        Static.
    loads_q : (e,) array
        Loads on the coordinates of equilibrium.
    r, q : arrays
        Reactions and coordinates.
    friction : (m,) array or float
        Coefficient of every pair.
    """
    loose, d = model.loose_motions, model.dimension
    _, sliding = _against_each_other(model, SLIDING)
    if not sliding.shape[1]:
        return 0.0
    missing = (loads_q - flexibility.stiffness * q - flexibility.R.T @ r)[:loose] @ sliding
    slid = np.linalg.norm(by_pair((model.mode_v[:, :loose] @ sliding).T, d)[..., 1:], axis=-1)
    most = slid @ (np.broadcast_to(friction, model.pairs) * np.maximum(by_pair(r, d)[:, 0], 0.0))
    return float((np.abs(missing) / np.maximum(most, 1e-300)).max())


def _sliding(
    model: JointModel, amplitudes: Array, least: float = SLIDING
) -> tuple[Array, Array, Array] | None:
    """Combinations (columns) of loose motions that move bodies against each other, the work of loads on them,
    and the part of it on those that slide; None where that is rounding."""
    loose = model.loose_motions
    if not loose:
        return None
    parting, sliding = opening_motions(model.mode_v[:, :loose], model.dimension, least)
    basis = np.hstack([parting, sliding])
    work = amplitudes @ (model.port_modes[:loose].T @ basis)
    slid = np.where(np.arange(len(work)) < parting.shape[1], 0.0, work)
    # of all modes: what a port does on motions that do not feel it is rounding
    size = np.abs(amplitudes) * np.abs(model.port_modes).max(axis=0)
    least = ROUNDING * size.max(initial=0.0) * np.abs(basis).max(initial=0.0)
    return (basis, work, slid) if np.abs(slid).max(initial=0.0) > least else None


def edges_of_cone(dimension: int, facets: int) -> Array:
    """(k, d - 1) unit tractions at the edges of a cone of friction; in space it has so many."""
    if dimension == 2:
        return np.array([[1.0], [-1.0]])
    angles = 2 * np.pi * np.arange(facets) / facets
    return np.column_stack([np.cos(angles), np.sin(angles)])


def within_cones(motions: Array, friction: Array, dimension: int, facets: int = FACETS) -> Array:
    """(f, c) work on motions of reactions whose sums with weights >= 0 are the cones of friction.

    In space these have so many edges on the round cone.
    """
    v = by_pair(motions.T, dimension)
    normal_work, slid = v[..., 0], v[..., 1:]
    if np.abs(slid).max(initial=0.0) <= ROUNDING * np.abs(v).max(initial=0.0):
        return normal_work
    edges = edges_of_cone(dimension, facets)
    return np.hstack([normal_work + friction * (slid @ edge) for edge in edges])


def opening_motions(v: Array, dimension: int, least: float = SLIDING) -> tuple[Array, Array]:
    """Combinations (columns) of rigid motions that part the sides of pairs, and of those that slide them past
    each other; the others move all bodies together.

    Of orthonormal motions of the pairs those that move them less than `least` along their normals slide;
    the rest is orthogonal to these in the tangential directions too, so that shear of a flat interface does
    no work on it.
    """
    moved, size, directions = np.linalg.svd(v, full_matrices=False)
    known = size > ROUNDING * size.max(initial=1e-300)
    if not known.any():
        return np.zeros((v.shape[1], 0)), np.zeros((v.shape[1], 0))
    along = np.linalg.qr(moved[normal_rows(dimension)][:, known], mode="r")
    _, share, mixed = np.linalg.svd(along)
    parts = int((share > least).sum())
    relative = directions[known].T / size[known] @ mixed.T
    return relative[:, :parts], relative[:, parts:]
