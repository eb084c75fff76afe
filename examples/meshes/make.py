"""Meshes of the examples in space: ``python make.py [NAME ...] [--size MM] [--rest MM] [--out FOLDER]``.

    bolted_plates     two steel plates, three bolts across, tetrahedra that do not match
    half_lap_beam     two beams with half laps and three bolts along, in the manner of the Brake-Reuss beam
    flange_sector     a quarter of a pipe joint with twelve bolts
    extruded_joint    the reference joint, one layer of hexahedra deep

Bolts are not meshed: the faces that head and nut press on are surfaces of their own. Without names all are
made; `--size` and `--rest` are the sizes of elements in the contact and far from it. The files beside this
script are the coarse ones that it makes without arguments.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from bodies import STEEL, Body, Place, body_of, session, sized, within, write_deck

SIZES = {
    "bolted_plates": (9.0, 18.0),
    "half_lap_beam": (12.0, 24.0),
    "flange_sector": (14.0, 18.0),
    "extruded_joint": (3.125, 9.0),
}
"""Elements in the contact and far from it where no size is given, mm."""

REFERENCE = (70000.0, 0.3, 2e-9)
"""The material of the reference joint: MPa, Poisson's ratio, tonnes per mm³."""

HOLE, WASHER = 8.5, 16.0
"""Diameters of the holes and of what head and nut press on, mm."""

Centres = Sequence[tuple[float, float]]


def drilled(gmsh: Any, volume: int, centres: Centres, z: tuple[float, float], outer: float) -> int:
    """A body with holes along z through it, and the circles of the washers on its outer face."""
    occ = gmsh.model.occ
    low, high = z
    holes = [
        (3, occ.addCylinder(x, y, low - 1, 0, 0, high - low + 2, HOLE / 2)) for x, y in centres
    ]
    (body,), _ = occ.cut([(3, volume)], holes)
    return imprinted(
        gmsh, body[1], [occ.addDisk(x, y, outer, WASHER / 2, WASHER / 2) for x, y in centres]
    )


def imprinted(gmsh: Any, volume: int, faces: Sequence[int]) -> int:
    """A body on whose outside the outlines of some faces are edges."""
    occ = gmsh.model.occ
    _, parts = occ.fragment([(3, volume)], [(2, face) for face in faces])
    (body,) = parts[0]
    spare = {tag for part in parts[1:] for _, tag in part}
    occ.synchronize()
    kept = {tag for _, tag in gmsh.model.getBoundary([body], oriented=False)}
    loose = [(2, tag) for tag in spare - kept]
    if loose:
        occ.remove(loose, recursive=True)
        occ.synchronize()
    return body[1]


def washers(prefix: str, centres: Centres, z: float) -> dict[str, Place]:
    """Places of the faces under heads or nuts, numbered from 1."""
    r = 0.55 * WASHER  # boxes of curved edges are not tight
    return {
        f"{prefix}_{k}": within(x=(x - r, x + r), y=(y - r, y + r), z=(z, z))
        for k, (x, y) in enumerate(centres, 1)
    }


def bolted_plates(size: float, rest: float) -> list[Body]:
    """Plates of 120 by 60 by 6 mm that overlap by 40 mm; three bolts across, 20 mm apart."""
    length, width, thickness, lap = 120.0, 60.0, 6.0, 40.0
    centres = [(0.0, y) for y in (-20.0, 0.0, 20.0)]
    half, far = lap / 2, length - lap / 2
    bodies = []
    for name, side, fine in (("LOWER", -1, size), ("UPPER", 1, 0.85 * size)):
        with session(name) as gmsh:
            occ = gmsh.model.occ
            z = (-thickness, 0.0) if side < 0 else (0.0, thickness)
            start = -far if side < 0 else -half
            box = occ.addBox(start, -width / 2, z[0], length, width, thickness)
            outer = side * thickness
            plate = drilled(gmsh, box, centres, z, outer)
            plate = imprinted(gmsh, plate, [occ.addRectangle(-half, -width / 2, 0.0, lap, width)])
            sized(gmsh, fine, rest, [(-half, half, -width, width, -9.0, 9.0)])
            gmsh.model.mesh.generate(3)
            places = {
                f"{name}_CONTACT": within(x=(-half, half), z=(0.0, 0.0)),
                **washers("NUT" if side < 0 else "HEAD", centres, outer),
                "WALL" if side < 0 else "TIP": within(x=(side * far, side * far)),
            }
            bodies.append(body_of(gmsh, name, [plate], places))
    return bodies


