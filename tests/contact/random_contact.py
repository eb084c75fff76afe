"""Random contact problems for tests, and the contact laws written out again to judge solutions."""

from __future__ import annotations

import numpy as np

from microslip.contact.pairs import normal, tangential
from microslip.model.flexibility import Flexibility


def plain(W, R=None, stiffness=None) -> Flexibility:
    rows = W.shape[0]
    R = np.zeros((rows, 0)) if R is None else R
    stiffness = np.zeros(R.shape[1]) if stiffness is None else stiffness
    empty = np.zeros((rows, 0)), np.zeros((R.shape[1], 0)), np.zeros((0, 0))
    return Flexibility(W, R, stiffness, *empty)


def random_flexibility(rng, pairs):
    """Symmetric positive definite, condition number at most about 100."""
    Q, _ = np.linalg.qr(rng.standard_normal((2 * pairs, 2 * pairs)))
    W = (Q * rng.uniform(0.02, 1.0, 2 * pairs)) @ Q.T
    return 1e-9 * 0.5 * (W + W.T)


def violation(W, v_free, mu, vt_old, r, force, R=None, q=None, stiffness=None, f_q=None):
    """Largest violation of every contact law, relative to `force` and to W_ii `force`."""
    v = v_free - W @ r
    found = 0.0
    if R is not None:
        v = v + R @ q
        balance = stiffness * q + R.T @ r - f_q
        found = np.abs(balance / np.abs(R).max(axis=0)).max() / force.sum()
    own = np.diag(W)
    vn, vt = normal(v) / normal(own) / force, (tangential(v) - vt_old) / tangential(own) / force
    rn, rt = normal(r) / force, tangential(r) / force
    slack = mu * rn - np.abs(rt)
    return max(
        found,
        np.max(vn),  # no penetration
        np.max(-rn),  # no adhesion
        np.max(np.minimum(np.abs(vn), np.abs(rn))),  # one of them is zero
        np.max(-slack),  # within the cone
        np.max(np.minimum(np.maximum(slack, 0), np.abs(vt) * (rn > 1e-12))),  # slip at the limit
        np.max(np.where(np.abs(vt) > 1e-8, -np.sign(vt) * rt, 0)),  # slip along the traction
    )


def unique_friction(W):
    """A coefficient of friction below which the solution is unique, from the contraction bound.

    The map (bound of friction -> normal reaction) of the Tresca problem is Lipschitz with at most
    the condition number of W in the Euclidean norm; mu times that below one is a contraction.
    """
    values = np.linalg.eigvalsh(W)
    return values[0] / values[-1]
