"""Multi-harmonic balance of the joint model with exact contact, condensed to the contact pairs.

With ``y(t) = Y_0 + sum_h Im(Y_h e^{i h omega t})`` the joint model is one linear relation per harmonic,

    v_h = v_free,h - W_h r_h
    W_h = W_res / (1 + i h omega tau) + Psi diag(1 / (omega_n² - h² omega² + i h omega c_n)) Psi^T

(tau: the residual flexibility follows behind its share of the stiffness damping, as in
`microslip.contact.timestep`), and the contact laws in time close it. In the mean the nearly rigid modes would
swamp W with their flexibility; their mean amplitudes q are unknowns of equilibrium, as in statics:

    v_0 = v_free,0 + R q - W_0 r_0,      K_q q + R^T r_0 = f_q

A joint that slips everywhere may *walk*: both halves of a cycle push the bodies past each other the same
way, against weak supports alone, which would stop the walk only after an offset without meaning. Then the
changes of v_t per cycle are the unknowns in place of the mean amplitudes of the sliding motions (one in the
plane; two ways and a turn between two bodies in space), which stay where they are (`walking`): at their
prestress values, or `offset` from these.

Unknowns are the coefficients of all reactions and q, and the equations of the reactions are

    F(r) = r - C(r + eps v(r)) = 0

with ``C`` the compiled contact cycle of `contact/aft.py` (dynamic Lagrangian; Nacivet, Pierre, Thouverez
& Jezequel, J. Sound Vib. 265 (2003) 201). ``1/eps`` is the flexibility that harmonics beyond the last
one see; it vanishes from the answer as harmonics grow. An elastic contact is a compliance on the
diagonal of ``W_res``.

`problem.py` states the equations, `operator.py` is their linear side, this module evaluates them and their
derivatives; `linear.py` solves the linearised ones at one frequency, `paths.py` and `response.py` walk over
frequencies and loads.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from microslip.analyses.harmonic.operator import LinearOperator
from microslip.analyses.harmonic.problem import HarmonicProblem
from microslip.brief import Brief
from microslip.contact.aft import ContactCycle, along_drift, contact_cycle, times_derivative
from microslip.errors import ContactError
from microslip.numerics.continuation import ContinuationError
from microslip.typing import Array


@dataclass(frozen=True, repr=False)
class Evaluation(Brief):
    """Equations evaluated at one set of unknowns.

    Attributes
    ----------
    w : (n,) array
        Unknowns.
    v : (d m, c) array
        Relative displacements.
    cycle : ContactCycle
    F : (n,) array
        ``r - C(r + eps v)``, and the imbalance of the nearly rigid modes; N per metre of width.
    """

    w: Array
    v: Array
    cycle: ContactCycle
    F: Array


def evaluate(
    operator: LinearOperator, load: float, w: Array, offset: Array | float = 0.0
) -> Evaluation:
    """Residual of the unknowns `w` under an amplitude of the load.

    `offset`, (d p, c), is added to the augmented forces: displacements ``offset / eps`` imposed beside v.
    """
    problem = operator.problem
    u, _ = problem.split(w)
    v, imbalance = _linear_side(operator, load, w)
    x = u + problem.stiffness[:, None] * v + offset
    cycle = contact_at(problem, x, w[u.size :])
    F = np.concatenate([(u - cycle.r.reshape(u.shape)).ravel(), imbalance])
    return Evaluation(w, v, cycle, F)


def evaluate_at(operator: LinearOperator, load: float, w: Array, x: Array) -> Evaluation:
    """Residual of the unknowns `w`, contact linearised at the augmented forces x, (d p, c).

    ``r - C(x) - D(x) (x(r) - x)``; the same as `evaluate` where x is that of `w`.
    """
    problem = operator.problem
    u, _ = problem.split(w)
    v, imbalance = _linear_side(operator, load, w)
    cycle = contact_at(problem, x, w[u.size :])
    away = u + problem.stiffness[:, None] * v - x
    change = np.empty_like(cycle.r)
    times_derivative(cycle.nn, cycle.tn, cycle.tt, away.reshape(change.shape), change)
    F = np.concatenate([(u - (cycle.r + change).reshape(u.shape)).ravel(), imbalance])
    return Evaluation(w, v, cycle, F)


def contact_at(problem: HarmonicProblem, x: Array, p: Array) -> ContactCycle:
    """Contact under augmented forces x, (d p, c), and the unknowns p of the nearly rigid modes.

    Raises
    ------
    ContinuationError
        Where a spatial pair's periodic traction is not found.
    """
    try:
        return contact_cycle(
            problem.table,
            x.reshape(-1, problem.dimension, problem.table.coefficients),
            problem.friction,
            problem.along * problem.held,
            problem.along * problem.drift(p),
        )
    except ContactError as error:
        raise ContinuationError(str(error)) from error


def _linear_side(operator: LinearOperator, load: float, w: Array) -> tuple[Array, Array]:
    """Relative displacements, and the imbalance of the nearly rigid modes as a force."""
    problem = operator.problem
    u, _ = problem.split(w)
    place = problem.place(w[u.size :])
    v = operator.free(load) - operator.flexibility(u)
    v[:, 0] += problem.rigid_spread @ place
    imbalance = problem.rigid_stiffness @ place + problem.rigid_gather.T @ u[:, 0]
    imbalance -= problem.rigid_held
    return v, imbalance * problem.spring


def derivative_times(operator: LinearOperator, cycle: ContactCycle, z: Array) -> Array:
    """Derivative of the residual along `z`: ``J z``."""
    problem = operator.problem
    u, _ = problem.split(z)
    p = z[u.size :]
    place = problem.means(p)
    x = -operator.flexibility(u)
    x[:, 0] += problem.rigid_spread @ place
    x *= problem.stiffness[:, None]
    x += u
    out = np.empty_like(cycle.r)
    times_derivative(cycle.nn, cycle.tn, cycle.tt, x.reshape(out.shape), out)
    if problem.walks:
        out[:, 1:] += along_drift(cycle, problem.along * problem.drift(p))
    imbalance = problem.rigid_stiffness @ place + problem.rigid_gather.T @ u[:, 0]
    return np.concatenate([(u - out.reshape(u.shape)).ravel(), imbalance * problem.spring])


def frequency_derivative(operator: LinearOperator, point: Evaluation, load: float) -> Array:
    """Derivative of the residual by omega."""
    problem = operator.problem
    x = operator.frequency_derivative(problem.split(point.w)[0], load)
    return offset_derivative(problem, point, problem.stiffness[:, None] * x)


def damping_derivative(operator: LinearOperator, point: Evaluation, load: float) -> Array:
    """Derivative of the residual by alpha of the damping."""
    problem = operator.problem
    x = operator.damping_derivative(problem.split(point.w)[0], load)
    return offset_derivative(problem, point, problem.stiffness[:, None] * x)


def load_derivative(operator: LinearOperator, point: Evaluation) -> Array:
    """Derivative of the residual by the amplitude of the load."""
    problem = operator.problem
    return offset_derivative(problem, point, problem.stiffness[:, None] * operator.per_load())


def offset_derivative(problem: HarmonicProblem, point: Evaluation, offset: Array) -> Array:
    """Derivative of the residual by the share of an offset of the augmented forces, (d p, c)."""
    out = np.empty_like(point.cycle.r)
    cycle, x = point.cycle, np.ascontiguousarray(offset).reshape(out.shape)
    times_derivative(cycle.nn, cycle.tn, cycle.tt, x, out)
    return np.concatenate([-out.ravel(), np.zeros(problem.rigid_modes.shape[1])])
