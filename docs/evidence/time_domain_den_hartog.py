"""Den Hartog's oscillator with the steps refined in which the mass stops or turns. Two minutes.

A mass directly on a slider: friction jumps where the mass turns, and a step of fixed length notices
up to a step late (its displacement still increases although its rate has changed sign). A step in
which the contact state changes or the rate changes sign is marched again in short steps.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from microslip.analyses.time.scheme import march
from microslip.analyses.time.steady import steady_state
from microslip.contact.pairs import STICK, tangential

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "benchmarks_physics"))
from den_hartog import OMEGA, P0, STIFFNESS
from test_den_hartog import EXACT, RATIO, amplitude, marching

CHUNK = 64
"""Steps marched before looking back for a turn."""


def place(part):
    """Where the mass is at every step: the slide of the only pair."""
    return tangential(part.v)[:, 0]


def first_turn(part, before: float) -> int | None:
    """First step in which the mass stops, starts or turns; `before` is its place a step earlier."""
    state, x = part.status[:, 0], place(part)
    earlier = np.append(before, x[:-2])
    rate = 3 * x[1:] - 4 * x[:-1] + earlier
    turned = (rate * np.diff(x) < 0) & (state[1:] != STICK)
    found = np.flatnonzero((state[1:] != state[:-1]) | turned)
    return int(found[0]) if len(found) else None


def refined_cycle(coarse, fine, state, before, steps, parts):
    """State after one cycle, place one step before, largest |x| and the number of steps."""
    k, marched, largest = 0, 0, 0.0
    while k < steps:
        count = min(CHUNK, steps - k)
        load = P0 * np.sin(2 * np.pi * np.arange(k, k + count + 1) / steps)
        part = march(coarse, state, load, keep=True)
        turn = first_turn(part, before)
        if turn is not None and turn > 0:
            part = march(coarse, state, load[: turn + 1], keep=True)
        if turn != 0:
            state, before = part.state, place(part)[-2]
            largest = max(largest, np.abs(part.output[:, 1]).max())
            k, marched = k + len(part.load) - 1, marched + len(part.load) - 1
        if turn is not None:
            load = P0 * np.sin(2 * np.pi * (k + np.arange(parts + 1) / parts) / steps)
            before = tangential(state.v)[0]
            part = march(fine, state, load)
            state = part.state
            largest = max(largest, np.abs(part.output[:, 1]).max())
            k, marched = k + 1, marched + parts
    return state, before, largest, marched


def refined_amplitude(ratio, r, steps, parts):
    """Largest |x| k / P0 of the steady state, and steps per cycle."""
    frequency = r * OMEGA / (2 * np.pi)
    coarse = marching(ratio * P0, 1 / (frequency * steps))
    fine = marching(ratio * P0, 1 / (frequency * steps * parts))
    rough = marching(ratio * P0, 1 / (frequency * 500))
    cycle = steady_state(rough, frequency, P0, tolerance=1e-4).cycle
    state, before, last = cycle.state, place(cycle)[-2], np.inf
    for _ in range(400):
        state, before, largest, marched = refined_cycle(coarse, fine, state, before, steps, parts)
        if abs(largest / last - 1) < 1e-7:
            break
        last = largest
    return largest * STIFFNESS / P0, marched


def main() -> None:
    plain, refined = (500, 1000, 2000), ((150, 16), (500, 64), (1000, 32))
    worst: dict[str, float] = {}
    for ratio, row in EXACT.items():
        for r, exact in zip(RATIO, row, strict=True):
            errors = {f"{n}": amplitude(ratio, r, n)[0] / exact - 1 for n in plain}
            errors["2000, extrapolated"] = 2 * errors["2000"] - errors["1000"]
            for steps, parts in refined:
                found, marched = refined_amplitude(ratio, r, steps, parts)
                errors[f"{steps} + turns in {parts} ({marched})"] = found / exact - 1
            print(f"F/P0 {ratio}, r {r}: " + ", ".join(f"{k}: {e:+.1e}" for k, e in errors.items()))
            for key, error in errors.items():
                name = key.split(" (")[0]
                worst[name] = max(worst.get(name, 0.0), abs(error))
    for name, error in worst.items():
        print(f"worst of twelve, {name}: {error:.1e}")


if __name__ == "__main__":
    main()