def half_lap_beam(size: float, rest: float) -> list[Body]:
    """0.72 m long, 25.4 mm square, half laps of 120 mm, three bolts along, 30 mm apart.

    The upper half is the lower one after half a turn about y. The steps at both ends of the laps do not
    touch: a slit too thin to be drawn.
    """
    length, side, lap = 720.0, 25.4, 120.0
    h, half = side / 2, lap / 2
    centres = [(x, 0.0) for x in (-30.0, 0.0, 30.0)]
    with session("beam") as gmsh:
        occ = gmsh.model.occ
        shank = occ.addBox(-length / 2, -h, -h, (length - lap) / 2, side, side)
        tongue = occ.addBox(-half, -h, -h, lap, side, h)
        ((_, whole),), _ = occ.fuse([(3, shank)], [(3, tongue)])
        occ.synchronize()
        beam = drilled(gmsh, whole, centres, (-h, 0.0), -h)
        sized(gmsh, size, rest, [(-half, half, -side, side, -side, side)])
        gmsh.model.mesh.generate(3)
        places = {
            "LOWER_LAP": within(x=(-half, half), z=(0.0, 0.0)),
            **washers("NUT", centres, -h),
            "LEFT": within(x=(-length / 2, -length / 2)),
        }
        lower = body_of(gmsh, "LOWER", [beam], places)
    turned = {"LOWER_LAP": "UPPER_LAP", "LEFT": "RIGHT"}
    turned |= {f"NUT_{k}": f"HEAD_{4 - k}" for k in (1, 2, 3)}
    return [lower, lower.turned("UPPER", turned)]


def flange_sector(size: float, rest: float) -> list[Body]:
    """Quarter of two pipes of 60 mm and 68 mm radius, flanges of 110 mm by 14 mm, twelve bolts at 90 mm."""
    inside, outside, rim, pitch, thickness, height = 60.0, 68.0, 110.0, 90.0, 14.0, 70.0
    angles = np.radians([15.0, 45.0, 75.0])
    centres = [(float(pitch * np.cos(a)), float(pitch * np.sin(a))) for a in angles]
    bodies = []
    for name, side, fine in (("LOWER", -1, size), ("UPPER", 1, 0.85 * size)):
        with session(name) as gmsh:
            occ = gmsh.model.occ
            quarter = 0.5 * np.pi
            below = min(side, 0)
            flange = occ.addCylinder(0, 0, below * thickness, 0, 0, thickness, rim, angle=quarter)
            pipe = occ.addCylinder(0, 0, below * height, 0, 0, height, outside, angle=quarter)
            bore = occ.addCylinder(0, 0, -2 * height, 0, 0, 4 * height, inside)
            whole, _ = occ.fuse([(3, flange)], [(3, pipe)])
            ((_, body),), _ = occ.cut(whole, [(3, bore)])
            occ.synchronize()
            z = (-thickness, 0.0) if side < 0 else (0.0, thickness)
            body = drilled(gmsh, body, centres, z, side * thickness)
            box = (0.0, rim, 0.0, rim, -thickness, thickness)
            sized(gmsh, fine, rest, [box])
            gmsh.model.mesh.generate(3)
            places = {
                f"{name}_CONTACT": within(z=(0.0, 0.0)),
                **washers("NUT" if side < 0 else "HEAD", centres, side * thickness),
                f"{name}_END": within(z=(side * height, side * height)),
            }
            bodies.append(body_of(gmsh, name, [body], places))
    return bodies


