"""Compiled active-set solver of planar Signorini–Coulomb contact.

Solves, for ``m`` contact pairs with ``v = (v_n, v_t)`` per pair (layout of `interface.py`),

    v = v_free + R q - W r,        K_q q + R^T r = f_q
    v_n <= 0,  r_n >= 0,  v_n r_n = 0                                   (Signorini)
    |r_t| <= mu r_n,  slip v_t - v_t_old parallel to r_t when |r_t| = mu r_n   (Coulomb)

``W`` is the flexibility of the analysis (static, time step, ...), ``q`` are coordinates solved for
in equilibrium (rigid-body modes, possibly with weak springs ``K_q``).

Method. Each pair is separated, sticking, slipping forward (``v_t`` grows, ``r_t = mu r_n``) or
backward. For given states the problem is linear; its inverse ``G`` is kept from step to step and
follows every change of state by rank-one updates (O(n²) instead of O(n³)). After each solve the
pairs whose inequality is violated change state. When the same set of states comes back (cycling),
only the worst violated pair changes; when that cycles too, only the first in order (Murty's
least-index rule, finite for P-matrices); when that does not end either, the caller halves the load
step. A solution is accepted only with its natural-map residual.

Reference: Hüeber, Stadler & Wohlmuth, SIAM J. Sci. Comput. 30 (2008) 572 (primal-dual active set
for friction); Murty, Linear Algebra Appl. 7 (1974) 65.
"""

from __future__ import annotations

import numba as nb
import numpy as np

STICK, FORWARD, BACKWARD, SEPARATED = 1, 2, 3, 4
"""Contact states, numbered as in the paper's figure 5."""

ACCEPTED = 1e-9
"""Natural-map residual below which a solution with no violated pair is accepted."""

PROVISIONAL = 1e-10
"""Inequalities may be violated by this much before a solution is refined to rounding."""

SAMPLES = 8
"""Pairs on which an unrefined solution is tried."""

MAX_FULL = 40
MAX_RANK = 64
_jit = nb.njit(
    cache=True, nogil=True, fastmath={"contract", "reassoc", "arcp", "nsz"}, error_model="numpy"
)


@_jit
def _fill_row(row, kind, pair, W, R, scale, mu, slots, nc):
    """Row of the active system: kind 0 normal, 1 tangential stick, 2 forward, 3 backward slip."""
    nr = R.shape[1]
    if kind >= 2:
        row[: nr + 2 * nc] = 0.0
        sign = 1.0 if kind == 2 else -1.0
        for k in range(nc):
            if slots[k] == pair:
                weight = W[2 * pair + 1, 2 * pair + 1]
                row[nr + 2 * k + 1] = weight
                row[nr + 2 * k] = -sign * mu[pair] * weight
        return
    source = 2 * pair + kind
    for a in range(nr):
        row[a] = -scale[a] * R[source, a]
    for k in range(nc):
        j = 2 * slots[k]
        row[nr + 2 * k] = W[source, j]
        row[nr + 2 * k + 1] = W[source, j + 1]


@_jit
def _tangential_kind(status):
    return 1 if status == STICK else status


@_jit
def _refactor(G, W, R, stiffness, scale, mu, status, slots, slot_of):
    """Build the active system from scratch and invert it. Returns the number of pairs touching."""
    m = status.shape[0]
    nr = R.shape[1]
    nc = 0
    for i in range(m):
        if status[i] != SEPARATED:
            slots[nc] = i
            slot_of[i] = nc
            nc += 1
        else:
            slot_of[i] = -1
    n = nr + 2 * nc
    A = np.zeros((n, n))
    for a in range(nr):
        A[a, a] = scale[a] * stiffness[a] * scale[a]
        for k in range(nc):
            j = 2 * slots[k]
            A[a, nr + 2 * k] = scale[a] * R[j, a]
            A[a, nr + 2 * k + 1] = scale[a] * R[j + 1, a]
    for k in range(nc):
        i = slots[k]
        _fill_row(A[nr + 2 * k], 0, i, W, R, scale, mu, slots, nc)
        kind = _tangential_kind(status[i])
        _fill_row(A[nr + 2 * k + 1], kind, i, W, R, scale, mu, slots, nc)
    if n > 0:
        G[:n, :n] = np.linalg.inv(A)
    return nc


