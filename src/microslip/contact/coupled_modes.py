"""Compiled time stepping of modes that damping couples: the part of a step that is the modes' own.

With a mass and a damping matrix of the step (`microslip.analyses.time.coupled`), one step h for all modes,
gains g and ``x = psi^T r``, the trapezoidal rule of `timestep.py` is on

    M eta'' + C eta' + omega² eta = f - g x.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from microslip.contact.compiled import jit
from microslip.typing import Array


class Coupling(NamedTuple):
    """What couples the modes of a step by their damping, `microslip.analyses.time.coupled`; empty without.

    ``M eta'' + C eta' + omega² eta = f`` with one step h for all modes.

    Attributes
    ----------
    damping, answer, release : (k, k) arrays
        C, ``(M + h C/2 + h² omega²/4)^-1`` and ``M^-1``.
    loss : (k, k) array
        C over h and, row by row, over the gain: the work of damping is the square of a step's displacements
        with it.
    """

    damping: Array
    answer: Array
    release: Array
    loss: Array


UNCOUPLED = Coupling(*(np.zeros((0, 0)) for _ in Coupling._fields))
"""Every mode by itself."""


@jit
def coupled_ahead(constants, motion, load, pv, start, predicted):
    """Coupled modes at the end of a step as far as they come from its start and the load."""
    coupling, h = constants.coupling, constants.mode_step[0]
    pv[:] = motion.rate + 0.5 * h * motion.acceleration
    predicted[:] = motion.eta + h * motion.rate + 0.25 * h**2 * motion.acceleration
    force = constants.constant_modes + constants.drive_modes * load
    force -= np.dot(coupling.damping, pv) + constants.omega**2 * predicted
    start[:] = np.dot(coupling.answer, force)
    predicted += 0.25 * h**2 * start


@jit
def coupled_behind(constants, motion, r, full, pv, start, predicted):
    """Coupled modes at the end of a step whose reactions are known; returns the work of their damping."""
    coupling, h = constants.coupling, constants.mode_step[0]
    force = constants.mode_gain * np.dot(constants.psi_t, r)
    share, released = np.dot(coupling.answer, force), full * np.dot(coupling.release, force)
    position = predicted - (1.0 + full) * 0.25 * h**2 * share
    moved = position - motion.eta
    motion.eta[:] = position
    motion.acceleration[:] = start - (1.0 + full) * share + released
    motion.rate[:] = pv + 0.5 * h * (motion.acceleration - released)
    return np.dot(moved, np.dot(coupling.loss, moved))
