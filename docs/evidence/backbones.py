"""Backbones by three routes, and the forced response at phase resonance (docs/backbones.md).

python docs/evidence/backbones.py [PAIRS]
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

from microslip import load_joint
from microslip.analyses.backbone.cycles import (
    Backbone,
    amplitude_scale,
    geometric,
    prescribed_backbone,
    quasi_static_backbone,
)
from microslip.analyses.backbone.extended_motion import harmonic_backbone
from microslip.analyses.harmonic.equations import harmonic_problem
from microslip.analyses.harmonic.response import LoadPath, describe, raise_load
from microslip.analyses.prepared.joint_modes import joint_modes
from microslip.pipeline.run import JointAssembly, assemble_joint

REFERENCE = Path(__file__).parents[2] / "examples" / "lap_joint.toml"


def at(backbone: Backbone, amplitude: float) -> tuple[float, float]:
    """Frequency and damping ratio, interpolated."""
    x = np.log(backbone.amplitude)
    return (
        float(np.interp(np.log(amplitude), x, backbone.frequency)),
        float(np.interp(np.log(amplitude), x, backbone.damping_ratio)),
    )


def compare(a: JointAssembly, number: int, count: int = 7) -> Backbone:
    """Print a table of one mode; returns its backbone by prescribed cycles."""
    mode = joint_modes(a.model, a.prestress)[number - 1]
    scale, mu = amplitude_scale(a.model, a.prestress, mode), a.joint.contact.friction
    what = (a.model, a.prestress, mode, mu)
    fine = scale * geometric(1e-5, 0.85, 60)
    began = time.process_time()
    static, lost = quasi_static_backbone(*what, scale * geometric(1e-5, 0.85, 30), threads=1)
    print(
        f"mode {number}: {mode.frequency:.4f} Hz sliding, {mode.stuck_frequency:.4f} stuck, MAC "
        f"{mode.assurance:.5f}; 30 amplitudes, quasi-static {time.process_time() - began:.1f} s"
    )
    static, lost = quasi_static_backbone(*what, fine)
    sizes = scale * geometric(1e-5, 0.6, count)
    cycles, lost_too = prescribed_backbone(*what, sizes)
    balance, lost_last = harmonic_backbone(*what, sizes)
    for message in lost + lost_too + lost_last:
        print("   ", message)
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


def resonance(a: JointAssembly, backbone: Backbone) -> None:
    """The moment that makes up for the damping: amplitude and lag that it really causes."""
    mode, mu = backbone.mode, a.joint.contact.friction
    push = abs(mode.shape @ a.model.port_modes[:, a.model.port("moment")])
    problem = harmonic_problem(a.model, a.prestress, mu, harmonics=5)
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
    joint = load_joint(REFERENCE)
    pairs = int(sys.argv[1]) if len(sys.argv) > 1 else 101
    contact = joint.contact.model_copy(update={"pairs": pairs})
    assembly = assemble_joint(joint.model_copy(update={"contact": contact}))
    first = compare(assembly, 1)
    for number in (2, 3):
        compare(assembly, number)
    print("forced response of the first mode, end moments:")
    resonance(assembly, first)


if __name__ == "__main__":
    main()
