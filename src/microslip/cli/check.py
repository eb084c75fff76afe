"""The command ``microslip check``: what follows from a joint file, and what a run will cost."""

from __future__ import annotations

from collections.abc import Iterator

import typer
from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from microslip.cli.messages import messages
from microslip.cli.options import JointFile
from microslip.describe.lap import LapJoint
from microslip.describe.reading import load_joint
from microslip.describe.units import readable
from microslip.errors import InputError
from microslip.pipeline.cost import (
    bending_frequency,
    bending_stiffness,
    degrees_of_freedom,
    total_seconds,
)
from microslip.pipeline.excitation import prepare_histories

app = typer.Typer(add_completion=False)

Row = tuple[str, str]


@app.command()
def check(file: JointFile) -> None:
    """Validate a joint file; show what follows from it and what a run will cost."""
    with messages():
        table = derived(load_joint(file))
    Console().print(table)


def derived(joint: LapJoint) -> Table:
    """Table of the quantities that follow from a joint.

    Raises
    ------
    InputError
        Where the mesh has fewer degrees of freedom than modes are wanted, or a signal of a history
        cannot be used.
    """
    title = escape(joint.title or "Lap joint")
    table = Table("quantity", "value", title=title, box=box.SIMPLE_HEAD)
    for name, value in (*_mechanics(joint), *_work(joint)):
        table.add_row(name, value)
    return table


def _mechanics(joint: LapJoint) -> Iterator[Row]:
    limit = joint.opening_ratio
    pressure = joint.clamp.force / (2 * joint.clamp.half_length)
    opening = readable(limit * joint.clamp_force_length, "N m/m")
    yield "bending stiffness E'h³/12", readable(bending_stiffness(joint), "N m²/m")
    yield "mean clamp pressure P/(2 L_p)", readable(pressure, "Pa")
    yield "P L", readable(joint.clamp_force_length, "N m/m")
    yield "M/(P L) that opens the joint", f"{limit:.4g}  (M = {opening})"


def _work(joint: LapJoint) -> Iterator[Row]:
    """What is asked for, and the time it will take."""
    dofs = degrees_of_freedom(joint)
    yield from _size(joint, dofs)
    yield from _loads(joint)
    yield from _frequency_analyses(joint)
    for item in prepare_histories(joint.analysis.history, bending_frequency(joint)):
        steps = len(item.load) - 1
        yield (
            f"history {item.entry.label!r}",
            f"about {steps} steps of {readable(item.dt, 's')}, {readable(steps * item.dt, 's')}",
        )
    yield "estimated time of a run", f"{total_seconds(joint, dofs):.0f} s on one core"


def _size(joint: LapJoint, dofs: int) -> Iterator[Row]:
    if joint.mesh.modes >= dofs - 1:
        raise InputError(
            f"mesh.modes = {joint.mesh.modes}: this mesh has only {dofs} degrees of freedom"
        )
    used, written = joint.contact.pairs_used, joint.contact.pairs
    raised = f"  (raised from {written}: must be odd)" if used != written else ""
    yield "contact pairs", f"{used}{raised}"
    yield "degrees of freedom", str(dofs)


def _loads(joint: LapJoint) -> Iterator[Row]:
    if joint.load is not None:
        values = ", ".join(f"{value:g}" for value in joint.load.values)
        yield f"loads: {joint.load.kind}", values
    if joint.analysis.cycle is not None:
        amplitudes = joint.cycle_amplitudes()
        listed = ", ".join(f"{value:.3g}" for value in amplitudes)
        yield f"{len(amplitudes)} cycle amplitudes M/(P L)", listed
        yield "driven by", ", ".join(joint.drives)


def _frequency_analyses(joint: LapJoint) -> Iterator[Row]:
    asked = joint.analysis
    if asked.response is not None:
        r = asked.response
        ends = tuple("the joint's" if end is None else f"{end:g} Hz" for end in (r.from_, r.to))
        if r.from_ is None and r.to is None:
            yield (
                "response",
                f"{r.count} frequencies and more, in a band that follows from the joint",
            )
        else:
            yield "response", f"{r.count} frequencies, {ends[0]} to {ends[1]}"
    if asked.backbone is not None:
        b = asked.backbone
        numbers = ", ".join(map(str, b.modes))
        methods = ", ".join(m.replace("_", "-") for m in b.methods)
        yield "backbones", f"mode {numbers}: {b.count} amplitudes, {methods}"
    if asked.harmonic is not None:
        h = asked.harmonic
        adaptive = h.harmonics == "adaptive"
        number = f"{h.branch_harmonics} to {h.most}" if adaptive else str(h.harmonics)
        yield "harmonic balance", f"{_span(h.band())}, {number} harmonics"
    if asked.time is not None:
        t = asked.time
        yield "steady states in time", f"{_span(t.band())}, {t.steps} steps per cycle"


def _span(band: tuple[float, ...]) -> str:
    return f"{len(band)} frequencies, {band[0]:g} to {band[-1]:g} Hz"
