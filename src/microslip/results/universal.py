"""Frequency responses of a run as a universal file, dataset 58, as test rigs and modal analysis have them.

The function is output over load, both at the amplitude of the load that the identification names: the
joint is not linear. Its time is ``e^{i omega t}``. Frequencies need more digits than the text form has, so
that the binary one is written, in double precision. Units are SI; dataset 164 says so and every function
has them beside its axes.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from microslip.analyses.reduced.response import CONVERGED
from microslip.describe.outputs import NamedOutput
from microslip.model.geometry import Geometry
from microslip.pipeline.run import Run
from microslip.results.files import replacing
from microslip.results.harmonic import outputs_of as harmonics_of
from microslip.results.time import outputs_of as steady_outputs
from microslip.typing import Array, Complex
from microslip.version import __version__

UFF = "frf.uff"
"""Name of the file in the folder of a run."""

FRF, FREQUENCY = 4, 18
"""Kind of function, and what it is over."""

ORDINATES = {0: 8, 1: 11, 2: 12}
"""Displacement, velocity, acceleration by the order of the derivative."""

REACTION = 9
"""Force of a support."""

FORCE = 13
LOADS = {"base": 12, "pressure": 15}
"""What a function is per: a force, or the acceleration of a base, or a pressure."""

ALONG = 0.999
"""Cosine beyond which a direction is that of an axis."""

BALANCED = 1e-6
"""Of the sum of the sizes of forces, a resultant below which they are a moment."""

SHORT, LINE = 10, 80
"""Characters of an entity and of a line of identification."""


@dataclass(frozen=True)
class Curve:
    """Outputs over frequency under one load.

    Attributes
    ----------
    said : str
        What computed them.
    load : float
        Amplitude.
    frequency : (n,) array
        Hz, ascending.
    outputs : dict of str to (n,) complex array
        First harmonics against the load's sine.
    """

    said: str
    load: float
    frequency: Array
    outputs: dict[str, Complex]


@dataclass(frozen=True)
class Place:
    """Node and direction of a load or an output.

    Attributes
    ----------
    node : int
        0 where none is known.
    direction : int
        1 to 3 along, 4 to 6 about x, y, z, negative the other way; 0 of what has none.
    nodes : int
        How many it is shared by; `node` is the one nearest to their middle.
    """

    node: int
    direction: int
    nodes: int


def curves_of(run: Run) -> Iterator[Curve]:
    """Everything that a run has over frequency: points that are answers, in order of their frequency."""
    for response in run.responses:
        good = response.flag == CONVERGED
        outputs = {name: y[good] for name, y in response.outputs.items()}
        yield Curve(f"{response.variant} model", response.load, response.frequency[good], outputs)
    for entry in run.harmonic:
        for branch in sorted(set(entry.response.branch_of)):
            own = zip(entry.response.branch_of, entry.points, entry.stability, strict=True)
            points = [p for b, p, s in own if b == branch and (s is None or s.stable)]
            named = f"harmonic balance, branch {branch}"
            for piece in _ascending(np.array([p.frequency for p in points])):
                first = [{n: y[1] for n, y in harmonics_of(run, points[k]).items()} for k in piece]
                f = np.array([points[k].frequency for k in piece])
                yield Curve(named, entry.load, f, _columns(first))
    steady = [p for p in run.time_domain if p.steady.converged]
    for load in sorted({p.steady.load for p in steady}):
        own_points = sorted(
            (p for p in steady if p.steady.load == load), key=lambda p: p.steady.frequency
        )
        harmonics = [{n: y[1] for n, y in steady_outputs(run, p).items()} for p in own_points]
        f = np.array([p.steady.frequency for p in own_points])
        yield Curve("time integration", load, f, _columns(harmonics))


def _columns(rows: list[dict[str, Any]]) -> dict[str, Complex]:
    return {name: np.array([row[name] for row in rows]) for name in (rows[0] if rows else {})}


def _ascending(frequency: Array) -> list[np.ndarray]:
    """Points of a branch in pieces along which the frequency rises or falls, each by rising frequency."""
    if len(frequency) < 2:
        return [np.arange(len(frequency))] * len(frequency)
    turns = np.flatnonzero(np.diff(np.sign(np.diff(frequency))) != 0) + 1
    ends = [0, *turns.tolist(), len(frequency) - 1]
    pieces = [np.arange(a, b + 1) for a, b in pairwise(ends)]
    return [piece[np.argsort(frequency[piece], kind="stable")] for piece in pieces]


def place_of(geometry: Geometry | None, load: Array) -> Place:
    """Where a load vector acts, and which way."""
    return Place(0, 0, 0) if geometry is None else _acting(geometry, geometry.forces(load))


def place_held(geometry: Geometry, motion: Array) -> Place:
    """Where supports hold, and which way, of a unit motion of theirs (`MeshedStructure.held_motions`)."""
    d = geometry.dimension
    return _acting(geometry, motion[: geometry.points.size].reshape(-1, d))


def _acting(geometry: Geometry, vectors: Array) -> Place:
    """The place of vectors (n, d) at all points."""
    forces = np.zeros((len(geometry.points), 3))
    forces[:, : geometry.dimension] = vectors
    size = np.linalg.norm(forces, axis=1)
    acting = np.flatnonzero(size > BALANCED * size.max(initial=0.0))
    if not len(acting):
        return Place(0, 0, 0)
    x = np.zeros((len(acting), 3))
    x[:, : geometry.dimension] = geometry.points[acting]
    middle = np.average(x, axis=0, weights=size[acting])
    node = int(geometry.labels[acting[np.argmin(np.linalg.norm(x - middle, axis=1))]])
    net = forces.sum(axis=0)
    if np.linalg.norm(net) > BALANCED * size.sum():
        return Place(node, _axis(net), len(acting))
    turn = np.cross(x - middle, forces[acting]).sum(axis=0)
    about = _axis(turn)
    return Place(node, about + 3 * int(np.sign(about)), len(acting))


def _axis(vector: Array) -> int:
    """1 to 3, negative the other way, of the axis a vector is along; 0 where it is along none."""
    length = float(np.linalg.norm(vector))
    k = int(np.argmax(np.abs(vector)))
    if not length or abs(vector[k]) < ALONG * length:
        return 0
    return int(np.sign(vector[k])) * (k + 1)


def functions_of(run: Run) -> list[dict[str, Any]]:
    """Every frequency response as pyuff takes it; those of less than two points are left out."""
    loads = run.structure.loads
    reference = place_of(run.geometry, loads[run.prepared.drive])
    places = {o.name: _place_of_output(run, o) for o in run.joint.outputs}
    return [
        _function(run, curve, output, places[output.name], reference)
        for curve in curves_of(run)
        for output in run.joint.outputs
        if output.name in curve.outputs and len(curve.frequency) > 1 and curve.load > 0
    ]


def points_alone(run: Run) -> list[str]:
    """What is left out of the file: answers at one frequency, which are no function of it."""
    said = run.joint.driven.load
    return [
        f"{curve.said}, {said.named(curve.load)}, {curve.frequency[0]:.6g} Hz"
        for curve in curves_of(run)
        if len(curve.frequency) == 1
    ]


def _place_of_output(run: Run, output: NamedOutput) -> Place:
    """Where an output is; the load vector of a reaction stands beside its support and against it."""
    imported, geometry = run.assembly.imported, run.geometry
    if not output.reacts:
        return place_of(geometry, run.structure.loads[output.port])
    if geometry is None or imported is None or imported.meshed is None:
        return Place(0, 0, 0)
    return place_held(geometry, imported.meshed.held_motions[output.port])


def _function(
    run: Run, curve: Curve, output: NamedOutput, place: Place, reference: Place
) -> dict[str, Any]:
    driven, measured = run.joint.driven, output.measured
    said, base = driven.load, driven.kind == "base"
    where = "" if place.nodes < 2 else f"; output of {place.nodes} nodes"
    return {
        "type": 58,
        "binary": 1,
        "func_type": FRF,
        "id1": f"{output.name}: {output.quantity} per {said.noun} of {driven.name}"[:LINE],
        "id2": (run.joint.title or "NONE")[:LINE],
        "id3": f"microslip {__version__}",
        "id4": f"{curve.said}, {said.named(curve.load)}"[:LINE],
        "id5": f"not linear: of this amplitude of the load{where}"[:LINE],
        "rsp_ent_name": output.name[:SHORT],
        "rsp_node": place.node,
        "rsp_dir": 0 if output.across else place.direction,
        "ref_ent_name": driven.name[:SHORT],
        "ref_node": 0 if base else reference.node,
        "ref_dir": -reference.direction if base else reference.direction,
        "abscissa_spacing": 0,
        "abscissa_spec_data_type": FREQUENCY,
        "abscissa_axis_lab": "frequency",
        "abscissa_axis_units_lab": "Hz",
        "ordinate_spec_data_type": REACTION if output.reacts else ORDINATES[measured.order],
        "ordinate_axis_lab": output.name[:20],
        "ordinate_axis_units_lab": measured.unit,
        "orddenom_spec_data_type": LOADS.get(driven.kind, FORCE),
        "orddenom_axis_lab": driven.name[:20],
        "orddenom_axis_units_lab": said.unit,
        "z_axis_spec_data_type": 0,
        "x": curve.frequency,
        "data": curve.outputs[output.name] / curve.load,
    }


def write_universal(run: Run, path: Path) -> Path | None:
    """Write all frequency responses of a run; None where it has none.

    Parameters
    ----------
    run : Run
    path : Path
    """
    import pyuff

    functions = functions_of(run)
    if not functions:
        return None
    units = {
        "type": 164,
        "units_code": 1,
        "units_description": "SI: m, N, s",
        "temp_mode": 1,
        "length": 1.0,
        "force": 1.0,
        "temp": 1.0,
        "temp_offset": 273.15,
    }
    with replacing(path) as temporary:
        file = pyuff.UFF(str(temporary))
        file.write_sets([units, *_nodes(run, functions), *functions], mode="overwrite")
        _correct_lengths(temporary, [len(each["x"]) for each in functions])
    return path


def _nodes(run: Run, functions: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Dataset 15: places of the nodes that functions name."""
    geometry = run.geometry
    named = sorted({each[key] for each in functions for key in ("rsp_node", "ref_node")} - {0})
    if geometry is None or not named:
        return []
    rows = [int(np.flatnonzero(geometry.labels == node)[0]) for node in named]
    x = np.zeros((len(rows), 3))
    x[:, : geometry.dimension] = geometry.points[rows]
    return [{"type": 15, "node_nums": named, "x": x[:, 0], "y": x[:, 1], "z": x[:, 2]}]


HEADER = re.compile(rb"(\n {4}58b.{24})(.{12})")
"""Of a binary dataset: byte order, format, lines; then how many bytes follow."""

VALUE = 24
"""Bytes of a frequency and a complex value."""


def _correct_lengths(path: Path, points: list[int]) -> None:
    """Put the number of bytes of every binary dataset right, which pyuff has for real values alone."""
    counts = iter(points)
    text = path.read_bytes()
    path.write_bytes(HEADER.sub(lambda found: found[1] + b"%12d" % (VALUE * next(counts)), text))
