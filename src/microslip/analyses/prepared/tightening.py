"""Bolts tightened one after the other: amplitudes with which those that keep their length have their forces.

The force of such a bolt, ``F = C a - k y`` (`microslip.model.bolts`), depends on all bolts through the
structure and its contact, which is frictionless. In each step the amplitudes a of some bolts are sought:

    tightened in this step to a force      F = that force
    tightened in this step by s            a = k s beyond where it was snug
    tightened before                       a as it was: it keeps its length, and its force changes
    still to be tightened                  F = 0: it is loose, however far the parts move

Forces that are known take the place of lengths in the flexibility. With a = [a_s, a_o], the sought ones s and
the others o, port flexibility P and port vectors L at the pairs and G at the coordinates q of equilibrium,

    a_s = A^-1 (F_s - C_so a_o + k P_so a_o + k (G^T q - L^T r)),   A = C_ss - k P_ss,   H = A^-1 k,
    W -> W + L H L^T,   R -> R + L H G^T,   K_q -> K_q - G H G^T,

which is the same contact problem with these bolts as constant forces. Its solution is corrected by Newton's
method, with the slope of the pairs that touch, in the problem where a is given.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

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

MOST = 12
"""Corrections in one step of the tightening."""

PUSHES = 1e-8
"""Of the largest force: a bolt that pushes more is loose."""


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
        a = a + np.where(turn == step, by, 0.0)
        sought = np.flatnonzero((turn > step) | ((turn == step) & by_force))
        wanted = np.where(turn == step, target, 0.0)[sought]
        a = work.with_forces(model.amplitudes(on), a, sought, wanted)
        a, force = work.corrected(model.amplitudes(on), a, sought, wanted)
        history.append(force)
        _check_pull(plan.bolts, force, turn <= step, work.scale)
    return Tightened(plan.bolts, a, force, a / plan.bolts.stiffness, steps, np.array(history))


class _Wrench:
    """Forces of the bolts and their slope, as functions of the amplitudes."""

    def __init__(self, model: JointModel, flexibility: Flexibility, plan: Tightening) -> None:
        self.model, self.flexibility, self.bolts = model, flexibility, plan.bolts
        self.ports = np.array([model.port(name) for name in plan.bolts.names], dtype=np.int64)
        self.direct = np.zeros((len(plan.bolts.names), len(model.ports)))
        for name, force in plan.bolts.direct.items():
            self.direct[:, model.port(name)] = force
        self.scale = max(*plan.force.values(), *plan.amplitudes.values(), 0.0)

    def with_forces(self, constant: Array, a: Array, sought: Indices, wanted: Array) -> Array:
        """Amplitudes with the wanted forces of some bolts, from the contact with these as constant forces."""
        if not len(sought):
            return a
        f, k = self.flexibility, self.bolts.stiffness[sought]
        given = constant.copy()
        given[np.delete(self.ports, sought)] += np.delete(a, sought)
        ports = self.ports[sought]
        L, G = f.loads_v[:, ports], f.loads_q[:, ports]
        coupled = np.delete(self.bolts.coupling[sought], sought, axis=1) @ np.delete(a, sought)
        A = (
            self.bolts.coupling[np.ix_(sought, sought)]
            - k[:, None] * f.loads_loads[np.ix_(ports, ports)]
        )
        without = wanted + self.direct[sought] @ constant
        start = np.linalg.solve(A, without - coupled + k * (f.loads_loads[ports] @ given))
        H = np.linalg.solve(A, np.diag(k))
        H = 0.5 * (H + H.T)
        soft, turn = np.linalg.eigh(np.diag(f.stiffness) - G @ H @ G.T)
        loose = Flexibility(
            W=f.W + L @ H @ L.T,
            R=np.ascontiguousarray((f.R + L @ H @ G.T) @ turn),
            stiffness=np.maximum(soft, 0.0),
            loads_v=f.loads_v,
            loads_q=f.loads_q,
            loads_loads=f.loads_loads,
        )
        v = f.loads_v @ given + L @ start
        q = turn.T @ (f.loads_q @ given + G @ start)
        try:
            found = without_friction(self.model, loose, v, q, self.scale)
        except ContactError as error:
            names = ", ".join(repr(self.bolts.names[k]) for k in sought)
            raise ContactError(
                f"bolt {names}: cannot be tightened to a force: {error}. While its force is given a bolt "
                "holds no length, and a part that nothing else holds is loose: give its shortening in place "
                "of its force, a constant force without stiffness, or support the part"
            ) from None
        out = a.copy()
        out[sought] = start + H @ (G.T @ turn @ found.q - L.T @ found.r)
        return out

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
            allowed = EXACT * self.scale + ROUNDING * np.abs(a).max()
            if np.abs(left).max(initial=0.0) <= allowed:
                return a, force
            slope = self.slope(touches(found.status))[np.ix_(sought, sought)]
            a = a.copy()
            a[sought] -= np.linalg.lstsq(slope, left, rcond=None)[0]
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