@_jit
def _times_column(G, x, out, n):
    """Compute ``out = G @ x`` over the leading n, four rows at a time."""
    i = 0
    while i + 4 <= n:
        a, b, c, d = G[i], G[i + 1], G[i + 2], G[i + 3]
        sa = 0.0
        sb = 0.0
        sc = 0.0
        sd = 0.0
        for j in range(n):
            y = x[j]
            sa += a[j] * y
            sb += b[j] * y
            sc += c[j] * y
            sd += d[j] * y
        out[i] = sa
        out[i + 1] = sb
        out[i + 2] = sc
        out[i + 3] = sd
        i += 4
    while i < n:
        g = G[i]
        s = 0.0
        for j in range(n):
            s += g[j] * x[j]
        out[i] = s
        i += 1


@_jit
def add_rows(M, weights, out, n):
    """``out[:n] += weights @ M[:, :n]``, zero weights skipped, four rows of M at a time."""
    which = np.empty(weights.shape[0], np.int64)
    count = 0
    for j in range(weights.shape[0]):
        if weights[j] != 0.0:
            which[count] = j
            count += 1
    j = 0
    while j + 4 <= count:
        a, b, c, d = which[j], which[j + 1], which[j + 2], which[j + 3]
        xa, xb, xc, xd = weights[a], weights[b], weights[c], weights[d]
        ma, mb, mc, md = M[a], M[b], M[c], M[d]
        for i in range(n):
            out[i] += xa * ma[i] + xb * mb[i] + xc * mc[i] + xd * md[i]
        j += 4
    while j < count:
        x = weights[which[j]]
        row = M[which[j]]
        for i in range(n):
            out[i] += x * row[i]
        j += 1


@_jit
def _vector_times(G, row, out, n):
    """Compute ``out = row @ G`` over the leading n."""
    out[:n] = 0.0
    add_rows(G, row[:n], out, n)


@_jit
def _replace_row(G, index, row, n, work):
    """Rank-one update of the inverse when row `index` of the system becomes `row`."""
    _vector_times(G, row, work, n)
    pivot = work[index]
    size = 0.0
    for j in range(n):
        size = max(size, abs(work[j]))
    if not abs(pivot) > 1e-11 * size:
        return False
    work[index] -= 1.0
    inverse = 1.0 / pivot
    for i in range(n):
        c = G[i, index] * inverse
        if c != 0.0:
            g = G[i]
            for j in range(n):
                g[j] -= c * work[j]
    return True


@_jit
def _drop_variable(G, index, n):
    """Inverse after removing variable and equation `index` (not compacted)."""
    pivot = G[index, index]
    size = 0.0
    for j in range(n):
        size = max(size, abs(G[index, j]))
    if not abs(pivot) > 1e-11 * size:
        return False
    inverse = 1.0 / pivot
    last = G[index]
    for i in range(n):
        if i != index:
            c = G[i, index] * inverse
            if c != 0.0:
                g = G[i]
                for j in range(n):
                    g[j] -= c * last[j]
    return True


@_jit
def _remove_pair(G, pair, nr, nc, slots, slot_of):
    k = slot_of[pair]
    n = nr + 2 * nc
    base = nr + 2 * k
    if not _drop_variable(G, base + 1, n):
        return False
    G[base + 1, :n] = 0.0
    G[:n, base + 1] = 0.0
    if not _drop_variable(G, base, n):
        return False
    end = nr + 2 * (nc - 1)
    if base != end:
        for a in range(2):
            for j in range(n):
                G[base + a, j] = G[end + a, j]
        for i in range(n):
            for a in range(2):
                G[i, base + a] = G[i, end + a]
        slots[k] = slots[nc - 1]
        slot_of[slots[k]] = k
    slot_of[pair] = -1
    return True


@_jit
def _border(G, column, row, corner, n, work, work2):
    """Inverse after adding one variable: `column` above, `row` left of, `corner` at the corner."""
    _vector_times(G, row, work, n)
    _times_column(G, column, work2, n)
    schur = corner
    for j in range(n):
        schur -= work[j] * column[j]
    if not abs(schur) > 1e-12 * abs(corner):
        return False
    inverse = 1.0 / schur
    for i in range(n):
        c = work2[i] * inverse
        g = G[i]
        for j in range(n):
            g[j] += c * work[j]
        G[i, n] = -c
    for j in range(n):
        G[n, j] = -work[j] * inverse
    G[n, n] = inverse
    return True


@_jit
def _fill_column(column, source, W, R, scale, status, slots, nc):
    """Column of the active system that belongs to reaction component `source`."""
    nr = R.shape[1]
    for a in range(nr):
        column[a] = scale[a] * R[source, a]
    for k in range(nc):
        i = slots[k]
        column[nr + 2 * k] = W[2 * i, source]
        column[nr + 2 * k + 1] = W[2 * i + 1, source] if status[i] == STICK else 0.0


