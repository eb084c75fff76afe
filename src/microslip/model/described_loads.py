"""Loads and outputs that a joint from a mesh names: preload, ports, bases, and what is measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from microslip.describe.bolts import MeshPreload
from microslip.describe.mesh import MeshJoint, MeshOutput, MeshPort
from microslip.errors import Caution, InputError, ModelError
from microslip.model.bolts import Bolts, Tightening
from microslip.model.elasticity import Material
from microslip.model.mesh.assembly import assemble, material_of_elements
from microslip.model.mesh.bolts import MeshBolt, bolt_between, bolt_through
from microslip.model.mesh.constraints import Rotations, rotations_of, spins
from microslip.model.mesh.facets import facets_of
from microslip.model.mesh.finite_elements import FiniteElementMesh
from microslip.model.mesh.loads import (
    moment_load,
    nodal_load,
    nodal_moment,
    pressure_load,
    resultant_load,
    shared_mass,
)
from microslip.model.mesh.thermal import changes, check_expands
from microslip.model.meshed import MeshedStructure
from microslip.model.mortar.coupling import MortarCoupling
from microslip.model.structure import Structure
from microslip.typing import Array, Indices

AWAY = 0.9
"""Cosine above which the normals of two surfaces count as opposed."""

ASKEW = 0.999
"""Cosine between the normals and the line of the middles below which a caution is given: 2.5°."""


def nodes_named(mesh: FiniteElementMesh, name: str) -> Indices:
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


def direction_in(mesh: FiniteElementMesh, direction: Sequence[float] | None, where: str) -> Array:
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
    return nodal_load(mesh, nodes_named(mesh, name), direction)


def _acting(
    mesh: FiniteElementMesh, name: str, turns: bool, direction: Sequence[float] | None, where: str
) -> Array:
    """A unit force or a unit moment on a named place; (N,) with rotations on a reference node."""
    if not turns:
        return _force(mesh, name, direction_in(mesh, direction, where))
    if mesh.dimension == 2 and direction is not None:
        raise InputError(
            f"{where}: direction: in the plane moments and rotations have none: remove it"
        )
    axis = None if mesh.dimension == 2 else direction_in(mesh, direction, where)
    if name in mesh.surfaces:
        return moment_load(mesh, name, axis)
    nodes, rotations = np.unique(nodes_named(mesh, name)), rotations_of(mesh)
    if len(nodes) == 1 and nodes[0] in rotations.nodes:
        return _turned(rotations, int(nodes[0]), axis)
    return nodal_moment(mesh, nodes, axis)


def _turned(rotations: Rotations, node: int, axis: Array | None) -> Array:
    """(N,) unit moment on a reference node, which its own rotations do the work of."""
    out = np.zeros(rotations.dofs)
    out[rotations.of(node)] = 1.0 if axis is None else axis / np.linalg.norm(axis)
    return out


def _difference(mesh: FiniteElementMesh, first: Array, second: Array) -> Array:
    """One load less another, of which some have rotations of reference nodes."""
    dofs = rotations_of(mesh).dofs
    return np.pad(first, (0, dofs - len(first))) - np.pad(second, (0, dofs - len(second)))


def with_masses(mesh: FiniteElementMesh, joint: MeshJoint) -> FiniteElementMesh:
    """The mesh with the masses that the description adds, at nodes."""
    masses = dict(mesh.masses)
    for entry in joint.mass:
        nodes = nodes_named(mesh, entry.on)
        surface = entry.on if entry.on in mesh.surfaces else None
        if surface is not None:
            nodes = facets_of(mesh, surface).nodes
        for node, share in zip(nodes, shared_mass(mesh, nodes, surface), strict=True):
            masses[int(node)] = masses.get(int(node), 0.0) + entry.mass * float(share)
    return replace(mesh, masses=masses)


def bolted(
    mesh: FiniteElementMesh, preloads: Sequence[MeshPreload], width: float
) -> tuple[FiniteElementMesh, list[MeshBolt]]:
    """The mesh with a coordinate for every bolt that is cut or keeps its length, and these bolts."""
    bolts = []
    for entry in preloads:
        if entry.section is not None:
            mesh, bolt = bolt_through(mesh, entry.name, entry.section, entry.keeps_length)
        elif entry.keeps_length:
            stiffness = None if entry.stiffness is None else entry.stiffness * width
            mesh, bolt = bolt_between(mesh, entry.name, _pull(mesh, entry), stiffness)
        else:
            continue
        bolts.append(bolt)
    return mesh, bolts


def constant_preload(
    mesh: FiniteElementMesh, entry: MeshPreload, width: float
) -> tuple[Array, float]:
    """Unit load and amplitude per metre of width, of a constant pair of forces or pressure."""
    if entry.force is not None:
        return _pull(mesh, entry), entry.force
    assert entry.pressure is not None
    assert entry.on is not None
    for name in entry.on:
        mesh.surface(name)
    load = np.sum([pressure_load(mesh, name) for name in entry.on], axis=0)
    areas = [facets_of(mesh, name) for name in entry.on]
    area = float(np.mean([sum(float(f.areas(g).sum()) for g in f.groups) for f in areas]))
    # an amplitude is a force: the pressure over the mean of the areas
    return load / area, entry.pressure * area / width


def temperature_changes(
    mesh: FiniteElementMesh,
    preloads: Sequence[MeshPreload],
    materials: Mapping[str, Material] | Material | None,
    area: float,
    width: float,
) -> tuple[dict[str, Array], dict[str, float]]:
    """Changes of temperature of every element per unit amplitude, and amplitudes per metre of width.

    As of other loads the amplitude is a force: the stress with which what changes most would press if
    it could not expand along one direction, over the area of the contact.
    """
    given, of = material_of_elements(mesh, materials)
    stress = np.array([m.youngs_modulus * abs(m.thermal_expansion) for m in given])[of]
    unit, amplitude = {}, {}
    for entry in preloads:
        if entry.temperature is None:
            continue
        change = changes(mesh, entry.on, entry.temperature)
        check_expands(mesh, change, materials, entry.name)
        force = float((stress * np.abs(change)).max()) * area
        unit[entry.name], amplitude[entry.name] = change / force, force / width
    return unit, amplitude


def _pull(mesh: FiniteElementMesh, entry: MeshPreload) -> Array:
    """Unit forces that draw two places towards each other, or the one on a single place."""
    assert entry.on is not None
    first, *second = entry.on
    way = _axis(mesh, entry)
    load = _force(mesh, first, way)
    return load - _force(mesh, second[0], way) if second else load


def _axis(mesh: FiniteElementMesh, entry: MeshPreload) -> Array:
    """Direction of the force on the first place: that given, or against the mean normals of two surfaces that
    look away from each other, or along the line between the middles."""
    if entry.direction is not None:
        return direction_in(mesh, entry.direction, f"preload {entry.name!r}")
    line, normals = _line(mesh, entry), _normals(mesh, entry)
    return line if normals is None else normals


def _line(mesh: FiniteElementMesh, entry: MeshPreload) -> Array:
    """Unit vector from the middle of the first place to that of the second."""
    assert entry.on is not None
    middles = []
    for name in entry.on:
        if name in mesh.surfaces:
            shares = resultant_load(mesh, name, np.eye(mesh.dimension)[0])
            middles.append(shares.reshape(mesh.points.shape)[:, 0] @ mesh.points)
        else:
            middles.append(mesh.points[nodes_named(mesh, name)].mean(axis=0))
    way = middles[1] - middles[0]
    length = float(np.linalg.norm(way))
    if not length > 0:
        raise InputError(
            f"preload {entry.name!r}: the middles of {entry.on[0]!r} and {entry.on[1]!r} are the same point: "
            "give direction"
        )
    return np.asarray(way / length)


def _normals(mesh: FiniteElementMesh, entry: MeshPreload) -> Array | None:
    """Unit vector against the mean normal of the first and along that of the second surface; None where they
    are no surfaces, or do not look away from each other."""
    assert entry.on is not None
    if not all(name in mesh.surfaces for name in entry.on):
        return None
    outward = [
        -pressure_load(mesh, name).reshape(mesh.points.shape).sum(axis=0) for name in entry.on
    ]
    sizes = [float(np.linalg.norm(each)) for each in outward]
    if not min(sizes) > 0:
        return None
    first, second = (each / size for each, size in zip(outward, sizes, strict=True))
    if first @ second > -AWAY:
        return None
    way = second - first
    return np.asarray(way / np.linalg.norm(way))


def bolt_cautions(mesh: FiniteElementMesh, preloads: Sequence[MeshPreload]) -> list[Caution]:
    """That head and nut do not face each other along their normals, or that a direction is another."""
    out = []
    for entry in preloads:
        if entry.on is None or len(entry.on) != 2:
            continue
        if entry.force is None and entry.shortening is None:
            continue
        normals = _normals(mesh, entry)
        along = normals if normals is None else normals @ _axis_or_line(mesh, entry)
        if along is None or along >= ASKEW:
            continue
        angle, places = np.degrees(np.arccos(np.clip(along, -1.0, 1.0))), " and ".join(entry.on)
        if entry.direction is None:
            reason = (
                f"the line between the middles of {places} is {angle:.2g}° off their normals, along which "
                "the force is taken"
            )
            remedy = "give direction, and see whether both places are of one bolt"
        elif along <= -ASKEW:
            reason = f"its direction pulls {places} off what is under them, as a bolt turned round"
            remedy = (
                "reverse direction of a bolt, or leave it out; of a force that is meant to pull there, as a "
                "centrifugal one is, nothing is wrong, and it may act on one place alone"
            )
        else:
            reason = f"its direction is {angle:.3g}° off the normals of {places}, along which a bolt presses"
            remedy = "leave direction out, or see whether both places are of one bolt"
        out.append(Caution("mesh", f"preload {entry.name!r}", reason, remedy))
    return out


def _axis_or_line(mesh: FiniteElementMesh, entry: MeshPreload) -> Array:
    """The direction that is given, or the line between the middles."""
    return _line(mesh, entry) if entry.direction is None else _axis(mesh, entry)


def tightening_of(preloads: Sequence[MeshPreload], bolts: Bolts) -> Tightening:
    """In which order the preloads are applied, and what bolts that keep their length are tightened to."""
    keeping = [entry for entry in preloads if entry.name in bolts.names]
    # the parts are put together at the temperature from which it changes
    last = 1 + max((entry.order or 1 for entry in preloads if entry.temperature is None), default=0)
    return Tightening(
        bolts=bolts,
        order={
            entry.name: entry.order or (1 if entry.temperature is None else last)
            for entry in preloads
        },
        force={entry.name: entry.force for entry in keeping if entry.force is not None},
        shortening={
            entry.name: entry.shortening for entry in keeping if entry.shortening is not None
        },
    )


def port_load(mesh: FiniteElementMesh, port: MeshPort, width: float) -> Array:
    """Unit load of a port that is no base; a pressure acts per area, and so its forces are divided by the
    width that a structure is per metre of."""
    assert port.on is not None
    if port.kind == "pressure":
        load = pressure_load(mesh, port.on)
        if port.opposite is not None:
            load = load - pressure_load(mesh, port.opposite)
        return load / width
    turns, where = port.kind == "moment", f"port {port.name!r}"
    load = _acting(mesh, port.on, turns, port.direction, where)
    if port.opposite is not None:
        opposite = _acting(mesh, port.opposite, turns, port.direction, where)
        load = _difference(mesh, load, opposite)
    return load


def output_load(
    mesh: FiniteElementMesh,
    output: MeshOutput,
    couplings: Sequence[MortarCoupling],
    joint: MeshJoint,
) -> Array:
    """What an output is of the displacements of the mesh."""
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
        nearest = ", ".join(f"{1e3 * x:.4g} mm" for x in coupling.points[pair])
        raise InputError(
            f"{where}: at lies farther from every contact pair than half an interface; the nearest is at "
            f"({nearest}), and numbers without a unit are m"
        )
    rows = coupling.relative()[d * pair : d * (pair + 1)].toarray()
    if output.measured.motion == "gap":
        return np.asarray(-rows[0])
    if d == 2:
        return np.asarray(rows[1])
    way = coupling.tangents[pair] @ direction_in(mesh, output.direction, where)
    return np.asarray(way @ rows[1:])


def support_motion(mesh: FiniteElementMesh, output: MeshOutput) -> Array:
    """(N,) unit motion of the nodes that a reaction is of: along its direction, or a turn about its axis
    through their middle; with the turns of reference nodes."""
    assert output.on is not None
    where, d = f"output {output.name!r}", mesh.dimension
    nodes, rotations = np.unique(nodes_named(mesh, output.on)), rotations_of(mesh)
    at = d * nodes[:, None] + np.arange(d)
    out = np.zeros(rotations.dofs)
    if output.quantity == "reaction":
        out[at] = direction_in(mesh, output.direction, where)
        return out
    if d == 2 and output.direction is not None:
        raise InputError(f"{where}: direction: in the plane moments have none: remove it")
    axis = np.ones(1) if d == 2 else direction_in(mesh, output.direction, where)
    arms = mesh.points[nodes] - mesh.points[nodes].mean(axis=0)
    out[at] = spins(arms) @ axis
    for node in nodes[np.isin(nodes, rotations.nodes)]:
        out[rotations.of(int(node))] = axis
    return out


def with_bases(
    found: MeshedStructure,
    bases: dict[str, MeshPort],
    materials: dict[str, Material] | Material | None,
    width: float,
) -> Structure:
    """The structure with the inertia of everything per unit acceleration of bases and width as loads, also
    what couples to supports."""
    mesh, structure = found.mesh, found.structure
    mass = assemble(mesh, materials)[1]
    out, reactions = {}, dict(structure.reactions)
    for name, port in bases.items():
        rigid = np.tile(direction_in(mesh, port.direction, f"port {name!r}"), len(mesh.points))
        extra = found.basis.shape[0] - len(rigid)
        inertia = -np.pad(mass @ rigid, (0, extra)) / width
        out[name] = found.basis.T @ inertia
        for own, reaction in reactions.items():
            at_once = float(found.held_motions[own] @ inertia)
            reactions[own] = replace(reaction, loads={**reaction.loads, name: at_once})
    return replace(structure, loads={**structure.loads, **out}, reactions=reactions)
