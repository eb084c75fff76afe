"""Lap joints drawn at random, to prove the analyses on more than one joint.

python benchmarks/population/lap_joints.py SEED COUNT FOLDER      writes FOLDER/joint_000.toml ...

Wide on purpose: length over thickness 8 to 40, overlap and clamp of every share, three metals,
friction 0.05 to 0.8, supports from 1e3 to 1e9 N/m per metre, clamp force 1e4 to 1e7 N/m, material
damping over two decades, load M/(P L) from 3e-4 to 1e-2. No band and no amplitudes are given: the
defaults must do. A seed is a population.
"""

import math
import random
import sys
from collections.abc import Iterator
from pathlib import Path

METALS = {70e9: 2700, 110e9: 4430, 210e9: 7850}
"""Young's modulus, Pa, and density, kg/m³."""


def joints(seed: int, count: int, pairs: int = 101) -> Iterator[str]:
    """Yield the text of one joint file after another."""
    draw = random.Random(seed)

    def log_uniform(low: float, high: float) -> float:
        return math.exp(draw.uniform(math.log(low), math.log(high)))

    for number in range(count):
        thickness = log_uniform(3e-3, 30e-3)
        length = thickness * log_uniform(8, 40)
        overlap = min(length * draw.uniform(0.1, 0.4), length * 0.45)
        clamp = overlap * draw.uniform(0.3, 0.95)
        modulus = draw.choice(list(METALS))
        poisson = draw.uniform(0.2, 0.4)
        friction = log_uniform(0.05, 0.8)
        spring = log_uniform(1e3, 1e9)
        force = log_uniform(1e4, 1e7)
        beta = log_uniform(1e-7, 1e-5)
        load = log_uniform(3e-4, 1e-2)
        yield f"""title = "joint {number} of population {seed}"
[beams]
length = "{length:.6g} m"
thickness = "{thickness:.6g} m"
overlap_half_length = "{overlap:.6g} m"
[material]
youngs_modulus = "{modulus:.6g} Pa"
poissons_ratio = {poisson:.4f}
density = "{METALS[modulus]} kg/m^3"
[contact]
friction = {friction:.5f}
pairs = {pairs}
[clamp]
force = "{force:.6g} N/m"
half_length = "{clamp:.6g} m"
[support]
horizontal_spring = "{spring:.6g} N/m/m"
[damping]
beta = "{beta:.5g} s"
[load]
moment_over_clamp_force_length = [{load:.6g}]
[analysis.cycle]
[analysis.response]
"""


if __name__ == "__main__":
    seed, count, folder = int(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3])
    folder.mkdir(parents=True, exist_ok=True)
    for number, text in enumerate(joints(seed, count)):
        (folder / f"joint_{number:03d}.toml").write_text(text)
