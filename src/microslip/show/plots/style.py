"""House style of the figures: one size, one palette, no pyplot.

Colours are Okabe and Ito's, always with a second mark (line style, marker or lightness), so that a
figure survives grey print and colour blindness.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, ParamSpec, TypeAlias, TypeVar

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.legend import Legend
from matplotlib.legend_handler import HandlerTuple
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from microslip.results.files import replacing

MM = 1 / 25.4
COLUMN = 85 * MM
"""Width of one column, inches."""
DOUBLE = 175 * MM
"""Width of two columns, inches."""

BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
BLUE, VERMILLION, PURPLE = "#0072B2", "#D55E00", "#CC79A7"
GREY = "#777777"

SERIES: tuple[dict[str, Any], ...] = (
    {"color": BLACK, "marker": "o"},
    {"color": BLUE, "marker": "s"},
    {"color": VERMILLION, "marker": "^"},
    {"color": GREEN, "marker": "D"},
    {"color": PURPLE, "marker": "v"},
    {"color": ORANGE, "marker": "P"},
    {"color": SKY, "marker": "X"},
)
"""Colour and marker of the first, second ... series of a figure."""

LINES = ("-", "--", "-.", ":")

DRIVES: dict[str, dict[str, Any]] = {
    "moment": {"color": BLUE, "marker": "s", "linestyle": "--", "label": "driven by end moments"},
    "load": {"color": BLUE, "marker": "s", "linestyle": "--", "label": "driven by the load"},
    "mode": {"color": VERMILLION, "marker": "o", "linestyle": "-", "label": "driven by the mode"},
}

PRESCRIBED: dict[str, Any] = {
    "color": BLACK,
    "linestyle": "-",
    "label": "mode prescribed (refined model)",
}

STYLE: dict[str, Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 8,
    "axes.titlesize": 8,
    "figure.titlesize": 8,
    "axes.labelsize": 8,
    "axes.linewidth": 0.6,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#e4e4e4",
    "grid.linewidth": 0.5,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "lines.linewidth": 1.1,
    "lines.markersize": 3.5,
    "legend.fontsize": 8,
    "legend.frameon": True,
    "legend.framealpha": 0.9,
    "legend.edgecolor": "none",
    "legend.borderpad": 0.2,
    "legend.handlelength": 2.2,
    "figure.dpi": 100,
    "savefig.dpi": 200,
    "svg.hashsalt": "microslip",
}

P = ParamSpec("P")
T = TypeVar("T")


def house_style(draw: Callable[P, T]) -> Callable[P, T]:
    """Run a drawing function under `STYLE`, whatever the user's own settings are."""

    @functools.wraps(draw)
    def styled(*args: P.args, **kwargs: P.kwargs) -> T:
        settings: dict[Any, Any] = {**mpl.rcParamsDefault}
        settings.update(STYLE)
        settings.pop("backend", None)
        with mpl.rc_context(settings):
            return draw(*args, **kwargs)

    return styled


def new_figure(width: float, height: float) -> Figure:
    """Empty figure of a size in inches, on an Agg canvas."""
    layout = ConstrainedLayoutEngine(wspace=0.06, hspace=0.04)
    figure = Figure(figsize=(width, height), layout=layout)
    FigureCanvasAgg(figure)
    return figure


def clamp_edges(ax: Axes, centre: float | None = 0.0) -> None:
    """Dashed lines where the clamp ends, on axes over ``x / L_p``; `centre` is its middle there, None
    where there is no clamp."""
    if centre is None:
        return
    for i, edge in enumerate((-1, 1)):
        label = None if i else "edge of the clamp"
        ax.axvline(centre + edge, color=BLACK, lw=0.6, ls=(0, (4, 3)), label=label)


def letters(axes: Iterable[Axes]) -> None:
    """Mark panels (a), (b) ... in bold at the start of their titles."""
    for letter, ax in zip("abcdefgh", axes, strict=False):
        title = ax.get_title(loc="left")
        ax.set_title(f"({letter})  {title}" if title else f"({letter})", loc="left")


Entry: TypeAlias = Line2D | Patch | tuple[Line2D, ...]
"""Of a legend: a line, an area, or marks side by side, the first of which has the label."""

MOST_COLOURS = 4
"""Marks side by side in one entry; further colours are left out."""


def marks(colours: Iterable[str], label: str, **style: Any) -> Entry:
    """Entry of a mark that is drawn in several colours, those of the loads."""
    every = list(dict.fromkeys(colours))[:MOST_COLOURS]
    return tuple(Line2D([], [], color=colour, label=label, **style) for colour in every)


def draw_legend(owner: Figure | Axes, entries: Sequence[Entry], **where: Any) -> Legend:
    """Legend of lines and of `marks`."""
    handles: list[Any] = list(entries)
    labels = [str((e[0] if isinstance(e, tuple) else e).get_label()) for e in handles]
    side_by_side = {tuple: HandlerTuple(ndivide=None, pad=0.4)}
    return owner.legend(handles, labels, handler_map=side_by_side, **where)


FORMATS: dict[str, dict[str, Any]] = {
    "png": {"Software": "microslip"},
    "svg": {"Date": None},
    "pdf": {"CreationDate": None},
}
"""Formats that a figure can be written in, and what it says of itself: no time, so that the same
figure is the same file."""

LAYOUTS = 2
"""So often a figure is laid out: the first time boxes of a fixed shape, and labels beside ticks, are not yet
where they will be."""

USUAL_FORMATS = ("png", "svg")
"""Those it is written in where nothing is said."""


@house_style
def save(
    figure: Figure, folder: Path, name: str, formats: Iterable[str] = USUAL_FORMATS
) -> list[Path]:
    """Write a figure, PNG with 200 dpi; files of the same name are replaced in one go."""
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for _ in range(LAYOUTS):
        _lay_out(figure)
    figure.set_layout_engine(None)  # the same for all formats, each drawn once
    for kind in formats:
        path = folder / f"{name}.{kind}"
        with replacing(path) as temporary:
            figure.savefig(temporary, format=kind, metadata=FORMATS[kind])
        written.append(path)
    return written


def _lay_out(figure: Figure) -> None:
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.execute(figure)
