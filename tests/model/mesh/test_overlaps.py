"""Bodies that overlap: boxes against their closed form, pins in holes, and what a contact may enter."""

import re
from dataclasses import replace

import numpy as np
import pytest
from grids import box
from scipy.spatial.transform import Rotation

from microslip.errors import ModelError
from microslip.model.mesh.boundary import joined, surface_of_nodes, with_surfaces
from microslip.model.mesh.element_types import TYPES
from microslip.model.mesh.finite_elements import Block, FiniteElementMesh
from microslip.model.mesh.overlaps import DEEP, check_apart

SAID = re.compile(r"node (\d+) of .* lies ([\d.e+-]+) m inside .*, at \((.*)\) m")


EDGE = re.compile(r"an edge of .*, ([\d.e+-]+) m inside at \((.*)\) m")


def boxes(kinds, seed):
    """Two unit boxes, the second turned and moved at random; and the depth of every node in the other."""
    rng = np.random.default_rng(seed)
    d = TYPES[kinds[0][0]].dimension
    parts = [box(kind, [np.linspace(-0.5, 0.5, n + 1)] * d) for kind, n in kinds]
    turn = Rotation.random(rng=seed) if d == 3 else Rotation.from_euler("z", seed)
    turn = turn.as_matrix()[:d, :d]
    shift = rng.uniform(-1, 1, d)
    shift *= rng.uniform(0.6, 1.3) / np.abs(shift).max()
    second = replace(parts[1], points=parts[1].points @ turn.T + shift)
    mesh = joined(parts[0], second)
    mesh = replace(mesh, node_labels=1 + np.arange(len(mesh.points)))
    local = [(second.points), (parts[0].points - shift) @ turn]
    depth = np.concatenate([0.5 - np.abs(local[1]).max(axis=1), 0.5 - np.abs(local[0]).max(axis=1)])
    return mesh, depth, lambda x: 0.5 - max(np.abs(x).max(), np.abs((x - shift) @ turn).max())


PAIRS = [(("quad4", 3), ("tri6", 2)), (("hex8", 3), ("tet10", 2)), (("wedge15", 2), ("hex20", 4))]


@pytest.mark.parametrize("kinds", PAIRS)
def test_the_deepest_node_of_boxes_is_that_of_geometry(kinds):
    found = 0
    for seed in range(12):
        mesh, depth, common = boxes(kinds, seed)
        try:
            check_apart(mesh)
        except ModelError as error:
            if edge := EDGE.search(str(error)):
                # no node is deep enough: the place is inside both boxes, an edge at the depth that is said
                assert depth.max() < DEEP * 2 * np.sqrt(2) / min(n for _, n in kinds)
                x = np.array([float(c) for c in edge[2].split(",")])
                assert common(x) > -1e-3
                continue
            node, said, place = SAID.search(str(error)).groups()
            assert float(said) == pytest.approx(depth.max(), rel=5e-3)  # three digits are written
            assert depth[int(node) - 1] == pytest.approx(depth.max(), rel=1e-9)
            x = np.array([float(c) for c in place.split(",")])
            assert x == pytest.approx(mesh.points[int(node) - 1], rel=2e-3, abs=1e-4)
            found += 1
        else:
            # the size of a face is at most that of a sphere around it
            assert depth.max() < DEEP * 2 * np.sqrt(2) / min(n for _, n in kinds)
    assert 3 <= found <= 11


def ring(inner, outer, sectors, turn=0.0):
    angle = turn + 2 * np.pi * np.arange(sectors) / sectors
    radii = np.linspace(inner, outer, 3)
    points = (radii[:, None, None] * np.stack([np.cos(angle), np.sin(angle)], axis=1)).reshape(
        -1, 2
    )
    k = np.arange(sectors)
    on = (k + 1) % sectors
    cells = [
        np.stack([k + low, k + low + sectors, on + low + sectors, on + low], axis=1)
        for low in (0, sectors)
    ]
    block = Block("quad4", np.concatenate(cells), 1 + np.arange(2 * sectors))
    mesh = FiniteElementMesh(points, 1 + np.arange(len(points)), (block,))
    size = np.hypot(*points.T)
    at = {"inside": inner, "outside": outer}
    on_circle = {name: np.flatnonzero(np.abs(size - r) < 1e-9) for name, r in at.items()}
    faces = {name: surface_of_nodes((block,), nodes) for name, nodes in on_circle.items()}
    return with_surfaces(mesh, faces)


@pytest.mark.parametrize(("pin", "hole"), [(16, 24), (31, 20), (24, 24)])
def test_a_pin_in_a_hole_of_other_facets_does_not_overlap(pin, hole):
    check_apart(joined(ring(0.2, 1.0, pin), ring(1.0, 2.0, hole, turn=0.1)))


