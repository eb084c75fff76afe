"""Flexibility operators W of ``v = v_free + R q - W r``: static, harmonic, with compliance."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from microslip.brief import Brief
from microslip.model.joint import JointModel
from microslip.typing import Array, Complex


@dataclass(frozen=True, repr=False)
class Flexibility(Brief):
    """The linear side of a contact problem.

    With port amplitudes ``a``:  ``v = loads_v a + R q - W r``,  ``k_q q + R^T r = loads_q^T a``,
    outputs ``y = loads_loads a + loads_q^T q - loads_v^T r``.

    Attributes
    ----------
    W : (d m, d m) array
        Flexibility at the pairs.
    R : (d m, e) array
        Relative displacement of the coordinates solved for in equilibrium.
    stiffness : (e,) array
        Their own stiffness k_q.
    loads_v : (d m, p) array
    loads_q : (e, p) array
    loads_loads : (p, p) array
    """

    W: Array
    R: Array
    stiffness: Array
    loads_v: Array
    loads_q: Array
    loads_loads: Array

    def outputs(self, a: Array, q: Array, r: Array) -> Array:
        """Outputs ``(..., p)`` of all ports, of port amplitudes, coordinates and reactions."""
        return np.asarray(a @ self.loads_loads.T + q @ self.loads_q - r @ self.loads_v)


def static_flexibility(model: JointModel) -> Flexibility:
    """Static flexibility; the nearly rigid modes stay unknowns of equilibrium."""
    rigid = model.equilibrium_modes
    v, g = model.mode_v[:, rigid:], model.port_modes[rigid:]
    soft = 1 / model.omega[rigid:] ** 2
    W = model.residual + (v * soft) @ v.T
    return Flexibility(
        W=np.ascontiguousarray(0.5 * (W + W.T)),
        R=np.ascontiguousarray(model.mode_v[:, :rigid]),
        stiffness=model.omega[:rigid] ** 2,
        loads_v=model.port_v + (v * soft) @ g,
        loads_q=np.ascontiguousarray(model.port_modes[:rigid]),
        loads_loads=model.port_port + (g.T * soft) @ g,
    )


def with_compliance(flexibility: Flexibility, compliance: Array) -> Flexibility:
    """Add a contact compliance (m/N per component, ``1 / (k area)``) to the diagonal of W.

    A penalty contact is the exact contact behind a spring: a Jenkins element is a rigid Coulomb
    slider in series with ``k_t``.
    """
    return replace(flexibility, W=flexibility.W + np.diag(compliance))


def harmonic_compliance(model: JointModel, omega: float, harmonics: int) -> tuple[Complex, Complex]:
    """Compliance of every mode, and lag of the residual part, at the harmonics 0..H of `omega`.

    ``W_h = residual lag_h + mode_v diag(modal_h) mode_v^T`` with

        modal_hn = 1 / (omega_n² - h² omega² + i h omega c_n),   lag_h = 1 / (1 + i h omega beta)

    Where damping couples the modes (`JointModel.damping`) there is a matrix in place of ``diag(modal_h)``,
    the inverse of ``diag(1 / modal_h) + i h omega D``.

    Parameters
    ----------
    model : JointModel
    omega : float
        rad/s.
    harmonics : int
        H.

    Returns
    -------
    modal : (H + 1, k) or (H + 1, k, k) complex array
        s² (mass-normalised modes), for `amplitudes_under`; matrices where damping couples the modes. Not
        finite in the mean of a mode of frequency zero.
    lag : (H + 1,) complex array
        The truncated modes follow quasi-statically behind their stiffness damping.
    """
    h = np.arange(harmonics + 1)[:, None] * omega
    with np.errstate(divide="ignore", invalid="ignore"):
        modal = np.asarray(
            1 / (model.omega**2 - h**2 + 1j * h * model.modal_damping()), dtype=complex
        )
    lag = np.asarray(1 / (1 + 1j * h[:, 0] * model.rayleigh[1]), dtype=complex)
    if model.damping is None:
        return modal, lag
    coupled = np.zeros((harmonics + 1, *model.damping.shape), dtype=complex)
    coupled[0] = np.diag(modal[0])
    k = np.arange(len(model.omega))
    for n in range(1, harmonics + 1):
        resisted = 1j * h[n, 0] * model.damping
        resisted[k, k] += 1 / modal[n]
        coupled[n] = np.linalg.inv(resisted)
    return coupled, lag


def amplitudes_under(modal: Complex, forces: Complex | Array) -> Complex:
    """Amplitudes (H + 1, k) of modes of a compliance, (H + 1, k) or (H + 1, k, k), under forces (H + 1, k).

    Examples
    --------
    >>> forces = np.array([[1.0 + 0j, 2.0]])
    >>> amplitudes_under(np.array([[3.0 + 0j, 4.0]]), forces).real.tolist()
    [[3.0, 8.0]]
    >>> amplitudes_under(np.array([[[0.0 + 0j, 1.0], [1.0, 0.0]]]), forces).real.tolist()
    [[2.0, 1.0]]
    """
    if modal.ndim == 2:
        return np.asarray(forces * modal)
    return np.asarray((modal @ forces[:, :, None])[:, :, 0])
