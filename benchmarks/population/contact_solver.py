"""The contact solver on random contact problems: which rule solved how many steps, and how well.

python benchmarks/population/contact_solver.py [--seeds 10 60] [--count 200] [--page FILE]

A hundred load steps each problem; seeds 10 to 59, the default, are 1,000,000 steps. The residual is
computed here from W and the reactions alone, the natural map relative to a contact force of 1. With
``--page`` the table is written as a page of the docs. The exit code is 1 where a step is unsolved or a
residual beyond 1e-9.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np
from contact_problems import Array, problems

from microslip.contact.pairs import STICK
from microslip.contact.solver import ContactSolver
from microslip.errors import ContactError
from microslip.model.flexibility import Flexibility

ASKED = 1e-9

BOUNDS = (0.03, 0.1, 0.3, 0.6, 1.0, 2.0)

RULES = ("all violated pairs", "worst pair", "least index", "step halved", "Lemke", "unsolved")

PAGE = """# Contact problems at random

Contact problems harder than joints make them, drawn at random: 3 to 59 pairs, every other flexibility
dense and badly conditioned, loads that jump by several times what holds the pairs, friction to 2
(`benchmarks/population/contact_problems.py`). W is positive definite, so every step has a solution,
and the solver has to find it ([how](theory.md#contact-solver)). Residuals are computed by the script
from W and the reactions alone, relative to a typical contact force; 1e-9 is asked for. The solver
was made on seeds 1 to 9, the table is of others:

    {command}

Steps by the rule that solved them, each by the dearest that it needed:

"""


@dataclass
class Found:
    """Steps of one range of friction."""

    count: Array = field(default_factory=lambda: np.zeros(len(RULES), dtype=int))
    residual: float = 0.0


def natural_residual(W: Array, mu: float, v_free: Array, vt_old: Array, r: Array) -> float:
    """Largest violation of the contact laws, ``|r - proj(r + v / W_ii)|``."""
    v, own = v_free - W @ r, np.diag(W)
    rn, rt = r[::2], r[1::2]
    normal = rn - np.maximum(0, rn + v[::2] / own[::2])
    bound = mu * np.maximum(rn, 0)
    tangential = rt - np.clip(rt + (v[1::2] - vt_old) / own[1::2], -bound, bound)
    return float(max(np.abs(normal).max(), np.abs(tangential).max()))


def take(found: Found, W: Array, mu: float, loads: Array) -> None:
    """Solve all steps of one problem; after an unsolved one the pairs stick where they were."""
    m = len(W) // 2
    none = np.zeros((2 * m, 0)), np.zeros(0), np.zeros((2 * m, 0)), np.zeros((0, 0))
    flexibility = Flexibility(W, *none, np.zeros((0, 0)))
    solver = ContactSolver(flexibility, mu, np.ones(m), np.full(m, STICK, np.int8))
    vt_old = np.zeros(m)
    for v_free in loads:
        try:
            solution = solver.solve(v_free, np.zeros(0), vt_old)
        except ContactError:
            found.count += solver.memory.solved
            solver = ContactSolver(flexibility, mu, np.ones(m), np.full(m, STICK, np.int8))
            continue
        residual = natural_residual(W, mu, v_free, vt_old, solution.r)
        found.residual = max(found.residual, residual)
        vt_old = solution.v[1::2].copy()
    found.count += solver.memory.solved


def table(bands: list[Found]) -> list[str]:
    """Rows by friction, and all of them."""
    lines = [
        f"| friction | steps | {' | '.join(RULES)} | largest residual |",
        "|" + "---|" * (len(RULES) + 3),
    ]
    whole = Found(
        sum(band.count for band in bands),
        max(band.residual for band in bands),
    )
    names = [f"{a:g} to {b:g}" for a, b in pairwise(BOUNDS)]
    for name, band in zip([*names, "all"], [*bands, whole], strict=True):
        steps = int(band.count.sum())
        counts = " | ".join(f"{n:,}" for n in band.count)
        lines.append(f"| {name} | {steps:,} | {counts} | {band.residual:.0e} |")
    return lines


def main() -> int:
    """Solve, print the table, and judge it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, nargs=2, default=[10, 60], metavar=("FROM", "TO"))
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--page", type=Path)
    asked = parser.parse_args()
    bands = [Found() for _ in BOUNDS[1:]]
    for seed in range(*asked.seeds):
        for W, mu, loads in problems(seed, asked.count):
            take(bands[int(np.searchsorted(BOUNDS[1:-1], mu))], W, mu, loads)
        print(f"seed {seed}: {sum(int(band.count.sum()) for band in bands):,} steps", flush=True)
    lines = table(bands)
    print("\n".join(lines))
    if asked.page:
        command = "python benchmarks/population/contact_solver.py"
        command += f" --seeds {asked.seeds[0]} {asked.seeds[1]} --count {asked.count}"
        asked.page.write_text(PAGE.format(command=command) + "\n".join(lines) + "\n")
    good = all(band.count[-1] == 0 and band.residual <= ASKED for band in bands)
    return 0 if good else 1


if __name__ == "__main__":
    raise SystemExit(main())
