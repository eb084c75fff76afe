"""Command line: write a joint file, check it, run what it asks for.

A mistake of the user ends with one message on stderr and exit code 2; a computation that fails
with 1; an interrupted one keeps what it has and ends with 130. Everything heavy is imported inside
the command that needs it, so that ``--help`` answers at once.
"""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from microslip.cli.reproduce import reproduce
from microslip.errors import InputError, MicroslipError
from microslip.version import __version__

if TYPE_CHECKING:
    from rich.table import Table

    from microslip.describe.lap import LapJoint
    from microslip.describe.requests import BackboneAnalysis, HarmonicAnalysis
    from microslip.pipeline.excitation import Prepared
    from microslip.pipeline.progress import Progress

USER_ERROR, FAILED, INTERRUPTED = 2, 1, 130

app = typer.Typer(
    help="Where a frictional joint slips, what it dissipates, and how it responds.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
)
new = typer.Typer(help="Write a commented input file.", no_args_is_help=True)
app.add_typer(new, name="new")
app.command()(reproduce)

JointFile = Annotated[Path, typer.Argument(metavar="FILE", help="Joint file (TOML).")]
Force = Annotated[bool, typer.Option("--force", help="Replace what is already there.")]


def main() -> None:
    """Run the command line."""
    app()


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"microslip {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_version, is_eager=True, help="Print the version."),
    ] = False,
) -> None:
    pass


@contextmanager
def _messages() -> Iterator[None]:
    """Turn errors into one message and an exit code."""
    try:
        yield
    except MicroslipError as error:
        typer.echo(f"error: {error}", err=True)
        raise typer.Exit(USER_ERROR if isinstance(error, InputError) else FAILED) from None
    except OSError as error:
        typer.echo(f"error: {error.filename or 'file'}: {error.strerror or error}", err=True)
        raise typer.Exit(FAILED) from None
    except KeyboardInterrupt:
        typer.echo("interrupted before it was finished", err=True)
        raise typer.Exit(INTERRUPTED) from None


@new.command("lap")
def new_lap(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="File to write.")],
    force: Force = False,
) -> None:
    """Write a commented joint file: two overlapping beams under a clamp."""
    text = resources.files("microslip").joinpath("templates", "lap.toml").read_text("utf-8")
    with _messages():
        _write_new(file, text, force)
    typer.echo(f"wrote {file}\nnext: microslip check {file}")


def _write_new(file: Path, text: str, force: bool) -> None:
    try:
        with open(file, "w" if force else "x", encoding="utf-8") as stream:
            stream.write(text)
    except FileExistsError:
        raise InputError(f"{file}: exists already; --force replaces it") from None
    except OSError as error:
        raise InputError(f"{file}: cannot be written: {error.strerror}") from None


@app.command()
def check(file: JointFile) -> None:
    """Validate a joint file; show what follows from it and what a run will cost."""
    from rich.console import Console

    from microslip.describe.reading import load_joint

    with _messages():
        table = _derived(load_joint(file))
    Console().print(table)


def _derived(joint: LapJoint) -> Table:
    """Table of the quantities that follow from a joint."""
    from rich import box
    from rich.markup import escape
    from rich.table import Table

    title = escape(joint.title or "Lap joint")
    table = Table("quantity", "value", title=title, box=box.SIMPLE_HEAD)
    for name, value in (*_mechanics(joint), *_work(joint)):
        table.add_row(name, value)
    return table


def _mechanics(joint: LapJoint) -> Iterator[tuple[str, str]]:
    from microslip.describe.units import readable
    from microslip.model.lap import material

    modulus = material(joint).plane_modulus()
    stiffness = modulus * joint.beams.thickness**3 / 12
    limit = joint.opening_ratio
    pressure = joint.clamp.force / (2 * joint.clamp.half_length)
    opening = readable(limit * joint.clamp_force_length, "N m/m")
    yield "bending stiffness E'h³/12", readable(stiffness, "N m²/m")
    yield "mean clamp pressure P/(2 L_p)", readable(pressure, "Pa")
    yield "P L", readable(joint.clamp_force_length, "N m/m")
    yield "M/(P L) that opens the joint", f"{limit:.4g}  (M = {opening})"


