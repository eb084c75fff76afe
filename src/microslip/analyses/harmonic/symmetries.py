"""What the equations of harmonic balance are spared: the half turn, motions that only slide, free motions.

See `problem.py` for the half turn and `equations.py` for joints that walk.
"""

from __future__ import annotations

import numpy as np

from microslip.analyses.prepared.prestress import Prestress
from microslip.contact.pairs import components, normal_rows
from microslip.errors import MicroslipError
from microslip.model.joint import JointModel
from microslip.typing import Array, Indices

SLIDES = 1e-3
"""Approach, over sliding, of a motion that only slides; and sliding, over the largest, of one that does."""


def slides_last(rigid: Array, dimension: int, folded: bool) -> tuple[Array, int]:
    """Combinations of the nearly rigid modes, those that only slide last; how many do.

    Parameters
    ----------
    rigid : (d p, e) array
        Reactions of the pairs to forces on the nearly rigid modes.
    dimension : int
    folded : bool
        Whether the half turn is used: combinations that it reverses do not move and are left out.

    Examples
    --------
    A body on two pairs that can approach, tilt and slide in the plane:

    >>> rigid = np.array([[1.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, -1.0, 0.0], [0.0, 0.0, 1.0]])
    >>> combinations, count = slides_last(rigid, 2, False)
    >>> count, np.abs(combinations[:, -1]).round(12).tolist()
    (1, [0.0, 0.0, 1.0])
    """
    count = rigid.shape[1]
    if count == 0:
        return np.zeros((0, 0)), 0
    basis = np.eye(count)
    if folded:
        _, size, directions = np.linalg.svd(rigid, full_matrices=False)
        basis = directions[size > 1e-6 * size.max(initial=1e-300)].T
    sliding = np.delete(rigid, normal_rows(dimension), axis=0)
    # sideways motion of the pairs in the space of combinations that do not open or close them
    _, size, directions = np.linalg.svd(rigid[normal_rows(dimension)] @ basis)
    closing = int(np.sum(size > SLIDES * np.abs(sliding @ basis).max() * np.sqrt(len(rigid))))
    still = directions[closing:].T
    if still.shape[1] == 0:
        return basis, 0
    _, size, sideways = np.linalg.svd(sliding @ basis @ still)
    order = np.hstack([directions[:closing].T, still @ sideways[::-1].T])
    return basis @ order, int(np.sum(size > SLIDES * size[0]))


FREE = 1e-9
"""Frequency of a mode without stiffness, over the highest."""

STILL = 1e-6
"""Sliding or approach of a motion of the joint as a whole, and what pushes it, over the largest."""


def placed_modes(model: JointModel, prestress: Prestress) -> Array:
    """Combinations of the nearly rigid modes whose mean position matters, (e, g), orthonormal columns.

    A free joint moves as a whole without stiffness and without moving the sides of a contact past each other.
    Reactions, in balance with each other, do not push it; in the mean, ``0 q = phi^T f`` with the preload f,
    it rests where it is where that is none, and its q is zero. At other harmonics it has its inertia.

    Parameters
    ----------
    model : JointModel
    prestress : Prestress
        Its preload.

    Raises
    ------
    MicroslipError
        Where the preload pushes such a motion: it would be accelerated for ever.
    """
    e = model.equilibrium_modes
    loose = np.flatnonzero(model.omega[:e] <= FREE * model.omega.max())
    if len(loose) == 0:
        return np.eye(e)
    moved = np.abs(model.mode_v[:, :e]).max(initial=0.0) * np.sqrt(len(model.mode_v))
    _, size, directions = np.linalg.svd(model.mode_v[:, loose])
    size = np.concatenate([size, np.zeros(len(loose) - len(size))])
    whole = np.zeros((e, int(np.sum(size <= STILL * moved))))
    whole[loose] = directions[size <= STILL * moved].T
    loads = model.port_modes * model.amplitudes(prestress.preload)
    pushed = np.abs(whole.T @ loads[:e].sum(axis=1))
    if (pushed > STILL * np.abs(loads).max(initial=1e-300)).any():
        raise MicroslipError(
            "the joint is free to move as a whole and its preload pushes it: harmonic balance has no mean "
            "position for it; support the joint, or let the preload be in balance with itself"
        )
    return np.asarray(np.linalg.svd(whole)[0][:, whole.shape[1] :]) if whole.size else np.eye(e)


def half_turn_of(
    model: JointModel, residual: Array, friction: Array, prestress: Prestress, port: str
) -> bool:
    """Whether the half turn of the structure keeps contact and preload and reverses the load."""
    if model.image is None or model.dimension != 2:
        return False
    turned = components(model.image)
    stiff = slice(model.equilibrium_modes, None)
    soft = model.mode_v[:, stiff] / model.omega[stiff] ** 2
    W = residual + soft @ model.mode_v[:, stiff].T
    v = model.port_v + soft @ model.port_modes[stiff]
    held, load = v @ model.amplitudes(prestress.preload), v[:, model.port(port)]
    pairs = [
        (W, W[np.ix_(turned, turned)]),
        (held, held[turned]),
        (load, -load[turned]),
        (prestress.solution.r, prestress.solution.r[turned]),
        (friction, friction[model.image]),
        *_damped_alike(model, turned, port),
    ]
    return all(np.abs(a - b).max() <= 1e-6 * np.abs(a).max() for a, b in pairs)


def _damped_alike(model: JointModel, turned: Indices, port: str) -> list[tuple[Array, Array]]:
    """What damping that couples the modes makes of reactions and of the load, and its image."""
    if model.damping is None:
        return []
    # any flexibility of the modes that has the symmetry of the structure
    square = model.omega**2
    seen = model.mode_v / (square + square[model.equilibrium_modes :].min(initial=square.max()))
    scale = seen / np.abs(seen).max(initial=1e-300)
    of_pairs, of_load = scale @ model.damping @ scale.T, scale @ model.damping
    load = of_load @ (model.port_modes[:, model.port(port)] / square.max())
    return [(of_pairs, of_pairs[np.ix_(turned, turned)]), (load, -load[turned])]
