"""Modes, prestress, motion and contact of a run as files of VTK (``.vtu``, ``.pvd``), for ParaView.

Lengths are in m, pressures and tractions in Pa, vectors in the axes of the mesh. Where a point of an
interface has no contact pair its values are nan, and its state is 0.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from microslip.analyses.statics.cycle import Cycle
from microslip.contact.fields import ContactFields
from microslip.contact.pairs import at_rest, normal, touches
from microslip.errors import InputError
from microslip.model.geometry import ContactSurface, Geometry
from microslip.model.mesh.foreign import CELLS
from microslip.pipeline.geometry import unplaced
from microslip.pipeline.motion import motion_from_prestress, prestressed_shape
from microslip.pipeline.run import Run
from microslip.pipeline.vibration import Vibration, largest_vibrations
from microslip.results.files import replacing
from microslip.typing import Array, Indices, Status

VTK = "vtk"
"""Folder of these files in the folder of a run."""

STEPS = 48
"""Instants of a cycle that are written at most."""

NAMES = {kind: name for name, kind in CELLS.items()} | {
    "line2": "line",
    "line3": "line3",
    "wedge15": "wedge15",
    "wedge18": "wedge18",
}
"""meshio's name of each element."""

Data = Mapping[str, Array | Status]
"""Values at points by name: scalars (n,) or vectors (n, 3)."""


@dataclass(frozen=True)
class Turn:
    """One turn of a load as it is written.

    Attributes
    ----------
    theta : (s + 1,) array
        Phases of the load, rad; the last one turn after the first.
    moved : callable
        Displacements of the structure from prestress, (k, n), at some of these steps.
    contact : ContactFields
        At all of them.
    status : (s + 1, m) int8 array
    dissipation : (m,) array
        Friction work per area over the turn, J/m².
    """

    theta: Array
    moved: Callable[[Indices], Array]
    contact: ContactFields
    status: Status
    dissipation: Array


def write_vtk(run: Run, folder: Path, drive: str = "", index: int = 0) -> list[Path]:
    """Write ``modes.vtu``, ``prestress.vtu``, ``prestress_NAME.vtu`` of every interface, and what moves.

    These are ``motion.pvd`` and ``contact_NAME.pvd`` with their files: of one cycle, and in the folders
    ``harmonic`` and ``time`` of the largest vibration that each of these analyses has found.

    Parameters
    ----------
    run : Run
    folder : Path
        Made where it does not exist.
    drive : str
        Of the cycle that is written; none where empty.
    index : int
        Of the cycle among those of its drive.

    Raises
    ------
    InputError
        Where nothing is known of the places of the nodes.
    """
    found = run.geometry
    if found is None:
        raise InputError(f"vtk: {unplaced(run.joint)}")
    folder.mkdir(parents=True, exist_ok=True)
    written = [_write(folder / "modes.vtu", *_body(found), modes_data(run, found))]
    rest = _flat(found.displacement(prestressed_shape(run.assembly)))
    written.append(_write(folder / "prestress.vtu", *_body(found), {"displacement": rest}))
    for surface in found.surfaces:
        file = folder / f"prestress_{surface.name}.vtu"
        written.append(_write(file, *_sheet(found, surface), prestress_data(run, surface)))
    if drive:
        turn = turn_of_cycle(run, run.cycles[drive][index])
        written += _write_turn(turn, found, folder)
    for analysis, vibration in largest_vibrations(run).items():
        own = folder / analysis
        own.mkdir(exist_ok=True)
        written += _write_turn(turn_of_vibration(run, vibration), found, own)
    return written


def turn_of_cycle(run: Run, cycle: Cycle) -> Turn:
    """A quasi-static cycle."""
    return Turn(
        cycle.theta,
        lambda steps: motion_from_prestress(run.assembly, cycle, steps),
        ContactFields(cycle.pressure, cycle.traction, cycle.slip, cycle.gap),
        cycle.status,
        cycle.friction_work / cycle.area,
    )


def turn_of_vibration(run: Run, vibration: Vibration) -> Turn:
    """A periodic motion."""
    return Turn(
        vibration.theta,
        lambda steps: vibration.from_prestress(run.assembly, vibration.theta[steps]),
        vibration.contact,
        vibration.status,
        vibration.friction_work / run.model.area,
    )


def modes_data(run: Run, geometry: Geometry) -> dict[str, Array]:
    """Sliding and stuck mode and the free-interface modes, mass-normalised, with their frequencies in the
    names."""
    mode, states, free = run.mode, run.assembly.states, run.assembly.reducer.modes
    shapes = {
        f"sliding_{mode.sliding_frequency:.6g}_Hz": states.sliding,
        f"stuck_{mode.stuck_frequency:.6g}_Hz": states.stuck,
    }
    for k, omega in enumerate(run.model.omega):
        name = f"free_interface_{k + 1:03d}_{omega / (2 * np.pi):.6g}_Hz"
        shapes[name] = free.shapes[:, k]
    return {name: _flat(geometry.displacement(shape)) for name, shape in shapes.items()}


def prestress_data(run: Run, surface: ContactSurface) -> dict[str, Array | Status]:
    """Pressure, gap and state of an interface under the preload alone."""
    own, start = surface.pairs, run.prestress
    gap = -normal(start.solution.v, run.model.dimension)
    return {
        "pressure": start.pressure[own],
        "gap": gap[own],
        "state": at_rest(start.touching)[own],
        "normal": _flat(surface.normal),
    }


