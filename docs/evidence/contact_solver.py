"""How the contact solver fares on all cycles of the reference joint. Half a minute."""

from pathlib import Path

import numpy as np

from microslip import load_joint, run
from microslip.contact.pairs import touches

EXAMPLE = Path(__file__).parents[2] / "examples" / "lap_joint.toml"


def main() -> None:
    result = run(load_joint(EXAMPLE))
    print("drive   cycles  steps per cycle  iterations per step: mean, most  worst residual")
    for drive, cycles in result.cycles.items():
        iterations = np.concatenate([cycle.iterations[1:] for cycle in cycles])
        residual = max(cycle.residual.max() for cycle in cycles)
        print(
            f"{drive:6s}  {len(cycles):6d}  {len(iterations) // len(cycles):15d}  "
            f"{iterations.mean():23.2f}, {iterations.max():4d}  {residual:14.0e}"
        )
        hard = sum(cycle.hard_steps for cycle in cycles)
        total = sum(cycle.cycles * (len(cycle.theta) - 1) for cycle in cycles)
        print(f"        steps of all cycles {total}, with a fallback {hard}")
        fewest = [int(touches(cycle.status).sum(axis=1).min()) for cycle in cycles]
        print(f"        fewest pairs touching, smallest to largest load: {fewest}")
    print(f"pairs touching at prestress {result.prestress.touching.sum()}")
    print(f"failures {[str(failure) for failure in result.failures]}")
    for response in result.responses:
        name = f"{response.variant}, rho {response.rho:g}"
        print(f"{name}: peak {response.peak_amplitude:.3e} at {response.peak_frequency:.2f} Hz")


if __name__ == "__main__":
    main()
