"""Sliding frequency of the reference joint against mesh and length of the bonded zone.

The bonded half-length ends between two contact pairs; the frequency is interpolated between bonding
up to the pair before and up to the pair after. About a minute.
"""

import numpy as np

from microslip.model.elasticity import Material
from microslip.model.lap import lap_joint_structure
from microslip.model.lap_mesh import LapGeometry, MeshControl
from microslip.model.modes import linear_modes
from microslip.model.structure import Structure

CLAMP_HALF_LENGTH = 0.025
LENGTHS = (1.18, 1.1955)
MESHES = (101, 201, 401, 801)


def reference_joint(pairs: int) -> Structure:
    return lap_joint_structure(
        LapGeometry(0.2515, 0.0125, 0.0375, CLAMP_HALF_LENGTH),
        Material(70e9, 0.3, 2000.0),
        MeshControl(contact_pairs=pairs),
        horizontal_spring=1e5,
    )


def frequency(structure: Structure, x: np.ndarray, length: float) -> float:
    """Third mode: the first two are rigid motion on the weak springs."""
    normal = 2 * np.flatnonzero(np.abs(x) <= length + 1e-9)
    return float(linear_modes(structure, normal, 3).frequency[2])


def main() -> None:
    print("pairs | bonded to | before at, Hz | after at, Hz | interpolated Hz")
    for pairs in MESHES:
        structure = reference_joint(pairs)
        x = structure.interface.position / CLAMP_HALF_LENGTH
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
