"""Motions of bodies that nothing holds: told apart, and kept from drifting away.

Matrices of bodies without any support have modes of frequency zero, which come in any mixture. Those that
move no pair along its normal slide the bodies past each other and are told from the rest. Each gets a
spring that only holds its mean position, so soft that nothing else depends on it:

    omega = 1e-4 of the lowest elastic circular frequency
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from microslip.errors import InputError
from microslip.model.interface import Interface
from microslip.model.modes import LinearModes
from microslip.model.structure import Structure
from microslip.typing import Array

NOTHING = 1e-14
"""Of the stiffness of single degrees of freedom, what a motion that nothing holds has at most."""

TOGETHER = 1e-6
"""Share of a motion, and of a load on it, that counts as none."""

WEAKEST = 1e-4
"""Circular frequency of a motion that nothing holds, over the lowest elastic one."""


def separated(
    modes: LinearModes, stiffness: sp.csc_matrix, interface: Interface
) -> tuple[LinearModes, int]:
    """The modes with those of frequency zero told apart, and how many there are.

    They are turned among themselves so that those without approach of any pair come first.
    """
    shapes = modes.shapes
    energy = np.einsum("ij,ij->j", shapes, stiffness @ shapes)
    alone = np.einsum("ij,i,ij->j", shapes, stiffness.diagonal(), shapes)
    loose = np.abs(energy) <= NOTHING * alone
    count = int(loose.sum())
    if not count or not loose[:count].all():
        return modes, 0
    v = np.asarray(interface.relative @ shapes[:, :count])
    approach = v.reshape(-1, interface.dimension, count)[:, 0]
    turn = np.linalg.svd(approach, full_matrices=True)[2][::-1].T
    turned = shapes.copy()
    turned[:, :count] = shapes[:, :count] @ turn
    omega = modes.omega.copy()
    omega[:count] = np.sqrt(np.einsum("ij,i,ij->j", turn, omega[:count] ** 2, turn))
    return replace(modes, shapes=turned, omega=omega), count


def check_balanced(structure: Structure, names: Iterable[str], unread: str = "") -> None:
    """Raise `InputError` for the first load that would push away all bodies together, held by nothing.

    Such a motion c of the rigid ones R moves no pair, ``B R c = 0``; a load p is balanced if ``p^T R c = 0``.
    `unread` is what its message says beside.
    """
    if structure.motions is None or not structure.motions.shape[1]:
        return
    R = structure.motions / np.linalg.norm(structure.motions, axis=0)
    v = np.asarray(structure.interface.relative @ R)
    _, size, directions = np.linalg.svd(v, full_matrices=True)
    rank = int((size > TOGETHER * max(float(np.abs(v).max(initial=0.0)), 1e-300)).sum())
    common = R @ directions[rank:].T
    for name in names:
        p = structure.loads[name]
        work = np.abs(p @ common)
        if common.shape[1] and work.max() > TOGETHER * float(
            np.abs(p) @ np.abs(common).max(axis=1)
        ):
            raise InputError(
                f"nothing holds the joint as a whole against the load {name!r}: no part of it has a support; "
                "add one, or soft springs: [[spring]] of a mesh, or in K, and matrices.supports names them"
                + unread
            )


def held(omega: Array, loose: int) -> tuple[Array, Array]:
    """Circular frequencies with the soft springs, and the stiffness (k, k) that these are.

    Examples
    --------
    >>> omega, springs = held(np.array([0.0, 100.0]), 1)
    >>> omega.tolist(), np.diag(springs).tolist()
    ([0.01, 100.0], [0.0001, 0.0])
    """
    found = omega.copy()
    if 0 < loose < len(omega):
        found[:loose] = WEAKEST * omega[loose]
    added = np.zeros(len(omega))
    added[:loose] = found[:loose] ** 2
    return found, np.diag(added)


def loose_modes(omega: Array) -> int:
    """How many of the lowest modes only keep their mean position: those of `held`.

    Examples
    --------
    >>> loose_modes(held(np.array([0.0, 0.0, 100.0, 200.0]), 2)[0])
    2
    >>> loose_modes(np.array([1.0, 100.0, 200.0]))
    0
    """
    soft = np.flatnonzero(omega[:-1] <= 1.001 * WEAKEST * omega[1:])
    return int(soft[-1]) + 1 if len(soft) else 0
