"""Bolted joints in space drawn at random, as joint files with meshes.

python benchmarks/population/meshed_joints.py SEED COUNT FOLDER    writes joint_000.toml and its mesh, ...

Two or three bodies: a lap of two plates, a fork of three, two plates under a strap. Bricks, wedges and
tetrahedra, linear and quadratic, shaken a little; nodes that match or do not; interfaces flat, inclined,
arched or crowned, with gaps; one to three bolts, along or across, between head and nut, behind a stiffness,
by shortening, as pressure of washers, or in the mesh with a cut through the shank, together or one after
the other; friction 0.1 to 0.8; bodies of unlike metals; ends built in, free, hinged along an edge or on
springs; forces, moments, pressures and moving bases; rigid contact or a stiffness. 20 to 150 pairs. One in
twelve is no joint: a part that nothing holds, plates too far apart to meet, a bolt that pushes them apart.
A seed is a population."""

from __future__ import annotations

import math
import random
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from meshed_bodies import Body, Box, box, deck, gmsh_file, lines

METALS = {70e9: 2700, 110e9: 4430, 210e9: 7850}
"""Young's modulus, Pa, and density, kg/m³."""

MESHES = {("hex", True): 3, ("tet", True): 3, ("wedge", True): 2, ("hex", False): 2}
"""Shapes of elements and whether they have nodes on the middles of sides, and how often they are drawn."""

SMALL = 1e-3
"""Lengths are drawn in mm."""


@dataclass(frozen=True)
class MeshedJoint:
    """A joint file and its mesh.

    Attributes
    ----------
    text : str
        Of the joint file, without amplitudes and analyses.
    mesh, name : str
        Text of the mesh and name of its file.
    key : str
        Of ``[load]`` that amplitudes are given by.
    share : float
        Of what opens the joint at resonance, that it is meant to be loaded by.
    unsound : str
        What makes it no joint; empty where it is one.
    """

    text: str
    mesh: str
    name: str
    key: str
    share: float
    unsound: str

    def write(self, folder: Path, stem: str, more: str = "") -> Path:
        """Write both files."""
        folder.mkdir(parents=True, exist_ok=True)
        name = f"{stem}{Path(self.name).suffix}"
        (folder / name).write_text(self.mesh)
        file = folder / f"{stem}.toml"
        file.write_text(self.text.replace(self.name, name) + more)
        return file


@dataclass
class Draw:
    """One joint as it is drawn.

    Attributes
    ----------
    any : random.Random
    bodies : list of Body
    sets : mapping of str to (str, Box)
        Node sets: body and place.
    said : list of str
        Sections of the joint file.
    turn : (3, 3) array
        Where the axes of the boxes point.
    """

    any: random.Random
    bodies: list[Body] = field(default_factory=list)
    sets: dict[str, tuple[str, Box]] = field(default_factory=dict)
    said: list[str] = field(default_factory=list)
    turn: np.ndarray = field(default_factory=lambda: np.eye(3))

    def log(self, low: float, high: float) -> float:
        """Uniform in the logarithm."""
        return math.exp(self.any.uniform(math.log(low), math.log(high)))

    def often(self, share: float) -> bool:
        """True in this share of the draws."""
        return self.any.random() < share

    def say(self, header: str, **keys: object) -> None:
        """Add a section."""
        rows = [f"{key} = {_toml(value)}" for key, value in keys.items() if value is not None]
        self.said.append("\n".join([header, *rows]))

    def along(self, direction: tuple[float, float, float]) -> list[float]:
        """A direction of the boxes, turned as the mesh is."""
        return [float(x) for x in self.turn @ np.array(direction, float)]


def _toml(value: object) -> str:
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml, value)) + "]"
    return repr(value)


