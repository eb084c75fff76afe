"""What stands behind Newton's method in three-dimensional contact, each way ending in it.

Friction gives no problem of minimum, and Newton's method may cycle where a load jumps far. Then, in
this order:

- other scales rho of the natural map than the pairs' own stiffness, which changes who changes state
  first;
- the load in parts, from the last solution, with the history of friction held as it is at its end:
  the solutions in between serve as starts alone;
- iterations of the extragradient method on De Saxcé's form, ``r = P_K(r - t u)`` with
  ``u = (-v_n + mu |s|, -s)`` and the slip s, for a start near the right states;
- the proximal-point method: Newton's on ``W + a``, with ``a r_last`` more approach, which is better
  conditioned and tends to a solution of the problem itself;
- cones of facets (`spatial_facets.py`), which have a solution for certain, finer and finer.

References: V. Acary, M. Brémond & O. Huber, On solving contact problems with Coulomb friction:
formulations and numerical comparisons, in Advanced Topics in Nonsmooth Dynamics, Springer 2018;
G. De Saxcé & Z.-Q. Feng, Math. Comput. Model. 28 (1998) 225.
"""

from __future__ import annotations

import numpy as np

from microslip.contact.compiled import inlined_jit, jit
from microslip.contact.folded import nothing_folded
from microslip.contact.lemke import SOLUTION
from microslip.contact.pairs import SEPARATED, STICK
from microslip.contact.problem import Contact, Given, Problem, relative_displacement
from microslip.contact.spatial_facets import fan, solve_faceted
from microslip.contact.spatial_newton import ACCEPTED, MOST, newton_anew
from microslip.contact.spatial_problem import certify, natural_residual
from microslip.contact.spatial_tableau import Memory
from microslip.contact.tableau import MADE

STRETCHES = (0.1, 10.0, 0.01)
"""Scales of the natural map tried, over the pairs' own stiffness."""

SMALLEST_PART = 1.0 / 256.0
"""Of a load taken in parts."""

EXTRAGRADIENT_STEPS = 300

PROXIMAL_STEPS = 60

FACETS = (4, 8, 16, 32)

MOST_ROWS = 2500
"""Of a faceted problem; larger ones are not tried."""

SMALLEST_PIVOTS = (1e-9, 1e-11, 1e-13)


@inlined_jit
def restore(memory, contact):
    """The last solution into `contact`."""
    contact.r[:] = memory.r
    contact.q[:] = memory.q
    contact.v[:] = memory.v
    contact.status[:] = memory.status


@inlined_jit
def other_scales(problem, memory, given, contact):
    """Newton's method with other scales, from the last solution."""
    count = 0
    for stretch in STRETCHES:
        restore(memory, contact)
        its, residual = newton_anew(problem, memory, given, contact, MOST, stretch)
        count += its
        if residual <= ACCEPTED:
            return count, residual
    return count, np.inf


@inlined_jit
def load_in_parts(problem, memory, given, contact):
    """Newton's method on parts of the way from the last load to this one."""
    v_start, f_start = memory.v_free.copy(), memory.f_q.copy()
    v_free, f_q = np.empty_like(v_start), np.empty_like(f_start)
    between = Given(v_free, f_q, given.vt_old)
    r, q, status = memory.r.copy(), memory.q.copy(), memory.status.copy()
    restore(memory, contact)
    done, part = 0.0, 0.25
    count = 0
    residual = np.inf
    while done < 1.0:
        target = min(1.0, done + part)
        v_free[:] = v_start + target * (given.v_free - v_start)
        f_q[:] = f_start + target * (given.f_q - f_start)
        its, residual = newton_anew(problem, memory, between, contact, MOST, 1.0)
        count += its
        if residual <= ACCEPTED:
            done = target
            part *= 2.0
            r[:] = contact.r
            q[:] = contact.q
            status[:] = contact.status
            continue
        part *= 0.5
        contact.r[:] = r
        contact.q[:] = q
        contact.status[:] = status
        if part < SMALLEST_PART:
            return count, np.inf
    return count, residual


@jit
def _gradient_step(problem, vt_old, r, v, t, out):
    """``P_K(r - t u)`` of every pair into out: the projection on its cone of friction."""
    mu = problem.friction
    for i in range(mu.shape[0]):
        n = 3 * i
        s1, s2 = v[n + 1] - vt_old[i, 0], v[n + 2] - vt_old[i, 1]
        a = r[n] + t * (v[n] - mu[i] * np.sqrt(s1 * s1 + s2 * s2))
        y1, y2 = r[n + 1] + t * s1, r[n + 2] + t * s2
        size = np.sqrt(y1 * y1 + y2 * y2)
        if size <= mu[i] * a:
            out[n], out[n + 1], out[n + 2] = a, y1, y2
        elif mu[i] * size <= -a:
            out[n], out[n + 1], out[n + 2] = 0.0, 0.0, 0.0
        else:
            a = (a + mu[i] * size) / (1.0 + mu[i] * mu[i])
            out[n] = a
            out[n + 1], out[n + 2] = mu[i] * a * y1 / size, mu[i] * a * y2 / size


