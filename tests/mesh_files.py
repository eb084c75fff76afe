"""Joints written as meshes and the joint files that name what is in them."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
from model.mesh.lap_as_mesh import lap_as_mesh
from model.mesh.write_inp import write_inp

from microslip.model.elasticity import Material
from microslip.model.mesh.boundary import boundary, joined, with_surfaces
from microslip.model.mesh.finite_elements import Block, FiniteElementMesh, Section, Surface


def faces_where(mesh, chosen):
    """Outside faces whose corners all satisfy a condition of their coordinates."""
    faces, corners = boundary(mesh.blocks)
    own = []
    for nodes in corners:
        own.append(bool(chosen(mesh.points[nodes[nodes >= 0]]).all()))
    return Surface(faces.elements[own], faces.faces[own])


def lap_document(joint, folder, name="lap.inp"):
    """A lap joint with pinned ends as a mesh in millimetres, and its joint file.

    The ends of the clamp must be ends of elements.
    """
    mesh = lap_as_mesh(joint)
    clamp, beams = joint.clamp, joint.beams
    across = clamp.half_length * (1 + 1e-9)

    def pressed(height):
        return lambda x: (np.abs(x[:, 1] - height) < 1e-12) & (np.abs(x[:, 0]) <= across)

    lower, upper = beams.thicknesses
    mesh = with_surfaces(
        mesh,
        {
            "below": faces_where(mesh, pressed(-lower)),
            "above": faces_where(mesh, pressed(upper)),
        },
    )
    x, y = mesh.points.T
    pins = [
        np.argmin(np.hypot(x - x.min(), y + 0.5 * lower)),
        np.argmin(np.hypot(x - x.max(), y - 0.5 * upper)),
    ]
    middle = np.flatnonzero(np.hypot(x, y) < 1e-12)
    sets = {"pins": np.array(pins), "middle": middle}
    in_mm = replace(
        mesh,
        points=mesh.points * 1e3,
        node_sets=sets,
        materials={
            key: replace(m, youngs_modulus=m.youngs_modulus * 1e-6, density=m.density * 1e-12)
            for key, m in mesh.materials.items()
        },
    )
    write_inp(in_mm, folder / name)
    return {
        "kind": "mesh",
        "mesh": {"file": name, "length_unit": "mm", "force_unit": "N", "modes": joint.mesh.modes},
        "support": {"on": "pins", "directions": ["y"]},
        "spring": {
            "on": ["left_end", "right_end"],
            "direction": "x",
            "stiffness": joint.spring_used / beams.thickness,
        },
        "interface": {
            "first": "lower_contact",
            "second": "upper_contact",
            "friction": joint.contact.friction,
        },
        "preload": {
            "on": ["below", "above"],
            "pressure": clamp.force / (2 * clamp.half_length),
        },
        "damping": {"alpha": joint.damping.alpha, "beta": joint.damping.beta},
        "port": {
            "name": "moment",
            "kind": "moment",
            "on": "right_end",
            "opposite": "left_end",
        },
        "output": {"name": "deflection", "on": "middle", "direction": "y"},
    }


STEEL_MM = Material(210e3, 0.3, 7.85e-9)
"""In MPa and tonnes per mm³."""


def grid(axes):
    """Quadrilaterals or hexahedra with incompatible modes between the products of lists of coordinates."""
    d = len(axes)
    sizes = [len(axis) for axis in axes]
    points = np.array(list(product(*axes)))
    number = np.arange(len(points)).reshape(sizes)
    ring = ((0, 0), (1, 0), (1, 1), (0, 1))
    corners = ring if d == 2 else [(*c, k) for k in (0, 1) for c in ring]
    cells = [
        number[tuple(slice(k, n - 1 + k) for k, n in zip(c, sizes, strict=True))].ravel()
        for c in corners
    ]
    nodes = np.column_stack(cells)
    kind = "quad4" if d == 2 else "hex8"
    block = Block(kind, nodes, 1 + np.arange(len(nodes)), "incompatible")
    return FiniteElementMesh(points, 1 + np.arange(len(points)), (block,))


def two_bodies(lower, upper):
    """Both in one mesh of steel, element sets named after them."""
    labels = upper.blocks[0].labels + lower.elements
    upper = replace(upper, blocks=(replace(upper.blocks[0], labels=labels),))
    mesh = joined(lower, upper)
    low = np.arange(mesh.elements) < lower.elements
    return replace(
        mesh,
        node_labels=1 + np.arange(len(mesh.points)),
        element_sets={"lower": np.flatnonzero(low), "upper": np.flatnonzero(~low)},
        materials={"steel": STEEL_MM},
        sections=(Section("lower", "steel"), Section("upper", "steel")),
    )


def on_body(mesh, body, chosen):
    """Outside faces of one body whose corners satisfy a condition."""
    found = faces_where(mesh, chosen)
    own = np.isin(found.elements, mesh.element_sets[body])
    return Surface(found.elements[own], found.faces[own])


def spot(height, first, last, reach=10.0):
    """Condition of faces on the plane z = height, from first to last along x, within +-reach along y."""
    return lambda p: (
        (np.abs(p[:, 2] - height) < 1e-9)
        & (p[:, 0] > first - 1e-9)
        & (p[:, 0] < last + 1e-9)
        & (np.abs(p[:, 1]) < reach + 1e-9)
    )


def graded(*pieces):
    """Coordinates of pieces, (start, stop, elements)."""
    parts = [np.linspace(a, b, n + 1)[1:] for a, b, n in pieces]
    return np.concatenate([[pieces[0][0]], *parts])


def plates(turn=0.0, fine=1):
    """Two steel plates of hexahedra that overlap by 30 mm, one bolt, meshes that do not match; mm.

    Parameters
    ----------
    turn : float
        About the normal of the interface, rad.
    fine : int
        Elements along each edge over those of the coarsest mesh.
    """
    f = fine
    lower = grid(
        (
            graded((-80, -15, 5 * f), (-15, -5, 2 * f), (-5, 5, 2 * f), (5, 15, 2 * f)),
            graded((-10, -4, f), (-4, 4, 2 * f), (4, 10, f)),
            np.linspace(-5, 0, 2 * f + 1),
        )
    )
    upper = grid(
        (
            graded((-15, -5, f), (-5, 5, 3 * f), (5, 15, f), (15, 80, 4 * f)),
            graded((-10, -4, f), (-4, 4, f), (4, 10, f)),
            np.linspace(0, 5, f + 1),
        )
    )
    mesh = two_bodies(lower, upper)

    def flat(height, x=15.0, y=10.0):
        return lambda p: (
            (np.abs(p[:, 2] - height) < 1e-9)
            & (np.abs(p[:, 0]) < x + 1e-9)
            & (np.abs(p[:, 1]) < y + 1e-9)
        )

    surfaces = {
        "lower_contact": on_body(mesh, "lower", flat(0.0)),
        "upper_contact": on_body(mesh, "upper", flat(0.0)),
        "nut": faces_where(mesh, flat(-5.0, 5.0, 4.0)),
        "head": faces_where(mesh, flat(5.0, 5.0, 4.0)),
        "left": faces_where(mesh, lambda p: p[:, 0] < -80 + 1e-9),
        "right": faces_where(mesh, lambda p: p[:, 0] > 80 - 1e-9),
    }
    for name, side in (("fore", -1), ("aft", 1)):
        for body in ("lower", "upper"):
            part = on_body(mesh, body, lambda p, s=side: flat(0.0)(p) & (s * p[:, 0] > 5 - 1e-9))
            surfaces[f"{body}_{name}"] = part
    c, s = np.cos(turn), np.sin(turn)
    turned = mesh.points @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T
    return replace(with_surfaces(mesh, surfaces), points=turned)


def plates_document(folder, name="plates.inp", turn=0.0, fine=1):
    """The plates as a file, and their joint file: 20 mm wide, bolted with 12 kN, bent at the tip."""
    write_inp(plates(turn, fine), folder / name)
    c, s = float(np.cos(turn)), float(np.sin(turn))
    return {
        "kind": "mesh",
        "mesh": {"file": name, "length_unit": "mm", "width": "20 mm", "modes": 20},
        "support": {"on": "left"},
        "interface": {"first": "lower_contact", "second": "upper_contact", "friction": 0.3},
        "preload": {"name": "bolt", "on": ["head", "nut"], "force": 12e3 / 0.02},
        "damping": {"beta": "1 us"},
        "port": {"name": "tip", "kind": "force", "on": "right", "direction": "z"},
        "load": {"force": [50.0]},
        "output": [
            {"name": "tip", "on": "right", "direction": "z"},
            {
                "name": "slip",
                "quantity": "slip",
                "at": [0.015 * c, 0.015 * s, 0.0],
                "direction": [c, s, 0.0],
            },
        ],
    }


def overlapping(mesh, axis, pressed):
    """Two bodies of 5 mm that overlap by 30 mm along x, with their surfaces named.

    Parameters
    ----------
    mesh : FiniteElementMesh
        Of `two_bodies`, from -80 to 80 mm, in contact where the coordinate of `axis` is 0.
    axis : int
        Across the contact.
    pressed : float
        Half length of the outer faces that are pressed, mm.
    """

    def level(height, reach=15.0):
        return lambda p: (np.abs(p[:, axis] - height) < 1e-9) & (np.abs(p[:, 0]) < reach + 1e-9)

    return with_surfaces(
        mesh,
        {
            "lower_contact": on_body(mesh, "lower", level(0.0)),
            "upper_contact": on_body(mesh, "upper", level(0.0)),
            "below": faces_where(mesh, level(-5.0, pressed)),
            "above": faces_where(mesh, level(5.0, pressed)),
            "left": faces_where(mesh, lambda p: p[:, 0] < -80 + 1e-9),
            "right": faces_where(mesh, lambda p: p[:, 0] > 80 - 1e-9),
        },
    )


def section_document(folder, depth=None):
    """Two beams of 5 mm that overlap by 30 mm, plane or with one layer of elements across `depth` mm.

    Without lateral contraction nothing moves across it: per metre of width all is that of the plane one.
    """
    across = () if depth is None else (np.array([0.0, depth]),)
    lower = grid((graded((-80, -15, 5), (-15, 15, 12)), np.linspace(-5, 0, 3), *across))
    upper = grid((graded((-15, 15, 6), (15, 80, 4)), np.linspace(0, 5, 3), *across))
    mesh = two_bodies(lower, upper)

    mesh = overlapping(mesh, 1, 5.0)
    name = "section.inp" if depth is None else "extruded.inp"
    deck = write_inp(mesh, folder / name)
    deck.write_text(deck.read_text().replace("TYPE=CPE4,", "TYPE=CPE4I,"))
    file = {"file": name, "length_unit": "mm", "modes": 20}
    if depth is not None:
        file["width"] = depth * 1e-3
    return {
        "kind": "mesh",
        "mesh": file,
        "material": {"youngs_modulus": 210e9, "poissons_ratio": 0.0, "density": 7850.0},
        "support": {"on": "left"},
        "interface": {"first": "lower_contact", "second": "upper_contact", "friction": 0.3},
        "preload": {"on": ["below", "above"], "force": 4e5},
        "damping": {"beta": "1 us"},
        "port": {"name": "tip", "kind": "force", "on": "right", "direction": "y"},
        "load": {"force": [50.0, 400.0]},
        "output": {"name": "tip", "on": "right", "direction": "y"},
    }


def matching_document(folder, name="matching.inp"):
    """Two plates 20 mm wide whose nodes match where they overlap, 15 pairs, bolted and bent aslant."""
    across = (np.array([-10.0, 0.0, 10.0]), np.array([-5.0, 0.0]))
    lower = grid((graded((-80, -15, 3), (-15, 15, 4)), *across))
    upper = grid((graded((-15, 15, 4), (15, 80, 3)), across[0], across[1] + 5.0))
    mesh = two_bodies(lower, upper)

    mesh = overlapping(mesh, 2, 7.5)
    write_inp(mesh, folder / name)
    return {
        "kind": "mesh",
        "mesh": {"file": name, "length_unit": "mm", "width": 0.02, "modes": 16},
        "support": {"on": "left"},
        "interface": {"first": "lower_contact", "second": "upper_contact", "friction": 0.3},
        "preload": {"name": "bolt", "on": ["above", "below"], "force": 6e5},
        "damping": {"beta": "20 us"},
        "port": {"name": "tip", "kind": "force", "on": "right", "direction": [0.0, 0.3, 1.0]},
        "load": {"force": [50.0, 2000.0]},
        "output": [{"name": "tip", "on": "right", "direction": "z"}],
    }
