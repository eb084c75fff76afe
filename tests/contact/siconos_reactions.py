"""Reactions of exported contact steps by the solver NSN_AC of Siconos: ``python3 FILE IN.npz OUT.npz``.

Run by the interpreter that has Debian's ``python3-siconos``; needs nothing of this repository.
"""

import sys

import numpy as np


def reactions(W, v_free, vt_old, mu):
    """r of ``u = W r - v_free + v_old``, ``u + mu |u_t| n`` in the dual cone, from r = 0."""
    import siconos.numerics as sn

    m = len(v_free) // 3
    q = -v_free.copy()
    q.reshape(-1, 3)[:, 1:] += vt_old
    # in units of displacement: the solver's scales are absolute
    mean = np.mean(np.diag(W))
    problem = sn.FrictionContactProblem(3, m, W / mean, q, np.full(m, mu))
    options = sn.SolverOptions(sn.SICONOS_FRICTION_3D_NSN_AC)
    options.dparam[sn.SICONOS_DPARAM_TOL] = 1e-12
    options.iparam[sn.SICONOS_IPARAM_MAX_ITER] = 1000
    r, u = np.zeros(3 * m), np.zeros(3 * m)
    failed = sn.fc3d_driver(problem, r, u, options)
    return r / mean, failed


if __name__ == "__main__":
    given = np.load(sys.argv[1])
    found = {}
    for k in range(int(given["count"])):
        r, failed = reactions(
            *(given[f"{name}{k}"] for name in ("W", "v_free", "vt_old")), float(given[f"mu{k}"])
        )
        found[f"r{k}"], found[f"failed{k}"] = r, failed
    np.savez(sys.argv[2], **found)