def extruded_joint(size: float, rest: float) -> list[Body]:
    """The reference joint, interface across y, one layer of 10 mm of hexahedra along z."""
    length, thickness, half, clamp, depth = 251.5, 12.5, 37.5, 25.0, 10.0
    # largest element ends are at the ends of clamp and overlap
    pieces = [(half - length, -half), (-half, -clamp), (-clamp, clamp), (clamp, half)]
    layers = max(2, round(2 * thickness / rest))
    with session("beam") as gmsh:
        occ = gmsh.model.occ
        boxes = [occ.addBox(a, -thickness, 0.0, b - a, thickness, depth) for a, b in pieces]
        parts, _ = occ.fragment([(3, boxes[0])], [(3, box) for box in boxes[1:]])
        occ.synchronize()
        for _, curve in gmsh.model.getEntities(1):
            low, high = np.array(gmsh.model.getBoundingBox(1, curve)).reshape(2, 3)
            along = int(np.argmax(high - low))
            span = float((high - low)[along])
            fine = rest if low[0] < -half - 1e-3 and along == 0 else size
            count = {0: max(1, round(span / fine)), 1: layers, 2: 1}[along]
            gmsh.model.mesh.setTransfiniteCurve(curve, count + 1)
        for _, surface in gmsh.model.getEntities(2):
            gmsh.model.mesh.setTransfiniteSurface(surface)
            gmsh.model.mesh.setRecombine(2, surface)
        volumes = [tag for _, tag in parts]
        for volume in volumes:
            gmsh.model.mesh.setTransfiniteVolume(volume)
        gmsh.model.mesh.generate(3)
        places = {
            "LOWER_CONTACT": within(x=(-half, half), y=(0.0, 0.0)),
            "BELOW": within(x=(-clamp, clamp), y=(-thickness, -thickness)),
            "LEFT": within(x=(half - length, half - length)),
        }
        lower = body_of(gmsh, "LOWER", volumes, places)
    x, y, _ = lower.points.T
    pinned = (np.abs(x - half + length) < 1e-6) & (np.abs(y + thickness / 2) < 1e-6)
    lower = lower.with_nodes(LEFT_PIN=pinned, LOWER_NODES=np.ones(len(x), dtype=bool))
    names = {
        "LOWER_CONTACT": "UPPER_CONTACT",
        "BELOW": "ABOVE",
        "LEFT": "RIGHT",
        "LEFT_PIN": "RIGHT_PIN",
        "LOWER_NODES": "UPPER_NODES",
    }
    return [lower, lower.turned("UPPER", names, about="z")]


MAKERS: dict[str, Callable[[float, float], list[Body]]] = {
    "bolted_plates": bolted_plates,
    "half_lap_beam": half_lap_beam,
    "flange_sector": flange_sector,
    "extruded_joint": extruded_joint,
}
MATERIALS = {"extruded_joint": REFERENCE}


def made(name: str, size: float | None = None, rest: float | None = None) -> list[Body]:
    """The bodies of one joint; without `rest` elements grow away from the contact as in the coarse mesh."""
    usual, far = SIZES[name]
    size = size or usual
    return MAKERS[name](size, rest or size * far / usual)


def main(argv: Sequence[str] | None = None) -> None:
    """Entry point."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("names", nargs="*", choices=[*MAKERS, []], metavar="NAME")
    parser.add_argument("--size", type=float, help="elements in the contact, mm")
    parser.add_argument("--rest", type=float, help="elements far from it, mm")
    parser.add_argument("--out", type=Path, default=Path(__file__).parent, help="folder")
    asked = parser.parse_args(argv)
    for name in asked.names or MAKERS:
        bodies = made(name, asked.size, asked.rest)
        file = asked.out / f"{name}.inp"
        write_deck(
            file, f"{name.replace('_', ' ')}; mm, N, tonnes", bodies, MATERIALS.get(name, STEEL)
        )
        points, cells = (sum(len(getattr(b, key)) for b in bodies) for key in ("points", "cells"))
        print(f"{file}: {points:,} nodes, {cells:,} elements, {file.stat().st_size / 1e3:.0f} kB")


if __name__ == "__main__":
    main()
