"""Frequencies by beam theory against finite elements, for joints drawn at random.

python docs/evidence/beam_estimate.py [JOINTS] [SEED]

Length over thickness 8 to 40, overlap and clamp of every share, three metals, end springs of 1e3 to
1e9 N/m per metre.
"""

from __future__ import annotations

import math
import random
import sys

from microslip.describe.lap import LapJoint
from microslip.describe.reading import parse_joint
from microslip.model.beams import beam_estimate
from microslip.model.lap import geometry, materials
from microslip.pipeline.prepare import assemble

METALS = ((70e9, 2700), (110e9, 4430), (210e9, 7850))


def drawn(rng: random.Random) -> LapJoint:
    """One joint."""

    def log_uniform(low: float, high: float) -> float:
        return math.exp(rng.uniform(math.log(low), math.log(high)))

    thickness = log_uniform(3e-3, 30e-3)
    length = thickness * log_uniform(8, 40)
    overlap = length * rng.uniform(0.1, 0.4)
    modulus, density = rng.choice(METALS)
    return parse_joint(
        {
            "beams": {"length": length, "thickness": thickness, "overlap_half_length": overlap},
            "material": {
                "youngs_modulus": modulus,
                "poissons_ratio": rng.uniform(0.2, 0.4),
                "density": density,
            },
            "contact": {"friction": 0.3, "pairs": 81},
            "clamp": {"force": 1e5, "half_length": overlap * rng.uniform(0.3, 0.95)},
            "support": {"horizontal_spring": log_uniform(1e3, 1e9)},
            "mesh": {"modes": 30},
            "analysis": {"cycle": {}},
        }
    )


def main(words: list[str]) -> None:
    """Print every joint and the largest deviations."""
    count = int(words[0]) if words else 20
    rng = random.Random(int(words[1]) if len(words) > 1 else 1)
    worst = [0.0, 0.0]
    print(
        " L/h  L_o/L  L_p/h   spring   sliding, Hz   stuck, Hz   beams over elements   "
        "contact beyond clamp / h"
    )
    for _ in range(count):
        joint = drawn(rng)
        b, spring = joint.beams, joint.support.horizontal_spring
        assembly = assemble(joint)
        mode = assembly.mode
        found = beam_estimate(geometry(joint), materials(joint), spring)
        ratios = (
            found.sliding_frequency / mode.sliding_frequency,
            found.stuck_frequency / mode.stuck_frequency,
        )
        worst = [max(w, abs(r - 1)) for w, r in zip(worst, ratios, strict=True)]
        touching = abs(assembly.model.position[assembly.prestress.touching]).max()
        print(
            f"{b.length / b.thickness:4.1f}  {b.overlap_half_length / b.length:5.2f}  "
            f"{joint.clamp.half_length / b.thickness:5.2f}  {spring:7.1e}   "
            f"{mode.sliding_frequency:11.2f}   {mode.stuck_frequency:9.2f}   "
            f"{ratios[0]:9.4f} {ratios[1]:9.4f}   "
            f"{(touching - joint.clamp.half_length) / b.thickness:24.3f}"
        )
    print(f"largest deviation: sliding {worst[0]:.2%}, stuck {worst[1]:.2%}")


if __name__ == "__main__":
    main(sys.argv[1:])
