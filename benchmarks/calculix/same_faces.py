"""Our solver on contact points of the faces in space, and with what CalculiX does to a pair that opens.

CalculiX cuts the faces of the slave along those of the master and has contact at points of the pieces, each
behind its own penalty springs. So it is here: pairs of `microslip` at quadrature points of the segments of
`microslip.model.mortar.segments`, with the compliance ``1 / (k weight)``.

A pair that has opened has no traction, and where it lands it has none: that is Coulomb's law. CalculiX keeps
the slip of the last increment in which it touched, and friction pulls the pair back to there
(`lifted_pair.py`). `cycle_of_ccx` does the same.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from microslip.analyses.prepared.joint import prepare_joint
from microslip.analyses.statics.start import prestressed_solver
from microslip.contact.law import contact_law
from microslip.contact.pairs import slip_history, touches
from microslip.errors import ModelError
from microslip.model.interface import Interface
from microslip.model.joint import Reducer
from microslip.model.mesh.facets import facets_of
from microslip.model.mortar.coupling import couple
from microslip.model.mortar.segments import segments

REACH = 1e-3
"""Faces are coupled up to this far apart, m: they lie on one plane."""


def point_interface(mesh, first, second, degree):
    """Contact pairs at the quadrature points of what two flat surfaces share, ascending in position.

    Parameters
    ----------
    mesh : FiniteElementMesh
        In space.
    first, second : str
        Surfaces that lie on one plane; the first is the slave.
    degree : int
        Of the quadrature on triangles: 3 points up to 2, 7 points up to 5.
    """
    frame = couple(mesh, first, second, slave=first)
    normal, tangents = frame.normal[0], frame.tangents[0]
    if not np.allclose(frame.normal, normal, atol=1e-9):
        raise ModelError(f"{first!r} is not flat")
    sides = facets_of(mesh, first), facets_of(mesh, second)
    # the slave is the lower side, or the upper one
    sign = 1.0 if frame.slave_below else -1.0
    directions = np.vstack([-normal, tangents])
    blocks, weights, places = [], [], []
    for _, found in segments(*sides, REACH, degree):
        count = found.weight.size
        jump = sp.csr_matrix((count, len(mesh.points)))
        for nodes, shapes, side in (
            (found.slave_nodes, found.slave_shapes, -sign),
            (found.master_nodes, found.master_shapes, sign),
        ):
            q, k = shapes.shape[1:]
            rows = np.repeat(np.arange(count), k)
            columns = np.repeat(nodes[:, None], q, axis=1).ravel()
            jump += sp.csr_matrix((side * shapes.ravel(), (rows, columns)), shape=jump.shape)
        blocks.append(sp.kron(jump, directions, format="csr"))
        weights.append(found.weight.ravel())
        own = np.repeat(found.slave_nodes[:, None], found.weight.shape[1], axis=1)
        places.append(
            np.einsum("sqk,sqkd->sqd", found.slave_shapes, mesh.points[own]).reshape(-1, 3)
        )
    along = np.concatenate(places) @ tangents[0]
    order = np.argsort(along, kind="stable")
    rows = (3 * order[:, None] + np.arange(3)).ravel()
    return Interface(
        along[order], np.concatenate(weights)[order], sp.vstack(blocks)[rows].tocsr(), 3
    )


def prepared_points(structure, interface, joint, stiffness, port):
    """The joint with contact at those points, behind springs of `stiffness` Pa/m both ways."""
    structure = replace(structure, interface=interface)
    model = Reducer(structure, joint.modes_kept, (0.0, 0.0), free=True).model(structure.loads)
    compliance = np.repeat(1 / (stiffness * interface.area), 3)
    law = contact_law(model.pairs, joint.interface[0].friction, compliance, 3)
    return prepare_joint(model, law, {each.name: each.force for each in joint.preload}, port)


def step_of_ccx(solver, v_free, f_q, sticks_at):
    """Solve a load step; pairs that are open keep the slip at which they last touched.

    With Coulomb's law they forget it. `sticks_at`, of `microslip.contact.pairs.slip_history`, is changed in
    place.
    """
    found = solver.solve(v_free, f_q, sticks_at)
    closed = touches(found.status)
    sticks_at[closed] = slip_history(found.v, solver.dimension)[closed]
    return found


def cycle_of_ccx(prepared, port, amplitude, factors):
    """Output of a port at the end of each load step, where friction drags pairs that open."""
    f, column, held = prepared.flexibility, prepared.model.port(port), prepared.held
    start = prepared.prestress.solution
    solver = prestressed_solver(prepared)
    sticks_at = slip_history(start.v, prepared.model.dimension)
    out = []
    for factor in factors:
        load = held.copy()
        load[column] += amplitude * factor
        found = step_of_ccx(solver, f.loads_v @ load, f.loads_q @ load, sticks_at)
        out.append(f.outputs(load, found.q, found.r)[column])
    return np.array(out) - f.outputs(held, start.q, start.r)[column]
