"""Displacements of the whole structure under loads that are held: back from the joint model.

With the load vectors p of the ports, their amplitudes a and the reactions r,

    K u = P a - B^T r,

of which the joint model keeps modes and a residual flexibility; both together are all of it, so that u is
that of the finite elements, and ``B u`` and ``P^T u`` are the relative displacements and the outputs that the
analyses have.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from microslip.analyses.statics.cycle import Cycle
from microslip.model.flexibility import Flexibility
from microslip.pipeline.prepare import Assembly
from microslip.typing import Array, Indices

FAINT = 1e-3
"""Weight of the springs of a nearly rigid motion beside the pairs that see it."""


def static_motion(assembly: Assembly, a: Array, r: Array, v: Array) -> Array:
    """Displacements from the unloaded structure, (s, n), of s equilibria.

    Parameters
    ----------
    assembly : Assembly
    a : (s, p) array
        Amplitudes of all ports of the joint model.
    r, v : (s, d m) arrays
        Reactions and relative displacements.
    """
    reducer, model, f = assembly.reducer, assembly.model, assembly.prepared.flexibility
    structure = assembly.structure
    vectors = {**structure.loads, **assembly.states.ports(structure)}
    known = [k for k, name in enumerate(model.ports) if name in vectors]
    loads = np.column_stack([vectors[model.ports[k]] for k in known])
    force = loads @ a[:, known].T - structure.interface.relative.T @ r.T
    rigid, shapes = reducer.equilibrium_modes, reducer.modes.shapes
    elastic = shapes[:, rigid:]
    x = reducer.residual_response(force)
    x += elastic @ ((elastic.T @ force) / model.omega[rigid:, None] ** 2)
    return np.asarray((x + shapes[:, :rigid] @ _nearly_rigid(f, a, r, v)).T)


def motion_from_prestress(
    assembly: Assembly, cycle: Cycle, steps: Sequence[int] | Indices
) -> Array:
    """Displacements from prestress, (s, n), at steps of a quasi-static cycle."""
    at = np.asarray(steps)
    model, start = assembly.model, assembly.prestress.solution
    a = np.tile(assembly.prepared.held, (len(at) + 1, 1))
    a[1:, model.port(cycle.port)] += cycle.load[at]
    r, v = np.vstack([start.r, cycle.r[at]]), np.vstack([start.v, cycle.v[at]])
    x = static_motion(assembly, a, r, v)
    return np.asarray(x[1:] - x[0])


def _nearly_rigid(f: Flexibility, a: Array, r: Array, v: Array) -> Array:
    """(e, s) coordinates of the modes that statics takes as unknowns: what the pairs see of them, and where
    these see nothing, what their springs balance."""
    if not len(f.stiffness):
        return np.zeros((0, len(a)))
    seen = v - a @ f.loads_v.T + r @ f.W
    pushed = a @ f.loads_q.T - r @ f.R
    springs = f.stiffness > 0
    rest = np.divide(pushed, f.stiffness, out=np.zeros_like(pushed), where=springs)
    weight = FAINT * np.abs(f.R).max(initial=0.0) or 1.0
    both = np.vstack([f.R, weight * np.diag(springs.astype(float))])
    return np.asarray(np.linalg.lstsq(both, np.hstack([seen, weight * rest]).T, rcond=None)[0])