def _work(joint: LapJoint) -> Iterator[tuple[str, str]]:
    from microslip.describe.units import readable

    dofs = degrees_of_freedom(joint)
    if joint.mesh.modes >= dofs - 1:
        raise InputError(
            f"mesh.modes = {joint.mesh.modes}: this mesh has only {dofs} degrees of freedom"
        )
    used, written = joint.contact.pairs_used, joint.contact.pairs
    raised = f"  (raised from {written}: must be odd)" if used != written else ""
    yield "contact pairs", f"{used}{raised}"
    yield "degrees of freedom", str(dofs)
    if joint.load is not None:
        values = ", ".join(f"{value:g}" for value in joint.load.values)
        yield f"loads: {joint.load.kind}", values
    if joint.analysis.cycle is not None:
        amplitudes = joint.cycle_amplitudes()
        yield f"{len(amplitudes)} cycle amplitudes M/(P L)", _listed(amplitudes)
        yield "driven by", ", ".join(joint.analysis.cycle.drives)
    if joint.analysis.response is not None:
        r = joint.analysis.response
        yield "response", f"{r.count} frequencies, {r.from_:g} to {r.to:g} Hz"
    if joint.analysis.backbone is not None:
        b = joint.analysis.backbone
        numbers = ", ".join(map(str, b.modes))
        methods = ", ".join(m.replace("_", "-") for m in b.methods)
        yield "backbones", f"mode {numbers}: {b.count} amplitudes, {methods}"
    if joint.analysis.harmonic is not None:
        h = joint.analysis.harmonic
        band = h.band()
        number = (
            f"{h.branch_harmonics} to {h.most}" if h.harmonics == "adaptive" else str(h.harmonics)
        )
        span = f"{len(band)} frequencies, {band[0]:g} to {band[-1]:g} Hz"
        yield "harmonic balance", f"{span}, {number} harmonics"
    if joint.analysis.time is not None:
        t = joint.analysis.time
        band = t.band()
        span = f"{len(band)} frequencies, {band[0]:g} to {band[-1]:g} Hz"
        yield "steady states in time", f"{span}, {t.steps} steps per cycle"
    prepared = _histories(joint)
    for item in prepared:
        steps = len(item.load) - 1
        yield (
            f"history {item.entry.label!r}",
            f"about {steps} steps of {readable(item.dt, 's')}, {readable(steps * item.dt, 's')}",
        )
    steps = sum(len(item.load) - 1 for item in prepared)
    yield "estimated time of a run", f"{seconds(joint, dofs, steps):.0f} s on one core"


def _histories(joint: LapJoint) -> list[Prepared]:
    """Signals of the histories, read and resampled; steps from an estimated frequency."""
    from microslip.pipeline.excitation import prepare_histories

    return prepare_histories(joint.analysis.history, bending_frequency(joint))


def bending_frequency(joint: LapJoint) -> float:
    """First bending frequency of a beam as long as the joint on its supports, Hz.

    ``f = pi/2 sqrt(E'I / (rho h)) / (2 (L - L_o))²``: what the joint would have if it were one
    beam of a single thickness, within some ten per cent of the sliding frequency.
    """
    from microslip.model.lap import material

    stiffness = material(joint).plane_modulus() * joint.beams.thickness**3 / 12
    mass = joint.material.density * joint.beams.thickness
    span = 2 * (joint.beams.length - joint.beams.overlap_half_length)
    return float(math.pi / 2 * math.sqrt(stiffness / mass) / span**2)


def _listed(values: tuple[float, ...]) -> str:
    return ", ".join(f"{value:.3g}" for value in values)


def degrees_of_freedom(joint: LapJoint) -> int:
    """Degrees of freedom of the joint's mesh, two of them held by the supports."""
    from microslip.model.lap import geometry, mesh_control
    from microslip.model.lap_mesh import lap_joint_meshes

    meshes = lap_joint_meshes(geometry(joint), mesh_control(joint))
    return sum(2 * (mesh.p.shape[1] + mesh.facets.shape[1]) for mesh in meshes) - 2


def seconds(joint: LapJoint, dofs: int, history_steps: int = 0) -> float:
    """Rough time of a run: a rule fitted to a 2020s core, good to a factor of three.

    5 s to start, compile and write, 6e-7 s per degree of freedom and contact pair to reduce the
    model, 8e-9 s per squared pair and load step for a quasi-static cycle, of which an amplitude
    takes five on average, the same per time step, of which a steady state takes 25 cycles, and
    5e-5 s per frequency of a response. A backbone takes three cycles per amplitude, with the motion
    prescribed four times as many, and 6e-6 s per squared pair and harmonic by harmonic balance.
    """
    pairs, analysis = joint.contact.pairs_used, joint.analysis
    total = 5.0 + 6e-7 * dofs * pairs
    if analysis.cycle is not None:
        cycle = analysis.cycle
        cycles = len(cycle.drives) * len(joint.cycle_amplitudes()) * min(5, cycle.max_cycles)
        total += 8e-9 * pairs**2 * cycle.steps * cycles
    if analysis.response is not None and joint.load is not None:
        curves = len(joint.load.values) * len(joint.variants)
        total += 5e-5 * curves * analysis.response.count
    if "refined" in joint.variants and joint.contact.friction > 0:
        reduced = analysis.reduced
        cycles = reduced.amplitudes * min(5, reduced.max_cycles) + 100
        total += 8e-9 * pairs**2 * reduced.steps * cycles
    if analysis.backbone is not None:
        total += _backbone_seconds(analysis.backbone, pairs)
    if analysis.harmonic is not None and joint.load is not None:
        total += len(joint.load.values) * _harmonic_seconds(analysis.harmonic, pairs)
    if analysis.time is not None and joint.load is not None:
        points = len(joint.load.values) * len(analysis.time.band())
        history_steps += points * analysis.time.steps * min(25, analysis.time.max_cycles)
    return total + 8e-9 * pairs**2 * history_steps


