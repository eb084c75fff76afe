"""The beam with three bolts: backbones by three routes, harmonic balance in time (docs/half-lap-numbers.md).

python docs/evidence/three_bolts.py [MESH] [--amplitudes 1e-4 1e-3 3e-3 6e-3] [--harmonics 5]

The mesh is that of the example unless another is named, such as the coarser one of
``python examples/meshes/make.py half_lap_beam --size 24 --rest 48 --out FOLDER``.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from microslip import PreparedJoint, joint_modes, load_joint, prepare
from microslip.analyses.backbone.cycles import (
    CycleControl,
    prescribed_backbone,
    quasi_static_backbone,
)
from microslip.analyses.backbone.extended_motion import harmonic_backbone
from microslip.analyses.backbone.points import (
    Backbone,
    BackbonePoint,
    amplitude_scale,
    material_damping,
)
from microslip.analyses.harmonic.over_time import OverTime
from microslip.analyses.harmonic.paths import LoadPath
from microslip.analyses.harmonic.points import HarmonicPoint, describe
from microslip.analyses.harmonic.problem import harmonic_problem
from microslip.analyses.harmonic.raising import raise_load
from microslip.analyses.prepared.joint_modes import with_mode_port
from microslip.analyses.statics.cycle import quasi_static_cycle
from microslip.describe.mesh import MeshJoint
from microslip.errors import MicroslipError
from microslip.numerics.execute import serial
from microslip.numerics.fourier import harmonic, without_drift

EXAMPLE = Path(__file__).parents[2] / "examples" / "half_lap_beam.toml"
STEPS, CYCLES, CLOSURE = 200, 40, 1e-4
"""Load steps of a cycle, cycles at most, and change of the reactions at which one repeats the last."""

HARMONICS = 5, 9
"""Of harmonic balance beside time integration."""


def joint_of(mesh: Path | None) -> PreparedJoint:
    """The example, or the same on another mesh."""
    joint = load_joint(EXAMPLE)
    if mesh is not None:
        assert isinstance(joint, MeshJoint)
        given = joint.mesh.model_copy(update={"file": str(mesh.resolve())})
        joint = joint.model_copy(update={"mesh": given})
    return prepare(joint)


def backbones(
    joint: PreparedJoint, shares: Sequence[float], harmonics: int, steps: int = STEPS
) -> dict[str, Backbone]:
    """Backbones of the first mode by method, at amplitudes over the one that opens the joint.

    All are taken at the amplitudes that prescribed cycles have: quasi-static ones, which are driven by a
    load, by two corrections of it.
    """
    mode = joint_modes(joint.model, joint.prestress, joint.law)[0]
    sizes = [share * amplitude_scale(joint, mode) for share in shares]
    control = CycleControl(steps, CYCLES, CLOSURE)
    began = time.process_time()
    held, lost = prescribed_backbone(joint, mode, sizes, control=control, executor=serial())
    told = [f"prescribed {time.process_time() - began:.0f} s"]
    began = time.process_time()
    driven = held.amplitude * (held.frequency / mode.sliding_frequency) ** 2
    for _ in range(3):
        static, missed = quasi_static_backbone(
            joint, mode, driven, control=control, executor=serial()
        )
        if missed:
            break
        driven = driven * held.amplitude / static.amplitude
    told.append(f"quasi-static {time.process_time() - began:.0f} s")
    began = time.process_time()
    balance, lost_last = harmonic_backbone(joint, mode, held.amplitude, harmonics=harmonics)
    told.append(f"harmonic {time.process_time() - began:.0f} s")
    print(f"{len(sizes)} amplitudes: {', '.join(told)}", flush=True)
    for failure in lost + missed + lost_last:
        print("   ", failure)
    loops = of_first_harmonic(joint, static)
    return {
        "harmonic": balance,
        "prescribed": held,
        "quasi_static": static,
        "first_harmonic": loops,
    }


def of_first_harmonic(joint: PreparedJoint, curve: Backbone) -> Backbone:
    """The quasi-static curve with the first harmonic of its loops in place of the secant through their tips.

    ``omega² (1 + 2 i zeta) = F_1 / Q_1``, and the damping of the material.
    """
    wide, points = joint.with_model(with_mode_port(joint.model, curve.mode)), []
    for point in curve.points:
        load = point.omega**2 * point.amplitude
        cycle = quasi_static_cycle(
            wide, curve.mode.port, load, steps=STEPS, max_cycles=CYCLES, closure=CLOSURE
        )
        output = without_drift(cycle.output, cycle.theta)
        first = harmonic(output, cycle.theta)[wide.model.port(curve.mode.port)]
        stiffness = load / first
        omega = float(np.sqrt(stiffness.real))
        ratio = float(abs(stiffness.imag) / (2 * stiffness.real))
        damping_ratio = ratio + material_damping(joint.model, omega)
        points.append(
            replace(point, amplitude=float(abs(first)), omega=omega, damping_ratio=damping_ratio)
        )
    return replace(curve, points=tuple(points))


def table(curves: dict[str, Backbone]) -> None:
    """Print frequency and damping by harmonic balance, and the other methods beside it."""
    print(
        "| amplitude over opening | Hz | ζ | `prescribed`: ω | ζ | `quasi_static`: ω | ζ "
        "| its first harmonic: ω | ζ |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    for point in curves["harmonic"].points:
        row = f"| {point.amplitude / curves['harmonic'].scale:.3g} "
        row += f"| {point.omega / (2 * np.pi):.4f} | {point.damping_ratio:.4e} "
        for name in ("prescribed", "quasi_static", "first_harmonic"):
            other = nearest(curves[name], point)
            row += f"| {100 * (other.omega / point.omega - 1):+.3f} % "
            row += f"| {100 * (other.damping_ratio / point.damping_ratio - 1):+.2f} % "
        print(row + "|", flush=True)


def nearest(curve: Backbone, point: BackbonePoint) -> BackbonePoint:
    """The point of the other curve whose amplitude is closest."""
    return min(curve.points, key=lambda other: abs(other.amplitude / point.amplitude - 1))


def at_resonance(
    joint: PreparedJoint, curve: Backbone, point: BackbonePoint, harmonics: int
) -> HarmonicPoint:
    """Harmonic balance at a point's frequency under the load that makes up for its damping.

    ``M = 2 zeta omega² a / |Phi^T p|``.
    """
    push = abs(curve.mode.load_on_sliding[joint.drive])
    load = 2 * point.damping_ratio * point.omega**2 * point.amplitude / push
    problem = harmonic_problem(joint, harmonics=harmonics)
    frequency = point.omega / (2 * np.pi)
    w, _ = raise_load(problem, frequency, load)
    return describe(LoadPath(problem, frequency, load).at(w, load), 0, 0.0)


def over_time(joint: PreparedJoint, curve: Backbone, points: Sequence[BackbonePoint]) -> None:
    """Print amplitudes of harmonic balance, and of time integration beside it."""
    print("| N m | Hz | lag, degrees | harmonics | amplitude | over time | s |")
    print("|---|---|---|---|---|---|---|")
    for point in points:
        for harmonics in HARMONICS:
            began = time.process_time()
            try:
                answer = at_resonance(joint, curve, point, harmonics)
            except MicroslipError as error:
                print(f"    {harmonics} harmonics: {error}", flush=True)
                continue
            beside = OverTime(joint, answer.load).beside(answer)
            said = "leaves it, or does not settle"
            if beside is not None:
                ratio = abs(beside.steady.amplitude) / abs(answer.amplitude)
                said = f"{100 * (ratio - 1):+.2f} % ± {100 * beside.own:.2f} %"
            print(
                f"| {answer.load:.4g} | {answer.frequency:.4f} | {np.degrees(abs(answer.phase)):.2f} "
                f"| {harmonics} | {abs(answer.amplitude):.5e} | {said} "
                f"| {time.process_time() - began:.0f} |",
                flush=True,
            )


def main(argv: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("mesh", nargs="?", type=Path, help="in mm; that of the example if left out")
    parser.add_argument(
        "--amplitudes",
        type=float,
        nargs="+",
        default=[1e-4, 1e-3, 3e-3, 6e-3],
        help="of the backbones, over the one that opens the joint",
    )
    parser.add_argument("--harmonics", type=int, default=5)
    parser.add_argument(
        "--over-time", type=int, nargs="*", default=[1, 2], help="which of them, counted from 0"
    )
    parser.add_argument(
        "--numbers",
        type=int,
        nargs="+",
        default=[5, 9, 13],
        help="of harmonics beside time integration",
    )
    asked = parser.parse_args(argv)
    joint = joint_of(asked.mesh)
    print(joint)
    curves = backbones(joint, asked.amplitudes, asked.harmonics)
    table(curves)
    balance = curves["harmonic"]
    over_time(joint, balance, [balance.points[k] for k in asked.over_time])


if __name__ == "__main__":
    main()
