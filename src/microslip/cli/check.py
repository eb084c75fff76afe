"""The command ``microslip check``: what follows from a joint file, and what a run will cost."""

from __future__ import annotations

import math
from collections.abc import Iterator

import typer
from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from microslip.cli.messages import messages, warn
from microslip.cli.options import JointFile
from microslip.describe.beam import bending_stiffnesses
from microslip.describe.lap import LapJoint
from microslip.describe.reading import load_joint
from microslip.describe.units import readable
from microslip.pipeline.cost import check_size, degrees_of_freedom
from microslip.pipeline.estimate import Estimate, elastic_limit, estimate, input_cautions
from microslip.pipeline.run import asked_for
from microslip.registry import column

app = typer.Typer(add_completion=False)

Row = tuple[str, str]


@app.command()
def check(file: JointFile) -> None:
    """Validate a joint file; show what follows from it and what a run will cost."""
    with messages():
        joint = load_joint(file)
        check_size(joint, degrees_of_freedom(joint))
        found = estimate(joint)
        table = derived(joint, found)
        cautions = input_cautions(joint, found)
    Console().print(table)
    warn(cautions)


def derived(joint: LapJoint, found: Estimate | None = None) -> Table:
    """Table of the quantities that follow from a joint.

    Raises
    ------
    InputError
        Where a signal of a history cannot be used.
    """
    found = found or estimate(joint)
    title = escape(joint.title or "Lap joint")
    table = Table("quantity", "value", title=title, box=box.SIMPLE_HEAD)
    for name, value in (*_mechanics(joint, found), *_load(joint, found), *_work(joint, found)):
        table.add_row(name, value)
    return table


def _mechanics(joint: LapJoint, found: Estimate) -> Iterator[Row]:
    limit = joint.opening_ratio
    opening = readable(limit * joint.clamp_force_length, "N m/m")
    stiff, beams = bending_stiffnesses(joint), joint.beams
    slender = [L / h for L, h in zip(beams.lengths, beams.thicknesses, strict=True)]
    yield "bending stiffness E'h³/12", _both([readable(EI, "N m²/m") for EI in stiff])
    yield "length over thickness of a beam", _both([f"{ratio:.3g}" for ratio in slender])
    yield (
        "estimated resonance",
        f"{found.sliding_frequency:.4g} Hz sliding, {found.stuck_frequency:.4g} Hz stuck",
    )
    yield "mean clamp pressure P/(2 L_p)", _judged(joint, found.pressure)
    yield "P L", readable(joint.clamp_force_length, "N m/m")
    if joint.driven_by_end_moments and "clamped" not in (joint.support.left, joint.support.right):
        yield "M/(P L) that opens the joint", f"{limit:.4g}  (M = {opening})"
    given, used = joint.support.horizontal_spring, joint.spring_used
    if used > given:
        yield (
            "horizontal springs",
            f"{readable(used, 'N/m/m')} in place of {readable(given, 'N/m/m')}: they hold the mean "
            "position, and nothing else depends on them",
        )


def _both(texts: list[str]) -> str:
    """Of the lower and the upper beam; once, where they are alike."""
    lower, upper = texts
    return lower if lower == upper else f"{lower} below, {upper} above"


def _load(joint: LapJoint, found: Estimate) -> Iterator[Row]:
    """Loads, and what the largest does to the joint at rest."""
    if joint.load is not None:
        said = joint.driven.load
        unit = f" {said.unit}" if joint.load.kind == said.key else ""
        values = ", ".join(f"{value:g}" for value in joint.load.values)
        where = "" if joint.load.port is None else f" on the port {joint.load.port}"
        yield f"loads: {joint.load.kind}{where}", values + unit
    if math.isnan(found.moment):
        return
    yield "bending stress at rest, 6 M/h²", _judged(joint, found.stress)
    bound = found.resonant_stress
    unbounded = "unbounded: the material does not damp"
    yield (
        "at resonance, without friction",
        unbounded if math.isinf(bound) else f"at most {_judged(joint, bound)}",
    )
    yield "deflection at the middle at rest", readable(found.deflection, "m", 3)
    if joint.friction:
        length = min(found.slip_length, joint.beams.overlap_half_length)
        every = found.slip_length >= joint.clamp.half_length
        pairs = "all pairs" if every else f"{found.slip_pairs:.0f} pairs"
        yield "slips at each edge at rest", f"about {readable(length, 'm', 2)}, {pairs}"


def _work(joint: LapJoint, found: Estimate) -> Iterator[Row]:
    """What is asked for, and the time it will take."""
    used, written = joint.contact.pairs_used, joint.contact.pairs
    raised = f"  (raised from {written}: must be odd)" if used != written else ""
    yield "contact pairs", f"{used}{raised}, {found.clamp_pairs:.0f} across the clamp"
    yield "degrees of freedom", str(found.degrees_of_freedom)
    for row, request in column("request"):
        if asked_for(joint, row.name):
            yield from request(joint)
    yield "estimated memory", f"{found.memory / 1e9:.2g} GB"
    yield "estimated time of a run", f"{found.seconds:.0f} s on one core"


def _judged(joint: LapJoint, stress: float) -> str:
    """A stress, and beside it the yield stress where it is given."""
    shown = readable(stress, "Pa")
    if joint.material.yield_stress is None:
        return shown
    share = stress / elastic_limit(joint)[0]
    return f"{shown}, {share:.0%} of yield" if share < 2 else f"{shown}, {share:.3g} times yield"
