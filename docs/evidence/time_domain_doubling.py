"""What doubling modes, pairs and steps changes in steady amplitude and dissipation. Five minutes.

Reference joint near resonance, end moment ``M = C mu P L / rho`` with C = 2.33e-3. All searches
start at rest.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from microslip import load_joint
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import SteadyState, steady_state
from microslip.pipeline.prepare import Assembly, assemble

EXAMPLE = Path(__file__).parents[2] / "examples" / "lap_joint.toml"
C = 2.33e-3
CASES = ((2.4, 178.5), (0.8, 175.0))
MODES, PAIRS, STEPS = 60, 201, 150
TOLERANCE = 5e-6
STUDIES = {"modes": (15, 30, 60, 120), "pairs": (101, 201, 401), "steps": (75, 150, 300, 600, 1200)}


def assembled(modes: int, pairs: int) -> Assembly:
    joint = load_joint(EXAMPLE)
    mesh = joint.mesh.model_copy(update={"modes": modes})
    contact = joint.contact.model_copy(update={"pairs": pairs})
    return assemble(joint.model_copy(update={"mesh": mesh, "contact": contact}))


def solved(a: Assembly, steps: int, rho: float, frequency: float) -> SteadyState:
    load = C * a.joint.contact.friction * a.moment_unit / rho
    scheme = time_scheme(a.prepared, 1 / (frequency * steps), frequency=frequency)
    return steady_state(scheme, frequency, load, tolerance=TOLERANCE, max_cycles=120)


def main() -> None:
    known = {}
    for name, values in STUDIES.items():
        for rho, frequency in CASES:
            print(f"{name}, rho {rho}, {frequency} Hz")
            last = None
            for value in values:
                size = {"modes": MODES, "pairs": PAIRS, "steps": STEPS, name: value}
                key = size["modes"], size["pairs"]
                if key not in known:
                    known[key] = assembled(*key)
                a = known[key]
                found = solved(a, size["steps"], rho, frequency)
                now = abs(found.amplitude), found.cycle.dissipated
                change = [
                    "" if last is None else f"{n / o - 1:+.1e}"
                    for n, o in zip(now, last or now, strict=True)
                ]
                print(
                    f"  {value:4d}  q {now[0]:.6e} {change[0]:>9s}  dissipated {now[1]:.6e} "
                    f"{change[1]:>9s}  cycles {found.cycles}, change {found.change:.0e}, highest mode "
                    f"{a.model.omega[-1] / (2 * np.pi) / 1e3:.1f} kHz, sliding "
                    f"{a.mode.sliding_frequency:.3f} Hz",
                    flush=True,
                )
                last = now


if __name__ == "__main__":
    main()
