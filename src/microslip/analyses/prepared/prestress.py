"""Contact under the preload alone, and the load that opens the joint.

Prestress is without friction, so that the interface starts with no memory.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linprog

from microslip.brief import Brief
from microslip.contact.pairs import FORWARD, at_rest, normal, normal_rows, touches
from microslip.contact.solver import ContactSolver, Solution
from microslip.errors import ContactError
from microslip.model.flexibility import Flexibility
from microslip.model.joint import JointModel
from microslip.typing import Array, Indices, Mask, Status


@dataclass(frozen=True, repr=False)
class Prestress(Brief):
    """Contact under the preload alone, frictionless.

    Attributes
    ----------
    preload : mapping of str to float
        Amplitude of every port that is held, N per metre of width where it is a force.
    solution : Solution
    pressure : (m,) array
        Pa.
    touching : (m,) bool array
    """

    preload: Mapping[str, float]
    solution: Solution
    pressure: Array
    touching: Mask

    @property
    def force(self) -> float:
        """Size of the preload, sum of its amplitudes: every field of a receding contact scales with it."""
        return float(sum(abs(a) for a in self.preload.values()))

    @property
    def largest_reaction(self) -> float:
        """Largest reaction, N per metre of width: the unit of residuals and changes."""
        return float(np.abs(self.solution.r).max())

    @property
    def status(self) -> Status:
        """Contact states to start from: pairs that touch stick."""
        return at_rest(self.touching)

    def bonded(self, directions: int) -> Indices:
        """Components of v of the touching pairs: the normal one, or the first `directions`."""
        pairs = np.flatnonzero(self.touching)
        d = len(self.solution.v) // len(self.touching)
        return np.sort((d * pairs[:, None] + np.arange(directions)).ravel())


def prestress(
    model: JointModel, flexibility: Flexibility, preload: Mapping[str, float]
) -> Prestress:
    """Frictionless contact under the preload.

    Parameters
    ----------
    model : JointModel
    flexibility : Flexibility
        Static, see `microslip.model.flexibility.static_flexibility`.
    preload : mapping of str to float
        Ports and their amplitudes, > 0: N per metre of width.

    Raises
    ------
    ContactError
        Where the preload presses no pair together or the solver does not converge.
    """
    for name, amplitude in preload.items():
        if not 0 < amplitude < np.inf:
            raise ContactError(f"preload {name!r} is {amplitude:g}: it must be positive")
    if not preload:
        raise ContactError("no preload: nothing presses the contact together")
    a = model.amplitudes(preload)
    force = sum(preload.values()) * model.area / model.area.sum()
    start = np.full(model.pairs, FORWARD, dtype=np.int8)
    solver = ContactSolver(flexibility, 0.0, force, start)
    solution = solver.solve(flexibility.loads_v @ a, flexibility.loads_q @ a, np.zeros(model.pairs))
    touching = touches(solution.status)
    if not touching.any():
        raise ContactError("no contact pair touches under the preload: is it pulling?")
    pressure = normal(solution.r, model.dimension) / model.area
    return Prestress(dict(preload), solution, pressure, touching)


def opening_load(model: JointModel, flexibility: Flexibility, start: Prestress, port: str) -> float:
    """Largest amplitude of a port that the preloaded contact can balance (limit analysis).

    Maximises ``A`` over compressive reactions that keep the nearly rigid bodies in equilibrium
    with the preload and ``±A`` on the port, their soft supports left out. Beyond it the joint opens;
    infinite where the load does not move the bodies.
    """
    d, m = model.dimension, model.pairs
    held = flexibility.loads_q @ (model.amplitudes(start.preload) / start.force)
    load = flexibility.loads_q[:, [model.port(port)]]
    size = np.abs(load).max(initial=0.0)
    if not (size * 1e-12 > 0 and flexibility.R.shape[1]):
        return float("inf")
    normals = np.arange(d * m)[normal_rows(d)]
    rest = np.delete(np.arange(d * m), normal_rows(d))
    columns = [flexibility.R[normals].T, flexibility.R[rest].T]
    bounds = [(0, None)] * m + [(None, None)] * (d - 1) * m + [(0, None)]
    limits = []
    for sign in (1.0, -1.0):
        found = linprog(
            np.r_[np.zeros(d * m), -1.0],
            A_eq=np.hstack([*columns, -sign * load / size]),
            b_eq=held,
            bounds=bounds,
            method="highs",
        )
        limits.append(found.x[-1] * start.force / size if found.status == 0 else np.inf)
    return float(min(limits))