@inlined_jit
def extragradient(problem, memory, given, contact):
    """Newton's method from iterations of the extragradient method; not for floating bodies."""
    if problem.stiffness.shape[0] > 0:
        return 0, np.inf
    W, vt_old = problem.W, given.vt_old
    n = W.shape[0]
    # the largest eigenvalue of W is below its largest row sum
    top = 0.0
    for i in range(n):
        top = max(top, np.sum(np.abs(W[i])))
    t = 2.0 / top
    restore(memory, contact)
    half = np.empty(n)
    old = np.empty(n)
    count = 0
    for step in range(EXTRAGRADIENT_STEPS):
        relative_displacement(problem, given.v_free, contact.r, contact.q, contact.v)
        _gradient_step(problem, vt_old, contact.r, contact.v, t, half)
        old[:] = contact.v
        relative_displacement(problem, given.v_free, half, contact.q, contact.v)
        error, change = 0.0, 0.0
        for i in range(n):
            error += (contact.v[i] - old[i]) ** 2
            change += (half[i] - contact.r[i]) ** 2
        if t * t * error > 0.81 * change:
            t *= 0.67
            continue
        _gradient_step(problem, vt_old, contact.r, contact.v, t, contact.r)
        if t * t * error < 0.09 * change:
            t *= 1.5
        if step % 100 == 99:
            its, residual = _attempt(problem, memory, given, contact)
            count += its
            if residual <= ACCEPTED:
                return count, residual
    return count, np.inf


@inlined_jit
def _attempt(problem, memory, given, contact):
    """Newton's method from r and q, which are put back where it fails."""
    r, q = contact.r.copy(), contact.q.copy()
    its, residual = newton_anew(problem, memory, given, contact, MOST, 1.0)
    if not residual <= ACCEPTED:
        contact.r[:] = r
        contact.q[:] = q
    return its, residual


@inlined_jit
def _empty_memory(memory):
    """Another memory of the same size."""
    return Memory(
        np.empty_like(memory.transposed),
        np.zeros_like(memory.held),
        memory.v_free.copy(),
        memory.f_q.copy(),
        memory.r.copy(),
        memory.q.copy(),
        memory.v.copy(),
        memory.status.copy(),
        memory.direction.copy(),
        memory.resistance.copy(),
        np.zeros_like(memory.flags),
        np.zeros_like(memory.solved),
        np.zeros_like(memory.changes),
        memory.images.copy(),
    )


@inlined_jit
def proximal(problem, memory, given, contact):
    """Newton's method from proximal points; the compliance they add shrinks as they settle."""
    n = problem.W.shape[0]
    restore(memory, contact)
    count = 0
    share = 1.0
    settled = Contact(contact.status.copy(), memory.r.copy(), memory.q.copy(), memory.v.copy())
    relative_displacement(problem, given.v_free, settled.r, settled.q, settled.v)
    last = natural_residual(problem, given, settled)
    other = _empty_memory(memory)
    W, diagonal = problem.W.copy(), problem.diagonal.copy()
    softer = Problem(
        W,
        problem.R,
        problem.stiffness,
        problem.scale,
        problem.friction,
        problem.force,
        problem.mean,
        problem.tolerance,
        diagonal,
        nothing_folded(),
    )
    v_free = np.empty(n)
    pushed = Given(v_free, given.f_q, given.vt_old)
    for step in range(PROXIMAL_STEPS):
        for i in range(n):
            diagonal[i] = problem.diagonal[i] + share * problem.mean
            W[i, i] = diagonal[i]
        v_free[:] = given.v_free + share * problem.mean * settled.r
        other.flags[MADE] = False
        contact.r[:] = settled.r
        contact.q[:] = settled.q
        its, residual = newton_anew(softer, other, pushed, contact, MOST, 1.0)
        count += its
        if not residual <= ACCEPTED:
            share *= 4.0
            if share > 1e3:
                return count, np.inf
            contact.status[:] = settled.status
            continue
        settled.r[:] = contact.r
        settled.q[:] = contact.q
        settled.status[:] = contact.status
        now = certify(problem, given, settled)
        if now < 0.3 * last:
            share *= 0.3
        last = now
        if step % 5 == 4 or now < 1e-2:
            contact.r[:] = settled.r
            contact.q[:] = settled.q
            its, residual = newton_anew(problem, memory, given, contact, MOST, 1.0)
            count += its
            if residual <= ACCEPTED:
                return count, residual
    return count, np.inf


@inlined_jit
def facets(problem, memory, given, contact):
    """Newton's method from solutions with faceted cones, finer and finer, without friction with none; takes
    nothing from `contact`."""
    for a in range(problem.stiffness.shape[0]):
        if problem.stiffness[a] < 0.0:
            return 0, np.inf
    m = problem.friction.shape[0]
    count = 0
    direction = np.zeros((m, 2))
    frictionless = np.max(problem.friction) == 0.0
    for sides in FACETS:
        if frictionless:
            sides = 0  # the problem itself
        if m * (sides + 2) > MOST_ROWS:
            break
        for attempt in range(1 if frictionless else 6):
            # evenly round with two turns, then closer and closer to the slip found
            focus = 0.0 if attempt < 2 else 0.5 ** (attempt - 1)
            directions = fan(direction, sides, 0.5 * (attempt % 2), focus)
            outcome = -1
            for smallest in SMALLEST_PIVOTS:
                outcome, pivots = solve_faceted(problem, given, directions, smallest, contact)
                count += pivots
                if outcome == SOLUTION:
                    break
            if outcome != SOLUTION:
                continue
            relative_displacement(problem, given.v_free, contact.r, contact.q, contact.v)
            for i in range(m):
                s1 = contact.v[3 * i + 1] - given.vt_old[i, 0]
                s2 = contact.v[3 * i + 2] - given.vt_old[i, 1]
                size = np.sqrt(s1 * s1 + s2 * s2)
                if size > 0.0:
                    direction[i, 0], direction[i, 1] = s1 / size, s2 / size
            for i in range(m):
                contact.status[i] = STICK if contact.r[3 * i] > 0.0 else SEPARATED
            memory.flags[MADE] = False
            its, residual = newton_anew(problem, memory, given, contact, MOST, 1.0)
            count += its
            if residual <= ACCEPTED:
                return count, residual
        if frictionless:
            break
    return count, np.inf
