"""A joint taken slowly along any path of its loads: what moves, slips and is dissipated on the way."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.statics.start import (
    check_held,
    check_stays_closed,
    held_path,
    prestressed_solver,
)
from microslip.brief import Brief
from microslip.contact.fields import ContactFields, contact_fields
from microslip.contact.pairs import slip_history
from microslip.contact.path import FRICTION
from microslip.errors import ModelError
from microslip.typing import Array, Status


@dataclass(frozen=True, repr=False)
class Loading(Brief):
    """Quasi-static response along a path of loads, from prestress on.

    Attributes
    ----------
    ports : tuple of str
        All ports of the model.
    load : (n, p) array
        Amplitudes of the ports beyond the preload, in their units.
    output : (n, p) array
        Output of every port, change from prestress.
    r, v : (n, d m) arrays
        Reactions and relative displacements of the pairs.
    status : (n, m) int8 array
    work : (n, m) array
        Dissipated by each pair from the start up to each point, J per metre of width.
    residual : (n,) array
    rest : (d m,) array
        Relative displacements at prestress.
    area : (m,) array
    """

    ports: tuple[str, ...]
    load: Array
    output: Array
    r: Array
    v: Array
    status: Status
    work: Array
    residual: Array
    rest: Array
    area: Array

    def of(self, port: str) -> tuple[Array, Array]:
        """Load and output of a port, both (n,): what a hysteresis loop is drawn of."""
        if port not in self.ports:
            raise ModelError(f"no port {port!r}; this model has {', '.join(self.ports)}")
        k = self.ports.index(port)
        return self.load[:, k], self.output[:, k]

    @property
    def fields(self) -> ContactFields:
        """Pressure, traction, slip and gap, each (n, m); spatial vectors (n, m, 2)."""
        return contact_fields(self.r, self.v, self.rest, self.area)

    @property
    def dissipated(self) -> Array:
        """(n,) dissipated by all pairs from the start up to each point, J per metre of width."""
        return np.asarray(self.work.sum(axis=1))


def load_path(joint: PreparedJoint, loads: Mapping[str, Array], *, steps: int = 1) -> Loading:
    """Take a joint slowly along a path of its loads.

    The path begins at prestress, from where the first point is reached in a straight line.

    Parameters
    ----------
    joint : PreparedJoint
        Planar.
    loads : mapping of str to (n,) array
        Amplitudes of ports beyond the preload, in their units; ports left out stay at 0.
    steps : int
        Load steps to every point of the path: more where friction is to be resolved in between.

    Returns
    -------
    Loading
        One row for every point.

    Raises
    ------
    ModelError
        Where there is no such port, or the loads are no path.
    JointOpensError
        Where one load alone is beyond what the preload holds.
    ContactError
        Where a step does not solve; names it.

    Examples
    --------
    >>> import microslip
    >>> joint = microslip.prepare(microslip.reference_joint(pairs=21))
    >>> there = np.linspace(0, 400, 50)
    >>> found = microslip.load_path(joint, {"moment": np.r_[there, there[::-1]]})
    >>> moment, rotation = found.of("moment")
    >>> bool(rotation[-1] > 0 and found.dissipated[-1] > 0)  # it does not come back all the way
    True
    """
    model, start, f = joint.model, joint.prestress, joint.flexibility
    wanted = _as_path(joint, loads)
    check = check_held if len(loads) == 1 else check_stays_closed
    for name in loads:
        check(joint, name, float(np.abs(wanted[:, model.port(name)]).max()))
    corners = np.vstack([np.zeros(len(model.ports)), wanted])
    at = np.arange(len(wanted) * steps + 1) / steps
    fine = np.column_stack([np.interp(at, np.arange(len(corners)), y) for y in corners.T])
    path = joint.held + fine
    record = held_path(
        joint,
        path,
        slip_history(start.solution.v, model.dimension),
        solver=prestressed_solver(joint),
        port=next(iter(loads)) if len(loads) == 1 else None,
        where=lambda step: f"(point {-(-step // steps)} of {len(wanted)})",
        remedy="try more steps",
    )
    output = f.outputs(path, record.q, record.r)
    kept = slice(steps, None, steps)
    return Loading(
        ports=model.ports,
        load=wanted,
        output=output[kept] - output[0],
        r=record.r[kept],
        v=record.v[kept],
        status=record.status[kept],
        work=np.cumsum(record.work[:, :, FRICTION], axis=0)[kept],
        residual=np.maximum.reduceat(record.residual[1:], np.arange(0, len(wanted) * steps, steps)),
        rest=start.solution.v,
        area=model.area,
    )


def _as_path(joint: PreparedJoint, loads: Mapping[str, Array]) -> Array:
    """(n, p) amplitudes of all ports.

    Raises
    ------
    ModelError
        Where the loads are not as many finite numbers each.
    """
    columns = {name: np.asarray(values, dtype=float) for name, values in loads.items()}
    lengths = {values.shape for values in columns.values()}
    if len(lengths) != 1 or len(next(iter(lengths))) != 1 or not next(iter(lengths))[0]:
        shapes = ", ".join(f"{name!r} {values.shape}" for name, values in columns.items())
        raise ModelError(
            f"a path is one or more numbers for every port, and as many of each: {shapes or 'none'}"
        )
    wanted = np.zeros((next(iter(lengths))[0], len(joint.model.ports)))
    for name, values in columns.items():
        if not np.isfinite(values).all():
            raise ModelError(f"the path of {name!r} holds numbers that are not finite")
        wanted[:, joint.model.port(name)] = values
    return wanted
