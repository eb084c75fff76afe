"""Compiled linearisation of a step: how small deviations of a state are carried along a motion.

Once the contact states of a step are known, its equations (`timestep.py`) are linear, and small deviations
follow with the factors that the solver has already, all columns at once (`linearised.py`, in space
`spatial_linearised.py`). What a pair that opens inside a step still pushes,
``theta² r_0``-wise, depends on the gap it would have left, and is differentiated too. The product of
the steps of a cycle is the derivative of the period map, exact wherever no pair is just on the verge
of another state: there it is that of one side.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from microslip.contact.answered import Answered, answer_by_modes, nothing_answered
from microslip.contact.by_dimension import dimension_of, gaps, with_states
from microslip.contact.compiled import jit
from microslip.contact.pairs import SEPARATED, SLIP, STICK
from microslip.contact.tableau import answer
from microslip.typing import Array


class Tangents(NamedTuple):
    """Deviations of a state, p of them, changed in place from step to step.

    Attributes
    ----------
    eta, rate, acceleration : (p, k) arrays
        Of modal coordinates and their derivatives.
    residual_v, residual_before, r, v : (p, d m) arrays
        Of the residual part of the relative displacement now and a step before, reactions, relative
        displacements.
    """

    eta: Array
    rate: Array
    acceleration: Array
    residual_v: Array
    residual_before: Array
    r: Array
    v: Array


class Workspace(NamedTuple):
    """Arrays of p columns that a step of deviations needs.

    Attributes
    ----------
    start, predicted : (p, k) arrays
    shares, before : (p, k) arrays
        In the modes of the free displacement of pairs that stay as they are; `Tangents.eta` a step before.
    v_free, dr, dv, carried : (p, d m) arrays
        `carried` is what is left of the reactions of the step before.
    answered : Answered
        Of steps before.
    """

    start: Array
    predicted: Array
    shares: Array
    before: Array
    v_free: Array
    dr: Array
    dv: Array
    carried: Array
    answered: Answered


@jit
def workspace(tangents, psi_t):
    """Arrays for as many columns."""
    p, k = tangents.eta.shape
    N = tangents.r.shape[1]
    return Workspace(
        np.empty((p, k)),
        np.empty((p, k)),
        np.empty((p, k)),
        np.zeros((p, k)),
        np.empty((p, N)),
        np.empty((p, N)),
        np.empty((p, N)),
        np.empty((p, N)),
        nothing_answered(p, psi_t),
    )


@jit
def followed(problem, status):
    """States for deviations: a pair without friction that has no slip by chance does not stick."""
    states = status.copy()
    for i in range(status.shape[0]):
        if status[i] == STICK and problem.friction[i] == 0.0:
            states[i] = SLIP
    return states


@jit
def predict(memory, constants, tangents, space):
    """Deviations at the end of a step as far as they come from its start.

    ``space.v_free`` is that of the relative displacements, without the tangential one at which pairs
    stick, and ``space.dr`` its part of the components that the tableau holds.
    """
    start, predicted, v_free, held = space.start, space.predicted, space.v_free, space.dr
    h, c, omega = constants.mode_step, constants.mode_damping, constants.omega
    eta, rate, acceleration = tangents.eta, tangents.rate, tangents.acceleration
    p, k = eta.shape
    N = v_free.shape[1]
    d = dimension_of(memory)
    coupling = constants.coupling
    coupled = coupling.answer.shape[0] > 0
    if coupled:
        pv = rate + 0.5 * h * acceleration
        predicted[:] = eta + h * rate + 0.25 * h**2 * acceleration
        start[:] = np.dot(-np.dot(pv, coupling.damping.T) - omega**2 * predicted, coupling.answer.T)
        predicted += 0.25 * h**2 * start
    for a in range(0 if coupled else p):
        for j in range(k):
            quarter = 0.25 * h[j] ** 2
            pe = eta[a, j] + h[j] * rate[a, j] + quarter * acceleration[a, j]
            pv = rate[a, j] + 0.5 * h[j] * acceleration[a, j]
            x = -c[j] * pv - omega[j] ** 2 * pe
            x /= 1.0 + 0.5 * h[j] * c[j] + quarter * omega[j] ** 2
            start[a, j] = x
            predicted[a, j] = pe + quarter * x
    np.dot(predicted, constants.psi_t, v_free)
    d0, d1, d2 = 1.0 + constants.lags[0], constants.lags[1], constants.lags[2]
    s, before, v_old = tangents.residual_v, tangents.residual_before, tangents.v
    if space.answered.rest.shape[0] > 0:
        # the residual part of what stays as it is lags behind as the modes do, the other way
        space.shares[:] = predicted + (d1 * eta + d2 * space.before) / d0
    for a in range(p):
        for i in range(N):
            v_free[a, i] -= (d1 * s[a, i] + d2 * before[a, i]) / d0
        for i in range(N // d):
            for t in range(d * i + 1, d * i + d):
                v_free[a, t] -= v_old[a, t]
        for i in range(N):
            held[a, i] = v_free[a, i] if memory.held[i] else 0.0


@jit
def ease(problem, memory, status, constants, r_old, v, tangents, space):
    """Take back what pairs that open inside the step push after they have, as `timestep.opened` does."""
    predict(memory, constants, tangents, space)
    d = dimension_of(memory)
    opened = np.empty(status.shape[0], np.int64)
    count = 0
    for i in range(status.shape[0]):
        n = d * i
        if status[i] == SEPARATED and r_old[n] > 0.0 and v[n] < 0.0:
            opened[count] = n
            count += 1
    opened = opened[:count]
    states = followed(problem, status)
    gap = gaps(problem, memory, states, opened, space.v_free, space.dr, space.dv)
    dr_old, lost = tangents.r, space.dr
    lost[:] = 0.0
    for b in range(count):
        n = opened[b]
        pull = -v[n] / problem.diagonal[n]
        whole = r_old[n] + pull
        after = pull / whole
        for a in range(lost.shape[0]):
            change = -gap[a, b] / problem.diagonal[n]
            dafter = (r_old[n] * change - pull * dr_old[a, n]) / whole**2
            for i in range(n, n + d):
                lost[a, i] = after * dr_old[a, i] + dafter * r_old[i]
    take_back(constants, tangents, space)


@jit
def take_back_all(constants, tangents, space):
    """Take back all of the push left from the step before: a dissipative step has none."""
    space.dr[:] = space.carried
    take_back(constants, tangents, space)


@jit
def take_back(constants, tangents, space):
    """Take the reactions in ``space.dr`` back from the push left from the step before."""
    force = np.dot(space.dr, constants.psi_t.T)
    coupled = constants.coupling.answer.shape[0] > 0
    if coupled:
        pushed = constants.mode_gain * force
        tangents.acceleration[:] += np.dot(pushed, constants.coupling.release.T)
    for a in range(0 if coupled else force.shape[0]):
        for j in range(force.shape[1]):
            tangents.acceleration[a, j] += constants.mode_gain[j] * force[a, j]
    space.carried[:] -= space.dr


@jit
def carry(problem, memory, status, constants, full, tangents, space):
    """Carry deviations over a step whose states are known; `full` is 1 in a dissipative step."""
    predict(memory, constants, tangents, space)
    states = followed(problem, status)
    if full > 0.0:  # another tableau
        answer(memory, space.v_free, space.dr, space.dv)
    else:
        answer_by_modes(
            memory,
            problem.friction,
            constants.psi_t,
            space.shares,
            space.v_free,
            space.dr,
            space.answered,
            space.dv,
        )
    with_states(problem, memory, states, space.dv, space.dr)
    d = dimension_of(memory)
    for a in range(space.dv.shape[0]):
        for i in range(status.shape[0]):
            for t in range(d * i + 1, d * i + d):
                space.dv[a, t] += tangents.v[a, t]
    h, c, omega = constants.mode_step, constants.mode_damping, constants.omega
    eta, rate, acceleration = tangents.eta, tangents.rate, tangents.acceleration
    force = np.dot(space.dr, constants.psi_t.T)
    if space.answered.rest.shape[0] > 0:
        space.before[:] = eta
    p, k = eta.shape
    coupling = constants.coupling
    coupled = coupling.answer.shape[0] > 0
    if coupled:
        pushed = constants.mode_gain * force
        share, released = (
            np.dot(pushed, coupling.answer.T),
            full * np.dot(pushed, coupling.release.T),
        )
        eta[:] = space.predicted - (1.0 + full) * 0.25 * h**2 * share
        rate += 0.5 * h * acceleration
        acceleration[:] = space.start - (1.0 + full) * share + released
        rate += 0.5 * h * (acceleration - released)
    for a in range(0 if coupled else p):
        for j in range(k):
            quarter = 0.25 * h[j] ** 2
            x = constants.mode_gain[j] * force[a, j]
            share = x / (1.0 + 0.5 * h[j] * c[j] + quarter * omega[j] ** 2)
            new = space.start[a, j] - share + full * (x - share)
            pv = rate[a, j] + 0.5 * h[j] * acceleration[a, j]
            eta[a, j] = space.predicted[a, j] - (1.0 + full) * quarter * share
            rate[a, j] = pv + 0.5 * h[j] * (new - full * x)
            acceleration[a, j] = new
    tangents.r[:] = space.dr
    tangents.v[:] = space.dv
    tangents.residual_before[:] = tangents.residual_v
    np.dot(eta, constants.psi_t, tangents.residual_v)
    for a in range(p):
        for i in range(space.dv.shape[1]):
            tangents.residual_v[a, i] = space.dv[a, i] - tangents.residual_v[a, i]
