"""The spatial contact solver on random problems: which way solved how many steps, and how well.

python benchmarks/population/spatial_solver.py [--seeds 10 60] [--count 40] [--jumps] [--most 60]
[--page FILE]

A hundred load steps each problem; seeds 10 to 59, the default, are 200,000 steps, some minutes. The
residual is computed here from W and the reactions alone, the natural map relative to a contact force of 1.
With ``--jumps`` the loads of each problem come in random order and friction is three times as large, far
beyond joints. With ``--most 200`` problems have up to 199 pairs, and many that slip are solved for by
iterations. With ``--page`` the table is written as a page of the docs. The exit code is 1 where a step is
unsolved or a residual beyond 1e-9.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from solver_table import Study, asked_parser, steps_by_seed
from spatial_problems import Array, problems

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


STUDY = Study(3, WAYS, BOUNDS, natural_residual)


def shuffled(seed: int, count: int, most: int) -> Iterator[tuple[Array, float, Array]]:
    """The problems of a seed with three times their friction and their loads in random order."""
    order = np.random.default_rng(seed)
    for W, mu, loads in problems(seed, count, most=most):
        yield W, 3 * mu, loads[order.permutation(len(loads))]


def main() -> int:
    """Solve, print the table, and judge it."""
    parser = asked_parser(__doc__.splitlines()[0], 40)
    parser.add_argument("--jumps", action="store_true")
    parser.add_argument("--most", type=int, default=60, help="pairs of a problem, below this")
    asked = parser.parse_args()
    drawn = shuffled if asked.jumps else problems
    bands = steps_by_seed(
        STUDY, range(*asked.seeds), lambda seed: drawn(seed, asked.count, most=asked.most)
    )
    command = "python benchmarks/population/spatial_solver.py"
    command += f" --seeds {asked.seeds[0]} {asked.seeds[1]} --count {asked.count}"
    command += " --jumps" if asked.jumps else ""
    command += f" --most {asked.most}" if asked.most != 60 else ""
    return STUDY.finish(bands, asked.page, PAGE.format(command=command))


if __name__ == "__main__":
    raise SystemExit(main())
