"""The structure of a joint from a mesh that its description names.

Names of the mesh become supports, ties, interfaces, loads and outputs (`microslip.model.meshed`). A spatial
structure of width w is divided by it,

    K -> K / w,   M -> M / w,   area -> area / w,   -M e -> -M e / w (base),   unit loads as they are,

so that loads, reactions and energies are per metre of width, and displacements, pressures and frequencies
are what they are. A plane mesh is one metre wide.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from microslip.describe.matrices import FORCES, LENGTHS
from microslip.describe.mesh import MeshInterface, MeshJoint, MeshOutput, MeshPort, MeshPreload
from microslip.describe.profile import Profile
from microslip.errors import InputError, ModelError
from microslip.model.elasticity import Material
from microslip.model.imported import Imported
from microslip.model.mesh.assembly import assemble
from microslip.model.mesh.facets import facets_of
from microslip.model.mesh.finite_elements import FiniteElementMesh, Tie
from microslip.model.mesh.loads import (
    moment_load,
    nodal_load,
    pressure_load,
    resultant_load,
    spring_stiffness,
)
from microslip.model.mesh.read import read_mesh
from microslip.model.mesh_in_words import (
    bodies_said,
    doubtful_materials,
    interface_said,
    names_of_motions,
)
from microslip.model.meshed import MeshedStructure, structure_from_mesh
from microslip.model.mortar.coupling import MortarCoupling, couple
from microslip.model.pair_table import Pairs
from microslip.model.soundness import zero_modes
from microslip.model.structure import Structure
from microslip.model.topography import gaps_from
from microslip.typing import Array, Indices

COMPONENTS = {"x": 0, "y": 1, "z": 2}
TURNS = {"rx": 0, "ry": 1, "rz": 2}
TOUCHING = 1e-9
"""Of the size of an interface: a smaller distance is rounding."""


def read_described_mesh(joint: MeshJoint) -> Imported:
    """Structure, contact pairs and loads of a joint from a mesh; again where the file has not changed.

    Raises
    ------
    InputError
        Where the file cannot be read, a name is not in it, or what is asked for is not known of it.
    """
    file = Path(joint.mesh.file)
    stats = [Path(name).stat() for name in joint.files]
    try:
        return _built(_Described(joint), tuple((s.st_mtime_ns, s.st_size) for s in stats))
    except ModelError as error:
        raise InputError(f"{file.name}: {error}") from None


class _Described:
    """A description, the same as another one in the same words."""

    def __init__(self, joint: MeshJoint) -> None:
        self.joint, self.text = joint, joint.model_dump_json()

    def __hash__(self) -> int:
        return hash(self.text)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Described) and self.text == other.text


@lru_cache(maxsize=1)
def _built(described: _Described, changed: tuple[tuple[int, int], ...]) -> Imported:
    joint = described.joint
    given = joint.mesh
    mesh = read_mesh(
        Path(given.file), length=LENGTHS[given.length_unit], force=FORCES[given.force_unit]
    )
    d = mesh.dimension
    width = _width(joint, d)
    ties = tuple(
        Tie(f"{tie.slave} to {tie.master}", tie.slave, tie.master, tie.tolerance)
        for tie in joint.tie
    )
    mesh = replace(mesh, ties=(*mesh.ties, *ties))
    materials = _materials(joint)
    couplings = [_coupled(mesh, entry) for entry in joint.interface]
    loads, preload = {}, {}
    for each in joint.preload:
        loads[each.name], preload[each.name] = _preload(mesh, each, width)
    for port in joint.port:
        if port.kind != "base":
            loads[port.name] = _port(mesh, port)
    for output in joint.measured:
        loads[output.port] = _output(mesh, output, couplings, joint)
    found = structure_from_mesh(
        _with_supports(mesh, joint),
        couplings,
        held=_held(joint, d),
        loads=loads,
        materials=materials,
        springs=_springs(mesh, joint),
    )
    structure = found.structure
    bases = {port.name: port for port in joint.port if port.kind == "base"}
    if bases:
        structure = replace(
            structure,
            loads={**structure.loads, **_bases(found, bases, materials, width)},
        )
    structure = _per_width(structure, width)
    _check_moved(structure, joint)
    zero = zero_modes(structure.stiffness, structure.mass, None)
    names = names_of_motions(found, zero.shapes)
    pairs = _pairs(joint, structure, couplings)
    facts = (
        ("bodies", "; ".join(bodies_said(found.mesh))),
        *(interface_said(entry, c) for entry, c in zip(joint.interface, couplings, strict=True)),
    )
    return Imported(
        structure=structure,
        pairs=pairs,
        numbering=None,
        preload=preload,
        zero_modes=names,
        first_frequency=zero.first,
        cautions=(*found.cautions, *([] if joint.material else doubtful_materials(mesh, given))),
        points=np.concatenate([c.points for c in couplings]),
        facts=facts,
        meshed=found,
    )


def _width(joint: MeshJoint, dimension: int) -> float:
    width = joint.mesh.width
    if dimension == 2:
        if width is not None:
            raise InputError("mesh.width: a plane mesh is one metre wide: remove it")
        return 1.0
    if width is None:
        raise InputError(
            "mesh.width is missing: loads and results of a spatial mesh are per metre of its width; "
            'with "1 m" they are the forces themselves'
        )
    _check_spatial_response(joint)
    return width


def _check_spatial_response(joint: MeshJoint) -> None:
    """Raise `InputError` where a response is asked for that spatial contact does not have."""
    response = joint.analysis.response
    if response is not None and response.method != "reduced":
        raise InputError(
            f'analysis.response.method = "{response.method}": is for plane meshes: take "reduced"'
        )


def _materials(joint: MeshJoint) -> dict[str, Material] | Material | None:
    """By element set, one for all, or None where the file has them."""
    out: dict[str, Material] = {}
    for entry in joint.material:
        material = Material(entry.youngs_modulus, entry.poissons_ratio, entry.density, entry.plane)
        if entry.elements is None:
            return material
        out |= dict.fromkeys(entry.elements, material)
    return out or None


def _with_supports(mesh: FiniteElementMesh, joint: MeshJoint) -> FiniteElementMesh:
    """The mesh with the nodes of supported surfaces as node sets."""
    surfaces = [name for each in joint.support for name in each.on if name not in mesh.node_sets]
    return replace(
        mesh,
        node_sets={**mesh.node_sets, **{name: _nodes(mesh, name) for name in surfaces}},
    )


def _nodes(mesh: FiniteElementMesh, name: str) -> Indices:
    """Nodes of a node set or of a surface.

    Raises
    ------
    ModelError
        Where the mesh has neither.
    """
    if name in mesh.node_sets:
        return mesh.nodes_of_set(name)
    if name in mesh.surfaces:
        return facets_of(mesh, name).nodes
    raise ModelError(
        f"there is no node set and no surface {name!r}; node sets: "
        f"{', '.join(mesh.node_sets) or 'none'}; surfaces: {', '.join(mesh.surfaces) or 'none'}"
    )


def _held(joint: MeshJoint, dimension: int) -> dict[str, list[int]]:
    """Components that supports hold, by node set."""
    held: dict[str, list[int]] = {}
    for support in joint.support:
        usual = "directions" not in support.model_fields_set
        own = []
        for word in support.directions:
            if word in COMPONENTS:
                component = COMPONENTS[word]
                if component < dimension:
                    own.append(component)
                elif not usual:
                    raise InputError("support.directions: a plane mesh has no direction z")
            elif dimension == 2 and word != "rz":
                raise InputError(f"support.directions: a plane mesh does not turn about {word[1]}")
            else:
                own.append(dimension + (TURNS[word] if dimension == 3 else 0))
        for name in support.on:
            held[name] = sorted({*held.get(name, []), *own})
    return held


def _springs(mesh: FiniteElementMesh, joint: MeshJoint) -> sp.csc_matrix | None:
    total = None
    for spring in joint.spring:
        axis = COMPONENTS[spring.direction]
        if axis >= mesh.dimension:
            raise InputError("spring.direction: a plane mesh has no direction z")
        for name in spring.on:
            part = spring_stiffness(mesh, name, spring.stiffness, axis)
            total = part if total is None else total + part
    return total


def _coupled(mesh: FiniteElementMesh, entry: MeshInterface) -> MortarCoupling:
    return couple(
        mesh,
        entry.first,
        entry.second,
        slave=entry.pairs_on,
        reach=entry.reach,
        overlap=entry.overlap,
    )


def _along(mesh: FiniteElementMesh, direction: Sequence[float] | None, where: str) -> Array:
    """A direction with the components of the mesh."""
    if direction is None:
        raise InputError(f"{where}: direction is missing: in space it is the axis")
    d = mesh.dimension
    if d == 2 and abs(direction[2]) > 0:
        raise InputError(f"{where}: direction: a plane mesh has no direction z")
    return np.asarray(direction[:d], dtype=float)


def _force(mesh: FiniteElementMesh, name: str, direction: Array) -> Array:
    """A unit force on a surface, spread evenly, or on a node set, shared by its nodes."""
    if name in mesh.surfaces:
        return resultant_load(mesh, name, direction)
    return nodal_load(mesh, _nodes(mesh, name), direction)


def _acting(
    mesh: FiniteElementMesh, name: str, turns: bool, direction: Sequence[float] | None, where: str
) -> Array:
    """A unit force or a unit moment on a named place."""
    if not turns:
        return _force(mesh, name, _along(mesh, direction, where))
    if mesh.dimension == 2:
        if direction is not None:
            raise InputError(
                f"{where}: direction: in the plane moments and rotations have none: remove it"
            )
        return moment_load(mesh, name)
    return moment_load(mesh, name, _along(mesh, direction, where))


def _preload(mesh: FiniteElementMesh, entry: MeshPreload, width: float) -> tuple[Array, float]:
    """Unit load and amplitude, per metre of width."""
    if entry.force is not None:
        first, second = entry.on
        if entry.direction is None:
            middles = [mesh.points[_nodes(mesh, name)].mean(axis=0) for name in entry.on]
            way = middles[1] - middles[0]
            if not np.linalg.norm(way) > 0:
                raise InputError(
                    f"preload {entry.name!r}: the middles of {first!r} and {second!r} are the same point: "
                    "give direction"
                )
        else:
            way = _along(mesh, entry.direction, f"preload {entry.name!r}")
        return _force(mesh, first, way) - _force(mesh, second, way), entry.force
    assert entry.pressure is not None
    for name in entry.on:
        mesh.surface(name)
    load = np.sum([pressure_load(mesh, name) for name in entry.on], axis=0)
    areas = [facets_of(mesh, name) for name in entry.on]
    area = float(np.mean([sum(float(f.areas(g).sum()) for g in f.groups) for f in areas]))
    # an amplitude is a force: the pressure over the mean of the areas
    return load / area, entry.pressure * area / width


def _port(mesh: FiniteElementMesh, port: MeshPort) -> Array:
    assert port.on is not None
    turns, where = port.kind == "moment", f"port {port.name!r}"
    load = _acting(mesh, port.on, turns, port.direction, where)
    if port.opposite is not None:
        load = load - _acting(mesh, port.opposite, turns, port.direction, where)
    return load


def _output(
    mesh: FiniteElementMesh,
    output: MeshOutput,
    couplings: Sequence[MortarCoupling],
    joint: MeshJoint,
) -> Array:
    where = f"output {output.name!r}"
    if not output.across:
        assert output.on is not None
        turns = output.measured.motion == "rotation"
        return _acting(mesh, output.on, turns, output.direction, where)
    assert output.at is not None
    d = mesh.dimension
    if len(output.at) != d:
        raise InputError(f"{where}: at has {len(output.at)} coordinates, the mesh {d}")
    point = np.array(output.at)
    among = [
        c
        for entry, c in zip(joint.interface, couplings, strict=True)
        if output.interface in (None, entry.name)
    ]
    apart = [np.linalg.norm(c.points - point, axis=1) for c in among]
    coupling = among[int(np.argmin([a.min() for a in apart]))]
    pair = int(np.argmin(np.linalg.norm(coupling.points - point, axis=1)))
    reach = float(np.ptp(coupling.points, axis=0).max())
    if np.linalg.norm(coupling.points[pair] - point) > 0.5 * reach:
        raise InputError(f"{where}: at lies farther from every contact pair than half an interface")
    rows = coupling.relative()[d * pair : d * (pair + 1)].toarray()
    if output.measured.motion == "gap":
        return np.asarray(-rows[0])
    if d == 2:
        return np.asarray(rows[1])
    way = coupling.tangents[pair] @ _along(mesh, output.direction, where)
    return np.asarray(way @ rows[1:])


def _bases(
    found: MeshedStructure,
    bases: dict[str, MeshPort],
    materials: dict[str, Material] | Material | None,
    width: float,
) -> dict[str, Array]:
    """Inertia of everything per unit acceleration of the base and width, also what couples to supports."""
    mesh = found.mesh
    mass = assemble(mesh, materials)[1]
    out = {}
    for name, port in bases.items():
        rigid = np.tile(_along(mesh, port.direction, f"port {name!r}"), len(mesh.points))
        extra = found.basis.shape[0] - len(rigid)
        out[name] = -(found.basis.T @ np.pad(mass @ rigid, (0, extra))) / width
    return out


def _per_width(structure: Structure, width: float) -> Structure:
    if width == 1.0:
        return structure
    interface = structure.interface
    return replace(
        structure,
        stiffness=(structure.stiffness / width).tocsc(),
        mass=(structure.mass / width).tocsc(),
        interface=replace(interface, area=interface.area / width),
        supports=None if structure.supports is None else (structure.supports / width).tocsc(),
    )


def _check_moved(structure: Structure, joint: MeshJoint) -> None:
    """Raise `InputError` where supports hold all of what a load acts on, or an output is of."""
    for port in joint.port:
        if not np.abs(structure.loads[port.name]).max(initial=0.0) > 0:
            raise InputError(f"port {port.name!r}: all that it acts on is held: it moves nothing")
    for output in joint.measured:
        if not np.abs(structure.loads[output.port]).max(initial=0.0) > 0:
            raise InputError(f"output {output.name!r}: what it is of is held: it does not move")


def _pairs(joint: MeshJoint, structure: Structure, couplings: Sequence[MortarCoupling]) -> Pairs:
    interface = structure.interface
    friction, gap, start = [], [], 0
    springs: dict[str, list[Array]] = {"normal_stiffness": [], "tangential_stiffness": []}
    for entry, coupling in zip(joint.interface, couplings, strict=True):
        own = interface.position[start : start + coupling.pairs]
        start += coupling.pairs
        mu = entry.friction
        friction.append(
            np.array([mu.at(x) for x in own])
            if isinstance(mu, Profile)
            else np.full(coupling.pairs, mu)
        )
        # what rounding leaves of surfaces that touch is no gap
        near = np.abs(coupling.gap) <= TOUCHING * np.ptp(coupling.points, axis=0).max()
        gap.append(np.where(near, 0.0, coupling.gap) + entry.gap)
        if entry.topography is not None:
            gap[-1] += gaps_from(entry.topography, coupling, LENGTHS[joint.mesh.length_unit])
        for key, values in springs.items():
            stiffness = getattr(entry, key)
            values.append(np.full(coupling.pairs, np.inf if stiffness is None else stiffness))
    return Pairs(
        position=interface.position,
        area=interface.area,
        gap=np.concatenate(gap),
        friction=np.concatenate(friction),
        stiffness={key: np.concatenate(values) for key, values in springs.items()},
        normals=np.concatenate([c.normal for c in couplings]),
        rows=1 + np.arange(interface.pairs),
    )
