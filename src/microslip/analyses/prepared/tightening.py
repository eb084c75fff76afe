"""Bolts tightened one after the other: amplitudes with which those that keep their length have their forces.

The force of such a bolt, ``F = C a - k y`` (`microslip.model.bolts`), depends on all bolts through the
structure and its contact, which is frictionless. In each step the amplitudes a of some bolts are sought:

    tightened in this step to a force      F = that force
    tightened in this step by s            a = k s beyond where it was snug: all but without force
    tightened before                       a as it was: it keeps its length, and its force changes
    still to be tightened                  F = 0: it is loose, however far the parts move

Amplitudes that are sought join the coordinates q of equilibrium, and the forces that are known its loads.
With a = [a_s, a_o], the sought ones s and the others o, port flexibility P and port vectors L at the pairs
and G at q,

    K_q q - G a_s + R^T r                      = loads_q^T a_o
    -G^T q + (k^-1 C_ss - P_ss) a_s + L^T r    = k^-1 (F_s - C_so a_o) + P_so a_o
    v = loads_v a_o + R q + L a_s - W r,

which is a contact problem as others are: k^-1 C is symmetric. A part that only loose bolts would hold has no
stiffness in it: a weak one holds its place. The solution is corrected by Newton's method, with the slope of
the pairs that touch, in the problem where a is given and nothing is weak.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from microslip.analyses.prepared.balance import PULLED, parts_bodies
from microslip.analyses.prepared.prestress import without_friction
from microslip.brief import Brief
from microslip.contact.pairs import normal_rows, touches
from microslip.contact.solver import Solution
from microslip.errors import ContactError
from microslip.model.bolts import Bolts, Tightening
from microslip.model.flexibility import Flexibility
from microslip.model.joint import JointModel
from microslip.typing import Array, Indices, Mask

EXACT = 1e-10
"""Of the largest force: what a bolt may lack of its own."""

ROUNDING = 1e-12
"""Of the amplitudes: what forces may lack as well, which of stiff bolts are small differences."""

NO_SLOPE = 1e-6
"""Of the largest slope: combinations of bolts that change no force, whose parts are loose, are left alone."""

MOST = 12
"""Corrections in one step of the tightening."""

HOLDS = 1e-3
"""Of the stiffness of the pairs: that which holds loose parts in place while amplitudes are first sought."""

ROUNDED = 1e-6
"""Of the terms of a load on a loose part: what is rounding, and would carry it far away."""

LOOSE, KNOWN = 1e-7, 1e-6
"""Of the stiffness of the pairs and of that of bolts: stiffness of a motion below which nothing holds it. The
springs of `microslip.model.loose` have 1e-8 of the former; of the latter the stiffness of loose parts is a
small difference."""

FIRM, SNUG = 1e-2, 1e-6
"""Of the largest force: that which draws loose parts together, and that of a bolt that has just met them."""

SOFT = 1e3
"""Flexibility over that of the pairs beyond which a motion of the bodies is an unknown of equilibrium."""

PUSHES = 1e-8
"""Of the largest force: a bolt that pushes more is loose, and one that is loose has less."""


@dataclass(frozen=True, repr=False)
class Tightened(Brief):
    """Bolts that keep their length, after all have been tightened.

    Attributes
    ----------
    bolts : Bolts
    amplitude : (b,) array
        Of their ports, N per metre of width.
    force : (b,) array
        N per metre of width.
    shortening : (b,) array
        s, m.
    steps : tuple of int
        The numbers of the order, ascending.
    history : (n, b) array
        Forces after each step.
    """

    bolts: Bolts
    amplitude: Array
    force: Array
    shortening: Array
    steps: tuple[int, ...]
    history: Array

    @property
    def preload(self) -> dict[str, float]:
        """Amplitudes by port."""
        return {name: float(a) for name, a in zip(self.bolts.names, self.amplitude, strict=True)}

    @property
    def rows(self) -> list[tuple[str, float, float]]:
        """Name, force and shortening of each."""
        found = zip(self.bolts.names, self.force, self.shortening, strict=True)
        return [(name, float(force), float(by)) for name, force, by in found]


def tighten(
    model: JointModel,
    flexibility: Flexibility,
    held: Mapping[str, float],
    plan: Tightening,
) -> Tightened:
    """Tighten bolts in their order.

    Parameters
    ----------
    model : JointModel
    flexibility : Flexibility
        Static, with the compliance of the contact.
    held : mapping of str to float
        Amplitudes of what is constant: applied from its place in the order on, from the beginning where it
        has none.
    plan : Tightening

    Raises
    ------
    ContactError
        Where no amplitude gives a bolt its force, or one that was tightened would have to push.
    """
    work = _Wrench(model, flexibility, plan)
    names, steps = plan.bolts.names, tuple(sorted(set(plan.order.values())))
    constant = {name: value for name, value in held.items() if name not in names}
    turn = np.array([plan.order[name] for name in names])
    by_force = np.array([name in plan.force for name in names])
    target = np.array([plan.force.get(name, 0.0) for name in names])
    by = np.array([plan.amplitudes.get(name, 0.0) for name in names])
    a = np.zeros(len(names))
    history = []

    for step in steps:
        on = {name: x for name, x in constant.items() if plan.order.get(name, step) <= step}
        now = turn == step
        if step > steps[0] and (now & ~by_force).any():
            before = {n: x for n, x in constant.items() if plan.order.get(n, step - 1) < step}
            a = work.met(model.amplitudes(before), a, np.flatnonzero(turn >= step), now & ~by_force)
        a = a + np.where(now, by, 0.0)
        sought = np.flatnonzero((turn > step) | (now & by_force))
        wanted = np.where(now, target, 0.0)[sought]
        a, force = work.tightened(model.amplitudes(on), a, sought, wanted)
        history.append(force)
        _check_pull(plan.bolts, force, turn <= step, work.scale)
    return Tightened(plan.bolts, a, force, a / plan.bolts.stiffness, steps, np.array(history))


class _Equations(NamedTuple):
    """Equilibrium of the coordinates q and the sought amplitudes, so scaled that each moves pairs by one.

    Attributes
    ----------
    motions : (d m, n) array
        R and L.
    stiffness : (n, n) array
        Without what only holds the place of parts (`microslip.model.loose`).
    loads : (n,) array
    scale : (n,) array
    given : (p,) array
        Amplitudes of all ports but the sought ones.
    terms : float
        Size of what loads on loose parts are sums of.
    nothing : float
        Stiffness of a motion below which nothing holds it.
    """

    motions: Array
    stiffness: Array
    loads: Array
    scale: Array
    given: Array
    terms: float
    nothing: float


class _Wrench:
    """Forces of the bolts and their slope, as functions of the amplitudes."""

    def __init__(self, model: JointModel, flexibility: Flexibility, plan: Tightening) -> None:
        self.model, self.flexibility, self.bolts = model, flexibility, plan.bolts
        self.ports = np.array([model.port(name) for name in plan.bolts.names], dtype=np.int64)
        self.direct = np.zeros((len(plan.bolts.names), len(model.ports)))
        for name, force in plan.bolts.direct.items():
            self.direct[:, model.port(name)] = force
        self.scale = max(*plan.force.values(), *plan.amplitudes.values(), 0.0)
        self.pair_stiffness = 1 / float(np.diag(flexibility.W).max())

    def met(self, constant: Array, a: Array, sought: Indices, meeting: Mask) -> Array:
        """Amplitudes at which some of the loose bolts have just met their parts, drawn together before."""
        force = np.where(meeting, self.scale, 0.0)[sought]
        a, _ = self.tightened(constant, a, sought, FIRM * force)
        return self.corrected(constant, a, sought, SNUG * force)[0]

    def tightened(
        self, constant: Array, a: Array, sought: Indices, wanted: Array
    ) -> tuple[Array, Array]:
        """Amplitudes with the wanted forces of some bolts, and the forces of all."""
        near = self.with_forces(constant, a, sought, wanted)
        return self.corrected(constant, near, sought, wanted)

    def with_forces(self, constant: Array, a: Array, sought: Indices, wanted: Array) -> Array:
        """Nearly the same, with the sought amplitudes as coordinates of equilibrium and loose parts held."""
        if not len(sought):
            return a
        f, e = self.flexibility, self._equations(constant, a, sought, wanted)
        held, turn = np.linalg.eigh(e.stiffness)
        R, loads = e.motions @ turn, turn.T @ e.loads
        free = held <= e.nothing
        pulled = parts_bodies(R[:, free], self.model.dimension, loads[free], e.terms)
        held[free] = HOLDS * self.pair_stiffness
        loads[free & (np.abs(loads) <= ROUNDED * e.terms)] = 0.0
        # with what is stiff as an unknown, equilibrium would be small differences of large forces
        stiff = ~free & (self.pair_stiffness * np.abs(R).max(axis=0) ** 2 < SOFT * held)
        give = R[:, stiff] / held[stiff]
        extended = replace(
            f,
            W=f.W + give @ R[:, stiff].T,
            R=np.ascontiguousarray(R[:, ~stiff]),
            stiffness=held[~stiff],
        )
        v = f.loads_v @ e.given + give @ loads[stiff]
        try:
            if pulled:
                raise ContactError(f"{PULLED}; while its force is given a bolt holds no length")
            found = without_friction(self.model, extended, v, loads[~stiff], self.scale)
        except ContactError as error:
            named = ", ".join(repr(self.bolts.names[n]) for n in sought)
            raise ContactError(f"bolt {named}: cannot be tightened to a force: {error}") from None
        z = (loads - R.T @ found.r) / held
        z[~stiff] = found.q
        out = a.copy()
        out[sought] = (e.scale * (turn @ z))[len(f.stiffness) :]
        return out

    def _equations(self, constant: Array, a: Array, sought: Indices, wanted: Array) -> _Equations:
        f, k = self.flexibility, self.bolts.stiffness[sought]
        ports, others = self.ports[sought], np.delete(self.ports, sought)
        given = constant.copy()
        given[others] += np.delete(a, sought)
        L, G, P = f.loads_v[:, ports], f.loads_q[:, ports], f.loads_loads[ports]
        coupled = np.delete(self.bolts.coupling[sought], sought, axis=1) @ np.delete(a, sought)
        known = (wanted + self.direct[sought] @ constant - coupled) / k
        own = self.bolts.coupling[np.ix_(sought, sought)] / k[:, None] - P[:, ports]
        motions = np.hstack([f.R, L])
        scale = 1 / np.abs(motions).max(axis=0)
        stiffness = scale[:, None] * np.block([[np.diag(f.stiffness), -G], [-G.T, own]]) * scale
        loose, of_bolts = self.model.loose_motions, scale[len(f.stiffness) :]
        stiffness[:loose, :loose] = 0.0
        apart = np.sqrt(np.diag(f.loads_loads))
        terms = of_bolts * (apart[ports] * (apart @ np.abs(given)) + np.abs(known))
        return _Equations(
            motions=motions * scale,
            stiffness=0.5 * (stiffness + stiffness.T),
            loads=scale * np.concatenate([f.loads_q @ given, known + P @ given]),
            scale=scale,
            given=given,
            terms=float(terms.max()),
            nothing=max(LOOSE * self.pair_stiffness, KNOWN * float((of_bolts**2 / k).max())),
        )

    def solved(self, constant: Array, a: Array) -> tuple[Array, Solution]:
        """Forces of the bolts, and the contact."""
        amplitudes = constant.copy()
        amplitudes[self.ports] += a
        f = self.flexibility
        v, q = f.loads_v @ amplitudes, f.loads_q @ amplitudes
        found = without_friction(self.model, f, v, q, self.scale)
        y = self.flexibility.outputs(amplitudes, found.q, found.r)[self.ports]
        return self.bolts.forces(a, y) - self.direct @ amplitudes, found

    def slope(self, touching: Mask) -> Array:
        """(b, b) derivative of the forces by the amplitudes, with the pairs that touch."""
        f, b = self.flexibility, self.ports
        rows = normal_rows(self.model.dimension)
        at = np.arange(len(f.W))[rows][touching]
        R, V = f.R[at], f.loads_v[at][:, b]
        n = len(at)
        system = np.block([[f.W[np.ix_(at, at)], -R], [R.T, np.diag(f.stiffness)]])
        moved = np.linalg.lstsq(system, np.vstack([V, f.loads_q[:, b]]), rcond=None)[0]
        y = f.loads_loads[np.ix_(b, b)] + f.loads_q[:, b].T @ moved[n:] - V.T @ moved[:n]
        return self.bolts.coupling - self.bolts.stiffness[:, None] * y

    def corrected(
        self, constant: Array, a: Array, sought: Indices, wanted: Array
    ) -> tuple[Array, Array]:
        """Amplitudes with the wanted forces of some bolts, from ones nearby, and the forces of all."""
        force, found = self.solved(constant, a)
        for _ in range(MOST):
            left = force[sought] - wanted
            exact = np.where(wanted <= SNUG * self.scale, PUSHES, EXACT)
            if (np.abs(left) <= exact * self.scale + ROUNDING * np.abs(a).max()).all():
                return a, force
            slope = self.slope(touches(found.status))[np.ix_(sought, sought)]
            a = a.copy()
            a[sought] -= np.linalg.lstsq(slope, left, rcond=NO_SLOPE)[0]
            force, found = self.solved(constant, a)
        worst = int(sought[np.argmax(np.abs(left))])
        raise ContactError(
            f"bolt {self.bolts.names[worst]!r} cannot be tightened: shortened by "
            f"{a[worst] / self.bolts.stiffness[worst]:.3g} m it has {force[worst]:.4g} N/m; does it close "
            "anything, and is what it acts on supported?"
        )


def _check_pull(bolts: Bolts, force: Array, tight: Mask, scale: float) -> None:
    """Raise `ContactError` where a bolt that was tightened has come loose."""
    loose = tight & (force < -PUSHES * scale)
    if loose.any():
        k = int(np.argmax(loose))
        raise ContactError(
            f"bolt {bolts.names[k]!r} comes loose: keeping its length it would have to push with "
            f"{-force[k]:.4g} N/m; tighten it later (order), or give it more force"
        )
