"""Bodies in space drawn by PyVista: depth by pixel, faces as curved as their elements, values between nodes.

It draws the bodies alone, in parallel projection, below titles, scales, arrows and outlines by matplotlib: a
figure keeps its name, its size and its formats, whoever draws it. ``pip install microslip[view]``; without
that, or where VTK finds no way to draw without a screen, matplotlib draws the bodies too.
"""

from __future__ import annotations

import importlib.util
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import cache
from types import ModuleType
from typing import Any

import numpy as np
from matplotlib.colors import Normalize

from microslip.errors import InputError
from microslip.typing import Array, Indices

RENDERERS = {
    "auto": "PyVista where it is installed and draws, else matplotlib",
    "matplotlib": "always",
    "pyvista": "or an error",
}
"""Who draws bodies in space."""

_CHOSEN: ContextVar[str] = ContextVar("renderer of bodies", default="matplotlib")

PIXELS = 2400
"""Of the longer side of a picture, twice those of a figure: matplotlib brings it to the size of the axes."""

SHADED = 0.12
"""Of the brightness of a colour that stands for a value, what depends on the light."""

PROBE = """
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(32, 32))
plotter.background_color = "white"
plotter.add_mesh(pyvista.Sphere(), color="black", lighting=False)
picture = plotter.screenshot(None, return_img=True)
raise SystemExit(0 if picture.min() < 50 and picture.max() > 200 else 1)
"""
"""Draws a black disc on white: a library of OpenGL that is missing ends the process, not an exception."""

PATIENCE = 60
"""Seconds that it may take."""


@contextmanager
def drawn_by(renderer: str) -> Iterator[None]:
    """Let bodies in space be drawn by one of `RENDERERS` while the block runs; outside it is matplotlib.

    Raises
    ------
    InputError
        Where there is none of this name, or PyVista is asked for and is not installed or cannot draw.

    Examples
    --------
    >>> with drawn_by("matplotlib"):
    ...     by_pyvista()
    False
    """
    if renderer not in RENDERERS:
        raise InputError(f"renderer {renderer!r}: must be one of {', '.join(RENDERERS)}")
    if renderer == "pyvista" and (why := missing()):
        raise InputError(f"renderer 'pyvista': {why}; or leave the renderer out")
    before = _CHOSEN.set(renderer)
    try:
        yield
    finally:
        _CHOSEN.reset(before)


def by_pyvista() -> bool:
    """Whether PyVista draws what is drawn now."""
    chosen = _CHOSEN.get()
    return chosen == "pyvista" or (chosen == "auto" and not missing())


@cache
def missing() -> str:
    """Why PyVista cannot draw here, and what to do; empty where it can.

    It is tried in a process of its own, once.
    """
    if importlib.util.find_spec("pyvista") is None:
        return 'pyvista is not installed: pip install "microslip[view]"'
    try:
        tried = subprocess.run(
            [sys.executable, "-c", PROBE], capture_output=True, timeout=PATIENCE, check=False
        )
    except (OSError, subprocess.TimeoutExpired):
        tried = None
    if tried is not None and tried.returncode == 0:
        return ""
    return (
        "VTK cannot draw without a screen here: install libEGL (Debian: libegl1, libgl1-mesa-dri) or "
        "libOSMesa (libosmesa6)"
    )


@dataclass(frozen=True)
class Camera:
    """A parallel projection.

    Attributes
    ----------
    right, up, toward : (3,) arrays
        Unit vectors of the picture, and towards who looks.
    """

    right: Array
    up: Array
    toward: Array


@dataclass(frozen=True)
class Picture:
    """Pixels, and where they are.

    Attributes
    ----------
    pixels : (rows, columns, 4) uint8 array
        From the upper left; transparent where there is nothing.
    extent : tuple of float
        Left, right, lower and upper end along `Camera.right` and `Camera.up`, in the unit of the points.
    """

    pixels: np.ndarray
    extent: tuple[float, float, float, float]