def contact_data(turn: Turn, surface: ContactSurface, step: int) -> dict[str, Array | Status]:
    """Contact of an interface at a step of a turn, and what friction takes over all of it."""
    own, found = surface.pairs, turn.contact
    return {
        "pressure": found.pressure[step, own],
        "traction": _flat(surface.along(found.traction[step, own])),
        "slip": _flat(surface.along(found.slip[step, own])),
        "gap": found.gap[step, own],
        "state": turn.status[step, own],
        "dissipation": turn.dissipation[own],
        "touches": np.asarray(touches(turn.status[1:, own]).any(axis=0)).astype(np.int8),
    }


def steps_of(turn: Turn | Cycle | Vibration) -> np.ndarray:
    """Steps of a turn that are written, evenly spaced; the last repeats the first."""
    count = len(turn.theta) - 1
    return np.unique(np.linspace(0, count, min(STEPS, count) + 1).round().astype(int))


def _write_turn(turn: Turn, geometry: Geometry, folder: Path) -> list[Path]:
    """Motion and contact over a turn: files by instant, and a list of them with the phase as time."""
    steps = steps_of(turn)
    time = turn.theta[steps]
    parts = folder / "cycle"
    parts.mkdir(exist_ok=True)
    moved = turn.moved(steps)
    body = _body(geometry)
    written = _series(
        folder / "motion.pvd",
        time,
        (
            _write(
                parts / f"motion_{k:03d}.vtu",
                *body,
                {"displacement": _flat(geometry.displacement(x))},
            )
            for k, x in enumerate(moved)
        ),
    )
    for surface in geometry.surfaces:
        sheet = _sheet(geometry, surface)
        written += _series(
            folder / f"contact_{surface.name}.pvd",
            time,
            (
                _write(
                    parts / f"contact_{surface.name}_{k:03d}.vtu",
                    *sheet,
                    contact_data(turn, surface, int(step)),
                )
                for k, step in enumerate(steps)
            ),
        )
    return written


Cells = list[tuple[str, Any]]
"""meshio's name of the cells, and their points."""


def _body(geometry: Geometry) -> tuple[Array, Cells, None]:
    """Points and elements; single points where no elements are known."""
    cells: Cells = [(NAMES[block.kind], block.nodes) for block in geometry.blocks]
    return _flat(geometry.points), cells or _single(len(geometry.points)), None


def _single(points: int) -> Cells:
    return [("vertex", np.arange(points)[:, None])]


def _sheet(geometry: Geometry, surface: ContactSurface) -> tuple[Array, Cells, Array | None]:
    """Points and faces of an interface, and which pair each point has; without a mesh, its pairs alone."""
    if not surface.facets:
        m = len(surface.points)
        line = np.stack([np.arange(m - 1), np.arange(1, m)], axis=1)
        return _flat(surface.points), [("line", line)] if m > 1 else _single(m), None
    nodes = np.unique(np.concatenate([group.nodes.ravel() for group in surface.facets]))
    row = np.full(len(geometry.points), -1)
    row[nodes] = np.arange(len(nodes))
    number = np.full(len(geometry.points), -1)
    number[surface.nodes] = np.arange(len(surface.nodes))
    cells: Cells = [(NAMES[group.kind], row[group.nodes]) for group in surface.facets]
    return _flat(geometry.points[nodes]), cells, number[nodes]


def _flat(vectors: Array) -> Array:
    """The same with three components."""
    return np.pad(vectors, [(0, 0)] * (vectors.ndim - 1) + [(0, 3 - vectors.shape[-1])])


def _write(path: Path, points: Array, cells: Cells, pair: Array | None, data: Data) -> Path:
    """One file; `pair` says which row of the data each point has, -1 none."""
    import meshio

    values = {name: _at_points(each, pair) for name, each in data.items()}
    mesh = meshio.Mesh(points, cells, point_data=values)
    with replacing(path) as temporary:
        meshio.write(temporary, mesh, file_format="vtu")
    return path


def _at_points(values: Array | Status, pair: Array | None) -> Array:
    """Values of pairs at the points of their interface."""
    if pair is None:
        return np.ascontiguousarray(values)
    blank = 0 if np.issubdtype(values.dtype, np.integer) else np.nan
    out = np.full((len(pair), *values.shape[1:]), blank, dtype=values.dtype)
    out[pair >= 0] = values[pair[pair >= 0]]
    return out


def _series(path: Path, time: Sequence[float] | Array, files: Iterable[Path]) -> list[Path]:
    """A ``.pvd``: which file is of which instant."""
    written = list(files)
    root = ElementTree.Element("VTKFile", type="Collection", version="0.1")
    collection = ElementTree.SubElement(root, "Collection")
    for instant, file in zip(time, written, strict=True):
        ElementTree.SubElement(
            collection,
            "DataSet",
            timestep=f"{float(instant):.12g}",
            part="0",
            file=file.relative_to(path.parent).as_posix(),
        )
    with replacing(path) as temporary:
        ElementTree.ElementTree(root).write(temporary, encoding="utf-8", xml_declaration=True)
    return [path, *written]