def test_a_press_fit_may_enter_what_is_named_and_nothing_else():
    shaft = ring(0.2, 1.1, 40)
    shaft = replace(shaft, surfaces={"shaft": shaft.surfaces["outside"]})
    mesh = joined(shaft, ring(1.0, 2.0, 40))
    both = {"shaft", "inside"}
    with pytest.raises(ModelError, match=r"body 1 and body 2 overlap.* lies 0\.1 m inside"):
        check_apart(mesh)
    check_apart(mesh, both)
    pin = (np.arange(len(mesh.points)) < 120)[:, None]
    moved = replace(mesh, points=mesh.points + [[0.3, 0.0]] * pin)
    check_apart(moved, both)  # how deep there is for the coupling to say
    far = replace(mesh, points=mesh.points + [[1.3, 0.0]] * pin)
    with pytest.raises(ModelError, match="overlap where they are not said to touch"):
        check_apart(far, both)


def test_a_body_all_inside_another_is_found():
    inner = box("hex8", [np.linspace(0.4, 0.6, 2)] * 3)
    outer = box("tet4", [np.linspace(0.0, 1.0, 4)] * 3)
    with pytest.raises(ModelError, match=r"lies 0\.4 m inside body 2"):
        check_apart(joined(inner, outer))


@pytest.mark.parametrize("kind", ["quad8", "hex8", "tet10"])
def test_bodies_that_touch_do_not_overlap(kind):
    d = 2 if kind == "quad8" else 3
    lower = box(kind, [np.linspace(0, 1, 4)] * d)
    upper = box(kind, [np.linspace(0.3, 1.3, 3)] * (d - 1) + [np.linspace(1.0, 2.0, 3)])
    check_apart(joined(lower, upper))
    notch = replace(upper, points=upper.points - np.eye(d)[-1] * 0.02)
    check_apart(joined(lower, notch))


def bars(reach, width, offset, kinds=("hex8", "hex8"), turn=0.0):
    """Two bars of one element across, the second turned and moved; none has a node in the other."""
    d = TYPES[kinds[0]].dimension
    across = [np.array([-0.5, 0.5])] * (d - 1)
    long = box(kinds[0], [np.array([-reach, reach]), *(width * a for a in across)])
    other = box(kinds[1], [np.array([-reach, reach]), *(width * a for a in across)])
    q = Rotation.from_euler("z", 90.0 + turn, degrees=True).as_matrix()[:d, :d]
    return joined(long, replace(other, points=other.points @ q.T + np.asarray(offset)))


@pytest.mark.parametrize("kinds", [("quad4", "quad4"), ("hex8", "hex8"), ("hex20", "tet10")])
@pytest.mark.parametrize("turn", [0.0, 17.0])
def test_bars_that_cross_are_found_by_their_edges(kinds, turn):
    d = TYPES[kinds[0]].dimension
    offset = (0.1, 0.2, 0.3)[:d]
    with pytest.raises(ModelError, match=r"an edge of body \d passes through") as error:
        check_apart(bars(3.0, 1.0, offset, kinds, turn))
    said = re.search(r"([\d.e+-]+) m inside at", str(error.value))
    assert 0.1 < float(said[1]) <= 0.5  # at most half of the width


def test_bars_that_pass_each_other_are_not():
    """One over the other, touching or not, and through the gap of a fork."""
    for height in (1.0, 1.0 + 1e-9, 1.01, 2.0):
        check_apart(bars(3.0, 1.0, (0.0, 0.0, height)))
    fork = joined(
        box("hex8", [np.array([-3.0, 3.0]), np.array([-1.5, -1.0]), np.array([-1.0, 1.0])]),
        box("hex8", [np.array([-3.0, 3.0]), np.array([1.0, 1.5]), np.array([-1.0, 1.0])]),
    )
    between = box("hex8", [np.array([-4.0, 4.0]), np.array([-0.9, 0.9]), np.array([-0.5, 0.5])])
    check_apart(joined(fork, between))


@pytest.mark.parametrize("depth", [0.02, 0.4])
def test_edges_may_enter_as_deep_as_nodes(depth):
    """A tenth of the face that is entered is allowed: facets of curved surfaces cut into each other."""
    mesh = bars(1.0, 1.0, (0.0, 0.0, 1.0 - depth))
    if depth < DEEP:
        check_apart(mesh)
    else:
        with pytest.raises(ModelError, match="overlap where they are not said to touch"):
            check_apart(mesh)


@pytest.mark.parametrize("off", [0.0, 1e-12, -1e-9, 1e-6])
def test_plates_whose_edges_touch_are_apart(off):
    """Side by side and flush, with nodes that match or not, and corners off by rounding."""
    lower = box("hex8", [np.linspace(-3, 3, 7), np.linspace(-1, 1, 4), np.linspace(-1, 0, 2)])
    upper = box("hex8", [np.linspace(-2, 4, 5), np.linspace(-1, 1, 3), np.linspace(0, 1, 2)])
    check_apart(joined(lower, replace(upper, points=upper.points + np.array([0.0, 0.0, off]))))


@pytest.mark.parametrize("sides", [(8, 8), (8, 48), (12, 10), (48, 12), (24, 8)])
def test_coarse_pins_fit_their_holes(sides):
    """Corners of one polygon through the sides of the other, whichever way it is turned."""
    for turn in np.linspace(0.0, 1.0, 7):
        check_apart(joined(ring(1.0, 2.0, sides[0]), ring(0.3, 1.0, sides[1], turn)))
