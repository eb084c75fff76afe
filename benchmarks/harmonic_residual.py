"""Time of a harmonic-balance residual with its derivative: spatial contact, 120 pairs, 481 freedoms.

    python benchmarks/harmonic_residual.py [--pairs 120] [--dofs 481] [--harmonics 3] [--samples 128]

Bodies of random mass and stiffness, all of whose modes are dynamic, driven so that pairs slip and open.
Three things are timed, one thread, medians after a warm-up:

residual
    what `equations.evaluate` does: the residual with the exact derivative of the contact of every pair.
product
    the derivative along one direction, as GMRES asks for it.
matrix
    the derivative written out over all unknowns that are left after elimination, in single precision: the
    preconditioner, made now and then.
"""

from __future__ import annotations

import argparse
import json
import statistics
import time

import numpy as np
import scipy.linalg as sl
from threadpoolctl import threadpool_limits

from microslip.analyses.harmonic.condensed import (
    CoupledEquations,
    Resonator,
    eliminate,
    static_share,
)
from microslip.analyses.harmonic.equations import derivative_times, evaluate
from microslip.analyses.harmonic.factorisation import Factorisation
from microslip.analyses.harmonic.operator import linear_operator
from microslip.analyses.harmonic.problem import harmonic_problem
from microslip.analyses.prepared.joint import prepare_joint
from microslip.contact.law import contact_law
from microslip.contact.pairs import SEPARATED, SLIP, STICK
from microslip.model.joint import JointModel

CONTACT = 1.0
"""Compliance of the contact over the mean flexibility of the bodies at a pair."""


def median_ms(work, repeats=31):
    """Median milliseconds of a call."""
    work()
    times = []
    for _ in range(repeats):
        began = time.perf_counter()
        work()
        times.append(time.perf_counter() - began)
    return 1e3 * statistics.median(times)


def joint_of(pairs, dofs, seed=0):
    """A joint with as many modes as degrees of freedom, pressed and driven, its contact elastic."""
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((dofs, dofs))
    K = A @ A.T / dofs + 0.5 * np.eye(dofs)
    values, shapes = sl.eigh(K)
    n = 3 * pairs
    psi = shapes[:n]
    down = np.tile([1.0, 0.0, 0.0], pairs)
    push = rng.standard_normal(dofs)
    W = (psi / values) @ psi.T
    model = JointModel(
        position=np.arange(pairs, dtype=float),
        area=np.ones(pairs),
        dimension=3,
        omega=np.sqrt(values),
        equilibrium_modes=0,
        mode_v=psi,
        residual=np.zeros((n, n)),
        ports=("press", "drive"),
        port_modes=np.column_stack([psi.T @ down, shapes.T @ push]),
        port_v=np.zeros((n, 2)),
        port_port=np.zeros((2, 2)),
        rayleigh=(0.02, 0.02),
    )
    compliance = np.full(n, CONTACT * np.diag(W).mean())
    return prepare_joint(model, contact_law(pairs, 0.3, compliance, 3), {"press": 1.0}, "drive")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pairs", type=int, default=120)
    parser.add_argument("--dofs", type=int, default=481)
    parser.add_argument("--harmonics", type=int, default=3)
    parser.add_argument("--samples", type=int, default=128)
    parser.add_argument("--load", type=float, default=1.5)
    asked = parser.parse_args()
    with threadpool_limits(1):
        joint = joint_of(asked.pairs, asked.dofs)
        problem = harmonic_problem(joint, harmonics=asked.harmonics, samples=asked.samples)
        operator = linear_operator(problem, 0.8)
        w = problem.rest()
        rng = np.random.default_rng(1)
        w[: problem.shape[0] * problem.shape[1]] += (
            0.5 * rng.standard_normal(w.size) / asked.harmonics
        )
        point = evaluate(operator, asked.load, w)
        z = rng.standard_normal(w.size)
        sets = eliminate(problem, point.cycle, static_share(problem))
        equations = CoupledEquations(operator, point.cycle, sets, Resonator(operator, sets))
        state = point.cycle.status
        row = {
            "pairs": asked.pairs,
            "degrees_of_freedom": asked.dofs,
            "unknowns": int(w.size),
            "coupled_unknowns": int(np.prod(equations.shape)),
            "stick_slip_open": [
                float((state == s).mean().round(3)) for s in (STICK, SLIP, SEPARATED)
            ],
            "residual_ms": median_ms(lambda: evaluate(operator, asked.load, w)),
            "product_ms": median_ms(lambda: derivative_times(operator, point.cycle, z)),
            "matrix_and_factors_ms": median_ms(lambda: Factorisation(equations), 5),
        }
    print(json.dumps(row, indent=2))


if __name__ == "__main__":
    main()
