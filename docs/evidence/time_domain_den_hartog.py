"""Den Hartog's oscillator with steps of one length and with refined turns. A minute.

A mass directly on a slider: friction jumps where the mass turns, and a step of fixed length notices
up to a step late (its displacement still increases although its rate has changed sign).
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from microslip.analyses.time.turns import turning_cycle

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "benchmarks_physics"))
from den_hartog import OMEGA, P0, STIFFNESS, oscillator
from test_den_hartog import EXACT, RATIO, amplitude

PLAIN, REFINED = (500, 1000, 2000), ((500, 64), (1000, 32))


def main() -> None:
    worst: dict[str, float] = {}
    for ratio, row in EXACT.items():
        for r, exact in zip(RATIO, row, strict=True):
            errors = {f"{n}": amplitude(ratio, r, n)[0] / exact - 1 for n in PLAIN}
            for steps, parts in REFINED:
                frequency = r * OMEGA / (2 * np.pi)
                found = turning_cycle(
                    oscillator(ratio * P0), frequency, P0, steps=steps, parts=parts
                )
                size = np.abs(found.output[:, 1]).max() * STIFFNESS / P0
                errors[f"{steps}, turns in {parts} ({found.steps})"] = size / exact - 1
            print(f"F/P0 {ratio}, r {r}: " + ", ".join(f"{k}: {e:+.1e}" for k, e in errors.items()))
            for key, error in errors.items():
                worst[key] = max(worst.get(key, 0.0), abs(error))
    for name, error in worst.items():
        print(f"worst of twelve, {name}: {error:.1e}")


if __name__ == "__main__":
    main()
