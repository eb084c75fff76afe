"""The spatial contact solver on random problems: which way solved how many steps, and how well.

python benchmarks/population/spatial_solver.py [--seeds 10 60] [--count 40] [--jumps] [--page FILE]

A hundred load steps each problem; seeds 10 to 59, the default, are 200,000 steps, some minutes. The
residual is computed here from W and the reactions alone, the natural map relative to a contact force of 1.
With ``--jumps`` the loads of each problem come in random order and friction is three times as large, far
beyond joints. With ``--page`` the table is written as a page of the docs. The exit code is 1 where a step is
unsolved or a residual beyond 1e-9.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np
from spatial_problems import Array, problems

from microslip.contact.pairs import STICK
from microslip.contact.solver import ContactSolver
from microslip.errors import ContactError
from microslip.model.flexibility import Flexibility

ASKED = 1e-9

BOUNDS = (0.03, 0.1, 0.3, 0.6, 1.0, 3.0)

WAYS = (
    "Newton",
    "other scales",
    "load in parts",
    "extragradient",
    "proximal",
    "step halved",
    "facets",
    "unsolved",
)

PAGE = """# Spatial contact problems at random

Three-dimensional contact problems harder than joints make them, drawn at random: 3 to 59 pairs, every
other flexibility dense, well or badly conditioned, tangential loads that turn, pairs that are pulled apart
and pressed together again, friction to 1 (`benchmarks/population/spatial_problems.py`). W is positive
definite, so every step has a solution ([how it is found](spatial-contact.md)). Residuals are computed by
the script from W and the reactions alone, relative to a typical contact force; 1e-9 is asked for. The
solver was made on seeds 1 to 3, the table is of others:

    {command}

Steps by the way that solved them, each by the dearest that it needed, and Newton iterations of all steps:

"""


@dataclass
class Found:
    """Steps of one range of friction."""

    count: Array = field(default_factory=lambda: np.zeros(len(WAYS), dtype=int))
    iterations: list[int] = field(default_factory=list)
    residual: float = 0.0


def natural_residual(W: Array, mu: float, v_free: Array, vt_old: Array, r: Array) -> float:
    """Largest violation of the contact laws, ``|r - proj(r + rho v)|`` with each pair's own rho."""
    v = (v_free - W @ r).reshape(-1, 3)
    own, r = np.diag(W).reshape(-1, 3), r.reshape(-1, 3)
    normal = r[:, 0] - np.maximum(0, r[:, 0] + v[:, 0] / own[:, 0])
    trial = r[:, 1:] + (v[:, 1:] - vt_old) / own[:, 1:].mean(axis=1)[:, None]
    size, bound = np.hypot(*trial.T), mu * np.maximum(r[:, 0], 0)
    share = np.where(size > bound, bound / np.maximum(size, 1e-300), 1.0)
    tangential = np.hypot(*(r[:, 1:] - share[:, None] * trial).T)
    return float(max(np.abs(normal).max(), tangential.max()))


def take(found: Found, W: Array, mu: float, loads: Array) -> None:
    """Solve all steps of one problem; after an unsolved one the pairs stick where they were."""
    m = len(W) // 3
    none = np.zeros((3 * m, 0)), np.zeros(0), np.zeros((3 * m, 0)), np.zeros((0, 0))
    flexibility = Flexibility(W, *none, np.zeros((0, 0)))
    solver = ContactSolver(flexibility, mu, np.ones(m), np.full(m, STICK, np.int8))
    vt_old = np.zeros((m, 2))
    for v_free in loads:
        try:
            solution = solver.solve(v_free, np.zeros(0), vt_old)
        except ContactError:
            found.count += solver.memory.solved
            solver = ContactSolver(flexibility, mu, np.ones(m), np.full(m, STICK, np.int8))
            continue
        residual = natural_residual(W, mu, v_free, vt_old, solution.r)
        found.residual = max(found.residual, residual)
        found.iterations.append(solution.iterations)
        vt_old = solution.v.reshape(-1, 3)[:, 1:].copy()
    found.count += solver.memory.solved


def table(bands: list[Found]) -> list[str]:
    """Rows by friction, and all of them."""
    lines = [
        f"| friction | steps | {' | '.join(WAYS)} | iterations: mean | 99 % | largest residual |",
        "|" + "---|" * (len(WAYS) + 5),
    ]
    whole = Found(
        sum(band.count for band in bands),
        [n for band in bands for n in band.iterations],
        max(band.residual for band in bands),
    )
    names = [f"{a:g} to {b:g}" for a, b in pairwise(BOUNDS)]
    for name, band in zip([*names, "all"], [*bands, whole], strict=True):
        if not band.iterations:
            continue
        counts = " | ".join(f"{n:,}" for n in band.count)
        mean, most = np.mean(band.iterations), np.percentile(band.iterations, 99)
        row = f"| {name} | {int(band.count.sum()):,} | {counts} | {mean:.1f} | {most:.0f} "
        lines.append(row + f"| {band.residual:.0e} |")
    return lines


def main() -> int:
    """Solve, print the table, and judge it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, nargs=2, default=[10, 60], metavar=("FROM", "TO"))
    parser.add_argument("--count", type=int, default=40)
    parser.add_argument("--jumps", action="store_true")
    parser.add_argument("--page", type=Path)
    asked = parser.parse_args()
    bands = [Found() for _ in BOUNDS[1:]]
    for seed in range(*asked.seeds):
        order = np.random.default_rng(seed)
        for W, mu, loads in problems(seed, asked.count):
            if asked.jumps:
                mu, loads = 3 * mu, loads[order.permutation(len(loads))]
            take(bands[int(np.searchsorted(BOUNDS[1:-1], mu))], W, mu, loads)
        print(f"seed {seed}: {sum(int(band.count.sum()) for band in bands):,} steps", flush=True)
    lines = table(bands)
    print("\n".join(lines))
    if asked.page:
        command = "python benchmarks/population/spatial_solver.py"
        command += f" --seeds {asked.seeds[0]} {asked.seeds[1]} --count {asked.count}"
        asked.page.write_text(PAGE.format(command=command) + "\n".join(lines) + "\n")
    good = all(band.count[-1] == 0 and band.residual <= ASKED for band in bands)
    return 0 if good else 1


if __name__ == "__main__":
    raise SystemExit(main())
