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


def hexahedra(axes, first=1, kind="hex8"):
    """A box of hexahedra with incompatible modes between the products of three lists of coordinates."""
    sizes = [len(axis) for axis in axes]
    points = np.array(list(product(*axes)))
    number = np.arange(len(points)).reshape(sizes)
    corners = (
        *((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)),
        *((0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)),
    )
    cells = [
        number[tuple(slice(k, n - 1 + k) for k, n in zip(c, sizes, strict=True))].ravel()
        for c in corners
    ]
    nodes = np.column_stack(cells)
    block = Block(kind, nodes, first + np.arange(len(nodes)), "incompatible")
    return FiniteElementMesh(points, 1 + np.arange(len(points)), (block,))


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
    lower = hexahedra(
        (
            graded((-80, -15, 5 * f), (-15, -5, 2 * f), (-5, 5, 2 * f), (5, 15, 2 * f)),
            graded((-10, -4, f), (-4, 4, 2 * f), (4, 10, f)),
            np.linspace(-5, 0, 2 * f + 1),
        )
    )
    upper = hexahedra(
        (
            graded((-15, -5, f), (-5, 5, 3 * f), (5, 15, f), (15, 80, 4 * f)),
            graded((-10, -4, f), (-4, 4, f), (4, 10, f)),
            np.linspace(0, 5, f + 1),
        )
    )
    labels = upper.blocks[0].labels + lower.elements
    upper = replace(upper, blocks=(replace(upper.blocks[0], labels=labels),))
    mesh = joined(lower, upper)
    numbers = np.arange(len(mesh.points)) + 1
    low = np.arange(mesh.elements) < lower.elements

    def flat(height, x=15.0, y=10.0):
        return lambda p: (
            (np.abs(p[:, 2] - height) < 1e-9)
            & (np.abs(p[:, 0]) < x + 1e-9)
            & (np.abs(p[:, 1]) < y + 1e-9)
        )

    def of(body, surface):
        own = low[surface.elements] == body
        return Surface(surface.elements[own], surface.faces[own])

    surfaces = {
        "lower_contact": of(True, faces_where(mesh, flat(0.0))),
        "upper_contact": of(False, faces_where(mesh, flat(0.0))),
        "nut": faces_where(mesh, flat(-5.0, 5.0, 4.0)),
        "head": faces_where(mesh, flat(5.0, 5.0, 4.0)),
        "left": faces_where(mesh, lambda p: p[:, 0] < -80 + 1e-9),
        "right": faces_where(mesh, lambda p: p[:, 0] > 80 - 1e-9),
    }
    c, s = np.cos(turn), np.sin(turn)
    return replace(
        with_surfaces(mesh, surfaces),
        points=mesh.points @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]).T,
        node_labels=numbers,
        element_sets={"lower": np.flatnonzero(low), "upper": np.flatnonzero(~low)},
        materials={"steel": STEEL_MM},
        sections=(Section("lower", "steel"), Section("upper", "steel")),
    )


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
