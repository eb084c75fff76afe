"""Backbones by three routes, and the forced response at phase resonance (docs/backbones.md).

python docs/evidence/backbones.py [PAIRS]
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

from microslip import PreparedJoint, joint_modes, load_joint, prepare
from microslip.analyses.backbone.cycles import prescribed_backbone, quasi_static_backbone
from microslip.analyses.backbone.extended_motion import harmonic_backbone
from microslip.analyses.backbone.points import Backbone, amplitude_scale, geometric
from microslip.analyses.harmonic.paths import LoadPath
from microslip.analyses.harmonic.points import describe
from microslip.analyses.harmonic.problem import harmonic_problem
from microslip.analyses.harmonic.raising import raise_load
from microslip.numerics.execute import serial

REFERENCE = Path(__file__).parents[2] / "examples" / "lap_joint.toml"


def at(backbone: Backbone, amplitude: float) -> tuple[float, float]:
    """Frequency and damping ratio, interpolated."""
    x = np.log(backbone.amplitude)
    return (
        float(np.interp(np.log(amplitude), x, backbone.frequency)),
        float(np.interp(np.log(amplitude), x, backbone.damping_ratio)),
    )


def compare(joint: PreparedJoint, number: int, count: int = 7) -> Backbone:
    """Print a table of one mode; returns its backbone by prescribed cycles."""
    mode = joint_modes(joint.model, joint.prestress, joint.law)[number - 1]
    scale = amplitude_scale(joint, mode)
    fine = scale * geometric(1e-5, 0.85, 60)
    began = time.process_time()
    static, lost = quasi_static_backbone(
        joint, mode, scale * geometric(1e-5, 0.85, 30), executor=serial()
    )
    print(
        f"mode {number}: {mode.sliding_frequency:.4f} Hz sliding, {mode.stuck_frequency:.4f} stuck, MAC "
        f"{mode.assurance:.5f}; 30 amplitudes, quasi-static {time.process_time() - began:.1f} s"
    )
    static, lost = quasi_static_backbone(joint, mode, fine)
    sizes = scale * geometric(1e-5, 0.6, count)
    cycles, lost_too = prescribed_backbone(joint, mode, sizes)
    balance, lost_last = harmonic_backbone(joint, mode, sizes)
    for failure in lost + lost_too + lost_last:
        print("   ", failure)
    print("    |q|/opening   f balance  zeta      | prescribed       | quasi-static")
    for point in balance.points:
        f, z = point.omega / (2 * np.pi), point.damping_ratio
        row = f"    {point.amplitude / scale:9.2e} {f:11.4f} {z:9.3e}"
        for other in (cycles, static):
            nearest = float(np.min(np.abs(other.amplitude / point.amplitude - 1)))
            g, y = at(other, point.amplitude) if nearest < 0.5 else (np.nan, np.nan)
            row += f" | {1e6 * (g / f - 1):+7.0f} ppm {100 * (y / z - 1):+6.2f} %"
        print(row)
    return cycles


def resonance(joint: PreparedJoint, backbone: Backbone) -> None:
    """The moment that makes up for the damping: amplitude and lag that it really causes."""
    push = abs(backbone.mode.load_on_sliding[joint.drive])
    problem = harmonic_problem(joint, harmonics=5)
    for point in backbone.points[2:]:
        frequency = point.omega / (2 * np.pi)
        load = 2 * point.damping_ratio * point.omega**2 * point.amplitude / push
        w, _ = raise_load(problem, frequency, load)
        answer = describe(LoadPath(problem, frequency, load).at(w, load), 0, 0.0)
        print(
            f"    |q| {point.amplitude:.3e} at {frequency:.4f} Hz: forced amplitude "
            f"{100 * (abs(answer.amplitude) / point.amplitude - 1):+.2f} %, lag "
            f"{abs(np.degrees(answer.phase)):.2f} degrees"
        )


def main() -> None:
    description = load_joint(REFERENCE)
    pairs = int(sys.argv[1]) if len(sys.argv) > 1 else 101
    contact = description.contact.model_copy(update={"pairs": pairs})
    joint = prepare(description.model_copy(update={"contact": contact}))
    first = compare(joint, 1)
    for number in (2, 3):
        compare(joint, number)
    print("forced response of the first mode, end moments:")
    resonance(joint, first)


if __name__ == "__main__":
    main()