@_jit
def _add_pair(G, pair, W, R, scale, mu, status, slots, slot_of, nc, w1, w2, row, column):
    """Add a pair whose new state is already in `status`."""
    nr = R.shape[1]
    n = nr + 2 * nc
    _fill_row(row, 0, pair, W, R, scale, mu, slots, nc)
    _fill_column(column, 2 * pair, W, R, scale, status, slots, nc)
    if not _border(G, column, row, W[2 * pair, 2 * pair], n, w1, w2):
        return False
    weight = W[2 * pair + 1, 2 * pair + 1]
    _fill_column(column, 2 * pair + 1, W, R, scale, status, slots, nc)
    column[n] = W[2 * pair, 2 * pair + 1]
    if status[pair] == STICK:
        _fill_row(row, 1, pair, W, R, scale, mu, slots, nc)
        row[n] = W[2 * pair + 1, 2 * pair]
    else:
        row[:n] = 0.0
        row[n] = -(1.0 if status[pair] == FORWARD else -1.0) * mu[pair] * weight
    if not _border(G, column, row, weight, n + 1, w1, w2):
        return False
    slots[nc] = pair
    slot_of[pair] = nc
    return True


@_jit
def _change_states(
    G, W, R, stiffness, scale, mu, status, wanted, slots, slot_of, nc, w1, w2, w3, w4
):
    """Bring the inverse from `status` to `wanted`. Returns the number of pairs touching."""
    m = status.shape[0]
    nr = R.shape[1]
    rank = 0
    for i in range(m):
        if status[i] != wanted[i]:
            rank += 2 if (status[i] == SEPARATED or wanted[i] == SEPARATED) else 1
    if rank > MAX_RANK:
        status[:] = wanted
        return _refactor(G, W, R, stiffness, scale, mu, status, slots, slot_of)
    good = True
    for i in range(m):
        if good and status[i] != SEPARATED and wanted[i] == SEPARATED:
            good = _remove_pair(G, i, nr, nc, slots, slot_of)
            status[i] = SEPARATED
            nc -= 1
    for i in range(m):
        if good and status[i] != wanted[i] and status[i] != SEPARATED:
            status[i] = wanted[i]
            _fill_row(w3, _tangential_kind(status[i]), i, W, R, scale, mu, slots, nc)
            good = _replace_row(G, nr + 2 * slot_of[i] + 1, w3, nr + 2 * nc, w1)
    for i in range(m):
        if good and status[i] == SEPARATED and wanted[i] != SEPARATED:
            status[i] = wanted[i]
            good = _add_pair(G, i, W, R, scale, mu, status, slots, slot_of, nc, w1, w2, w3, w4)
            nc += 1
    if not good:
        status[:] = wanted
        nc = _refactor(G, W, R, stiffness, scale, mu, status, slots, slot_of)
    return nc


@_jit
def _relative_displacement(v, v_free, W, R, r, q):
    """Compute ``v = v_free + R q - W r`` row by row of the symmetric W, zero reactions skipped."""
    n = v.shape[0]
    for i in range(n):
        s = -v_free[i]
        for a in range(q.shape[0]):
            s -= R[i, a] * q[a]
        v[i] = s
    add_rows(W, r, v, n)
    for i in range(n):
        v[i] = -v[i]


@_jit
def natural_residual(W, R, stiffness, mu, f_q, vt_old, r, q, v, force):
    """Largest violation of the contact laws and of equilibrium, relative to `force`.

    ``max_i |r - proj(r + v / W_ii)| / force_i`` over normal and tangential components, where the
    displacement is measured in units of the pair's own compliance, and the imbalance of the
    coordinates q; `v` belongs to `r` and `q`.
    """
    worst = 0.0
    for i in range(mu.shape[0]):
        rn = r[2 * i]
        rt = r[2 * i + 1]
        en = abs(rn - max(0.0, rn + v[2 * i] / W[2 * i, 2 * i]))
        bound = mu[i] * max(rn, 0.0)
        trial = rt + (v[2 * i + 1] - vt_old[i]) / W[2 * i + 1, 2 * i + 1]
        et = abs(rt - min(max(trial, -bound), bound))
        worst = max(worst, max(en, et) / force[i])
        if not (en < np.inf and et < np.inf):
            return np.inf
    total = 0.0
    for i in range(mu.shape[0]):
        total += force[i]
    for a in range(q.shape[0]):
        e = stiffness[a] * q[a] - f_q[a]
        size = 0.0
        for i in range(r.shape[0]):
            e += R[i, a] * r[i]
            size = max(size, abs(R[i, a]))
        if size > 0.0:
            worst = max(worst, abs(e) / (size * total))
    return worst


