"""What analyses found, at the points that the user named: from columns of ports to outputs by name.

Every output is a port of the joint model, so that whatever knows the outputs of all ports knows
these; velocities and accelerations follow by ``i h omega`` per derivative of a harmonic, and by central
differences of samples, whose error is of the second order, as that of the time steps.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from microslip.analyses.reduced.outputs import response_motion
from microslip.analyses.reduced.response import Response
from microslip.analyses.reduced.table import EquivalentTable
from microslip.analyses.reduced.two_mode import TwoModeModel
from microslip.describe.outputs import NamedOutput
from microslip.model.reactions import RATE
from microslip.pipeline.prepare import Assembly
from microslip.typing import Array, Complex, Indices

Model = tuple[TwoModeModel, EquivalentTable | None]
"""A reduced model and the table it reads; None where there is no friction."""


def columns(assembly: Assembly) -> dict[NamedOutput, int]:
    """Column of every output among the ports of the model, in the order of the file."""
    return {output: assembly.model.port(output.port) for output in assembly.joint.outputs}


def _rates(assembly: Assembly) -> dict[str, int]:
    """Columns whose derivatives belong to outputs: the damping part of reactions, by name."""
    ports = assembly.model.ports
    return {
        o.name: ports.index(o.port + RATE) for o in assembly.joint.outputs if o.port + RATE in ports
    }


def harmonics_by_name(
    assembly: Assembly, motion: Complex, omega: Array | float, order: Indices | int = 1
) -> dict[str, Complex]:
    """Outputs by name from harmonics of all ports, ``(..., p)``.

    Parameters
    ----------
    assembly : Assembly
    motion : (..., p) complex array
        Harmonics of the outputs of all ports, ``y = Im(Y e^{i h theta})``.
    omega : (...) array
        Circular frequency of the first harmonic, rad/s.
    order : (...) int array
        h; 0 is the mean, whose derivatives vanish.
    """
    rate = 1j * np.asarray(order) * np.asarray(omega)
    found = {
        output.name: motion[..., k] * rate**output.measured.order
        for output, k in columns(assembly).items()
    }
    for name, k in _rates(assembly).items():
        found[name] = found[name] + motion[..., k] * rate
    return found


def samples_by_name(
    assembly: Assembly, output: Array, dt: float, *, periodic: bool = False
) -> dict[str, Array]:
    """Outputs by name from samples of all ports over time, ``(n, p)``.

    Parameters
    ----------
    assembly : Assembly
    output : (n, p) array
    dt : float
        Between samples, s.
    periodic : bool
        Whether the last sample is the first one again.
    """
    found = {
        wanted.name: derivative(output[:, k], dt, wanted.measured.order, periodic=periodic)
        for wanted, k in columns(assembly).items()
    }
    for name, k in _rates(assembly).items():
        found[name] = found[name] + derivative(output[:, k], dt, 1, periodic=periodic)
    return found


def static_by_name(assembly: Assembly, output: Array) -> dict[str, Array]:
    """Outputs by name from those of all ports without time, ``(..., p)``: those that are no rates."""
    return {o.name: output[..., k] for o, k in columns(assembly).items() if o.measured.order == 0}


def derivative(y: Array, dt: float, order: int, *, periodic: bool = False) -> Array:
    """First or second derivative of samples by central differences; 0 returns the samples.

    Examples
    --------
    >>> t = np.linspace(0, 1, 5)
    >>> derivative(t**2, 0.25, 1)[1:-1], derivative(t**2, 0.25, 2)
    (array([0.5, 1. , 1.5]), array([2., 2., 2., 2., 2.]))
    """
    if order == 0 or len(y) < 3:
        return y if order == 0 else np.full_like(y, np.nan)
    if periodic:
        around = np.concatenate([y[-2:-1], y, y[1:2]])
    else:
        around = np.concatenate([[3 * y[0] - 3 * y[1] + y[2]], y, [3 * y[-1] - 3 * y[-2] + y[-3]]])
    before, after = around[:-2], around[2:]
    if order == 1:
        return (after - before) / (2 * dt)
    return (after - 2 * y + before) / dt**2


def with_outputs(assembly: Assembly, models: Mapping[str, Model], response: Response) -> Response:
    """A response with the outputs of the file.

    Parameters
    ----------
    assembly : Assembly
    models : mapping of str to (TwoModeModel, EquivalentTable)
        By variant.
    response : Response
        Of one of them, or of the refined one put right; one without a table is that of the joint
        without friction.
    """
    put_right = response.variant in ("corrected", "auto")
    model, table = models["refined" if put_right else response.variant]
    motion = response_motion(response, model, table if response.drive else None, assembly.prepared)
    omega = 2 * np.pi * response.frequency
    smaller = response.smaller and with_outputs(assembly, models, response.smaller)
    return replace(response, outputs=harmonics_by_name(assembly, motion, omega), smaller=smaller)
