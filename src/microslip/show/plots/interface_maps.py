"""Drawing on interfaces in space: fields, contact states and arrows of slip in the plane of each."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection, PolyCollection
from matplotlib.colors import BoundaryNorm, ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch, PathPatch
from matplotlib.path import Path
from matplotlib.ticker import MaxNLocator

from microslip.contact.pairs import SEPARATED, STICK
from microslip.model.geometry import ContactSurface
from microslip.pipeline.run import Run
from microslip.show.plots.charts import Chart, bare, chart_of
from microslip.show.plots.states import COLOURS
from microslip.show.plots.style import BLACK, DOUBLE, MM, new_figure
from microslip.typing import Array, Mask, Status

FIELD = "viridis_r"
"""Colours of fields that are nowhere negative: nothing is light."""

MOST_ARROWS = 260
"""Arrows on one panel."""

WIDEST, TALLEST = 150.0, 68.0
"""Room that one panel has at most, mm."""

BESIDE = 45.0
"""Width of the labels of a panel and of its scale of colours, mm."""

LABELS = 19.0
"""Height of the title and the labels of a panel, mm."""

Drawn = tuple[ContactSurface, Chart]
"""An interface and how it is laid flat."""


def laid_flat(run: Run) -> tuple[Drawn, ...]:
    """All interfaces of a spatial joint."""
    found = run.geometry
    if found is None:
        return ()
    return tuple((each, chart_of(each, found.points)) for each in found.surfaces)


def by_interface(
    run: Run, draw: Callable[[Run, Drawn], Figure | None]
) -> Figure | dict[str, Figure] | None:
    """A figure for every interface; of one interface the figure itself."""
    found = {each[0].name: draw(run, each) for each in laid_flat(run)}
    some = {name: figure for name, figure in found.items() if figure is not None}
    if len(found) == 1:
        return next(iter(some.values()), None)
    return some or None


def panels(charts: Sequence[Chart], foot: float = 12.0) -> tuple[Figure, list[Axes]]:
    """A figure with axes for as many charts, two in a row unless they are long: titles need the room.

    Parameters
    ----------
    charts : sequence of Chart
    foot : float
        Height of what stands below all, mm.
    """
    count = len(charts)
    shape = max(float(np.divide(*(chart.extent + 2 * chart.margins))) for chart in charts)
    columns = min(count, 1 if shape > 3.2 else 2)
    rows = -(-count // columns)
    wide = min(WIDEST, DOUBLE / MM / columns - 24.0)
    tall = min(max(wide / shape, 14.0), TALLEST)
    alone = min(DOUBLE, (tall * shape + BESIDE) * MM)
    width = DOUBLE if count > 1 else alone
    figure = new_figure(width, (rows * (tall + LABELS) + foot) * MM)
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for ax in axes[count:]:
        ax.set_axis_off()
    return figure, list(axes[:count])


def draw_field(
    ax: Axes,
    drawn: Drawn,
    values: Array,
    *,
    norm: Normalize,
    absent: Mask | None = None,
    colours: Any = FIELD,
) -> PolyCollection:
    """Values of the pairs of an interface, each over its part of it; hatched where there is nothing.

    Parameters
    ----------
    ax : Axes
    drawn : (ContactSurface, Chart)
    values : (m,) array
        Of this interface.
    norm : Normalize
    absent : (m,) bool array, optional
        Pairs that have no value.
    colours : colour map
    """
    surface, chart = drawn
    gone = np.zeros(len(values), bool) if absent is None else absent
    cells, pair = _parts(chart, surface)
    some = (pair >= 0) & ~np.append(gone, True)[pair]
    shown = PolyCollection(
        [cell for cell, own in zip(cells, some, strict=True) if own],
        array=values[pair[some]],
        cmap=colours,
        norm=norm,
        linewidths=0.3,
        edgecolors="face",
        rasterized=True,
    )
    ax.add_collection(shown)
    rest = [cell for cell, own in zip(cells, some, strict=True) if not own]
    if rest:
        # as one shape: a hatch costs as much of a small part as of the whole
        loops = [Path(np.vstack([cell, cell[:1]]), closed=True) for cell in rest]
        ax.add_patch(PathPatch(Path.make_compound_path(*loops), **APART))
    outline(ax, chart)
    bare(ax, chart)
    return shown


APART: dict[str, Any] = {
    "facecolor": "white",
    "edgecolor": "#b8b8b8",
    "linewidth": 0.0,
    "hatch": "//////",
}
"""How parts look that never touch."""


def apart_handle(label: str = "never touches") -> Patch:
    """Legend entry of those."""
    return Patch(facecolor="white", edgecolor="#b8b8b8", hatch="//////", label=label)


def _parts(chart: Chart, surface: ContactSurface) -> tuple[list[Array], np.ndarray]:
    """Polygons of the pairs: parts of facets, else squares of a size that fills the interface."""
    if chart.cells:
        return list(chart.cells), chart.pair
    m = len(surface.points)
    size = 0.5 * np.sqrt(max(float(np.prod(chart.extent)), 1e-12) / m)
    square = size * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    return [centre + square for centre in chart.centres], np.arange(m)


def outline(ax: Axes, chart: Chart) -> None:
    """Facets of the mesh, faintly."""
    loops = [np.vstack([line, line[:1]]) for line in chart.outlines]
    ax.add_collection(
        LineCollection(loops, colors="#00000030", linewidths=0.25, rasterized=len(loops) > 2000)
    )


STICKS, SLIPS, CHANGES, OPEN = range(4)
"""Rows of `OVER_CYCLE`."""

OVER_CYCLE = (
    ("sticks", COLOURS[0]),
    ("slips", COLOURS[1]),
    ("opens and closes", COLOURS[2]),
    ("open", COLOURS[3]),
)
"""What a pair does at an instant or over a whole cycle, and its colour."""


def draw_states(ax: Axes, drawn: Drawn, status: Status, never: Mask) -> None:
    """Contact states of the pairs of an interface at one instant; hatched those that never touch."""
    found = np.select([status == STICK, status == SEPARATED], [STICKS, OPEN], SLIPS)
    _draw_rows(ax, drawn, found, never)


def _draw_rows(ax: Axes, drawn: Drawn, row: np.ndarray, never: Mask) -> None:
    colours = ListedColormap([colour for _, colour in OVER_CYCLE])
    steps = BoundaryNorm(np.arange(-0.5, len(OVER_CYCLE)), len(OVER_CYCLE))
    draw_field(ax, drawn, row.astype(float), norm=steps, absent=never, colours=colours)


def over_cycle(status: Status) -> np.ndarray:
    """(m,) row of `OVER_CYCLE` of states (s, m).

    Examples
    --------
    >>> from microslip.contact.pairs import SLIP
    >>> over_cycle(np.array([[STICK, STICK, SEPARATED, SEPARATED], [STICK, SLIP, SLIP, SEPARATED]]))
    array([0, 1, 2, 3])
    """
    opened = status == SEPARATED
    return np.select(
        [(status == STICK).all(axis=0), opened.all(axis=0), opened.any(axis=0)],
        [STICKS, OPEN, CHANGES],
        SLIPS,
    )


def draw_over_cycle(ax: Axes, drawn: Drawn, status: Status) -> None:
    """What every pair does over a cycle; states (s, m)."""
    row = over_cycle(status)
    _draw_rows(ax, drawn, row, row == OPEN)


def never_touching(status: Status) -> Mask:
    """(m,) pairs that are open in all of the states (s, m)."""
    return np.asarray((status == SEPARATED).all(axis=0))


def state_handles(never: Mask) -> list[Artist]:
    """Legend entries of the states; of those that never touch where there are any."""
    shown: list[Artist] = [
        Patch(facecolor=c, edgecolor=BLACK, linewidth=0.5, label=n) for n, c in OVER_CYCLE
    ]
    return [*shown, apart_handle()] if never.any() else shown


def draw_arrows(
    ax: Axes, drawn: Drawn, components: Array, shown: Mask, colour: str = BLACK
) -> float:
    """Arrows of vectors (m, 2) in the tangential directions of the pairs, of some where they are many.

    Returns
    -------
    float
        The largest vector, whose arrow is the longest; 0 where nothing is drawn.
    """
    surface, chart = drawn
    vectors = chart.flat(surface.along(components))
    size = np.linalg.norm(vectors, axis=1)
    shown = shown & (size > 0)
    if not shown.any():
        return 0.0
    every = np.flatnonzero(shown)
    step = -(-len(every) // MOST_ARROWS)
    own = every[np.lexsort((chart.centres[every, 1], chart.centres[every, 0]))][::step]
    largest = float(size[every].max())
    reach = 0.075 * float(chart.extent.max())
    ax.quiver(
        *chart.centres[own].T,
        *(vectors[own] * reach / largest).T,
        angles="xy",
        scale_units="xy",
        scale=1.0,
        facecolor=colour,
        edgecolor="white",
        linewidth=0.25,
        units="inches",
        width=0.011,
        headwidth=4.0,
        headlength=4.5,
        headaxislength=4.0,
        minlength=0.6,
        zorder=4,
    )
    return largest


def colour_bar(figure: Figure, shown: ScalarMappable, axes: Sequence[Axes], label: str) -> None:
    """Scale of a field beside its axes."""
    bar = figure.colorbar(shown, ax=list(axes), shrink=0.85, pad=0.02, aspect=22)
    bar.set_label(label)
    bar.outline.set_linewidth(0.5)
    bar.locator = MaxNLocator(5)
    bar.update_ticks()


def title(drawn: Drawn, run: Run, text: str) -> str:
    """Title of a panel: names the interface where there are several, and how it was laid flat."""
    surface, chart = drawn
    several = run.geometry is not None and len(run.geometry.surfaces) > 1
    named = f"{surface.name}: {text}" if several else text
    return f"{named} ({chart.said})" if chart.said else named
