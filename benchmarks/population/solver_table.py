"""Load steps of random contact problems: solved one after the other, counted by range of friction.

What `contact_solver.py` (planar) and `spatial_solver.py` share. Residuals are those of the script that asks,
from W and the reactions alone.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from microslip.contact.pairs import STICK, slip_history
from microslip.contact.solver import ContactSolver
from microslip.errors import ContactError
from microslip.model.flexibility import Flexibility

ASKED = 1e-9

Array = NDArray[np.float64]


@dataclass
class Found:
    """Steps of one range of friction, by the dearest rule that each needed; the last is unsolved."""

    count: Array
    iterations: list[int] = field(default_factory=list)
    residual: float = 0.0


@dataclass(frozen=True)
class Study:
    """One kind of contact problems.

    Attributes
    ----------
    dimension : int
        Rows of W a pair.
    rules : tuple of str
        What may solve a step, cheapest first, and "unsolved".
    bounds : tuple of float
        Ranges of friction.
    residual : callable
        ``(W, mu, v_free, vt_old, r)`` to the largest violation of the contact laws.
    """

    dimension: int
    rules: tuple[str, ...]
    bounds: tuple[float, ...]
    residual: Callable[[Array, float, Array, Array, Array], float]

    def nothing(self) -> Found:
        """No step yet."""
        return Found(np.zeros(len(self.rules), dtype=int))

    def take(self, found: Found, W: Array, mu: float, loads: Array) -> None:
        """Solve all steps of one problem; after an unsolved one the pairs stick where they were."""
        m = len(W) // self.dimension
        none = np.zeros((len(W), 0)), np.zeros(0), np.zeros((len(W), 0)), np.zeros((0, 0))
        flexibility = Flexibility(W, *none, np.zeros((0, 0)))

        def at_rest() -> ContactSolver:
            return ContactSolver(flexibility, mu, np.ones(m), np.full(m, STICK, np.int8))

        solver = at_rest()
        vt_old = slip_history(np.zeros(len(W)), self.dimension)
        for v_free in loads:
            try:
                solution = solver.solve(v_free, np.zeros(0), vt_old)
            except ContactError:
                found.count += solver.memory.solved
                solver = at_rest()
                continue
            found.residual = max(found.residual, self.residual(W, mu, v_free, vt_old, solution.r))
            found.iterations.append(solution.iterations)
            vt_old = slip_history(solution.v, self.dimension)
        found.count += solver.memory.solved

    def table(self, bands: list[Found]) -> list[str]:
        """Rows by friction, and all of them; ranges without a step are left out."""
        rules = " | ".join(self.rules)
        lines = [
            f"| friction | steps | {rules} | iterations: mean | 99 % | largest residual |",
            "|" + "---|" * (len(self.rules) + 5),
        ]
        whole = Found(
            sum(band.count for band in bands),
            [n for band in bands for n in band.iterations],
            max(band.residual for band in bands),
        )
        names = [f"{a:g} to {b:g}" for a, b in pairwise(self.bounds)]
        for name, band in zip([*names, "all"], [*bands, whole], strict=True):
            if not band.count.any():
                continue
            counts = " | ".join(f"{n:,}" for n in band.count)
            taken = band.iterations or [0]
            mean, most = np.mean(taken), np.percentile(taken, 99)
            row = f"| {name} | {int(band.count.sum()):,} | {counts} | {mean:.1f} | {most:.0f} "
            lines.append(row + f"| {band.residual:.0e} |")
        return lines

    def finish(self, bands: list[Found], page: Path | None, text: str) -> int:
        """Print the table, write the page, and judge: 1 where a step is unsolved or not solved well."""
        lines = self.table(bands)
        print("\n".join(lines))
        if page:
            page.write_text(text + "\n".join(lines) + "\n")
        good = all(band.count[-1] == 0 and band.residual <= ASKED for band in bands)
        return 0 if good else 1


def asked_parser(summary: str, count: int) -> argparse.ArgumentParser:
    """Seeds, problems for each, and a page to write."""
    parser = argparse.ArgumentParser(description=summary)
    parser.add_argument("--seeds", type=int, nargs=2, default=[10, 60], metavar=("FROM", "TO"))
    parser.add_argument("--count", type=int, default=count)
    parser.add_argument("--page", type=Path)
    return parser


def steps_by_seed(
    study: Study,
    seeds: Iterable[int],
    problems: Callable[[int], Iterable[tuple[Array, float, Array]]],
) -> list[Found]:
    """Solve all problems of all seeds, with a line of progress for each."""
    bands = [study.nothing() for _ in study.bounds[1:]]
    for seed in seeds:
        for W, mu, loads in problems(seed):
            study.take(bands[int(np.searchsorted(study.bounds[1:-1], mu))], W, mu, loads)
        print(f"seed {seed}: {sum(int(band.count.sum()) for band in bands):,} steps", flush=True)
    return bands
