"""Compiled alternating frequency–time evaluation of planar Signorini–Coulomb contact.

Each pair brings the Fourier coefficients of two augmented forces (N per metre of width)

    x_n = r_n + eps_n v_n,        x_t = r_t + eps_t v_t

(dynamic Lagrangian: Nacivet, Pierre, Thouverez & Jezequel, J. Sound Vib. 265 (2003) 201). On N equal
steps of the cycle the kernel applies the exact laws as projections,

    r_n[k] = max(0, x_n[k])
    r_t[k] = clip(r_t[k-1] + x_t[k] - x_t[k-1],  -mu r_n[k], +mu r_n[k])

and returns the coefficients of ``r`` and their exact derivatives. A fixed point, ``r`` in equal to ``r``
out, obeys the laws whatever the augmentation eps: where a pair touches, the first line says
``v_n = 0``; where it sticks the second says ``v_t`` does not change.

Memory. Friction needs the periodic solution of the recursion. One step is a shift followed by a clip,
so the map over a whole period is a single clip, and applying it twice is the same as once: *one* cycle
erases the start, exactly. A second cycle is counted from the last clipped sample, the *anchor*, whose
traction is known. A pair that is never clipped sticks for good; it keeps ``v_t`` at the value
`held` that it has had from the beginning, ``r_t = x_t - held``.

Walk. A joint that slips everywhere can creep the same way every cycle: ``v_t`` is periodic but for a
`drift`, and the increments of ``x_t`` are a little larger than its coefficients say. Such pairs are
clipped in every cycle, on the side that the drift pushes to, and forget `held`.

Derivative. Over a run of sticking samples ``dr_t[k] = dx_t[k] - dx_t[a] + dr_t[a]`` with ``a`` the last
sample before the run, over a run of slip ``dr_t = ±mu dx_n``. Products of sines and cosines are sines and
cosines of sums and differences, and their sum over a run is the difference of two rows of a table
(`samples.SampleTable.sums`): the Jacobian costs per run, not per sample.

Coefficients are those of `samples.py`: ``Y_h = c_{2h-1} + i c_{2h}`` in the convention of
`numerics/fourier.py`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from microslip.contact.compiled import jit
from microslip.contact.pairs import BACKWARD, FORWARD, SEPARATED, STICK
from microslip.contact.samples import SampleTable, add_run, analyse, synthesise
from microslip.typing import Array, Status

OPEN, LINEAR, CHANGING = 0, 1, 2
"""Kinds of a component over the cycle: its reaction is zero throughout; its reaction is the augmented
force throughout (touching, sticking); anything else."""


class ContactCycle(NamedTuple):
    """Reactions of all pairs over the cycle and their derivatives.

    Attributes
    ----------
    r : (m, 2, c) array
        Coefficients of the reactions, normal and tangential.
    nn, tn, tt : (m, c, c) arrays
        Derivative of ``r_n`` by ``x_n``, of ``r_t`` by ``x_n`` and by ``x_t``; ``r_n`` does not
        depend on ``x_t``.
    td : (m, c) array
        Derivative of ``r_t`` by `drift`.
    kind : (m, 2) int8 array
        `OPEN`, `LINEAR` or `CHANGING`.
    status : (m, N) int8 array
        Contact state at every sample, numbered as in `contact/pairs.py`.
    """

    r: Array
    nn: Array
    tn: Array
    tt: Array
    td: Array
    kind: NDArray[np.int8]
    status: Status


def contact_cycle(
    table: SampleTable, x: Array, friction: Array, held: Array, drift: Array | None = None
) -> ContactCycle:
    """Apply the contact laws over one cycle to all pairs.

    Parameters
    ----------
    table : SampleTable
    x : (m, 2, c) array
        Coefficients of the augmented forces, N per metre of width.
    friction : (m,) array
        Coefficient of friction.
    held : (m,) array
        ``eps_t v_t`` at which a pair sticks that never slips.
    drift : (m,) array, optional
        ``eps_t`` times the change of ``v_t`` over a cycle; none by default.

    Examples
    --------
    A slider pressed by 1 with mu = 0.5, moved far enough: a stiff spring's friction is nearly a
    square wave, whose first harmonic is 4/pi times its height.

    >>> from microslip.contact.samples import sample_table
    >>> table = sample_table(1, 4096)
    >>> x = np.zeros((1, 2, 3)); x[0, 0, 0] = 1.0; x[0, 1, 1] = 1e4
    >>> cycle = contact_cycle(table, x, np.array([0.5]), np.zeros(1))
    >>> bool(np.isclose(np.hypot(*cycle.r[0, 1, 1:]), 2 / np.pi, rtol=1e-3))
    True
    """
    m, c = len(friction), table.coefficients
    out = ContactCycle(
        r=np.empty((m, 2, c)),
        nn=np.empty((m, c, c)),
        tn=np.empty((m, c, c)),
        tt=np.empty((m, c, c)),
        td=np.zeros((m, c)),
        kind=np.empty((m, 2), np.int8),
        status=np.empty((m, table.samples), np.int8),
    )
    start = np.zeros(m) if drift is None else drift
    all_pairs(table, np.ascontiguousarray(x), friction, held, start, out)
    return out


@jit
def all_pairs(table, x, mu, held, drift, cycle):
    """Evaluate every pair into `cycle`."""
    basis, projection, sums = table.basis, table.projection, table.sums
    r, nn, tn, tt, td = cycle.r, cycle.nn, cycle.tn, cycle.tt, cycle.td
    kind, status = cycle.kind, cycle.status
    N = basis.shape[1]
    xn, xt, bound, traction = np.empty(N), np.empty(N), np.empty(N), np.empty(N)
    since = np.empty(N)
    transposed = np.ascontiguousarray(basis.T)
    for i in range(x.shape[0]):
        synthesise(basis, x[i, 0], xn)
        synthesise(basis, x[i, 1], xt)
        state = status[i]
        closed = _normal(xn, sums, nn[i], state, bound)
        kind[i, 0] = LINEAR if closed == N else (OPEN if closed == 0 else CHANGING)
        analyse(projection, bound, r[i, 0])
        if closed == N:
            r[i, 0] = x[i, 0]
        tn[i] = 0.0
        tt[i] = 0.0
        if closed == 0 or mu[i] == 0.0:
            kind[i, 1] = OPEN
            r[i, 1] = 0.0
            if closed > 0:
                for k in range(N):
                    if state[k] != SEPARATED:
                        state[k] = FORWARD
            continue
        for k in range(N):
            bound[k] *= mu[i]
        step = drift[i] / N
        start = xt[0] - held[i]
        if step != 0.0:
            start = np.inf if step > 0.0 else -np.inf
        anchor, side = _forget(xt, bound, start, step)
        if anchor < 0 and closed < N:
            anchor = 0
            while state[anchor] != SEPARATED:
                anchor += 1
        if anchor < 0:
            kind[i, 1] = LINEAR
            r[i, 1] = x[i, 1]
            r[i, 1, 0] -= held[i]
            for j in range(tt.shape[1]):
                tt[i, j, j] = 1.0
            continue
        kind[i, 1] = CHANGING
        _friction(xt, bound, anchor, side, step, traction, state)
        analyse(projection, traction, r[i, 1])
        _friction_derivative(transposed, sums, mu[i], state, anchor, tn[i], tt[i])
        _steps_since_slip(state, anchor, since)
        analyse(projection, since, td[i])


@jit
def _normal(xn, sums, nn, state, reaction):
    """Positive part of the normal force; returns how many samples are closed."""
    N = xn.shape[0]
    closed = 0
    for k in range(N):
        touching = xn[k] > 0.0
        reaction[k] = xn[k] if touching else 0.0
        state[k] = STICK if touching else SEPARATED
        closed += touching
    nn[:] = 0.0
    if closed == N:
        for j in range(nn.shape[0]):
            nn[j, j] = 1.0
    elif closed > 0:
        first = 0
        while first < N:
            last = first + 1
            while last < N and state[last] == state[first]:
                last += 1
            if state[first] != SEPARATED:
                add_run(nn, sums, first, last, N, 1.0)
            first = last
    return closed


@jit
def _forget(xt, bound, start, step):
    """One cycle from the traction `start`: the last clipped sample and its side, or (-1, 0)."""
    N = xt.shape[0]
    anchor = -1
    side = 0.0
    traction = start
    before = xt[0]
    for k in range(N):
        traction += xt[k] - before + step
        before = xt[k]
        b = bound[k]
        if traction > b:
            traction = b
            anchor = k
            side = 1.0
        elif traction < -b:
            traction = -b
            anchor = k
            side = -1.0
    return anchor, side


@jit
def _friction(xt, bound, anchor, side, step, traction, state):
    """Periodic traction from the anchor round to itself; `state` knows who is separated."""
    N = xt.shape[0]
    value = side * bound[anchor]
    traction[anchor] = value
    if state[anchor] != SEPARATED:
        state[anchor] = FORWARD if side > 0.0 else BACKWARD
    before = xt[anchor]
    for j in range(1, N):
        k = anchor + j
        if k >= N:
            k -= N
        value += xt[k] - before + step
        before = xt[k]
        b = bound[k]
        if value > b:
            value = b
            if state[k] != SEPARATED:
                state[k] = FORWARD
        elif value < -b:
            value = -b
            if state[k] != SEPARATED:
                state[k] = BACKWARD
        traction[k] = value


@jit
def _friction_derivative(basis, sums, mu, state, anchor, tn, tt):
    """Sum the derivative over runs of equal state, from the anchor round to itself."""
    N = state.shape[0]
    c = tt.shape[0]
    first = anchor
    before = anchor
    slope = 0.0
    done = 0
    while done < N:
        last = first + 1
        while last < N and last - first + done < N and state[last] == state[first]:
            last += 1
        kind = state[first]
        if kind == STICK:
            add_run(tt, sums, first, last, N, 1.0)
            origin = basis[before]
            for i in range(c):
                kind_i, h = (0, i // 2) if i % 2 == 0 else (1, (i + 1) // 2)
                weight = (sums[last, kind_i, h] - sums[first, kind_i, h]) * (2.0 if i else 1.0) / N
                for j in range(c):
                    tt[i, j] -= weight * origin[j]
                    tn[i, j] += slope * weight * origin[j]
        else:
            slope = 0.0
            if kind != SEPARATED:
                slope = mu if kind == FORWARD else -mu
                add_run(tn, sums, first, last, N, slope)
            before = last - 1
        done += last - first
        first = last if last < N else 0


@jit
def _steps_since_slip(state, anchor, since):
    """Sticking samples since the last that did not stick, as a share of the cycle."""
    N = state.shape[0]
    count = 0
    for j in range(N):
        k = anchor + j
        if k >= N:
            k -= N
        count = count + 1 if state[k] == STICK else 0
        since[k] = count / N


@jit
def times_derivative(nn, tn, tt, x, out):
    """Write the derivative of all reactions along `x`, (m, 2, c), into `out`."""
    c = x.shape[2]
    for i in range(x.shape[0]):
        for j in range(c):
            n = 0.0
            t = 0.0
            for k in range(c):
                n += nn[i, j, k] * x[i, 0, k]
                t += tn[i, j, k] * x[i, 0, k] + tt[i, j, k] * x[i, 1, k]
            out[i, 0, j] = n
            out[i, 1, j] = t
