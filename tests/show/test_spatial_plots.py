"""Figures of joints in space: what they show, against geometry and balance of forces and energy."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from conftest import with_value
from matplotlib.collections import PolyCollection
from matplotlib.quiver import Quiver
from mesh_files import plates_document

from microslip.contact.pairs import SEPARATED
from microslip.describe.reading import parse_joint
from microslip.model.geometry import ContactSurface
from microslip.model.mesh.element_types import element_type
from microslip.model.mesh.facets import FacetGroup
from microslip.pipeline.run import run as run_joint
from microslip.show.figures import draw_figures, figures_of, left_out, save_figures
from microslip.show.plots.charts import chart_of, reference_cells
from microslip.show.plots.interface_maps import OVER_CYCLE, over_cycle
from microslip.show.plots.spatial_fields import instants, shown_cycle
from microslip.show.plots.structure import structure_figure
from microslip.show.plots.view import skin_of, view_of

FORCE = 12e3
"""Of the bolt of the plates, N."""

PICTURES = {"model", "modes", "prestress", "contact_states", "tractions", "dissipation", "motion"}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """Two plates turned by 0.3 about the normal of their interface; one cycle in which they slip and open."""
    folder = tmp_path_factory.mktemp("plates")
    document = plates_document(folder, turn=0.3)
    document["analysis"] = {"cycle": {"force": [2e3, 1.5e4], "drives": ["load"], "steps": 40}}
    return run_joint(parse_joint(document, "mesh", folder))


def area(polygon):
    """Of a plane polygon."""
    x, y = np.asarray(polygon).T
    return 0.5 * abs(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def shown(ax):
    """Areas, mm², and values of the parts of a map."""
    (found,) = [
        c for c in ax.collections if isinstance(c, PolyCollection) and c.get_array() is not None
    ]
    parts = [area(path.vertices[:-1]) for path in found.get_paths()]
    return np.array(parts), np.asarray(found.get_array())


def total(ax):
    """Integral of a map over its interface."""
    parts, values = shown(ax)
    return float(parts @ values)


@pytest.mark.parametrize("kind", ["tri3", "tri6", "quad4", "quad8", "quad9"])
def test_parts_of_a_facet_are_all_of_it_and_nearest_to_their_nodes(kind):
    shape = element_type(kind)
    even = np.array([[1, 0], [0.5, np.sqrt(0.75)]]) if shape.family == "tri" else np.eye(2)
    cells = reference_cells(kind)
    whole = area(shape.nodes[: shape.corners])
    assert sum(area(cell) for cell in cells) == pytest.approx(whole, rel=1e-12)
    for own, cell in zip(shape.nodes, cells, strict=True):
        apart = np.linalg.norm((cell[:, None] - shape.nodes) @ even, axis=2)
        nearest = apart.min(axis=1)
        mine = np.linalg.norm((cell - own) @ even, axis=1)
        assert mine == pytest.approx(nearest, abs=1e-12)


def surface_over(points, normal, kind="quad4", columns=8):
    """An interface with a pair at each node of a grid, and its tangents."""
    rows = len(points) // (columns + 1) - 1
    at = np.arange(len(points)).reshape(rows + 1, columns + 1)
    nodes = np.stack([at[:-1, :-1], at[1:, :-1], at[1:, 1:], at[:-1, 1:]], axis=-1).reshape(-1, 4)
    first = np.eye(3)[0] - normal[:, :1] * normal
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    tangents = np.stack([first, np.cross(normal, first)], axis=1)
    group = FacetGroup(kind, nodes, np.arange(len(nodes)))
    every = np.arange(len(points))
    return ContactSurface("round", 0, points, normal, tangents, every, facets=(group,))


def grid(*axes):
    return (x.ravel() for x in np.meshgrid(*axes, indexing="ij"))


def test_a_cylinder_is_unrolled_to_its_length_and_width():
    """Radius 0.05 m, over 2 rad and across the direction where angles begin again."""
    z, angle = grid(np.linspace(0, 0.03, 4), np.linspace(2.3, 4.3, 9))
    normal = np.column_stack([np.cos(angle), np.sin(angle), 0 * z])
    points = 0.05 * normal + np.column_stack([0.7 + 0 * z, 0.2 + 0 * z, z])
    chart = chart_of(surface_over(points, normal), points)
    assert chart.labels[0] == "along the circumference, radius 50 mm (mm)"
    assert chart.extent == pytest.approx([100.0, 30.0], rel=1e-9)
    assert sum(map(area, chart.cells)) == pytest.approx(100 * 30, rel=0.01)
    along = np.column_stack([-np.sin(angle), np.cos(angle), 0 * z])
    assert np.abs(chart.flat(along)) == pytest.approx(np.tile([1.0, 0.0], (len(z), 1)), abs=1e-9)


def test_a_sphere_is_projected_and_says_so():
    a, b = grid(np.linspace(-0.4, 0.4, 9), np.linspace(-0.4, 0.4, 9))
    points = 0.05 * np.column_stack([a, b, np.sqrt(1 - a**2 - b**2)])
    chart = chart_of(surface_over(points, points / 0.05), points)
    assert chart.said == "projected on its mean plane"
    assert chart.labels == ("x (mm)", "y (mm)")
    assert chart.centres == pytest.approx(1e3 * points[:, :2], abs=1e-9)


def test_a_flat_interface_is_as_it_is(run):
    """Coordinates of the mesh, in mm, whatever its direction in the plane."""
    geometry = run.geometry
    chart = chart_of(geometry.surfaces[0], geometry.points)
    assert chart.said == ""
    assert chart.labels == ("x (mm)", "y (mm)")
    assert chart.centres == pytest.approx(1e3 * geometry.surfaces[0].points[:, :2], abs=1e-9)
    assert sum(map(area, chart.cells)) == pytest.approx(30 * 20, rel=1e-9)


def test_every_figure_is_there(run, tmp_path):
    names = set(figures_of(run))
    assert names >= PICTURES | {"overview", "hysteresis", "energy", "equivalent"}
    assert left_out(run) == {}
    written = save_figures(run, tmp_path, formats=("png",))
    assert {path.stem for path in written} == names
    assert all(path.stat().st_size > 4000 for path in written)


def test_the_map_of_pressure_carries_the_bolt(run):
    """MPa over mm² are newtons."""
    figure = figures_of(run)["prestress"](run)
    assert total(figure.axes[0]) == pytest.approx(FORCE, rel=1e-6)


def test_the_map_of_dissipation_holds_the_work_of_the_load(run):
    """Friction work of the map is that of the cycle, which the load gives; J/m² over mm²."""
    *_, cycle = shown_cycle(run)
    figure = figures_of(run)["dissipation"](run)
    width = 600e-6 / run.model.area.sum()  # of the interface of 600 mm², if per metre of it
    assert 1e-6 * total(figure.axes[0]) == pytest.approx(width * cycle.external_work, rel=1e-3)


def test_tractions_stay_within_the_friction_limit(run):
    figure = figures_of(run)["tractions"](run)
    size, part = (shown(ax)[1] for ax in figure.axes[:2])
    assert part.max() == pytest.approx(1.0, abs=1e-6)
    assert size.max() > 0


def test_arrows_of_slip_are_against_the_tractions(run):
    """Friction acts against the slip of the upper side."""
    *_, cycle = shown_cycle(run)
    geometry = run.geometry
    chart = chart_of(geometry.surfaces[0], geometry.points)
    figure = figures_of(run)["contact_states"](run)
    step = instants(cycle.load)[0][0]
    (arrows,) = [c for c in figure.axes[0].collections if isinstance(c, Quiver)]
    traction = chart.flat(geometry.surfaces[0].along(cycle.traction[step]))
    for (x, y), u, v in zip(arrows.get_offsets(), arrows.U, arrows.V, strict=True):
        pair = int(np.argmin(np.hypot(*(chart.centres - [x, y]).T)))
        f = traction[pair]
        cosine = (u * f[0] + v * f[1]) / (np.hypot(u, v) * np.hypot(*f))
        assert cosine < -0.99


def test_what_never_touches_is_hatched(run):
    *_, cycle = shown_cycle(run)
    never = (cycle.status == SEPARATED).all(axis=0)
    figure = figures_of(run)["contact_states"](run)
    hatched = [c for c in figure.axes[3].patches if c.get_hatch()]
    assert bool(hatched) == bool(never.any())
    counts = np.bincount(over_cycle(cycle.status[1:]), minlength=len(OVER_CYCLE))
    assert counts.sum() == run.model.pairs
    assert (counts[:3] > 0).all()


def test_several_interfaces_have_figures_of_their_own(run):
    """The same pairs as two interfaces: a file each, with the title of each, and one scale of pressure."""
    geometry = run.geometry
    (whole,) = geometry.surfaces
    half = len(whole.points) // 2
    parts = [
        replace(
            whole,
            name=name,
            first=first,
            points=whole.points[first:last],
            normal=whole.normal[first:last],
            tangents=whole.tangents[first:last],
            nodes=whole.nodes[first:last],
        )
        for name, first, last in (("left", 0, half), ("right", half, len(whole.points)))
    ]
    cut = replace(run)
    cut.__dict__["geometry"] = replace(geometry, surfaces=tuple(parts))
    drawings = figures_of(cut)
    found = draw_figures("dissipation", drawings["dissipation"], cut)
    assert set(found) == {"dissipation_left", "dissipation_right"}
    assert "of all" in found["dissipation_left"].axes[0].get_title(loc="left")
    both = drawings["prestress"](cut)
    assert sum(total(ax) for ax in both.axes[:2]) == pytest.approx(FORCE, rel=1e-6)


def test_faces_that_are_drawn_look_at_the_reader_and_are_all_of_the_outside(run):
    """Areas of the outside of two plates of 95 by 20 by 5 mm; outward normals sum to nothing."""
    geometry = run.geometry
    skin = skin_of(geometry)
    x = geometry.points
    areas, sums = 0.0, np.zeros(3)
    for loop, outward in zip(skin.loops, skin.outward, strict=True):
        corners = x[loop]
        across = 0.5 * np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
        size = np.linalg.norm(across, axis=1)
        areas += size.sum()
        sums += size @ outward
    one = 2 * (95 * 20 + 95 * 5 + 20 * 5) * 1e-6
    assert areas == pytest.approx(2 * one, rel=1e-9)
    assert np.abs(sums).max() < 1e-12
    view = view_of(geometry)
    assert np.stack([view.right, view.up, view.toward]) @ view.toward == pytest.approx([0, 0, 1])


def test_the_structure_shows_what_holds_and_loads_it(run):
    figure = structure_figure(run)
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    pairs = f"interface, {run.model.pairs} pairs"
    assert labels == ["held", pairs, "preload bolt", "load tip"]
    held = run.geometry.held
    wall = run.geometry.points @ [np.cos(0.3), np.sin(0.3), 0] < -0.08 + 1e-9
    assert (held.all(axis=1) == wall).all()


def test_loads_are_forces_on_the_nodes(run):
    """The unit load of the tip is one newton upward; head and nut balance each other."""
    geometry, loads = run.geometry, run.structure.loads
    assert geometry.forces(loads["tip"]).sum(axis=0) == pytest.approx([0, 0, 1], abs=1e-12)
    assert np.abs(geometry.forces(loads["bolt"]).sum(axis=0)).max() < 1e-12


def test_a_steady_state_in_time_is_drawn_as_a_cycle_is(run):
    """The same contact as that of the cycle: the same maps, from reactions and relative displacements."""
    *_, cycle = shown_cycle(run)
    steps = len(cycle.theta) - 1
    march = SimpleNamespace(r=cycle.r, v=cycle.v, status=cycle.status, time=np.arange(steps + 1.0))
    steady = SimpleNamespace(
        converged=True, amplitude=1.0, cycle=march, load=cycle.amplitude, phase=0.0, frequency=50.0
    )
    timed = with_value(run, "time", (SimpleNamespace(steady=steady),))
    figure = figures_of(timed)["steady_state"](timed)
    other = figures_of(run)["contact_states"](run)
    for one, two in zip(figure.axes, other.axes, strict=True):
        assert shown(one)[1].tolist() == shown(two)[1].tolist()
    assert "50.00 Hz" in figure._suptitle.get_text()


def test_why_figures_are_left_out_is_said(run):
    bare = replace(run)
    bare.__dict__["geometry"] = None
    said = left_out(bare)
    assert {"prestress", "contact_states", "overview"} <= set(said)
    assert set(said.values()) == {"the nodes have no coordinates"}
    assert not set(said) & set(figures_of(bare))
