"""The contact solver on random contact problems: which rule solved how many steps, and how well.

python benchmarks/population/contact_solver.py [--seeds 10 60] [--count 200] [--page FILE]

A hundred load steps each problem; seeds 10 to 59, the default, are 1,000,000 steps. The residual is
computed here from W and the reactions alone, the natural map relative to a contact force of 1. With
``--page`` the table is written as a page of the docs. The exit code is 1 where a step is unsolved or a
residual beyond 1e-9.
"""

from __future__ import annotations

import numpy as np
from contact_problems import Array, problems
from solver_table import Study, asked_parser, steps_by_seed

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


def natural_residual(W: Array, mu: float, v_free: Array, vt_old: Array, r: Array) -> float:
    """Largest violation of the contact laws, ``|r - proj(r + v / W_ii)|``."""
    v, own = v_free - W @ r, np.diag(W)
    rn, rt = r[::2], r[1::2]
    normal = rn - np.maximum(0, rn + v[::2] / own[::2])
    bound = mu * np.maximum(rn, 0)
    tangential = rt - np.clip(rt + (v[1::2] - vt_old) / own[1::2], -bound, bound)
    return float(max(np.abs(normal).max(), np.abs(tangential).max()))


STUDY = Study(2, RULES, BOUNDS, natural_residual)


def main() -> int:
    """Solve, print the table, and judge it."""
    asked = asked_parser(__doc__.splitlines()[0], 200).parse_args()
    bands = steps_by_seed(STUDY, range(*asked.seeds), lambda seed: problems(seed, asked.count))
    command = "python benchmarks/population/contact_solver.py"
    command += f" --seeds {asked.seeds[0]} {asked.seeds[1]} --count {asked.count}"
    return STUDY.finish(bands, asked.page, PAGE.format(command=command))


if __name__ == "__main__":
    raise SystemExit(main())
