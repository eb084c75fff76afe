"""Quasi-static load steps of random lap joints: how many there were, and which rule solved them.

python benchmarks/population/load_steps.py [--seeds 10 13] [--count 20] [--pairs 51] [--page FILE]

For every joint: steady cycles under the moment up to 0.95 of what opens it, under the inertia of the first
mode, and with that mode prescribed, as the table of the refined model has them, up to 0.85 of the
amplitude whose inertia opens it. The exit code is 1 where a step is unsolved. With ``--page`` the
table is appended to a page of the docs.
"""

from __future__ import annotations

import argparse
import tomllib
from collections.abc import Iterator
from dataclasses import astuple
from pathlib import Path

import numpy as np
from contact_solver import RULES
from lap_joints import joints

from microslip.analyses.backbone.points import amplitude_scale
from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.prepared.joint_modes import JointMode, joint_modes, with_mode_port
from microslip.analyses.prepared.prestress import opening_load
from microslip.analyses.statics.cycle import quasi_static_cycle
from microslip.analyses.statics.held import hold_port
from microslip.analyses.statics.prescribed import prescribed_cycle
from microslip.contact.fallbacks import Fallbacks, together
from microslip.describe.reading import parse_joint
from microslip.errors import ContactError
from microslip.pipeline.prepare import prepare

KINDS = ("moment", "inertia of the mode", "mode prescribed")

HEAD = """
## Load steps of lap joints at random

Quasi-static cycles of {joints} random lap joints (`benchmarks/population/lap_joints.py`, seeds {seeds}),
twelve amplitudes each way: under the moment up to 0.95 of what opens the joint, under the inertia of
the first mode and with the first mode prescribed, as in the table of the refined model, up to 0.85 of
the amplitude that opens it.

    {command}

"""


def amplitudes(largest: float, fraction: float) -> Iterator[float]:
    """Twelve of them, from sticking on."""
    return (largest * float(a) for a in np.geomspace(1e-4, fraction, 12))


def attempts(joint: PreparedJoint, mode: JointMode) -> Iterator[tuple[str, Fallbacks | str]]:
    """What became of each cycle: its steps, or what was said."""
    wide = joint.with_model(with_mode_port(joint.model, mode))
    scale = amplitude_scale(joint, mode)
    held = hold_port(wide, mode.port, mode.sliding_omega, mode.stuck_omega)

    def moment(a: float) -> Fallbacks:
        return quasi_static_cycle(joint, "moment", a, steps=200, max_cycles=4).fallbacks

    def inertia(a: float) -> Fallbacks:
        load = a * mode.sliding_omega**2
        return quasi_static_cycle(wide, mode.port, load, steps=200, max_cycles=4).fallbacks

    def prescribed(a: float) -> Fallbacks:
        return prescribed_cycle(held, a, steps=200, cycles=4).fallbacks

    limits = (
        (opening_load(joint.model, joint.prestress, "moment"), 0.95),
        (scale, 0.85),
        (scale, 0.85),
    )
    for kind, one, limit in zip(KINDS, (moment, inertia, prescribed), limits, strict=True):
        for a in amplitudes(*limit):
            try:
                yield kind, one(a)
            except ContactError as error:
                yield kind, str(error)


def main() -> int:
    """March, print the table, and judge it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, nargs=2, default=[10, 13], metavar=("FROM", "TO"))
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--pairs", type=int, default=51)
    parser.add_argument("--page", type=Path)
    asked = parser.parse_args()
    steps: dict[str, list[Fallbacks]] = {kind: [] for kind in KINDS}
    failed = dict.fromkeys(KINDS, 0)
    number = 0
    for seed in range(*asked.seeds):
        for text in joints(seed, asked.count, asked.pairs):
            number += 1
            joint = prepare(parse_joint(tomllib.loads(text), "random"))
            mode = joint_modes(joint.model, joint.prestress, joint.law)[0]
            for kind, found in attempts(joint, mode):
                if isinstance(found, Fallbacks):
                    steps[kind].append(found)
                else:
                    failed[kind] += 1
                    print(f"{seed}, joint {number}, {kind}: {found}", flush=True)
    lines = [
        f"| cycles | without an answer | steps | {' | '.join(RULES)} |",
        "|" + "---|" * (len(RULES) + 3),
    ]
    for kind in KINDS:
        counts = astuple(together(steps[kind]))
        numbers = " | ".join(f"{n:,}" for n in counts)
        lines.append(f"| {kind} | {failed[kind]} | {sum(counts):,} | {numbers} |")
    print("\n".join(lines))
    if asked.page:
        command = "python benchmarks/population/load_steps.py"
        command += f" --seeds {asked.seeds[0]} {asked.seeds[1]} --count {asked.count}"
        seeds = f"{asked.seeds[0]} to {asked.seeds[1] - 1}"
        with asked.page.open("a") as page:
            page.write(HEAD.format(joints=number, seeds=seeds, command=command))
            page.write("\n".join(lines) + "\n")
    return 1 if any(failed.values()) else 0


if __name__ == "__main__":
    raise SystemExit(main())
