"""Sliding frequency of the reference joint against mesh and length of the bonded zone.

The bonded half-length ends between two contact pairs; the frequency is interpolated between bonding
up to the pair before and up to the pair after. About a minute.
"""

import numpy as np

from microslip import reference_joint
from microslip.contact.pairs import normal_components
from microslip.model.lap import structure_of
from microslip.model.modes import linear_modes
from microslip.model.structure import Structure

LENGTHS = (1.18, 1.1955)
"""Of the bonded zone, over half the length that is clamped."""
MESHES = (101, 201, 401, 801)


def frequency(structure: Structure, x: np.ndarray, length: float) -> float:
    """Third mode: the first two are rigid motion on the weak springs."""
    bonded = normal_components(np.flatnonzero(np.abs(x) <= length + 1e-9))
    return float(linear_modes(structure, bonded, 3).frequency[2])


def main() -> None:
    print("pairs | bonded to | before at, Hz | after at, Hz | interpolated Hz")
    for pairs in MESHES:
        joint = reference_joint(pairs)
        structure = structure_of(joint)
        x = structure.interface.position / joint.clamp.half_length
        for length in LENGTHS:
            before, after = x[x <= length + 1e-9].max(), x[x > length + 1e-9].min()
            f0, f1 = frequency(structure, x, before), frequency(structure, x, after)
            mixed = f0 + (length - before) / (after - before) * (f1 - f0)
            print(
                f"{pairs:5d} | {length:6.4f} | {before:.4f} {f0:.2f} "
                f"| {after:.4f} {f1:.2f} | {mixed:.3f}"
            )


if __name__ == "__main__":
    main()
