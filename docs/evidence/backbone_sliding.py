"""The second mode at wide slip, where the beams slide past each other: prescribed cycles against
harmonic balance. Ten minutes to an hour."""

import numpy as np

from microslip import prepare, reference_joint
from microslip.analyses.backbone.cycles import prescribed_backbone
from microslip.analyses.backbone.extended_motion import harmonic_backbone
from microslip.analyses.backbone.points import amplitude_scale
from microslip.analyses.prepared.joint_modes import joint_modes


def main() -> None:
    joint = prepare(reference_joint(pairs=51))
    mode = joint_modes(joint.model, joint.prestress, joint.law)[1]
    scale = amplitude_scale(joint, mode)
    sizes = scale * np.geomspace(0.02, 0.85, 12)[:11]
    cycles, lost = prescribed_backbone(joint, mode, sizes)
    balance, lost_too = harmonic_backbone(joint, mode, sizes, harmonics=5)
    for failure in lost + lost_too:
        print(failure)
    print("|q|/opening   f balance  zeta      | prescribed")
    for point in balance.points:
        other = min(cycles.points, key=lambda p: abs(p.amplitude / point.amplitude - 1))
        f, z = point.omega / (2 * np.pi), point.damping_ratio
        print(
            f"{point.amplitude / scale:11.3f} {f:11.4f} {z:9.3e} | "
            f"{1e6 * (other.omega / point.omega - 1):+7.0f} ppm "
            f"{100 * (other.damping_ratio / z - 1):+6.2f} %"
        )


if __name__ == "__main__":
    main()