def _harmonic_seconds(asked: HarmonicAnalysis, pairs: int) -> float:
    """Sixty points along the branch, each as dear as one asked for, at 3e-6 s per squared pair and
    harmonic; as much again for stability; adaptive ones four times as much."""
    point = 3e-6 * pairs**2 * asked.branch_harmonics
    each = point * (4 if asked.harmonics == "adaptive" else 1) + point * asked.stability
    return 60 * point + len(asked.band()) * each


def _backbone_seconds(asked: BackboneAnalysis, pairs: int) -> float:
    cycle = 8e-9 * pairs**2 * asked.steps
    each = {
        "quasi_static": 3 * cycle,
        "prescribed": 12 * cycle,
        "harmonic": 6e-6 * pairs**2 * asked.harmonics,
    }
    return len(asked.modes) * asked.count * sum(each[method] for method in asked.methods)


@app.command()
def run(
    file: JointFile,
    out: Annotated[
        Path | None,
        typer.Option("--out", metavar="DIR", help="Output folder; FILE's name with -output."),
    ] = None,
    force: Force = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="No progress and no summary.")] = False,
) -> None:
    """Run all analyses that a joint file asks for, and write the results."""
    from rich.console import Console

    from microslip.describe.reading import load_joint
    from microslip.pipeline.progress import progress_on

    folder = out if out is not None else Path(f"{file.stem}-output")
    with _messages():
        joint = load_joint(file)
        created = _claim(folder, force)
        try:
            with progress_on(Console(stderr=True), quiet=quiet) as progress:
                interrupted, written = _compute(joint, folder, progress, quiet)
        finally:
            _withdraw(created)
    _report(folder, written, quiet)
    if interrupted:
        typer.echo(f"interrupted: what was finished is in {folder}", err=True)
        raise typer.Exit(INTERRUPTED)


def _compute(
    joint: LapJoint, folder: Path, progress: Progress, quiet: bool
) -> tuple[bool, list[Path]]:
    """Run, write and summarise; whether it was interrupted, and the files written."""
    from rich.console import Console

    from microslip.pipeline.run import run_lap_joint
    from microslip.results.dataset import write_results
    from microslip.show.terminal import print_summary

    result = run_lap_joint(joint, progress)
    progress.finish()
    written = write_results(result, folder, progress)
    progress.finish()
    if not quiet:
        print_summary(result, Console())
    return bool(result.interrupted), written


def _report(folder: Path, written: list[Path], quiet: bool) -> None:
    """Say what was written, and what of an earlier run stands beside it."""
    if not quiet:
        typer.echo(f"results are in {folder}")
    mine = {path.resolve() for path in written}
    others = [
        str(path.relative_to(folder))
        for path in sorted(folder.rglob("*"))
        if path.is_file() and path.resolve() not in mine
    ]
    if others:
        shown = ", ".join(others[:5]) + (", ..." if len(others) > 5 else "")
        typer.echo(f"note: not from this run and left as they were: {shown}", err=True)


def _claim(folder: Path, force: bool) -> list[Path]:
    """Make sure results can be written to a folder; the folders created for it, outermost first."""
    try:
        missing = [place for place in (folder, *folder.parents) if not place.exists()][::-1]
        if folder.is_dir() and any(folder.iterdir()) and not force:
            raise InputError(
                f"{folder}: holds files already; choose another --out, or --force to replace "
                "the results in it"
            )
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except FileExistsError:
        raise InputError(f"{folder}: is a file; the output must be a folder") from None
    except OSError as error:
        raise InputError(f"{folder}: cannot be written to: {error.strerror}") from None
    return missing


def _withdraw(created: list[Path]) -> None:
    """Remove folders created for a run that wrote nothing into them."""
    for place in reversed(created):
        if place.is_dir() and not any(place.iterdir()):
            place.rmdir()


if __name__ == "__main__":
    main()
