"""Alternating frequency–time evaluation of Signorini–Coulomb contact over a cycle, planar and spatial.

Each pair brings the Fourier coefficients of its augmented forces (N, per metre of width in the plane)

    x_n = r_n + eps_n v_n,        x_t = r_t + eps_t v_t

with d - 1 tangential directions and one eps_t for them (dynamic Lagrangian: Nacivet, Pierre, Thouverez &
Jezequel, J. Sound Vib. 265 (2003) 201). On N equal steps of the cycle the kernels apply the exact laws
as projections,

    r_n[k] = max(0, x_n[k])
    r_t[k] = P_b(r_t[k-1] + x_t[k] - x_t[k-1]),    b = mu r_n[k]

with P_b the projection on the interval [-b, b], in space on the disc of radius b, and return the
coefficients of ``r`` and their exact derivatives. A fixed point, ``r`` in equal to ``r`` out, obeys the
laws whatever the augmentation eps: where a pair touches, the first line says ``v_n = 0``; where it
sticks the second says that ``v_t`` does not change.

Friction needs the periodic solution of the recursion: `aft_planar.py` and `aft_spatial.py` say how the
start is forgotten, and how the derivatives go with it.

Walk. A joint that slips everywhere can creep the same way every cycle: ``v_t`` is periodic but for a
`drift`, and the increments of ``x_t`` are a little larger than its coefficients say. Such pairs are at
their limit in every cycle, on the side that the drift pushes to, and forget `held`.

Coefficients are those of `samples.py`: ``Y_h = c_{2h-1} + i c_{2h}`` in the convention of
`numerics/fourier.py`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from microslip.contact.aft_normal import CHANGING, LINEAR, OPEN
from microslip.contact.aft_planar import all_planar_pairs
from microslip.contact.aft_spatial import MOST_CYCLES, all_spatial_pairs
from microslip.contact.compiled import jit
from microslip.contact.samples import SampleTable
from microslip.errors import ContactError
from microslip.typing import Array, Status

__all__ = [
    "CHANGING",
    "LINEAR",
    "OPEN",
    "ContactCycle",
    "along_drift",
    "contact_cycle",
    "times_derivative",
]


class ContactCycle(NamedTuple):
    """Reactions of all pairs over the cycle and their derivatives; ``t = d - 1`` tangential directions.

    Attributes
    ----------
    r : (m, d, c) array
        Coefficients of the reactions, normal and tangential.
    nn : (m, c, c) array
        Derivative of ``r_n`` by ``x_n``; it does not depend on ``x_t``.
    tn : (m, t, c, c) array
        Of each component of ``r_t`` by ``x_n``.
    tt : (m, t, t, c, c) array
        Of each component of ``r_t`` by each of ``x_t``.
    td : (m, t, t, c) array
        Of each component of ``r_t`` by each of `drift`.
    kind : (m, d) int8 array
        `OPEN`, `LINEAR` or `CHANGING`; the tangential directions of a pair have one kind.
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
    table: SampleTable,
    x: Array,
    friction: Array,
    held: Array,
    drift: Array | None = None,
) -> ContactCycle:
    """Apply the contact laws over one cycle to all pairs.

    Parameters
    ----------
    table : SampleTable
    x : (m, d, c) array
        Coefficients of the augmented forces, N (per metre of width in the plane); d is 2 or 3.
    friction : (m,) array
        Coefficient of friction.
    held : (m, d - 1) array
        ``eps_t v_t`` at which a pair sticks that never slips.
    drift : (m, d - 1) array, optional
        ``eps_t`` times the change of ``v_t`` over a cycle; none by default.

    Raises
    ------
    ContactError
        Where a spatial pair's periodic traction was not found; names the pair.

    Examples
    --------
    A slider pressed by 1 with mu = 0.5, moved far enough: a stiff spring's friction is nearly a
    square wave, whose first harmonic is 4/pi times its height.

    >>> from microslip.contact.samples import sample_table
    >>> table = sample_table(1, 4096)
    >>> x = np.zeros((1, 2, 3)); x[0, 0, 0] = 1.0; x[0, 1, 1] = 1e4
    >>> cycle = contact_cycle(table, x, np.array([0.5]), np.zeros((1, 1)))
    >>> bool(np.isclose(np.hypot(*cycle.r[0, 1, 1:]), 2 / np.pi, rtol=1e-3))
    True

    The same slider in space, taken round a wide circle: its traction has the size 0.5 and turns with the
    way it goes, ``(-sin, cos)`` for ``(cos, sin)``.

    >>> table = sample_table(1, 256)
    >>> x = np.zeros((1, 3, 3)); x[0, 0, 0] = 1.0; x[0, 1, 2] = x[0, 2, 1] = 1e4
    >>> cycle = contact_cycle(table, x, np.array([0.5]), np.zeros((1, 2)))
    >>> np.round(cycle.r[0, 1:, 1:], 1).tolist()
    [[-0.5, 0.0], [0.0, 0.5]]
    """
    (m, d, c), t = x.shape, x.shape[1] - 1
    out = ContactCycle(
        r=np.empty((m, d, c)),
        nn=np.empty((m, c, c)),
        tn=np.zeros((m, t, c, c)),
        tt=np.zeros((m, t, t, c, c)),
        td=np.zeros((m, t, t, c)),
        kind=np.empty((m, d), np.int8),
        status=np.empty((m, table.samples), np.int8),
    )
    way = np.zeros((m, t)) if drift is None else np.ascontiguousarray(drift)
    every_pair = all_planar_pairs if d == 2 else all_spatial_pairs
    start = np.ascontiguousarray(held)
    lost = every_pair(table, np.ascontiguousarray(x), friction, start, way, out)
    if lost >= 0:
        raise ContactError(
            f"the periodic traction of pair {lost} was not found in {MOST_CYCLES} cycles: it slips "
            "by next to nothing; take another amplitude or more samples"
        )
    return out


def along_drift(cycle: ContactCycle, drift: Array) -> Array:
    """Derivative of the tractions, (m, d - 1, c), along a `drift`, (m, d - 1)."""
    return np.asarray(np.einsum("mabc,mb->mac", cycle.td, drift))


@jit
def times_derivative(nn, tn, tt, x, out):
    """Write the derivative of all reactions along `x`, (m, d, c), into `out`."""
    c = x.shape[2]
    if x.shape[1] == 2:
        for i in range(x.shape[0]):
            for j in range(c):
                n = 0.0
                t = 0.0
                for k in range(c):
                    n += nn[i, j, k] * x[i, 0, k]
                    t += tn[i, 0, j, k] * x[i, 0, k] + tt[i, 0, 0, j, k] * x[i, 1, k]
                out[i, 0, j] = n
                out[i, 1, j] = t
        return
    for i in range(x.shape[0]):
        for j in range(c):
            n = 0.0
            t = 0.0
            s = 0.0
            for k in range(c):
                pressed, one, other = x[i, 0, k], x[i, 1, k], x[i, 2, k]
                n += nn[i, j, k] * pressed
                t += tn[i, 0, j, k] * pressed
                t += tt[i, 0, 0, j, k] * one + tt[i, 0, 1, j, k] * other
                s += tn[i, 1, j, k] * pressed
                s += tt[i, 1, 0, j, k] * one + tt[i, 1, 1, j, k] * other
            out[i, 0, j] = n
            out[i, 1, j] = t
            out[i, 2, j] = s