@_jit
def _reactions(z, nr, nc, slots, status, scale, mu, r, q):
    """Reactions and coordinates from the unknowns of the active system."""
    r[:] = 0.0
    for a in range(nr):
        q[a] = scale[a] * z[a]
    for k in range(nc):
        i = slots[k]
        r[2 * i] = z[nr + 2 * k]
        if status[i] == STICK:
            r[2 * i + 1] = z[nr + 2 * k + 1]
        else:
            r[2 * i + 1] = (1.0 if status[i] == FORWARD else -1.0) * mu[i] * r[2 * i]


@_jit
def _free_displacement(v, v_free, W, R, r, q, status, slots, nc):
    """The components of v that the states leave free: gaps, and slips."""
    for i in range(status.shape[0]):
        if status[i] == STICK:
            continue
        for j in range(2 * i if status[i] == SEPARATED else 2 * i + 1, 2 * i + 2):
            s = v_free[j]
            for a in range(q.shape[0]):
                s += R[j, a] * q[a]
            w = W[j]
            for k in range(r.shape[0]):
                s -= w[k] * r[k]
            v[j] = s


@_jit
def _sampled_error(W, R, force, v_free, r, q, slots, nc):
    """Largest relative gap that a solution leaves at a few of the touching pairs."""
    worst = 0.0
    for k in range(0, nc, max(1, nc // SAMPLES)):
        j = 2 * slots[k]
        s = v_free[j]
        for a in range(q.shape[0]):
            s += R[j, a] * q[a]
        w = W[j]
        for i in range(r.shape[0]):
            s -= w[i] * r[i]
        e = abs(s) / (w[j] * force[slots[k]])
        if not e < np.inf:
            return np.inf
        worst = max(worst, e)
    return worst


@_jit
def _unbalance(W, R, stiffness, scale, force, f_q, vt_old, status, slots, nc, r, q, v, out):
    """Residual of the active system into `out`; returns its largest relative size."""
    nr = q.shape[0]
    worst = 0.0
    total = 0.0
    for k in range(nc):
        i = slots[k]
        out[nr + 2 * k] = v[2 * i]
        e = abs(v[2 * i]) / (W[2 * i, 2 * i] * force[i])
        out[nr + 2 * k + 1] = 0.0
        total += force[i]
        if status[i] == STICK:
            slip = v[2 * i + 1] - vt_old[i]
            out[nr + 2 * k + 1] = slip
            e = max(e, abs(slip) / (W[2 * i + 1, 2 * i + 1] * force[i]))
        worst = max(worst, e)
    for a in range(nr):
        e = f_q[a] - stiffness[a] * q[a]
        top = 0.0
        for i in range(r.shape[0]):
            e -= R[i, a] * r[i]
            top = max(top, abs(R[i, a]))
        out[a] = scale[a] * e
        if top > 0.0 and total > 0.0:
            worst = max(worst, abs(e) / (top * total))
    return worst


@_jit
def _judge(W, mu, force, vt_old, status, r, v, slack, rule, wanted):
    """New states into `wanted`: how many differ, and the pair that may change alone."""
    changes = 0
    worst = 0.0
    pair = -1
    for i in range(status.shape[0]):
        state = status[i]
        new = state
        size = 0.0
        if state == SEPARATED:
            e = v[2 * i] / (W[2 * i, 2 * i] * force[i])
            if e > slack:
                slip = v[2 * i + 1] - vt_old[i]
                new = STICK
                if abs(slip) > mu[i] * v[2 * i]:
                    new = FORWARD if slip > 0.0 else BACKWARD
                size = e
        else:
            e = -r[2 * i] / force[i]
            if e > slack:
                new = SEPARATED
                size = e
            elif state == STICK:
                over = (abs(r[2 * i + 1]) - mu[i] * r[2 * i]) / force[i]
                if over > slack:
                    new = FORWARD if r[2 * i + 1] > 0.0 else BACKWARD
                    size = over
            else:
                slip = (v[2 * i + 1] - vt_old[i]) / (W[2 * i + 1, 2 * i + 1] * force[i])
                if state == BACKWARD:
                    slip = -slip
                if slip < -slack:
                    new = STICK
                    size = -slip
        wanted[i] = new
        if new != state:
            changes += 1
            if rule == 2:
                if pair < 0:
                    pair = i
            elif size > worst:
                worst = size
                pair = i
    return changes, pair


@_jit
def solve(
    W,
    R,
    stiffness,
    scale,
    mu,
    force,
    tolerance,
    v_free,
    f_q,
    vt_old,
    status,
    G,
    slots,
    slot_of,
    nc,
    r,
    q,
    v,
):
    """Solve one contact problem from the states in `status`; all of the last ten are updated.

    Returns ``(nc, iterations, residual, rule)``; ``rule`` is 0 full changes, 1 worst pair, 2 least
    index, 3 not solved.
    """
    m = status.shape[0]
    N = 2 * m
    nr = R.shape[1]
    size = N + nr
    b = np.empty(size)
    z = np.empty(size)
    w1 = np.empty(size)
    w2 = np.empty(size)
    w3 = np.empty(size)
    w4 = np.empty(size)
    wanted = np.empty_like(status)
    limit = MAX_FULL + 12 * m + 40 * m
    seen = np.empty(limit + 1, np.uint64)
    since = 0
    rule = 0
    refreshed = -1
    residual = np.inf
    for iteration in range(limit):
        n = nr + 2 * nc
        for a in range(nr):
            b[a] = scale[a] * f_q[a]
        for k in range(nc):
            i = slots[k]
            b[nr + 2 * k] = v_free[2 * i]
            b[nr + 2 * k + 1] = v_free[2 * i + 1] - vt_old[i] if status[i] == STICK else 0.0
        _times_column(G, b, z, n)
        _reactions(z, nr, nc, slots, status, scale, mu, r, q)
        _free_displacement(v, v_free, W, R, r, q, status, slots, nc)
        changes, worst_pair = _judge(W, mu, force, vt_old, status, r, v, PROVISIONAL, rule, wanted)
        error = 0.0
        sound = _sampled_error(W, R, force, v_free, r, q, slots, nc) < PROVISIONAL
        if changes == 0 or rule > 0 or not sound:
            error = np.inf
            for attempt in range(5):
                previous = error
                if attempt > 0:
                    _reactions(z, nr, nc, slots, status, scale, mu, r, q)
                _relative_displacement(v, v_free, W, R, r, q)
                error = _unbalance(
                    W, R, stiffness, scale, force, f_q, vt_old, status, slots, nc, r, q, v, w1
                )
                if error <= 5.0 * tolerance or attempt == 4:
                    break
                stalled = not error < 0.3 * previous
                if stalled and error <= 0.1 * ACCEPTED:
                    break
                if stalled and refreshed != iteration:
                    nc = _refactor(G, W, R, stiffness, scale, mu, status, slots, slot_of)
                    refreshed = iteration
                    z[:n] = 0.0
                    for k in range(nc):
                        i = slots[k]
                        b[nr + 2 * k] = v_free[2 * i]
                        b[nr + 2 * k + 1] = (
                            v_free[2 * i + 1] - vt_old[i] if status[i] == STICK else 0.0
                        )
                    w1[:n] = b[:n]
                _times_column(G, w1, w2, n)
                for i in range(n):
                    z[i] += w2[i]
            changes, worst_pair = _judge(
                W, mu, force, vt_old, status, r, v, max(tolerance, 3.0 * error), rule, wanted
            )
        if changes == 0:
            residual = natural_residual(W, R, stiffness, mu, f_q, vt_old, r, q, v, force)
            if residual <= ACCEPTED:
                return nc, iteration + 1, residual, rule
            if refreshed == iteration:
                return nc, iteration + 1, residual, 3
            nc = _refactor(G, W, R, stiffness, scale, mu, status, slots, slot_of)
            refreshed = iteration + 1
            continue
        if not error < np.inf:
            return nc, iteration + 1, np.inf, 3
        code = np.uint64(1469598103934665603)
        for i in range(m):
            code = (code ^ np.uint64(status[i])) * np.uint64(1099511628211)
        for k in range(since, iteration):
            if seen[k] == code:
                since = iteration
                rule += 1
                break
        seen[iteration] = code
        if rule == 0 and iteration >= MAX_FULL:
            rule = 1
            since = iteration
        if rule == 1 and iteration - since > 12 * m:
            rule = 2
            since = iteration
        if rule > 2:
            return nc, iteration + 1, np.inf, 3
        if rule > 0 and worst_pair >= 0:
            choice = wanted[worst_pair]
            wanted[:] = status
            wanted[worst_pair] = choice
        nc = _change_states(
            G, W, R, stiffness, scale, mu, status, wanted, slots, slot_of, nc, w1, w2, w3, w4
        )
    return nc, limit, residual, 3
