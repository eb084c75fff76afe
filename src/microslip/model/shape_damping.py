"""What damping that couples the modes is worth to a shape of the joint, sliding, stuck or in between.

A motion with amplitudes eta of the kept modes has beside alpha and beta the damping

    d = eta^H D eta / eta^H eta,      ratio d / (2 omega),

which is ``2 zeta_n omega_n`` in a stuck mode whose ratio was given. Ports of single modes make their
amplitudes outputs of any analysis.
"""

from __future__ import annotations

import numpy as np

from microslip.model.joint import JointModel, bonded_modes
from microslip.typing import Array, Complex, Indices


def with_mode_outputs(model: JointModel) -> JointModel:
    """The model with a port of every kept mode after its own, where damping couples them; else as it is."""
    if model.damping is None:
        return model
    each = np.eye(len(model.omega))
    return model.with_modal_ports({f"kept mode {n}": e for n, e in enumerate(each, 1)})


def damping_of_shape(model: JointModel, eta: Complex | Array) -> float:
    """d of a shape (k,), 1/s; zero where nothing couples the modes.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> model = SimpleNamespace(damping=np.array([[3.0, 1.0], [1.0, 3.0]]))
    >>> round(damping_of_shape(model, np.array([2.0, 2.0])), 12)
    4.0
    """
    if model.damping is None:
        return 0.0
    return float((eta.conj() @ model.damping @ eta).real / (eta.conj() @ eta).real)


def damping_of_pair(model: JointModel, sliding: Array, stuck: Array) -> Array:
    """``T^T D T``, (2, 2), of a sliding mode and what of its stuck mode is orthogonal to it.

    Both of unit length in the kept modes.
    """
    if model.damping is None:
        return np.zeros((2, 2))
    first = sliding / np.linalg.norm(sliding)
    second = stuck - (first @ stuck) * first
    T = np.column_stack([first, second / max(float(np.linalg.norm(second)), 1e-300)])
    return model.damping_beyond(T)


def ratio_by_coupling(
    model: JointModel, bonded: Indices, shape: Array, compliance: Array | None = None
) -> tuple[float, float]:
    """Damping ratio of a linear state as d of its shape has it, and of the complex mode that is most like it.

    Parameters
    ----------
    model : JointModel
    bonded : (b,) int array
        Components of v that are held.
    shape : (k,) array
        Of the mode.
    compliance : (d m,) array, optional
        As for `microslip.model.joint.bonded_modes`.

    Returns
    -------
    ratio : float
        To first order in the damping.
    coupled : float
        ``-Re lambda / |lambda|``; 1 where it does not vibrate.
    """
    omega, shapes = bonded_modes(model, bonded, compliance)
    own = int(np.argmax(np.abs(shapes.T @ shape)))
    free = shapes.T @ (model.omega[:, None] ** 2 * shapes)
    C = shapes.T @ model.damping_matrix() @ shapes
    C += model.rayleigh[1] * (np.diag(omega**2) - free)
    k = len(omega)
    rates = np.block([[np.zeros((k, k)), np.diag(omega)], [-np.diag(omega), -C]])
    values, vectors = np.linalg.eig(rates)
    share = np.abs(vectors[own]) / np.linalg.norm(vectors[:k], axis=0)
    found = values[int(np.argmax(np.where(values.imag > 0, share, -1.0)))]
    coupled = -found.real / abs(found) if found.imag > 0 else 1.0
    return float(C[own, own] / (2 * omega[own])), float(coupled)
