"""Motion of points of the joint in a reduced model, from the amplitude of its mode.

A reduced model gives Q, the first harmonic of ``q = Phi_sl^T M x``. What else moves does so because
the contact force bends the other modes, or because the load does:

    Y = phi Q + s(|A|) A + h(omega) M,        A = Q + c M

with ``phi`` the output of the mode, ``s`` what the contact force adds per amplitude, tabulated in
the same cycles as the force itself and at the same argument A (`refined.py`), and ``h`` what the load
moves besides the mode in the sliding state (`microslip.analyses.prepared.direct`). A table holds
``phi + s = (Y_1 - h(0) L_1)/Q_1`` of cycles driven by a load L, so that

    Y = (phi + s)(|A|) A + (h(omega) - c phi) M.

Of the stuck oscillator (`two_mode.stuck_model`), whose table is of resonances, the outputs of a motion less
what the load moves besides the stuck mode in the stuck state, over A, take the place of ``phi + s``:
``Y = (phi + s) A + h M``.

Without friction s vanishes and this is the modal sum of the linear joint, exactly.
"""

from __future__ import annotations

import numpy as np
from scipy.interpolate import Akima1DInterpolator, PchipInterpolator

from microslip.analyses.prepared.direct import direct_motion, mode_motion
from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.reduced.response import Response
from microslip.analyses.reduced.table import EquivalentTable
from microslip.analyses.reduced.two_mode import TwoModeModel
from microslip.errors import MicroslipError
from microslip.typing import Array, Complex


def motion_per_amplitude(table: EquivalentTable, amplitude: Array) -> Complex:
    """Outputs of all ports per amplitude of the mode, interpolated in its logarithm.

    Beyond the table the value at its end; below it that of its smallest amplitude, where the joint
    sticks.

    Parameters
    ----------
    table : EquivalentTable
    amplitude : (n,) array

    Returns
    -------
    (n, p) complex array

    Raises
    ------
    MicroslipError
        Where the table was made without outputs.
    """
    if table.motion is None:
        raise MicroslipError("this table holds no outputs: make it from cycles")
    knots = np.log(table.amplitude)
    x = np.log(np.clip(amplitude, table.amplitude[0], table.amplitude[-1]))
    interpolate = PchipInterpolator if table.uncertainty is None else Akima1DInterpolator
    real, imag = interpolate(knots, table.motion.real)(x), interpolate(knots, table.motion.imag)(x)
    return np.asarray(real + 1j * imag, dtype=complex)


def response_motion(
    response: Response, model: TwoModeModel, table: EquivalentTable | None, joint: PreparedJoint
) -> Complex:
    """First harmonics of the outputs of all ports at every point of a response.

    Parameters
    ----------
    response : Response
    model : TwoModeModel
        That it is of.
    table : EquivalentTable or None
        That it was read from; None of the joint without friction.
    joint : PreparedJoint
        Driven at its own port.

    Returns
    -------
    (n, p) complex array
        Against the sine of the load; change from prestress.

    Examples
    --------
    >>> import microslip
    >>> from microslip.analyses.reduced.two_mode import two_mode_model
    >>> from microslip.analyses.reduced.response import forced_response
    >>> joint = microslip.prepare(microslip.reference_joint(pairs=21))
    >>> linear = two_mode_model(joint, "consistent")
    >>> found = forced_response(linear, None, np.array([150.0, 160.0]), 1.0)
    >>> response_motion(found, linear, None, joint).shape == (2, len(joint.model.ports))
    True
    """
    own = joint.principal().load_on_sliding
    ports = joint.model.ports
    modal = mode_motion(joint)  # of ports that are no loads of the structure
    phi = np.array([own.get(name, value) for name, value in zip(ports, modal, strict=True)])
    offset = model.offset[0] if table is not None else 0.0
    A = np.asarray(response.amplitude) + offset * response.load
    h = direct_motion(joint, joint.drive, 2 * np.pi * response.frequency, stuck=model.stuck)
    per_amplitude = phi[None] if table is None else motion_per_amplitude(table, np.abs(A))
    rest = h if model.stuck else h - offset * phi
    return np.asarray(per_amplitude * A[:, None] + rest * response.load)
