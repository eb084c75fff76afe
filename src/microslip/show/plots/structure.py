"""The structure: what holds and loads it, its modes, and how a motion of it is drawn."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from microslip.describe.joint import Joint
from microslip.describe.mesh import MeshJoint
from microslip.model.geometry import ContactSurface, Geometry
from microslip.model.structure import Structure
from microslip.pipeline.run import Run
from microslip.show.plots.charts import loop_of
from microslip.show.plots.interface_maps import colour_bar
from microslip.show.plots.style import (
    BLACK,
    BLUE,
    DOUBLE,
    GREEN,
    GREY,
    PURPLE,
    VERMILLION,
    house_style,
    letters,
    new_figure,
)
from microslip.show.plots.view import (
    Skin,
    View,
    columns_of,
    draw_edges,
    draw_skin,
    draw_triad,
    fitted,
    frame,
    same_frame,
    skin_of,
    view_of,
)
from microslip.typing import Array, Indices

LARGEST = 0.08
"""Largest displacement as it is drawn, over the size of the structure."""

ARROW = 0.11
"""Length of the arrow of a load, over the size of the structure."""

FEW = 4
"""Arrows of one load in one direction."""

MANY = 4
"""Names that are too many for a legend."""

FAINT = 0.1
"""Of the largest, a force on a node that is not drawn."""


BAR = 22.0
"""Width of the scale of colours, mm."""


@dataclass(frozen=True)
class Marks:
    """What acts on a structure, by name.

    Attributes
    ----------
    preload : mapping of str to (dofs,) array
        Unit loads that are held.
    drive : mapping
        Loads that drive it, or may.
    bolts : tuple of str
        Of the preload, bolts that a coordinate shortens: forces of the elements beside it stand for them.
    """

    preload: Mapping[str, Array]
    drive: Mapping[str, Array]
    bolts: tuple[str, ...] = ()


def marks_of(joint: Joint, structure: Structure, held: Mapping[str, float], drive: str) -> Marks:
    """Preload and ports of a described structure; a temperature acts on no place, and is no mark."""
    warmed = (
        [p.name for p in joint.preload if p.temperature] if isinstance(joint, MeshJoint) else []
    )
    ports = dict.fromkeys([drive, *(port.name for port in joint.ports)])
    return Marks(
        {n: structure.loads[n] for n in held if n in structure.loads and n not in warmed},
        {name: structure.loads[name] for name in ports if name in structure.loads},
        _shortened(joint) if isinstance(joint, MeshJoint) else (),
    )


def _shortened(joint: MeshJoint) -> tuple[str, ...]:
    """Bolts through a section, and rigid ones that keep their length."""
    return tuple(
        entry.name
        for entry in joint.preload
        if entry.section is not None or (entry.keeps_length and entry.stiffness is None)
    )


@house_style
def structure_figure(run: Run) -> Figure | None:
    """Bodies with what holds and loads them and where they touch; None where no nodes are known."""
    if run.geometry is None:
        return None
    marks = marks_of(run.joint, run.structure, run.prestress.preload, run.prepared.drive)
    return given_figure(run.geometry, run.structure, marks, run.joint.title or "")


@house_style
def given_figure(geometry: Geometry, structure: Structure, marks: Marks, name: str) -> Figure:
    """The same of what a file describes, before anything is computed."""
    view = view_of(geometry)
    figure = new_figure(DOUBLE, DOUBLE)
    ax = figure.subplots()
    handles = draw_given(ax, geometry, structure, marks, view)
    fitted(figure, [ax], 1)
    figure.legend(handles=handles, loc="outside lower center", ncols=min(4, len(handles)))
    if name:
        ax.set_title(name, loc="left")
    return figure


def draw_given(
    ax: Axes, geometry: Geometry, structure: Structure, marks: Marks, view: View
) -> list[Line2D]:
    """Bodies, supports, springs, loads and interfaces on given axes; gives entries of the legend."""
    skin = skin_of(geometry)
    draw_skin(ax, geometry, skin, view)
    draw_edges(ax, geometry, skin, view)
    flat = view.flat(geometry.points)
    handles = []
    held, inside = geometry.held, geometry.body >= 0
    everywhere = np.logical_and(held[inside].all(axis=0), inside.any())
    if everywhere.any():
        along = listed([name for name, still in zip("xyz", everywhere, strict=False) if still])
        handles.append(_entry(f"all held along {along}", GREY, marker=r"$\ast$"))
    for some, label, marker, colour in (
        (held.all(axis=1), "held", "s", BLACK),
        (
            (held & ~everywhere).any(axis=1) & ~held.all(axis=1),
            "held in some directions",
            "D",
            GREY,
        ),
        (_sprung(geometry, structure), "on springs", "v", GREEN),
    ):
        if some.any():
            ax.plot(*flat[some].T, marker, color=colour, ms=2.6, mew=0, zorder=4)
            handles.append(_entry(label, colour, marker=marker, linestyle=""))
    handles += _draw_interfaces(ax, geometry, view)
    reach = ARROW * geometry.size
    ends = [flat]
    for loads, colour, what in (
        (marks.preload, BLUE, "preload"),
        (marks.drive, VERMILLION, "load"),
    ):
        drawn = []
        for name, load in loads.items():
            forces = geometry.forces(load)
            found: Array | None
            if what == "preload" and name in marks.bolts:
                found = _draw_bolt(ax, view, *pair_of(geometry.points, forces), reach, colour)
            else:
                found = _draw_load(ax, geometry, view, forces, reach, colour)
            if found is not None:
                ends.append(found)
                drawn.append(name)
        if drawn:
            label = f"{what} {listed(drawn)}"
            handles.append(_entry(label, colour, marker=r"$\rightarrow$", ms=9))
    frame(ax, np.vstack(ends))
    draw_triad(ax, geometry, view)
    return handles


def listed(names: Sequence[str]) -> str:
    """Names in a line, of many the first and the last.

    Examples
    --------
    >>> listed(["bolt_1", "bolt_2"]), listed(["bolt_1", "bolt_2", "bolt_3", "bolt_4"])
    ('bolt_1, bolt_2', 'bolt_1 to bolt_4')
    """
    return ", ".join(names) if len(names) < MANY else f"{names[0]} to {names[-1]}"


def _entry(label: str, colour: str, **style: object) -> Line2D:
    kept = {"linestyle": "", **style}
    return Line2D([], [], color=colour, label=label, **kept)  # type: ignore[arg-type]


def _sprung(geometry: Geometry, structure: Structure) -> np.ndarray:
    """Points on springs to the ground."""
    found = np.zeros(len(geometry.points), bool)
    if structure.supports is not None:
        stiff = np.flatnonzero(structure.supports.diagonal() > 0)
        at = geometry.place[stiff]
        found[at[at >= 0] // geometry.dimension] = True
    return found


def _draw_interfaces(ax: Axes, geometry: Geometry, view: View) -> list[Line2D]:
    handles = []
    for k, surface in enumerate(geometry.surfaces):
        style = ("-", "--", "-.", ":")[k % 4]
        lines = rim_of(surface, geometry.points)
        if len(lines):
            ax.add_collection(
                LineCollection(
                    list(view.flat(lines)),
                    colors=PURPLE,
                    linewidths=1.3,
                    linestyles=style,
                    zorder=5,
                )
            )
        else:
            ax.plot(*view.flat(surface.points).T, ".", color=PURPLE, ms=2.5, mew=0, zorder=5)
        named = "interface" if len(geometry.surfaces) == 1 else f"interface {surface.name}"
        label = f"{named}, {len(surface.points)} pairs"
        handles.append(_entry(label, PURPLE, linestyle=style if len(lines) else "", marker=""))
        if not len(lines):
            handles[-1].set_marker(".")
    return handles


def rim_of(surface: ContactSurface, points: Array) -> Array:
    """(e, k, d) edges around the faces of an interface; the faces themselves in the plane."""
    found: list[Indices] = []
    for group in surface.facets:
        loops = group.nodes if points.shape[1] == 2 else group.nodes[:, loop_of(group.kind)]
        if points.shape[1] == 2:
            order = [0, 2, 1] if loops.shape[1] == 3 else [0, 1]
            return np.asarray(points[np.vstack([g.nodes[:, order] for g in surface.facets])])
        found.append(np.stack([loops, np.roll(loops, -1, axis=1)], axis=2).reshape(-1, 2))
    if not found:
        return np.zeros((0, 2, points.shape[1]))
    ends = np.sort(np.vstack(found), axis=1)
    once, count = np.unique(ends, axis=0, return_counts=True)
    return np.asarray(points[once[count == 1]])


def _draw_load(
    ax: Axes, geometry: Geometry, view: View, forces: Array, reach: float, colour: str
) -> Array | None:
    """Arrows of a load on its nodes, of a few of each direction; what they reach, None where none acts on a
    node."""
    size = np.linalg.norm(forces, axis=1)
    acting = np.flatnonzero(size > FAINT * size.max(initial=0.0))
    if not len(acting):
        return None
    way = np.round(forces[acting] / size[acting][:, None], 1)
    _, group = np.unique(way, axis=0, return_inverse=True)
    reached = []
    for k in range(int(group.max()) + 1):
        own = acting[group.ravel() == k]
        reached.append(_arrows(ax, geometry, view, own, forces[own], reach, colour))
    return np.vstack(reached)


def _arrows(
    ax: Axes,
    geometry: Geometry,
    view: View,
    nodes: Indices,
    forces: Array,
    reach: float,
    colour: str,
) -> Array:
    """Arrows of forces of one direction on nodes: they end there where they push a body."""
    every = geometry.points[nodes]
    some = scattered(every, FEW)
    x = every[some]
    way = forces[some] / np.linalg.norm(forces[some], axis=1)[:, None]
    middle = geometry.points[geometry.body == geometry.body[nodes[0]]].mean(axis=0)
    pushes = float(((middle - every) * forces).sum()) > 0
    start = x - reach * way if pushes else x
    return _pointed(ax, view, start, start + reach * way, colour)


def pair_of(points: Array, forces: Array) -> tuple[Array, Array]:
    """Where (2, d) and which way the two opposite forces act that forces on nodes add up to.

    Their line is that of most of the squares of the forces; each acts in the middle of those along it.

    Examples
    --------
    >>> points = np.array([[-1.0, 0.0], [1.0, 0.0], [-1.0, 3.0], [1.0, 3.0]])
    >>> forces = np.array([[0.3, 1.0], [-0.3, 1.0], [0.3, -1.0], [-0.3, -1.0]])
    >>> at, way = pair_of(points, forces)
    >>> at[np.argsort(at[:, 1])].tolist(), np.round(np.abs(way), 12).tolist()
    ([[0.0, 0.0], [0.0, 3.0]], [[0.0, 1.0], [0.0, 1.0]])
    """
    axis = np.linalg.eigh(forces.T @ forces)[1][:, -1]
    way = np.array([axis, -axis])
    share = np.maximum(way @ forces.T, 0.0)
    return share @ points / share.sum(axis=1, keepdims=True), way


def _draw_bolt(ax: Axes, view: View, at: Array, way: Array, reach: float, colour: str) -> Array:
    """The two forces of a bolt, towards each other."""
    return _pointed(ax, view, at - reach * way, at, colour)


def _pointed(ax: Axes, view: View, tails: Array, tips: Array, colour: str) -> Array:
    """Arrows from (k, d) tails to tips; what they reach on paper."""
    ends = view.flat(np.stack([tails, tips], axis=1))
    for tail, tip in ends:
        ax.annotate(
            "",
            tip,
            tail,
            arrowprops={
                "arrowstyle": "-|>",
                "lw": 0.8,
                "color": colour,
                "shrinkA": 0,
                "shrinkB": 0,
                "mutation_scale": 7,
            },
            zorder=6,
        )
    return np.asarray(ends.reshape(-1, 2))


def scattered(points: Array, count: int) -> Indices:
    """(c,) rows of points as far from each other as they may be, at most so many.

    Examples
    --------
    >>> scattered(np.array([[0.0], [1.0], [2.0], [9.0]]), 2).tolist()
    [0, 3]
    """
    first = int(np.argmin(points.sum(axis=1)))
    chosen = [first]
    apart = np.linalg.norm(points - points[first], axis=1)
    while len(chosen) < min(count, len(points)) and apart.max() > 0:
        chosen.append(int(np.argmax(apart)))
        apart = np.minimum(apart, np.linalg.norm(points - points[chosen[-1]], axis=1))
    return np.array(chosen)


@house_style
def modes_figure(run: Run) -> Figure | None:
    """The mode that the load excites most, sliding and stuck; colours are sizes of displacements."""
    if run.geometry is None or not len(run.geometry.points):
        return None
    states, mode = run.assembly.states, run.mode
    shapes = {
        f"sliding, {mode.sliding_frequency:.4g} Hz": states.sliding,
        f"stuck, {mode.stuck_frequency:.4g} Hz": states.stuck,
    }
    return shapes_figure(run.geometry, shapes)


@house_style
def shapes_figure(geometry: Geometry, shapes: Mapping[str, Array]) -> Figure:
    """Motions of the structure (dofs,) by what they are called, each in its own scale."""
    view, skin = view_of(geometry), skin_of(geometry)
    columns = columns_of(geometry, view, len(shapes)) if len(shapes) < FEW else 3
    rows = -(-len(shapes) // columns)
    figure = new_figure(DOUBLE, DOUBLE)
    axes = list(figure.subplots(rows, columns, squeeze=False).ravel())
    for ax in axes[len(shapes) :]:
        ax.set_axis_off()
    shown = None
    for ax, (name, shape) in zip(axes, shapes.items(), strict=False):
        moved = geometry.displacement(shape)
        size = np.linalg.norm(moved, axis=1)
        top = float(size.max()) or 1.0
        shown = draw_motion(ax, geometry, skin, view, moved / top, Normalize(0.0, 1.0))
        ax.set_title(name, loc="left")
    same_frame(axes[: len(shapes)])
    fitted(figure, axes[: len(shapes)], columns, BAR)
    if shown is not None:
        colour_bar(figure, shown, axes, "displacement over its largest")
    if len(shapes) > 1:
        letters(axes[: len(shapes)])
    return figure


def draw_motion(
    ax: Axes,
    geometry: Geometry,
    skin: Skin,
    view: View,
    unit: Array,
    norm: Normalize,
    values: Array | None = None,
) -> ScalarMappable | None:
    """Bodies displaced and coloured, with their edges where they were; `unit` is at most 1."""
    moved = geometry.points + LARGEST * geometry.size * unit
    values = np.linalg.norm(unit, axis=1) if values is None else values
    shown = draw_skin(ax, geometry, skin, view, moved=moved, values=values, norm=norm, rest=True)
    frame(ax, np.vstack([view.flat(geometry.points), view.flat(moved)]))
    draw_triad(ax, geometry, view)
    return shown
