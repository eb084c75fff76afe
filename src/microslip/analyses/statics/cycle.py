"""Quasi-static cycles on the static flexibility: inertia left out.

The preload is held, another port driven by ``A sin(theta)``, with friction, until two successive
cycles end in the same state.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.statics.start import check_held, held_path, prestressed_solver
from microslip.contact.fallbacks import Counts, together
from microslip.contact.fields import ContactFields, contact_fields
from microslip.contact.pairs import slip_history
from microslip.contact.path import PathRecord
from microslip.errors import ModelError
from microslip.typing import Array, Indices, Status

ROUNDING = 1e-10
"""Of the work that a load does to and fro in a cycle: less is none."""


@dataclass(frozen=True, repr=False)
class Cycle:
    """One steady quasi-static cycle (or the last one computed).

    Attributes
    ----------
    port : str
        Driven port.
    amplitude : float
        Its amplitude A: load ``A sin(theta)``.
    theta : (s + 1,) array
        Phase, from 0 to 2 pi.
    load : (s + 1,) array
    output : (s + 1, p) array
        Outputs of all ports, change from prestress.
    r, v : (s + 1, d m) arrays
        Reactions (N, per metre of width in two dimensions) and relative displacements (m), total; by
        name they are `pressure`, `traction`, `slip` and `gap`.
    status : (s + 1, m) int8 array
        Contact states; the first row repeats the last.
    friction_work : (m,) array
        Energy dissipated per cycle by each pair, J (per metre of width in two dimensions).
    normal_work : float
        Work of the normal reactions over the cycle: an error of discretisation, tends to zero.
    external_work : float
        Work of the load over the cycle.
    to_and_fro : float
        The same with that of every step taken as positive: what of it is left over may be rounding.
    cycles : int
        How many cycles were computed, the first loading included.
    closure : float
        Largest change of a reaction between the last two cycles over the largest prestress
        reaction.
    iterations, residual : (s + 1,) arrays
    fallbacks : Fallbacks or SpatialFallbacks
        Steps of all cycles by how they were solved.
    rest : (d m,) array
        Relative displacements at prestress.
    area : (m,) array
        Of the pairs per metre of width, m.
    """

    port: str
    amplitude: float
    theta: Array
    load: Array
    output: Array
    r: Array
    v: Array
    status: Status
    friction_work: Array
    normal_work: float
    external_work: float
    to_and_fro: float
    cycles: int
    closure: float
    iterations: Indices
    residual: Array
    fallbacks: Counts
    rest: Array
    area: Array

    @property
    def hard_steps(self) -> int:
        """Steps of all cycles that needed a fallback."""
        return self.fallbacks.hard

    @property
    def imbalance(self) -> float:
        """Difference of the load's work and what friction took over the cycle, over the latter.

        Zero for a cycle that repeats itself, but for rounding; 0 where nothing is dissipated, or no more than
        rounding of the work that the load does to and fro.
        """
        work = max(self.dissipated, abs(self.external_work))
        if not self.dissipated > 0 or work < ROUNDING * self.to_and_fro:
            return 0.0
        return abs(self.external_work - self.dissipated) / self.dissipated

    @property
    def dissipated(self) -> float:
        """Energy dissipated per cycle, J per metre of width."""
        return float(self.friction_work.sum())

    @cached_property
    def fields(self) -> ContactFields:
        """Pressure, traction, slip and gap, each ``(s + 1, m)``; spatial vectors ``(s + 1, m, 2)``."""
        return contact_fields(self.r, self.v, self.rest, self.area)

    @property
    def pressure(self) -> Array:
        """Contact pressure, Pa, (s + 1, m)."""
        return self.fields.pressure

    @property
    def traction(self) -> Array:
        """Tangential traction on the upper body, Pa, (s + 1, m), or (s + 1, m, 2) of spatial pairs."""
        return self.fields.traction

    @property
    def slip(self) -> Array:
        """Tangential displacement of the upper body over the lower from prestress, m, as `traction`."""
        return self.fields.slip

    @property
    def gap(self) -> Array:
        """Opening of the interface, m, (s + 1, m); zero in contact."""
        return self.fields.gap

    def __repr__(self) -> str:
        return (
            f"Cycle({self.port!r}, amplitude {self.amplitude:.4g}, {len(self.theta) - 1} steps, "
            f"dissipates {self.dissipated:.4g} J/m, closure {self.closure:.1e}, residual "
            f"{self.residual.max():.1e})"
        )


def quasi_static_cycle(
    joint: PreparedJoint,
    port: str,
    amplitude: float,
    *,
    steps: int = 300,
    phase: float = 0.0,
    max_cycles: int = 20,
    closure: float = 1e-9,
) -> Cycle:
    """Steady cycle under the preload and ``A sin(theta)`` on a port.

    Parameters
    ----------
    joint : PreparedJoint
        Planar or spatial.
    port : str
        Driven port.
    amplitude : float
        A, in the unit of the port.
    steps : int
        Load steps per cycle.
    phase : float
        Phase at which loading starts; the load is ramped there from prestress first.
    max_cycles : int
        Cycles at most, the first loading included.
    closure : float
        Cycles stop when no reaction changes by more than this between successive cycles.

    Returns
    -------
    Cycle

    Raises
    ------
    JointOpensError
        Where the amplitude is beyond what the preload can hold; names the limit.
    ContactError
        Where the amplitude slides bodies away that friction alone holds, or a step does not solve; names the
        phase.
    ModelError
        Where the amplitude is not finite.
    """
    f, start, column = joint.flexibility, joint.prestress, joint.model.port(port)
    held = joint.held
    if not np.isfinite(amplitude):
        raise ModelError(f"the load {amplitude} on {port!r} must be a finite number")
    check_held(joint, port, abs(amplitude))
    solver = prestressed_solver(joint)
    theta = phase + 2 * np.pi * np.arange(steps + 1) / steps
    path = np.tile(held, (steps + 1, 1))
    path[:, column] += amplitude * np.sin(theta)
    vt_old = slip_history(start.solution.v, joint.model.dimension)

    def march(path: Array) -> PathRecord:
        return held_path(
            joint,
            path,
            vt_old,
            solver=solver,
            port=port,
            where=lambda step: f"(load {path[step, column]:.4g} on {port!r})",
            remedy="try more load steps",
        )

    ramp_steps = int(np.ceil(abs(np.sin(phase)) * steps / 4))
    if ramp_steps:
        ramp = np.tile(path[0], (ramp_steps + 1, 1))
        change_of_load = ramp[:, column] - held[column]
        ramp[:, column] = held[column] + np.linspace(0, 1, ramp_steps + 1) * change_of_load
        march(ramp)
    change = np.inf
    found: list[Counts] = []
    last = None
    for cycle in range(1, max_cycles + 1):  # noqa: B007 - reported
        record = march(path)
        found.append(record.fallbacks)
        if last is not None:
            change = float(np.abs(record.r - last).max() / start.largest_reaction)
        if change <= closure:
            break
        last = record.r
    load = path[:, column] - held[column]
    rest = f.outputs(held, start.solution.q, start.solution.r)
    output = f.outputs(path, record.q, record.r) - rest
    mean_load = 0.5 * (load[1:] + load[:-1])
    status = record.status.copy()
    status[0] = status[-1]
    work = mean_load * np.diff(output[:, column])
    return Cycle(
        port=port,
        amplitude=float(amplitude),
        theta=theta,
        load=load,
        output=output,
        r=record.r,
        v=record.v,
        status=status,
        friction_work=record.friction_work,
        normal_work=record.normal_work,
        external_work=float(work.sum()),
        to_and_fro=float(np.abs(work).sum()),
        cycles=cycle,
        closure=change,
        iterations=record.iterations,
        residual=record.residual,
        fallbacks=together(found),
        rest=start.solution.v,
        area=joint.model.area,
    )
