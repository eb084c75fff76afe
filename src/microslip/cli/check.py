"""The command ``microslip check``: what follows from a joint file, and what a run will cost."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator
from math import pi
from pathlib import Path
from typing import Annotated

import typer
from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from microslip.analyses.prepared.prestress import slides_from
from microslip.cli.figure_formats import Renderer
from microslip.cli.folders import claim, withdraw
from microslip.cli.messages import messages, warn
from microslip.cli.options import JointFile
from microslip.contact.fields import contact_extent
from microslip.describe.beam import bending_stiffnesses
from microslip.describe.joint import Joint
from microslip.describe.lap import LapJoint
from microslip.describe.mesh import MeshJoint
from microslip.describe.reading import load_joint
from microslip.describe.units import readable
from microslip.describe.units_of_the_whole import in_whole
from microslip.model.damping import GivenDamping
from microslip.model.imported import Imported
from microslip.pipeline.cost import check_size, degrees_of_freedom, memory, total_seconds
from microslip.pipeline.estimate import Estimate, elastic_limit, estimate, input_doubts
from microslip.pipeline.geometry import unplaced
from microslip.pipeline.prepare import Assembly, assemble
from microslip.pipeline.run import asked_for
from microslip.registry import column
from microslip.show.described import draw_described
from microslip.show.plots.solid import drawn_by

app = typer.Typer(add_completion=False)

Row = tuple[str, str]

ROUNDING = 1e-12
"""Of a damping, what is missed of it by rounding alone."""


@app.command()
def check(
    file: JointFile,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            metavar="DIR",
            help="Draw the structure, its interfaces and what moves without stiffness into DIR.",
        ),
    ] = None,
    renderer: Renderer = "auto",
) -> None:
    """Validate a joint file; show what follows from it and what a run will cost."""
    with messages(), drawn_by(renderer):
        joint = load_joint(file)
        check_size(joint, degrees_of_freedom(joint))
        if out is not None:
            _draw(joint, out)
        assembly = None if isinstance(joint, LapJoint) else assemble(joint)
        table = derived(joint, assembly)
        doubts = () if assembly is None else assembly.doubts
        cautions = dict.fromkeys((*input_doubts(joint), *doubts))
    Console().print(table)
    warn(cautions)


def _draw(joint: Joint, folder: Path) -> None:
    """Pictures first: they are wanted most where the rest ends with an error."""
    created = claim(folder, force=True)
    try:
        written = draw_described(joint, folder)
    finally:
        withdraw(created)
    if written:
        typer.echo(f"{', '.join(path.name for path in written)} are in {folder}")
    else:
        typer.echo(f"no pictures: {unplaced(joint)}")


def derived(joint: Joint, assembly: Assembly | None = None) -> Table:
    """Table of the quantities that follow from a joint; one from files is prestressed for them.

    Raises
    ------
    InputError
        Where a signal of a history cannot be used.
    """
    table = Table(
        "quantity", "value", title=escape(joint.title or _untitled(joint)), box=box.SIMPLE_HEAD
    )
    rows = _of_beams(joint) if isinstance(joint, LapJoint) else _of_files(joint, assembly)
    for name, value in rows:
        table.add_row(name, escape(in_whole(value) if joint.whole else value))
    return table


def _untitled(joint: Joint) -> str:
    return joint.unnamed.removeprefix("a ").capitalize()


def _of_beams(joint: LapJoint) -> Iterator[Row]:
    found = estimate(joint)
    yield from _mechanics(joint, found)
    yield from _loads(joint)
    yield from _load(joint, found)
    used, written = joint.contact.pairs_used, joint.contact.pairs
    raised = f"  (raised from {written}: must be odd)" if used != written else ""
    yield "contact pairs", f"{used}{raised}, {found.clamp_pairs:.0f} across the clamp"
    yield from _work(joint, found.degrees_of_freedom)


def _of_files(joint: Joint, done: Assembly | None) -> Iterator[Row]:
    """What the files hold, and what the preload makes of it."""
    assembly = assemble(joint) if done is None else done
    found = assembly.imported
    modes, measures, start = assembly.mode, assembly.measures, assembly.prestress
    model = assembly.model
    yield from _of_saved(assembly) if found is None else _of_structure(found)
    yield (
        "resonance",
        f"{modes.sliding_frequency:.4g} Hz sliding, {modes.stuck_frequency:.4g} Hz stuck",
    )
    for name, force, by in () if assembly.bolts is None else assembly.bolts.rows:
        yield f"bolt {name}", f"{readable(force, 'N/m', 4)}, shortened by {readable(by, 'm', 3)}"
    for entry in joint.preload if isinstance(joint, MeshJoint) else ():
        if not entry.keeps_length:
            unit, value = entry.amount
            yield f"preload {entry.name}", f"{readable(value, unit, 4)}, constant"
    taken = "with" if start.frictional else "without"
    yield "contact force under the preload", f"{readable(measures.force, 'N/m')}, {taken} friction"
    left, right = contact_extent(model.position, start.touching)
    yield (
        "contact under the preload",
        f"{int(start.touching.sum())} of {model.pairs} pairs, {readable(left, 'm', 4)} to "
        f"{readable(right, 'm', 4)}",
    )
    yield "largest pressure", readable(float(start.pressure.max()), "Pa")
    if found is not None and found.pairs.gap.any():
        gaps = [
            readable(float(gap), "m", 3) for gap in (found.pairs.gap.min(), found.pairs.gap.max())
        ]
        yield "initial gaps", f"{gaps[0]} to {gaps[1]}"
    if assembly.damping is not None:
        yield from _of_damping(joint, assembly.damping)
    friction = assembly.prepared.law.friction
    yield "coefficient of friction", _span(friction.min(), friction.max())
    yield (
        "most that friction holds",
        readable(float(friction @ (start.pressure * model.area)), "N/m"),
    )
    said, opening = joint.driven.load, assembly.opening_moment
    yield (
        f"what opens it on the port {joint.driven.name}",
        said.named(opening) if math.isfinite(opening) else "no amplitude",
    )
    slides = slides_from(model, start, joint.driven.name, friction)
    if math.isfinite(slides):
        yield f"what slides it on the port {joint.driven.name}", f"about {said.named(slides)}"
    yield from _loads(joint)
    yield from _work(joint, assembly.structure.dofs)


def _of_damping(joint: Joint, given: GivenDamping) -> Iterator[Row]:
    """What a matrix, or ratios of modes, say."""
    by_matrix = given.of == "matrices.damping"
    said = f"alpha = {given.alpha:.4g} 1/s, beta = {given.beta:.4g} s"
    if given.matrix is not None:
        said += " and a matrix that couples the modes, " + (
            f"{given.missed:.1%} of it" if by_matrix else "for what these two miss"
        )
    elif given.missed > ROUNDING:
        said += f", up to {given.missed:.1e} of it"
    yield "damping matrix" if by_matrix else "damping ratios of modes", said
    if by_matrix and given.off > ROUNDING:
        yield "damping that the model misses", f"{given.off:.1e} of that of the joint's mode"
    modes = zip(joint.damping_of_modes, given.at, given.ratios, strict=True)
    for (number, _), omega, ratio in modes if not by_matrix else ():
        yield (
            f"damping ratio of mode {number}",
            f"{ratio:.4g}, which sticks at {omega / (2 * pi):.5g} Hz",
        )


def _of_structure(found: Imported) -> Iterator[Row]:
    """What files of matrices or of a mesh hold."""
    yield from found.facts
    motions = Counter(found.zero_modes)
    named = [f"{name}{f' ({count})' if count > 1 else ''}" for name, count in motions.items()]
    yield "motions without stiffness", "; ".join(named) or "none: all is supported"
    yield "lowest frequency without contact", f"{found.first_frequency:.4g} Hz"


def _of_saved(assembly: Assembly) -> Iterator[Row]:
    """What a saved model holds."""
    model, held = assembly.model, assembly.prestress.preload
    where = "in the plane" if model.dimension == 2 else "in space"
    yield "saved model", f"{model.pairs} contact pairs {where}, {len(model.omega)} modes"
    yield "ports", ", ".join(model.ports)
    yield "held by", ", ".join(f"{name} {force:.4g}" for name, force in held.items())
    alpha, beta = model.rayleigh
    full = "" if model.damping is None else " and a matrix that couples the modes"
    yield "damping of the model", f"alpha = {alpha:.4g} 1/s, beta = {beta:.4g} s{full}"


def _span(low: float, high: float) -> str:
    return f"{low:.4g}" if low == high else f"{low:.4g} to {high:.4g}"


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


def _loads(joint: Joint) -> Iterator[Row]:
    """Loads of the file."""
    if joint.load is not None:
        said = joint.driven.load
        unit = f" {said.unit}" if joint.load.kind == said.key else ""
        values = ", ".join(f"{value:g}" for value in joint.load.values)
        where = "" if joint.load.port is None else f" on the port {joint.load.port}"
        yield f"loads: {joint.load.kind}{where}", values + unit


def _load(joint: LapJoint, found: Estimate) -> Iterator[Row]:
    """What the largest load does to the joint at rest."""
    if math.isnan(found.moment):
        return
    yield "bending stress at rest, 6 M/h²", _judged(joint, found.stress)
    bound = found.resonant_stress
    said = f"at most {_judged(joint, bound)}"
    if math.isinf(bound):
        said = "unbounded: the material does not damp"
    if math.isnan(bound):
        said = "not known: both beams lie within the overlap"
    yield "at resonance, without friction", said
    yield "deflection at the middle at rest", readable(found.deflection, "m", 3)
    if joint.friction:
        length = min(found.slip_length, joint.beams.overlap_half_length)
        every = found.slip_length >= joint.clamp.half_length
        pairs = "all pairs" if every else f"{found.slip_pairs:.0f} pairs"
        yield "slips at each edge at rest", f"about {readable(length, 'm', 2)}, {pairs}"


def _work(joint: Joint, dofs: int) -> Iterator[Row]:
    """What is asked for, and the time it will take."""
    yield "degrees of freedom", str(dofs)
    for row, request in column("request"):
        if asked_for(joint, row.name):
            yield from request(joint)
    yield "estimated memory", f"{memory(joint, dofs) / 1e9:.2g} GB"
    yield "estimated time of a run", f"{total_seconds(joint, dofs):.0f} s on one core"


def _judged(joint: LapJoint, stress: float) -> str:
    """A stress, and beside it the yield stress where it is given."""
    shown = readable(stress, "Pa")
    if joint.material.yield_stress is None:
        return shown
    share = stress / elastic_limit(joint)[0]
    return f"{shown}, {share:.0%} of yield" if share < 2 else f"{shown}, {share:.3g} times yield"