def rotation(axis: int, degrees: float) -> np.ndarray:
    """By an angle about an axis."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    found = np.eye(3)
    found[i, i], found[i, j], found[j, i], found[j, j] = c, -s, s, c
    return found


def joints(seed: int, count: int, turned: float = 0.0) -> Iterator[MeshedJoint]:
    """Yield one joint after another; `turned` in degrees about the normal of their interfaces."""
    for number in range(count):
        draw = Draw(random.Random(1000 * seed + number))
        yield joint(draw, f"meshed joint {number} of population {seed}", turned)


def joint(draw: Draw, title: str, turned: float = 0.0) -> MeshedJoint:
    """Draw one joint."""
    d = draw
    kind = d.any.choices(["lap", "fork", "strap"], [6, 2, 2])[0]
    width = d.log(15, 50)
    half = width * d.any.uniform(0.35, 0.8)
    thick = [d.log(3, 9) * (width / 25) ** 0.5 for _ in range(3)]
    reach = half + max(thick) * d.log(4, 12)
    tilt = d.any.choices([0.0, d.any.uniform(-60, 60), 90.0], [5, 4, 1])[0]
    d.turn = rotation(1, tilt) @ rotation(2, turned)
    bolts = Bolts.drawn(d, kind, half, width)
    arch = 0.0 if bolts.meshed or d.often(0.75) else d.any.uniform(0.003, 0.03) / half
    crown = d.any.choice([-1, 1]) * d.log(2e-4, 3e-3) if not arch and d.often(0.25) else 0.0
    unsound = ""
    if d.often(1 / 12):
        unsound = d.any.choice(
            ["a part that nothing holds", "plates that do not meet", "a bolt that pushes"]
        )
    lift = 10 * max(thick) if unsound == "plates that do not meet" else 0.0
    layers = stacked(kind, half, reach, thick, lift)
    make_bodies(d, layers, bolts, half, width, bool(arch))
    if bolts.meshed:
        add_bolts(d, bolts, layers)
    if unsound == "a part that nothing holds":
        axes = [np.array([a, a + 10.0, a + 20.0]) for a in (3 * reach, 0.0, 0.0)]
        d.bodies.append(box("LOOSE", "hex", True, axes, {}))
    ends = d.any.choices(["cantilever", "both", "sprung", "hinged", "free"], [3, 3, 2, 2, 2])[0]
    d.bodies = [shaken(d, body, 0.0 if arch or ends == "free" else 0.07) for body in d.bodies]
    d.bodies = [
        body.moved(lambda p, b=body: bent(b, p, arch, crown, half, layers) @ d.turn.T)
        for body in d.bodies
    ]
    whole = d.often(0.7)
    per = 1.0 if whole else 1 / (width * SMALL)
    known = all(body.shape != "wedge" or not body.quadratic for body in d.bodies)
    suffix = ".msh" if d.often(0.4) and known else ".inp"
    ties, d.said = d.said, [f'kind = "mesh"\ntitle = "{title}: {kind}"']
    d.say(
        "[mesh]",
        file=f"joint{suffix}",
        length_unit="mm",
        width="whole" if whole else f"{width!r} mm",
        modes=25,
    )
    d.said += ties
    moduli = [d.any.choice(list(METALS)) for _ in range(3)]
    same = d.often(0.5)
    for body in d.bodies:
        E = moduli[0] if same else moduli[d.bodies.index(body) % 3]
        d.say(
            "[[material]]", elements=[body.name], youngs_modulus=E,
            poissons_ratio=round(d.any.uniform(0.2, 0.4), 3), density=METALS[E],
        )  # fmt: skip
    contacts(d, layers, thick)
    area = 2 * half * width * SMALL**2
    force = d.log(2e6, 3e7) * min(moduli) / 210e9 * area / bolts.count
    bolts.say(d, layers, force, per, push=unsound == "a bolt that pushes")
    supports(d, ends, layers, per, moduli[0], thick[0])
    key = load(d, layers, ends)
    d.say("[damping]", ratios=[d.log(1e-3, 1e-2)], modes=[1])
    outputs(d, layers, ends)
    text = "\n\n".join(d.said) + "\n"
    write = gmsh_file if suffix == ".msh" else deck
    return MeshedJoint(
        text, write(d.bodies, d.sets), f"joint{suffix}", key, d.log(0.02, 0.5), unsound
    )


@dataclass(frozen=True)
class Layer:
    """A plate: its body, where it is, and which end of it is far from the joint."""

    name: str
    x: tuple[float, float]
    z: tuple[float, float]
    far: float
    faces: tuple[str, ...]
    level: int


def stacked(kind: str, half: float, reach: float, thick: list[float], lift: float) -> list[Layer]:
    """Plates of a joint from below, the first one always on the left; `faces` are the sides in contact."""
    a, b, c = thick
    left, right = (-reach, half), (-half, reach)
    if kind == "lap":
        return [
            Layer("LOWER", left, (-a, 0.0), -reach, ("TOP",), 0),
            Layer("UPPER", right, (lift, lift + b), reach, ("BOTTOM",), 1),
        ]
    if kind == "fork":
        return [
            Layer("LOWER", left, (-a, 0.0), -reach, ("TOP",), 0),
            Layer("MIDDLE", right, (0.0, b), reach, ("BOTTOM", "TOP"), 1),
            Layer("UPPER", left, (lift + b, lift + b + c), -reach, ("BOTTOM",), 2),
        ]
    slit = 0.04 * half
    return [
        Layer("LEFT", (-reach, -slit), (-a, 0.0), -reach, ("TOP",), 0),
        Layer("RIGHT", (slit, reach), (-a, 0.0), reach, ("TOP",), 0),
        Layer("STRAP", (-half, half), (lift, lift + b), 0.0, ("BOTTOM",), 1),
    ]


@dataclass(frozen=True)
class Bolts:
    """Bolts: where, and how they are said."""

    centres: tuple[tuple[float, float], ...]
    washer: float
    how: str
    ordered: bool

    @property
    def count(self) -> int:
        """How many."""
        return len(self.centres)

    @property
    def meshed(self) -> bool:
        """Whether they are bodies."""
        return self.how == "section"

    @classmethod
    def drawn(cls, d: Draw, kind: str, half: float, width: float) -> Bolts:
        """Draw them."""
        how = d.any.choices(
            ["force", "stiffness", "shortening", "pressure", "section"], [5, 2, 1, 2, 2]
        )[0]
        count = d.any.choice([1, 2, 3])
        if how == "section":
            count = min(count, 2)
        if kind == "strap":
            count = 2
        if count == 1:
            centres = [(0.0, 0.0)]
        elif kind == "strap" or d.often(0.5):
            step = (half if kind == "strap" else 1.4 * half) / (count - 1)
            centres = [(step * (k - (count - 1) / 2), 0.0) for k in range(count)]
        else:
            step = 0.66 * width / (count - 1)
            centres = [(0.0, step * (k - (count - 1) / 2)) for k in range(count)]
        room = min(
            [0.8 * half if kind != "strap" else 0.4 * half, 0.4 * width]
            + ([0.4 * step] if count > 1 else [])
        )
        room = min(
            room,
            *(0.9 * (half - abs(x)) for x, _ in centres),
            *(0.9 * (width / 2 - abs(y)) for _, y in centres),
        )
        return cls(
            tuple(centres), room * d.any.uniform(0.55, 0.95), how, count > 1 and d.often(0.4)
        )

    def marks(self, axis: int, scale: float) -> list[float]:
        """Lines that the mesh of a plate has, around the bolts."""
        sizes = [self.washer * scale] + ([0.5 * self.washer] if self.meshed else [])
        return [c[axis] + side * size for c in self.centres for size in sizes for side in (-1, 1)]

    def holed(self, centre: np.ndarray) -> bool:
        """Whether a place lies in a hole."""
        r = 0.5 * self.washer
        return self.meshed and any(
            max(abs(centre[0] - x), abs(centre[1] - y)) < r for x, y in self.centres
        )

    def say(self, d: Draw, layers: list[Layer], force: float, per: float, push: bool) -> None:
        """Sections of the joint file."""
        down = d.along((0, 0, 1) if push else (0, 0, -1))
        way = down if push or d.often(0.7) else None
        if self.how == "pressure":
            on = [f"{side}_{k}" for k in range(self.count) for side in ("HEAD", "NUT")]
            area = (2 * self.washer) ** 2 * SMALL**2
            d.say(
                "[[preload]]", name="washers", on=on, pressure=(force / area if not push else 1.0)
            )
            return
        for k in range(self.count):
            own = force * d.any.uniform(0.6, 1.4)
            keys: dict[str, object] = {
                "name": f"bolt_{k}",
                "order": k + 1 if self.ordered else None,
            }
            if self.how == "section":
                d.say("[[preload]]", **keys, section=f"SHANK_{k}", force=own * per)
                continue
            keys |= {"on": [f"HEAD_{k}", f"NUT_{k}"], "direction": way}
            high = max(layer.z[1] for layer in layers) - min(layer.z[0] for layer in layers)
            stiffness = 210e9 * (self.washer * SMALL) ** 2 / (high * SMALL)
            if self.how == "force":
                keys["force"] = own * per
            else:
                keys["stiffness"] = stiffness * per
                keys |= (
                    {"force": own * per}
                    if self.how == "stiffness"
                    else {"shortening": 2.5 * own / stiffness}
                )
            d.say("[[preload]]", **keys)


def make_bodies(
    d: Draw, layers: list[Layer], bolts: Bolts, half: float, width: float, arched: bool
) -> None:
    """Mesh the plates."""
    high = max(layer.level for layer in layers)
    shape, quadratic = d.any.choices(list(MESHES), list(MESHES.values()))[0]
    alike = d.often(0.6)
    matching = d.often(0.4)
    coarse = {2: 1.0 if bolts.count == 1 else 1.2, 3: 2.5}[len(layers)]
    size = half * (0.75 if quadratic else 0.45) * coarse
    for n, layer in enumerate(layers):
        if n and not alike:
            shape, quadratic = d.any.choices(list(MESHES), list(MESHES.values()))[0]
        finer = 1.0 if matching else 1.0 - 0.22 * n
        washer = 1.0 if matching or bolts.meshed or arched else 1.0 - 0.12 * n
        (x0, x1), (z0, z1) = layer.x, layer.z
        inner = sorted(x for x in {*bolts.marks(0, washer), -half, half} if x0 <= x <= x1)
        far = lines([x0, inner[0]], (half + x1 - x0) / 5)[:-1] if x0 < inner[0] else []
        after = lines([inner[-1], x1], (half + x1 - x0) / 5)[1:] if x1 > inner[-1] else []
        x = np.concatenate([far, lines(inner, size if arched else size * finer), after])
        y = lines(sorted({-width / 2, *bolts.marks(1, washer), width / 2}), size * finer)
        z = np.array([z0, z1]) if quadratic or d.often(0.6) else np.array([z0, 0.5 * (z0 + z1), z1])
        places: dict[str, Box] = {}
        side = (-width / 2, width / 2)
        lap = (max(x0, -half), min(x1, half))
        for face in layer.faces:
            level = z1 if face == "TOP" else z0
            places[f"{layer.name}_{face}"] = (lap, side, (level, level))
        for k, (cx, cy) in enumerate(bolts.centres):
            r = bolts.washer * washer
            spot = ((cx - r, cx + r), (cy - r, cy + r))
            if layer.level == high and lap[0] <= cx <= lap[1]:
                places[f"HEAD_{k}"] = (*spot, (z1, z1))
            if layer.level == 0 and lap[0] <= cx <= lap[1]:
                places[f"NUT_{k}"] = (*spot, (z0, z0))
        if layer.far:
            places[f"{layer.name}_END"] = ((layer.far, layer.far), side, (z0, z1))
            d.sets[f"{layer.name}_EDGE"] = (layer.name, ((layer.far, layer.far), side, (z0, z0)))
            d.sets[f"{layer.name}_NODES"] = (layer.name, ((layer.far, layer.far), side, (z0, z1)))
            beyond = (x0, -half) if layer.far < 0 else (half, x1)
            places[f"{layer.name}_SIDE"] = (beyond, side, (z1, z1))
        d.bodies.append(box(layer.name, shape, quadratic, (x, y, z), places, bolts.holed))


def add_bolts(d: Draw, bolts: Bolts, layers: list[Layer]) -> None:
    """Mesh the bolts, and tie heads and nuts to the plates."""
    w = bolts.washer
    bottom, top = min(layer.z[0] for layer in layers), max(layer.z[1] for layer in layers)
    for k, (cx, cy) in enumerate(bolts.centres):
        out, shank = w, 0.42 * w
        across = [np.array([c - out, c - shank, c + shank, c + out]) for c in (cx, cy)]
        middle = 0.5 * (bottom + top)
        z = np.array([bottom - 0.5 * w, bottom, middle, top, top + 0.5 * w])

        def clear(p: np.ndarray, x: float = cx, y: float = cy, s: float = shank) -> bool:
            return bottom < p[2] < top and max(abs(p[0] - x), abs(p[1] - y)) > s

        spot = ((cx - out, cx + out), (cy - out, cy + out))
        places = {f"HEAD_RING_{k}": (*spot, (top, top)), f"NUT_RING_{k}": (*spot, (bottom, bottom))}
        cut: dict[str, Box] = {f"SHANK_{k}": (*spot, (middle, middle))}
        d.bodies.append(box(f"BOLT_{k}", "hex", True, (*across, z), places, clear, cut))
        d.say("[[tie]]", slave=f"HEAD_RING_{k}", master=f"HEAD_{k}")
        d.say("[[tie]]", slave=f"NUT_RING_{k}", master=f"NUT_{k}")


def shaken(d: Draw, body: Body, share: float) -> Body:
    """Nodes moved at random by a share of the pieces, along the outside where they are on it."""
    if body.name.startswith("BOLT"):
        return body
    points = body.place.copy()
    for axis in range(3):
        own = body.place[:, axis]
        levels = np.unique(own)
        inside = (own > levels[0]) & (own < levels[-1])
        least = float(np.diff(levels).min())
        for n in np.flatnonzero(inside):
            points[n, axis] += share * least * d.any.uniform(-1, 1)
    return body.moved(lambda old: points)


def bent(
    body: Body, points: np.ndarray, arch: float, crown: float, half: float, layers: list[Layer]
) -> np.ndarray:
    """Arched as a whole, and the upper body crowned below: its middle or its edges stand out."""
    found = points.copy()
    if body.name in ("UPPER", "STRAP") and crown:
        bottom = body.place[:, 2] == next(layer.z[0] for layer in layers if layer.name == body.name)
        x = np.clip(points[bottom, 0] / half, -1, 1)
        found[bottom, 2] += crown * (x**2 if crown > 0 else x**2 - 1)
    found[:, 2] += arch * points[:, 0] ** 2
    return found


def contacts(d: Draw, layers: list[Layer], thick: list[float]) -> None:
    """Interfaces."""
    if len(layers) == 2:
        couples = [("LOWER_TOP", "UPPER_BOTTOM")]
    elif layers[1].name == "MIDDLE":
        couples = [("LOWER_TOP", "MIDDLE_BOTTOM"), ("MIDDLE_TOP", "UPPER_BOTTOM")]
    else:
        couples = [("LEFT_TOP", "STRAP_BOTTOM"), ("RIGHT_TOP", "STRAP_BOTTOM")]
    friction = d.log(0.1, 0.8)
    elastic = d.log(1e12, 1e14) if d.often(0.4) else None
    both = d.often(0.5)
    gap = (
        d.any.choice([-1, 1]) * d.log(0.1e-6, 3e-6) if len(couples) == 2 and d.often(0.3) else None
    )
    for k, (first, second) in enumerate(couples):
        if d.often(0.5):
            first, second = second, first
        d.say(
            "[[interface]]", name=f"contact_{k}", first=first, second=second,
            friction=round(friction if k == 0 else d.log(0.1, 0.8), 4),
            gap=gap if k else None,
            tangential_stiffness=elastic, normal_stiffness=elastic if both else None,
        )  # fmt: skip


def supports(
    d: Draw, ends: str, layers: list[Layer], per: float, modulus: float, thick: float
) -> None:
    """What holds the joint."""
    left = [layer.name for layer in layers if layer.far < 0]
    right = next(layer.name for layer in layers if layer.far > 0)
    if ends in ("cantilever", "both", "sprung"):
        d.say("[[support]]", on=[f"{name}_END" for name in left])
    if ends == "both":
        d.say("[[support]]", on=[f"{right}_END"])
    if ends == "hinged":
        d.say("[[support]]", on=[f"{name}_EDGE" for name in (*left, right)])
    if ends == "sprung":
        total = modulus * thick * SMALL * d.log(1e-4, 1e-1) * per
        for axis in "xyz":
            d.say("[[spring]]", on=[f"{right}_END"], direction=axis, total=total)


def load(d: Draw, layers: list[Layer], ends: str) -> str:
    """The port that drives it; its key in ``[load]``."""
    left = next(layer.name for layer in layers if layer.far < 0)
    right = next(layer.name for layer in layers if layer.far > 0)
    if ends == "free":
        axis = d.any.choices([(0, 1, 0), (0, 0, 1)], [3, 1])[0]
        d.say(
            "[[port]]", name="drive", kind="moment", on=f"{right}_END", opposite=f"{left}_END",
            direction=d.along(axis),
        )  # fmt: skip
        return "moment"
    kinds = ["force", "moment", "pressure", "base"]
    kind = d.any.choices(kinds, [5, 2, 2, 2])[0]
    sway = [(0, 0, 1), (0, 1, 0), (1, 0, 0), (0.3, 0.2, 1)]
    direction = d.any.choices(sway, [5, 1, 1, 2])[0]
    on = f"{right}_SIDE" if ends in ("both", "hinged") or kind == "pressure" else f"{right}_END"
    if kind == "moment":
        twists = (1, 0, 0) if on.endswith("SIDE") or d.often(0.5) else (0, 0, 1)
        direction = (0, 1, 0) if d.often(0.75) else twists
        if direction == (1, 0, 0) and on.endswith("END"):
            on = f"{right}_NODES"
    if kind == "pressure":
        d.say("[[port]]", name="drive", kind="pressure", on=on)
    elif kind == "base":
        d.say("[[port]]", name="drive", kind="base", direction=d.along(direction))
    else:
        d.say("[[port]]", name="drive", kind=kind, on=on, direction=d.along(direction))
    return {"base": "acceleration"}.get(kind, kind)


def outputs(d: Draw, layers: list[Layer], ends: str) -> None:
    """What is reported, reactions along every axis among it."""
    right = next(layer.name for layer in layers if layer.far > 0)
    d.say("[[output]]", name="out", on=f"{right}_SIDE", direction=d.along((0, 0, 1)))
    held = [
        layer.name
        for layer in layers
        if layer.far and (layer.far < 0 or ends in ("both", "hinged"))
    ]
    if ends == "free":
        return
    place = "EDGE" if ends == "hinged" else "END"
    for name in held:
        for axis in "xyz":
            d.say(
                "[[output]]", name=f"hold_{name.lower()}_{axis}", quantity="reaction", on=f"{name}_{place}",
                direction=axis,
            )  # fmt: skip


if __name__ == "__main__":
    chosen, total, out = int(sys.argv[1]), int(sys.argv[2]), Path(sys.argv[3])
    for index, each in enumerate(joints(chosen, total)):
        each.write(out, f"joint_{index:03d}", "\n[analysis.cycle]\ncount = 6\nsteps = 60\n")