def picture_of(
    points: Array,
    loops: Sequence[Indices],
    edges: Indices,
    camera: Camera,
    colours: Sequence[Array],
    shaded: float,
    values: Array | None = None,
    norm: Normalize | None = None,
    colour_map: str = "viridis",
    mesh: bool = True,
    at_rest: Array | None = None,
    pixels: int = PIXELS,
) -> Picture:
    """Draw faces, seen from a direction.

    Parameters
    ----------
    points : (n, 3) array
    loops : sequence of (f, k) int arrays
        Nodes around faces: corners of 3 or 4, or with the middles of sides between them, 6 or 8.
    edges : (e, 2) int array
        Lines that are drawn stronger.
    camera : Camera
    colours : sequence of (f, 3) arrays
        Of the faces where there are no values, each channel from 0 to 1.
    shaded : float
        Of the brightness, what depends on the light, where there are no values.
    values : (n,) array, optional
        Interpolated over the faces as the points are.
    norm : Normalize, optional
        Of the values.
    colour_map : str
    mesh : bool
        Whether the edges of all faces are drawn.
    at_rest : (n, 3) array, optional
        Other places of the points, where `edges` are drawn faintly as well.
    pixels : int
        Of the longer side.
    """
    pv = _pyvista()
    every = points if at_rest is None else np.vstack([points, at_rest])
    wide, tall = (every @ camera.right, every @ camera.up)
    centre = np.array([[x.min() + x.max()] for x in (wide, tall)]).ravel() / 2
    half = np.array([np.ptp(wide), np.ptp(tall)]) / 2 * 1.02 + 1e-12
    size = np.maximum(np.ceil(pixels * half / half.max()), 16).astype(int)
    half = half.max() * size / size.max()
    plotter = pv.Plotter(off_screen=True, window_size=tuple(size), lighting="none")
    try:
        light = camera.toward + 0.6 * camera.up
        plotter.add_light(pv.Light(position=light, light_type="scene light", intensity=1.0))
        _add_faces(
            pv, plotter, points, loops, colours, shaded, values, norm or Normalize(), colour_map
        )
        if mesh:
            _add_lines(pv, plotter, points, [_around(each) for each in loops], 1.0, 0.35)
        _add_lines(pv, plotter, points, [edges], 2.5, 0.9)
        if at_rest is not None:
            _add_lines(pv, plotter, at_rest, [edges], 1.5, 0.8)
        _look(plotter, every, camera, centre, half[1])
        drawn = plotter.screenshot(None, return_img=True, transparent_background=True)
    finally:
        plotter.close()
    (x, y), (a, b) = centre, half
    return Picture(np.asarray(drawn), (x - a, x + a, y - b, y + b))


def _pyvista() -> ModuleType:
    """PyVista, whose VTK says errors alone: it warns of every screen that it looks for."""
    import pyvista
    from vtkmodules.vtkCommonCore import vtkLogger

    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_ERROR)
    return pyvista


def _add_faces(
    pv: Any,
    plotter: Any,
    points: Array,
    loops: Sequence[Indices],
    colours: Sequence[Array],
    shaded: float,
    values: Array | None,
    norm: Normalize,
    colour_map: str,
) -> None:
    kinds, cells = [], []
    for nodes in loops:
        kind, order = _cell(pv, nodes.shape[1])
        kinds.append(np.full(len(nodes), kind))
        cells.append(np.insert(nodes[:, order], 0, nodes.shape[1], axis=1).ravel())
    grid = pv.UnstructuredGrid(np.concatenate(cells), np.concatenate(kinds), np.asarray(points))
    grid.cell_data["colour"] = (255 * np.vstack(colours)).astype(np.uint8)
    if values is not None:
        norm.autoscale_None(values)
        grid.point_data["value"] = np.asarray(norm(values), float)
    surface = grid.extract_surface(algorithm="dataset_surface", nonlinear_subdivision=2)
    shaded = shaded if values is None else SHADED
    look = {"ambient": 1 - shaded, "diffuse": shaded, "specular": 0.0, "lighting": True}
    if values is None:
        plotter.add_mesh(surface, scalars="colour", rgb=True, preference="cell", **look)
    else:
        plotter.add_mesh(
            surface,
            scalars="value",
            clim=(0.0, 1.0),
            cmap=colour_map,
            n_colors=256,
            show_scalar_bar=False,
            **look,
        )
    for actor in plotter.actors.values():
        actor.mapper.SetResolveCoincidentTopologyToPolygonOffset()
        actor.mapper.SetRelativeCoincidentTopologyPolygonOffsetParameters(2.0, 2.0)


def _cell(pv: Any, around: int) -> tuple[int, Indices]:
    """Type of a cell of VTK by the nodes around it, and their order there: corners first."""
    ends = np.arange(around)
    if around > 4:
        ends = ends.reshape(-1, 2).T.ravel()
    types = pv.CellType
    kind = {
        3: types.TRIANGLE,
        4: types.QUAD,
        6: types.QUADRATIC_TRIANGLE,
        8: types.QUADRATIC_QUAD,
    }[around]
    return int(kind), ends


def _around(loops: Indices) -> Indices:
    """(e, 2) edges of faces by the nodes around them, each once."""
    ends = np.stack([loops, np.roll(loops, -1, axis=1)], axis=2).reshape(-1, 2)
    return np.unique(np.sort(ends, axis=1), axis=0)


def _add_lines(
    pv: Any, plotter: Any, points: Array, edges: Sequence[Indices], width: float, opacity: float
) -> None:
    ends = np.vstack([each.reshape(-1, 2) for each in edges])
    if len(ends):
        lines = pv.PolyData(
            np.asarray(points), lines=np.insert(ends, 0, 2, axis=1).ravel().astype(np.int64)
        )
        plotter.add_mesh(
            lines,
            color="#303030",
            line_width=width,
            opacity=opacity,
            lighting=False,
            style="wireframe",
        )


def _look(plotter: Any, points: Array, camera: Camera, centre: Array, half_height: float) -> None:
    """Place the camera far enough away to have all in front of it."""
    far = np.linalg.norm(np.ptp(points, axis=0)) or 1.0
    depth = float((points @ camera.toward).max()) + far
    at = centre[0] * camera.right + centre[1] * camera.up
    seen = plotter.camera
    seen.parallel_projection = True
    seen.focal_point = tuple(at)
    seen.position = tuple(at + depth * camera.toward)
    seen.up = tuple(camera.up)
    seen.parallel_scale = half_height
    plotter.renderer.ResetCameraClippingRange()
