"""Compiled time stepping of a joint model with exact contact.

The trapezoidal rule on the modes, with ``f`` all external and contact forces on a mode and a step h
and damping c of its own (`microslip.analyses.time.poles`),

    eta_1 - eta_0 = h (eta'_0 + eta'_1)/2,    eta'_1 - eta'_0 = h (eta''_0 + eta''_1)/2
    eta'' + c eta' + omega² eta = f

and the residual flexibility quasi-static behind its share of the stiffness damping,
``s + tau s' = V_res a - W_res r``, over three points in time,

    (1 + d_0) s_1 + d_1 s_0 + d_2 s_-1 = V_res a - W_res r

(`microslip.analyses.time.poles.lags`). One contact problem per step:

    v = v_free - W_step r,   W_step = W_res / (1 + d_0) + Psi S Psi^T

with ``S = h²/4 / (1 + c h/2 + (omega h)²/4)`` the displacement of a mode at the end of a step per
unit force there.

Tangential displacements are solved for from where each pair sticks, as slips of the step: bodies that have
walked far past each other are rounded in the place where they are, and not in the contact.

Energy. What the step takes from kinetic and strain energy, apart from damping, is *exactly* the
work

    (r_0 + r_1)/2 . (v_1 - v_0)

of contact. A pair that closes takes energy, since its reaction acts while the gap is still open;
one that opens gives some back, the half of its push that is left from the step before. Where
contact moves along gently both are small of third order in the step. Where bodies fall onto each
other neither is small, nor need they be equal. Two things keep contact from making energy, and no
constant decides what an impact is:

- A pair that opens inside a step pushes until it opens. The reaction that would hold it closed to
  the end of the step is ``r_1 = v_1/W_11 < 0``; on a straight line from r_0 it vanishes at the share
  ``theta = r_0/(r_0 - r_1)`` of the step, so that of what is left of r_0 the share theta is
  spent, and the step is solved again. Where a pair opens only just this changes nothing.
- The energy that contact, normal and friction together, has taken is counted. A step that would
  give back more is solved again with the reactions of its end acting all through it. Such a step
  is of first order, and takes energy whatever happens under a steady load,

      r_1 . (v_1 - v_0) + (r_1 - r_0) . W_res (r_1 - r_0)/2 >= 0

  (Moreau's sweeping process; C. Kane, E. A. Repetto, M. Ortiz, J. E. Marsden, Comput. Methods Appl.
  Mech. Engrg. 180 (1999) 1).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from microslip.contact.by_dimension import dimension_of, follow, follow_modes, solve
from microslip.contact.compiled import jit
from microslip.contact.coupled_modes import UNCOUPLED, Coupling, coupled_ahead, coupled_behind
from microslip.contact.pairs import SEPARATED
from microslip.contact.problem import Contact, Given
from microslip.contact.tableau import add_rows
from microslip.contact.tangent import carry, ease, take_back_all, workspace
from microslip.typing import Array, Mask, Status

SLIGHT = 1e-12
"""Energies below this share of those of the largest reactions are rounding."""

EXTERNAL, FRICTION, NORMAL, MODAL, RESIDUAL = 0, 1, 2, 3, 4
"""Places in the array of works: of the load, friction, normal reactions, damping of the modes,
damping of the residual part."""


class StepConstants(NamedTuple):
    """A joint model with k modes, m pairs and p ports, and one way of stepping it.

    Attributes
    ----------
    psi_t : (k, d m) array
        Relative displacements of the modes, transposed.
    omega : (k,) array
        Circular frequency of each mode, rad/s.
    mode_step, mode_damping, mode_gain : (k,) arrays
        Step h (s) and damping c (1/s) with which a mode is stepped, and what multiplies the force
        of the reactions on it.
    lags : (3,) array
        d_0, d_1, d_2: the residual part's damping over its stiffness, by the displacements of now, one and
        two steps before.
    drive_modes, drive_v : (k,) and (d m,) arrays
        Forces on the modes and relative displacements per unit load.
    constant_modes, constant_v : (k,) and (d m,) arrays
        The same of the loads that are held.
    out_modes, out_v : (k, p) and (p, d m) arrays
        Outputs of all ports per unit of the modes and of minus the reactions.
    out_load : (2, p) array
        Outputs of the loads that are held, and per unit load.
    drive : int
        Driven port among the outputs.
    coupling : Coupling
        Of modes whose damping couples them: then their steps are all the same, and it stands for
        their damping.
    """

    psi_t: Array
    omega: Array
    mode_step: Array
    mode_damping: Array
    mode_gain: Array
    lags: Array
    drive_modes: Array
    drive_v: Array
    constant_modes: Array
    constant_v: Array
    out_modes: Array
    out_v: Array
    out_load: Array
    drive: int
    coupling: Coupling = UNCOUPLED


class Motion(NamedTuple):
    """State of a joint model, changed in place from step to step.

    Attributes
    ----------
    eta, rate, acceleration : (k,) arrays
        Modal coordinates and their derivatives.
    residual_v, r, v : (d m,) arrays
        Residual part s of the relative displacement, reactions, relative displacements.
    residual_before : (d m,) array
        s one step before.
    taken : (1,) array
        Energy that contact has taken and not given back, J per metre of width.
    vt_old : (m,) or (m, 2) array
        Tangential displacement at which each pair sticks.
    status : (m,) int8 array
    """

    eta: Array
    rate: Array
    acceleration: Array
    residual_v: Array
    residual_before: Array
    r: Array
    v: Array
    taken: Array
    vt_old: Array
    status: Status


class Records(NamedTuple):
    """What is written while marching n steps, row 0 is the state at entry.

    Attributes
    ----------
    output : (n + 1, p) array
        Outputs of all ports; row 0 is given.
    works : (5,) array
        Works since the start, at `EXTERNAL` to `RESIDUAL`, J per metre of width.
    friction_work : (m,) array
        Friction work of each pair.
    r, v : (n + 1, d m) arrays, or (0, d m)
    status : (n + 1, m) int8 array, or (0, m)
        Histories, not kept where they have no rows.
    iterations, residual : (n + 1,) arrays
        Of the contact solver.
    dissipative : (n + 1,) bool array
        Steps that were solved again with the reactions of their end.
    """

    output: Array
    works: Array
    friction_work: Array
    r: Array
    v: Array
    status: Status
    iterations: NDArray[np.int64]
    residual: Array
    dissipative: Mask


WHOLE, EASED, DISSIPATIVE = 0, 1, 2
"""Ways to take a step: with all of the push left from the step before, with less of it where pairs
open, with the reactions of the end all through."""


@jit
def opened(problem, memory, status, r_old, v, reduced):
    """Whether pairs open in a step; what they would push after they have, into `reduced`.

    By their states: the gap of one that touches is zero to rounding only. Push and traction are given up in
    the same share, so that they stay within the cone.
    """
    d = dimension_of(memory)
    any_opened = False
    for i in range(status.shape[0]):
        n = d * i
        reduced[n] = 0.0
        for t in range(n + 1, n + d):
            reduced[t] = 0.0
        if status[i] == SEPARATED and r_old[n] > 0.0 and v[n] < 0.0:
            any_opened = True
            pull = -v[n] / problem.diagonal[n]
            after = pull / (r_old[n] + pull)
            reduced[n] = after * r_old[n]
            for t in range(n + 1, n + d):
                reduced[t] = after * r_old[t]
    return any_opened


@jit
def contact_work(memory, r, carried, v, v_old):
    """Work of normal contact and of friction over a step."""
    d = dimension_of(memory)
    normal_work, slip_work = 0.0, 0.0
    for i in range(v.shape[0] // d):
        n = d * i
        normal_work += 0.5 * (r[n] + carried[n]) * (v[n] - v_old[n])
        for t in range(n + 1, n + d):
            slip_work += 0.5 * (r[t] + carried[t]) * (v[t] - v_old[t])
    return normal_work, slip_work


@jit
def work_on_residual(constants, predicted, denominator, r, v, s, reduced):
    """Half the work of reactions left out on the residual part, which had stored it."""
    psi_t, h, gain = constants.psi_t, constants.mode_step, constants.mode_gain
    work = 0.0
    for i in range(v.shape[0]):
        work += 0.5 * reduced[i] * (v[i] - s[i])
    if constants.coupling.answer.shape[0] > 0:
        share = np.dot(constants.coupling.answer, gain * np.dot(psi_t, r))
        position = predicted - 0.25 * h**2 * share
        return work - 0.5 * np.dot(np.dot(psi_t, reduced), position)
    for j in range(psi_t.shape[0]):
        x, y = 0.0, 0.0
        p = psi_t[j]
        for i in range(v.shape[0]):
            x += p[i] * r[i]
            y += p[i] * reduced[i]
        position = predicted[j] - 0.25 * h[j] ** 2 * gain[j] * x / denominator[j]
        work -= 0.5 * y * position
    return work


@jit
def step_through(problems, memories, constants, load, motion, records, tangents):
    """March over the steps of `load` (row 0 is the state at entry); `motion` is updated in place.

    `problems` are those of a step and of a dissipative step, each with its memory. `tangents` are
    small deviations of the motion, carried along with it.
    Planar or spatial, as the memories are. Returns the failed step, or -1.
    """
    problem, dissipative_problem = problems
    memory, dissipative_memory = memories
    psi_t, omega = constants.psi_t, constants.omega
    h, c, gain = constants.mode_step, constants.mode_damping, constants.mode_gain
    d0, d1, d2 = 1.0 + constants.lags[0], constants.lags[1], constants.lags[2]
    drive = constants.drive
    drive_modes, drive_v = constants.drive_modes, constants.drive_v
    constant_modes, constant_v = constants.constant_modes, constants.constant_v
    out_modes, out_v, out_load = constants.out_modes, constants.out_v, constants.out_load
    eta, eta1, eta2, s = motion.eta, motion.rate, motion.acceleration, motion.residual_v
    s_before = motion.residual_before
    r, v, taken = motion.r, motion.v, motion.taken
    vt_old, status = motion.vt_old, motion.status
    outputs, works, friction = records.output, records.works, records.friction_work
    r_out, v_out, status_out = records.r, records.v, records.status
    iterations, residuals, again = records.iterations, records.residual, records.dissipative
    k = eta.shape[0]
    N = v.shape[0]
    m = status.shape[0]
    d = dimension_of(memory)
    sticks_at = vt_old.reshape(m, d - 1)
    coupled = constants.coupling.answer.shape[0] > 0
    not_solved = memory.solved.shape[0] - 1
    keep = r_out.shape[0] == load.shape[0]
    linearised = tangents.eta.shape[0] > 0
    space = workspace(tangents, psi_t)
    nothing = np.empty(0)
    v_free = np.empty(N)
    given = Given(v_free, nothing, np.zeros_like(vt_old))
    shift = np.zeros(N)
    contact = Contact(status, r, nothing, v)
    moves, followed = np.zeros(k + 1), np.zeros(k + 1)
    few, before = memory.images.shape[0] > 0, np.zeros(k)
    pv = np.empty(k)
    denominator = np.empty(k)
    start = np.empty(k)
    predicted = np.empty(k)
    carried = np.empty(N)
    reduced = np.empty(N)
    r_old = r.copy()
    v_old = v.copy()
    slight = 0.0
    for i in range(m):
        slight = max(slight, SLIGHT * problem.force[i] ** 2 * problem.diagonal[d * i])
    for j in range(k):
        denominator[j] = 1.0 + 0.5 * h[j] * c[j] + 0.25 * h[j] ** 2 * omega[j] ** 2
    for step in range(1, load.shape[0]):
        stage = WHOLE
        iterations[step] = 0
        for i in range(m):
            for a in range(d - 1):
                t = d * i + 1 + a
                shift[t] = sticks_at[i, a]
                v[t] -= shift[t]
                v_old[t] -= shift[t]
        carried[:] = r_old
        space.carried[:] = tangents.r
        while True:
            if coupled:
                coupled_ahead(constants, motion, load[step], pv, start, predicted)
            for j in range(0 if coupled else k):
                pe = eta[j] + h[j] * eta1[j] + 0.25 * h[j] ** 2 * eta2[j]
                pv[j] = eta1[j] + 0.5 * h[j] * eta2[j]
                external = constant_modes[j] + drive_modes[j] * load[step]
                start[j] = (external - c[j] * pv[j] - omega[j] ** 2 * pe) / denominator[j]
                predicted[j] = pe + 0.25 * h[j] ** 2 * start[j]
            for i in range(N):
                lagging = d1 * s[i] + d2 * s_before[i]
                v_free[i] = (constant_v[i] + drive_v[i] * load[step] - lagging) / d0
            add_rows(psi_t, predicted, v_free)
            v_free -= shift
            if few:
                # the residual part of what stays as it is lags behind as the modes do, the other way
                for j in range(k):
                    moves[j] = predicted[j] + (d1 * eta[j] + d2 * before[j]) / d0
                moves[k] = load[step] / d0
                follow_modes(memory, moves, followed)
                followed[:] = moves
            if stage == DISSIPATIVE:
                its, residual, rule = solve(dissipative_problem, dissipative_memory, given, contact)
            else:
                its, residual, rule = solve(problem, memory, given, contact)
            iterations[step] += its
            if rule == not_solved or stage == DISSIPATIVE:
                break
            if stage == WHOLE and opened(problem, memory, status, r_old, v, reduced):
                stage = EASED
                if linearised:
                    ease(problem, memory, status, constants, r_old, v, tangents, space)
            else:
                normal_work, slip_work = contact_work(memory, r, carried, v, v_old)
                left = taken[0] + normal_work + slip_work
                if stage == EASED:
                    reduced[:] = r_old - carried
                    left += work_on_residual(
                        constants, predicted, denominator, r, v + shift, s, reduced
                    )
                if left >= -slight:
                    break
                stage = DISSIPATIVE
                again[step] = True
                reduced[:] = carried
                follow(dissipative_problem, dissipative_memory, status)
                if linearised:
                    take_back_all(constants, tangents, space)
            if coupled:
                pushed = gain * np.dot(psi_t, reduced)
                eta2 += np.dot(constants.coupling.release, pushed)
            for j in range(0 if coupled else k):
                x = 0.0
                p = psi_t[j]
                for i in range(N):
                    x += p[i] * reduced[i]
                eta2[j] += gain[j] * x
            carried[:] = carried - reduced
        residuals[step] = residual
        if rule == not_solved:
            return step
        full = 0.0
        if stage == DISSIPATIVE:
            full = 1.0
            carried[:] = r
            r_old[:] = r
            follow(problem, memory, status)
        if linearised and stage == DISSIPATIVE:
            carry(dissipative_problem, dissipative_memory, status, constants, full, tangents, space)
        elif linearised:
            carry(problem, memory, status, constants, full, tangents, space)
        if stage == DISSIPATIVE:
            normal_work, slip_work = contact_work(memory, r, carried, v, v_old)
            left = taken[0] + normal_work + slip_work
        works[FRICTION] += slip_work
        works[NORMAL] += normal_work
        taken[0] = max(left, 0.0)
        for i in range(m):
            for t in range(d * i + 1, d * i + d):
                friction[i] += 0.5 * (r[t] + carried[t]) * (v[t] - v_old[t])
                memory.v_free[t] -= v[t]
        v += shift
        raised = load[step] - load[step - 1]
        for i in range(N):
            works[RESIDUAL] += 0.5 * (r[i] + r_old[i]) * (s[i] + drive_v[i] * raised)
            s_before[i] = s[i]
            s[i] = v[i]
        if few:
            before[:] = eta
        if coupled:
            works[MODAL] += coupled_behind(constants, motion, r, full, pv, start, predicted)
            s -= np.dot(eta, psi_t)
        for j in range(0 if coupled else k):
            x = 0.0
            p = psi_t[j]
            for i in range(N):
                x += p[i] * r[i]
            x *= gain[j]
            share = x / denominator[j]
            acceleration = start[j] - share + full * (x - share)
            position = predicted[j] - (1.0 + full) * 0.25 * h[j] ** 2 * share
            works[MODAL] += c[j] * (position - eta[j]) ** 2 / (gain[j] * h[j])
            eta[j] = position
            eta1[j] = pv[j] + 0.5 * h[j] * (acceleration - full * x)
            eta2[j] = acceleration
            for i in range(N):
                s[i] -= position * p[i]
        for i in range(N):
            works[RESIDUAL] -= 0.5 * (r[i] + r_old[i]) * s[i]
        for i in range(m):
            for a in range(d - 1):
                sticks_at[i, a] = v[d * i + 1 + a]
        for o in range(outputs.shape[1]):
            y = out_load[0, o] + out_load[1, o] * load[step]
            for j in range(k):
                y += out_modes[j, o] * eta[j]
            for i in range(N):
                y -= out_v[o, i] * r[i]
            outputs[step, o] = y
        works[EXTERNAL] += (
            0.5 * (load[step] + load[step - 1]) * (outputs[step, drive] - outputs[step - 1, drive])
        )
        if keep:
            r_out[step] = r
            v_out[step] = v
            status_out[step] = status
        r_old[:] = r
        v_old[:] = v
    return -1
