"""Random spatial contact problems for tests, and the contact laws written out again to judge solutions."""

from __future__ import annotations

import numpy as np

from microslip.contact.pairs import by_pair


def random_flexibility(rng, pairs):
    """Symmetric positive definite, condition number at most about 100."""
    n = 3 * pairs
    Q, _ = np.linalg.qr(rng.standard_normal((n, n)))
    W = (Q * rng.uniform(0.02, 1.0, n)) @ Q.T
    return 1e-9 * 0.5 * (W + W.T)


def violation(W, v_free, mu, vt_old, r, force, R=None, q=None, stiffness=None, f_q=None):
    """Largest violation of every contact law, relative to `force` and to W_ii `force`."""
    v = v_free - W @ r
    found = 0.0
    if R is not None:
        v = v + R @ q
        balance = stiffness * q + R.T @ r - f_q
        found = np.abs(balance / np.abs(R).max(axis=0)).max() / force.sum()
    own = by_pair(np.diag(W), 3)
    soft_t = own[:, 1:].mean(axis=1)
    vn = by_pair(v, 3)[:, 0] / own[:, 0] / force
    slip = (by_pair(v, 3)[:, 1:] - vt_old) / (soft_t * force)[:, None]
    rn, rt = by_pair(r, 3)[:, 0] / force, by_pair(r, 3)[:, 1:] / force[:, None]
    pull, moved = np.linalg.norm(rt, axis=1), np.linalg.norm(slip, axis=1)
    slack = mu * rn - pull
    across = slip[:, 0] * rt[:, 1] - slip[:, 1] * rt[:, 0]
    against = np.where(moved > 1e-8, -(slip * rt).sum(axis=1), 0.0)
    return max(
        found,
        np.max(vn),  # no penetration
        np.max(-rn),  # no adhesion
        np.max(np.minimum(np.abs(vn), np.abs(rn))),  # one of them is zero
        np.max(-slack),  # within the cone
        np.max(np.minimum(np.maximum(slack, 0), moved * (rn > 1e-12))),  # slip at the limit
        np.max(np.abs(across) / np.maximum(moved, 1.0)),  # traction along the slip
        np.max(against / np.maximum(moved, 1.0)),  # and with it
    )


def turned(pairs, angles):
    """(3 m, 3 m) rotation of every pair about its normal."""
    Q = np.zeros((3 * pairs, 3 * pairs))
    for i, a in enumerate(np.broadcast_to(angles, pairs)):
        c, s = np.cos(a), np.sin(a)
        Q[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] = [[1, 0, 0], [0, c, -s], [0, s, c]]
    return Q
