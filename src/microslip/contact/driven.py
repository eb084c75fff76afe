"""Contact over a cycle in which displacements are driven through a flexibility.

The bodies are where a periodic motion y takes them, and give way by W under the reactions,

    v(t) = y(t) - W r(t),

with the laws of contact at every sample, and friction with its memory. Nothing here has inertia: each sample
is a problem of statics, solved to its residual. The cycle is taken until it ends where it has begun. A pair
that slips in it forgets where it was; one that never does stays where it has stuck at first, or where slip on
the way to a periodic motion has left it.

Bodies that walk go on by a `walk` in every cycle, evenly: y is periodic but for that.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from microslip.contact.by_dimension import recall, solve_states
from microslip.contact.compiled import jit
from microslip.contact.pairs import BACKWARD, FORWARD, SLIP, STICK, at_rest, slip_history
from microslip.contact.path import PathRecord, follow_path
from microslip.contact.solver import ContactSolver, singularity_named
from microslip.errors import ContactError
from microslip.model.flexibility import Flexibility
from microslip.typing import Array, Mask, Status

MOST_CYCLES = 30
"""Cycles until one ends where it has begun."""

PERIODIC = 1e-10
"""How far from there it may end, over what the largest force makes of the softest pair."""

REMEMBERED = 4
"""Steps that an extrapolation takes into account."""

MOST_NUMBERS = 150_000_000
"""Of the responses of all samples: a gigabyte."""

AT_LIMIT = 1e-6
"""Share of its limit that a traction may miss that a slip has left there."""

FELT = 1e-8
"""Relative change of a derivative from one cycle to the next at which it is periodic."""


class DrivenCycle(NamedTuple):
    """What contact answers, sample by sample.

    Attributes
    ----------
    r, v : (N, d m) arrays
        Reactions and relative displacements, these without the walk.
    status : (N, m) int8 array
    record : PathRecord
        Of the last cycle that was taken, n = N steps.
    residual : float
        Largest complementarity residual of its samples.
    """

    r: Array
    v: Array
    status: Status
    record: PathRecord
    residual: float


class Extrapolation:
    """Fixed point of a contraction from its last steps (Anderson's method).

    Pairs that slip together forget where they were by and by, a few shapes of it slowly.

    Examples
    --------
    >>> way, x = Extrapolation(), np.array([0.0, 0.0])
    >>> for _ in range(4):
    ...     x = way.next(x, np.array([0.5, 0.9]) * x + 1.0)
    >>> np.round(x, 9).tolist()
    [2.0, 10.0]
    """

    def __init__(self) -> None:
        self.begun: list[Array] = []
        self.steps: list[Array] = []

    def next(self, begun: Array, ended: Array) -> Array:
        """Where to begin after a step from `begun` to `ended`."""
        self.begun = [*self.begun[-REMEMBERED:], begun.copy()]
        self.steps = [*self.steps[-REMEMBERED:], ended - begun]
        if len(self.steps) == 1:
            return ended.copy()
        dx = np.array([b - a for a, b in pairwise(self.begun)]).reshape(len(self.steps) - 1, -1)
        df = np.array([b - a for a, b in pairwise(self.steps)]).reshape(len(self.steps) - 1, -1)
        share = np.linalg.lstsq(df.T, self.steps[-1].ravel(), rcond=1e-10)[0]
        return ended - ((dx + df).T @ share).reshape(ended.shape)


class DrivenTangent:
    """Contact of a driven cycle, its states as they are: linear, with a memory.

    With dy from where the pairs stick each sample answers ``dr = dy response``; sticking pairs stay where
    they are, and others are where the sample leaves them. Pairs that stick all cycle stay where they stick.

    Parameters
    ----------
    W : (n, n) array
    response : (N, n, n) array
        Reactions, along the last axis, to displacements along the one before.
    sticks : (N, m) bool array
    """

    def __init__(self, W: Array, response: Array, sticks: Mask) -> None:
        self.W, self.response, self.sticks = W, response, sticks
        self.dimension = len(W) // sticks.shape[1]
        self.slips = np.flatnonzero(np.arange(len(W)) % self.dimension > 0)

    def times(self, dy: Array, walk: Array) -> Array:
        """Changes of the reactions, (N, n), by one of the motion, (N, n), and of the walk, (n,)."""
        N, moved = len(dy), walk[self.slips]
        changes = dy + np.arange(N)[:, None] / N * walk
        changes[0] += walk
        vt, way = np.zeros(len(moved)), Extrapolation()
        r = np.empty_like(changes)
        for _ in range(MOST_CYCLES):
            ended = vt.copy()
            carried(self.W, self.response, self.sticks, self.dimension, changes, ended, r)
            ended -= moved
            if np.abs(ended - vt).max(initial=0.0) <= FELT * np.abs(ended).max(initial=0.0):
                break
            vt = way.next(vt, ended)
        return r

    def matrix(self, columns: Array, basis: Array, projection: Array) -> Array:
        """What a motion ``columns zeta(t)`` does to the forces ``columns^T r(t)``, both by coefficients.

        Parameters
        ----------
        columns : (n, k) array
        basis, projection : (c, N) arrays
            Of `samples.SampleTable`.

        Returns
        -------
        (k, c, k, c) array
            Of pairs that forget within a cycle; of others nearly.
        """
        k, (c, N) = columns.shape[1], basis.shape
        moving = self.response.transpose(0, 2, 1) @ columns
        holding = self.response[:, self.slips].transpose(0, 2, 1)
        pushes = np.einsum("nk,tnj->tkj", columns, holding, optimize=True)
        direct = np.einsum("ni,tnj->tij", columns, moving, optimize=True)
        W = self.W[self.slips]
        goes = columns[self.slips] - W @ moving
        stays = W @ holding
        free = ~np.repeat(self.sticks, self.dimension - 1, axis=1)
        vt = np.zeros((len(self.slips), k, c))
        forces = np.empty((N, k, k * c))
        for t in np.r_[1:N, 0:N, 0]:
            forces[t] = (direct[t][:, :, None] * basis[:, t]).reshape(k, -1)
            forces[t] -= pushes[t] @ vt.reshape(len(vt), -1)
            rows = np.flatnonzero(free[t])
            new = (stays[t][rows] @ vt.reshape(len(vt), -1)).reshape(-1, k, c)
            vt[rows] = new + goes[t][rows][:, :, None] * basis[:, t]
        found = (projection @ forces.reshape(N, -1)).reshape(c, k, k, c)
        return np.asarray(found.transpose(1, 0, 2, 3))


@jit
def carried(W, response, sticks, d, changes, vt, r):
    """Take changes of a motion once round the cycle, from those of where pairs stick, to these at its end."""
    N, n = changes.shape
    w = np.empty(n)
    for step in range(1, N + 1):
        t = step if step < N else 0
        place = 0
        for i in range(n):
            w[i] = changes[t, i]
            if i % d > 0:
                w[i] -= vt[place]
                place += 1
        r[t] = np.dot(w, response[t])
        place = 0
        for i in range(n):
            if i % d > 0:
                if not sticks[t, i // d]:
                    x = changes[t, i]
                    for j in range(n):
                        x -= W[i, j] * r[t, j]
                    vt[place] = x
                place += 1


class DrivenContact:
    """Pairs behind a flexibility.

    Parameters
    ----------
    W : (d m, d m) array
        Flexibility, symmetric and positive definite.
    friction : (m,) array
    force : (m,) array
        Typical force of each pair, the scale of residuals.

    Examples
    --------
    A pair with mu = 0.5 behind the flexibility 1 that is pressed in by 1 and moved sideways: its traction
    follows the displacement up to the limit.

    >>> contact = DrivenContact(np.eye(2), np.array([0.5]), np.array([1.0]))
    >>> sideways = 2 * np.sin(2 * np.pi * np.arange(8) / 8)
    >>> y = np.column_stack([np.ones(8), sideways])
    >>> cycle = contact.cycle(y, np.zeros(1))
    >>> np.round(cycle.r[:, 1], 3).tolist()
    [0.5, 0.5, 0.5, -0.086, -0.5, -0.5, -0.5, 0.086]
    """

    def __init__(self, W: Array, friction: Array, force: Array) -> None:
        n, m = len(W), len(force)
        none = np.zeros((n, 0))
        self.flexibility = Flexibility(
            np.ascontiguousarray(W), none, np.zeros(0), np.eye(n), none.T, np.zeros((n, n))
        )
        self.solver = ContactSolver(self.flexibility, friction, force, at_rest(np.ones(m, bool)))
        self.scale = float(np.diag(W).max() * np.max(force))

    def cycle(self, y: Array, held: Array, walk: Array | None = None) -> DrivenCycle:
        """What contact answers to a periodic motion.

        Parameters
        ----------
        y : (N, d m) array
            At N equal steps of the cycle.
        held : (m,) or (m, 2) array
            Tangential displacement at which each pair sticks at first, as `pairs.slip_history` gives it.
        walk : (d m,) array, optional
            How much farther the bodies are after a cycle.

        Raises
        ------
        ContactError
            Where a sample is not solved, or the cycle does not become periodic.
        """
        solver, N = self.solver, len(y)
        walk = np.zeros(y.shape[1]) if walk is None else walk
        ramp = np.arange(N + 1)[:, None] / N * walk
        path = np.vstack([y, y[:1]]) + ramp
        moved = slip_history(walk, solver.dimension)
        vt = np.array(held, dtype=float)
        if moved.any():
            # all that touch are at their limit, where a walk takes them in the end
            size = np.abs(moved).max()
            vt = slip_history(y[0], solver.dimension) - moved * (self._far(y) / size)
        way = Extrapolation()
        slipped = np.full((N, len(solver.status)), STICK, np.int8)
        for _ in range(MOST_CYCLES):
            solver.solve(path[0], np.zeros(0), vt)
            vt[...] = slip_history(solver.v, solver.dimension)
            begun = vt.copy()
            record = follow_path(
                solver, self.flexibility, path, vt, where=_of_sample, remedy="take more harmonics"
            )
            vt -= moved
            slips = _slips(record.status[1:]).any(axis=0)
            slipped[:, slips] = record.status[1:, slips]
            if np.abs(vt - begun).max(initial=0.0) <= PERIODIC * self.scale:
                break
            vt = way.next(begun, vt)
        else:
            raise ContactError(
                f"contact has not come to a periodic motion in {MOST_CYCLES} cycles of driven displacements"
            )
        order = np.r_[N, 1:N]
        record.status[1:] = self._left_by_slip(record, slipped)
        return DrivenCycle(
            r=record.r[order],
            v=record.v[order] - ramp[order],
            status=record.status[order],
            record=record,
            residual=float(record.residual.max()),
        )

    def _left_by_slip(self, record: PathRecord, slipped: Status) -> Status:
        """States of a periodic cycle, (N, m); those of pairs that slip on the way to it have done so once.

        Such a pair sticks where its last slip has left it, at its limit in that sample alone: where it is
        changes with the motion as if it slipped there. `slipped` are the states of its last cycle with slip.
        """
        states = record.status[1:].copy()
        if self.solver.dimension != 2:
            return states
        for i in np.flatnonzero((states == STICK).all(axis=0)):
            slips = np.flatnonzero(_slips(slipped[:, i]))
            if len(slips) == 0:
                continue
            last = slips[-1]
            pressed = self.solver.friction[i] * record.r[last + 1, 2 * i]
            if abs(record.r[last + 1, 2 * i + 1]) >= (1 - AT_LIMIT) * pressed:
                states[last, i] = slipped[last, i]
        return states

    def _far(self, y: Array) -> float:
        """A slip that no friction holds, m."""
        return float(np.ptp(y, axis=0).max() + 10 * self.scale)

    def linearised(self, cycle: DrivenCycle) -> DrivenTangent:
        """What small changes of the motion do.

        Raises
        ------
        ContactError
            Where the states of a sample make its equations singular.
        """
        N, n = cycle.r.shape
        record = cycle.record
        # a pair without friction that has no slip by chance does not stick
        slides = (record.status == STICK) & (self.solver.friction == 0)
        record = record._replace(status=np.where(slides, SLIP, record.status).astype(np.int8))
        if N * n**2 > MOST_NUMBERS:
            raise ContactError(
                f"{N} samples of {n} components are too many to linearise: take fewer harmonics"
            )
        response = np.empty((N, n, n))
        with singularity_named():
            responses(
                self.solver.problem,
                self.solver.kernels.tableau.memory(cycle.status.shape[1], 0),
                record,
                np.eye(n),
                response,
            )
        sticks = record.status[np.r_[N, 1:N]] == STICK
        return DrivenTangent(self.flexibility.W, response, sticks)


def _slips(status: Status) -> Mask:
    """Which planar pairs and samples slip."""
    return np.asarray((status == FORWARD) | (status == BACKWARD))


def _of_sample(sample: int) -> str:
    return "of a driven cycle"


@jit
def responses(problem, memory, record, columns, out):
    """Reactions to small displacements of each sample of a cycle, (N, c, d m), with its states.

    The last step of its record is the first sample.
    """
    status, r, v = record.status, record.r, record.v
    count, n = columns.shape
    weights = np.empty((count, n))
    x = np.empty((count, n))
    for step in range(1, status.shape[0]):
        recall(problem, memory, status[step], r[step], v[step] - v[step - 1])
        for a in range(count):
            for i in range(n):
                weights[a, i] = columns[a, i] if memory.held[i] else 0.0
        sample = step if step < out.shape[0] else 0
        solve_states(problem, memory, status[step], columns, weights, x, out[sample])
