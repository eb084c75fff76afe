"""The structure of a joint from a mesh that its description names.

Names of the mesh become supports, ties, interfaces, loads and outputs (`microslip.model.meshed`). A spatial
structure of width w is divided by it,

    K -> K / w,   M -> M / w,   area -> area / w,   -M e -> -M e / w (base),   unit loads as they are,

so that loads, reactions and energies are per metre of width, and displacements, pressures and frequencies
are what they are. A plane mesh is one metre wide.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from microslip.describe.matrices import FORCES, LENGTHS
from microslip.describe.mesh import MeshInterface, MeshJoint, MeshSpring
from microslip.describe.profile import Profile
from microslip.errors import InputError, ModelError
from microslip.model.described import Described, Stamps, stamps
from microslip.model.described_loads import (
    bolt_cautions,
    bolted,
    constant_preload,
    direction_in,
    nodes_named,
    output_load,
    port_load,
    support_motion,
    temperature_changes,
    tightening_of,
    with_bases,
    with_masses,
)
from microslip.model.described_names import check_names
from microslip.model.elasticity import Material
from microslip.model.imported import Imported
from microslip.model.mesh.constraints import rotations_of
from microslip.model.mesh.finite_elements import FiniteElementMesh, Tie
from microslip.model.mesh.loads import nodal_springs, spring_stiffness
from microslip.model.mesh.overlaps import check_apart
from microslip.model.mesh.read import read_mesh
from microslip.model.mesh_in_words import (
    bodies_said,
    coupled_said,
    doubtful_materials,
    doubtful_size,
    given_materials,
    interface_said,
    names_of_motions,
)
from microslip.model.meshed import held_dofs, structure_from_mesh
from microslip.model.mortar.bonded import bonded_cautions
from microslip.model.mortar.claims import Claim, check_claims
from microslip.model.mortar.coupling import MortarCoupling, couple
from microslip.model.mortar.flat import couple_with_flat
from microslip.model.mortar.supported import in_planes_of_symmetry
from microslip.model.pair_table import Pairs
from microslip.model.soundness import zero_modes
from microslip.model.spatial import check_spatial, width_said
from microslip.model.structure import Structure
from microslip.model.topography import gaps_from
from microslip.typing import Array, Mask

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
    try:
        return _built(Described(joint), stamps(joint.files))
    except ModelError as error:
        raise InputError(f"{file.name}: {error}") from None


@lru_cache(maxsize=1)
def _built(described: Described[MeshJoint], changed: Stamps) -> Imported:
    joint = described.joint
    given = joint.mesh
    mesh = read_mesh(
        Path(given.file), length=LENGTHS[given.length_unit], force=FORCES[given.force_unit]
    )
    check_names(mesh, joint)
    d = mesh.dimension
    width = _width(joint, d)
    ties = tuple(
        Tie(f"{tie.slave} to {tie.master}", tie.slave, tie.master, tie.tolerance, "[[tie]]")
        for tie in joint.tie
    )
    mesh = replace(mesh, ties=(*mesh.ties, *ties))
    materials = _materials(joint, d)
    bodies = bodies_said(mesh)
    whole = mesh
    mesh, bolts = bolted(with_masses(mesh, joint), joint.preload, width)
    supported = _with_supports(mesh, joint)
    held = _held_nodes(supported, _held(joint, d))
    couplings = [
        in_planes_of_symmetry(_coupled(mesh, entry), held, mesh.points) for entry in joint.interface
    ]
    check_claims(mesh, [_claim(mesh, entry) for entry in joint.interface], mesh.ties)
    check_apart(whole, _touching(whole, joint))
    loads, preload = {}, {}
    for each in joint.preload:
        if each.name in [bolt.name for bolt in bolts]:
            preload[each.name] = each.force or 0.0
        elif each.temperature is None:
            loads[each.name], preload[each.name] = constant_preload(mesh, each, width)
    area = float(sum(c.interface().area.sum() for c in couplings))
    warmed, stresses = temperature_changes(mesh, joint.preload, materials, area, width)
    for port in joint.port:
        if port.kind != "base":
            loads[port.name] = port_load(mesh, port, width)
    held_with = {}
    for output in joint.measured:
        if output.reacts:
            held_with[output.port] = support_motion(mesh, output)
        else:
            loads[output.port] = output_load(mesh, output, couplings, joint)
    found = structure_from_mesh(
        supported,
        couplings,
        held=_held(joint, d),
        loads=loads,
        materials=materials,
        springs=_springs(mesh, joint, width),
        bolts=bolts,
        temperatures=warmed,
        reactions=held_with,
    )
    structure = found.structure
    bases = {port.name: port for port in joint.port if port.kind == "base"}
    if bases:
        structure = with_bases(found, bases, materials, width)
    structure = _per_width(structure, width)
    _check_moved(structure, joint, mesh)
    zero = zero_modes(structure.stiffness, structure.mass, None)
    names = names_of_motions(found, zero.shapes)
    pairs = _pairs(joint, structure, couplings)
    plan = tightening_of(joint.preload, found.bolts.per_width(width))
    facts = (
        ("bodies", "; ".join(bodies)),
        *([] if d == 2 else width_said(joint)),
        *(interface_said(entry, c) for entry, c in zip(joint.interface, couplings, strict=True)),
    )
    return Imported(
        structure=structure,
        pairs=pairs,
        numbering=None,
        # of bolts that keep their length a first guess: amplitudes are found with the contact
        preload=preload | stresses | plan.amplitudes,
        zero_modes=names,
        first_frequency=zero.first,
        cautions=(
            *found.cautions,
            *bonded_cautions(couplings, found.bonded),
            *bolt_cautions(found.mesh, joint.preload),
            *(
                given_materials(joint.material)
                if joint.material
                else doubtful_materials(mesh, given)
            ),
            *doubtful_size(mesh, given),
        ),
        points=np.concatenate([c.points for c in couplings]),
        facts=facts,
        meshed=found,
        tightening=plan,
    )


def _width(joint: MeshJoint, dimension: int) -> float:
    if dimension == 3:
        check_spatial(joint)
    elif joint.given_width is not None:
        raise InputError("mesh.width: a plane mesh is one metre wide: remove it")
    return joint.width


def _materials(joint: MeshJoint, dimension: int) -> dict[str, Material] | Material | None:
    """By element set, one for all, or None where the file has them."""
    out: dict[str, Material] = {}
    for entry in joint.material:
        if dimension == 3 and entry.plane == "stress":
            raise InputError("material.plane: is of a plane mesh: remove it")
        material = Material(
            entry.youngs_modulus,
            entry.poissons_ratio,
            entry.density,
            entry.plane,
            entry.thermal_expansion,
        )
        if entry.elements is None:
            return material
        out |= dict.fromkeys(entry.elements, material)
    return out or None


def _with_supports(mesh: FiniteElementMesh, joint: MeshJoint) -> FiniteElementMesh:
    """The mesh with the nodes of supported surfaces as node sets."""
    surfaces = [name for each in joint.support for name in each.on if name not in mesh.node_sets]
    return replace(
        mesh,
        node_sets={**mesh.node_sets, **{name: nodes_named(mesh, name) for name in surfaces}},
    )


def _held(joint: MeshJoint, dimension: int) -> dict[str, list[int]]:
    """Components that supports hold, by node set."""
    held: dict[str, list[int]] = {}
    for support in joint.support:
        # stored joints have all keys: what is left out is told by its value
        usual = support.directions == ("x", "y", "z")
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


def _held_nodes(mesh: FiniteElementMesh, held: Mapping[str, Sequence[int]]) -> Mask:
    """(n, d) components of the nodes that do not move."""
    out = np.zeros(mesh.points.size, dtype=bool)
    dofs = held_dofs(mesh, held, rotations_of(mesh))
    out[dofs[dofs < out.size]] = True
    return out.reshape(mesh.points.shape)


def _spring(
    mesh: FiniteElementMesh, spring: MeshSpring, name: str, axis: int, width: float
) -> sp.csc_matrix:
    """Springs on one name."""
    if name in mesh.surfaces:
        if spring.total is None:
            assert spring.stiffness is not None
            return spring_stiffness(mesh, name, spring.stiffness, axis)
        whole = spring_stiffness(mesh, name, 1.0, axis)
        return (spring.total * width / whole.sum() * whole).tocsc()
    nodes = np.unique(nodes_named(mesh, name))
    if spring.total is None:
        raise InputError(
            f"spring.stiffness: {name!r} is a node set and has no area: give total, for all of it"
        )
    return nodal_springs(mesh, nodes, spring.total * width / len(nodes), axis)


def _springs(mesh: FiniteElementMesh, joint: MeshJoint, width: float) -> sp.csc_matrix | None:
    total = None
    for spring in joint.spring:
        axis = COMPONENTS[spring.direction]
        if axis >= mesh.dimension:
            raise InputError("spring.direction: a plane mesh has no direction z")
        for name in spring.on:
            part = _spring(mesh, spring, name, axis, width)
            total = part if total is None else total + part
    return total


def _coupled(mesh: FiniteElementMesh, entry: MeshInterface) -> MortarCoupling:
    if entry.second is None:
        return couple_with_flat(
            mesh,
            entry.first,
            direction_in(mesh, entry.flat, f"interface {entry.name!r}"),
            entry.offset,
            reach=entry.reach,
            overlap=entry.overlap,
        )
    return couple(
        mesh,
        entry.first,
        entry.second,
        slave=entry.pairs_on,
        reach=entry.reach,
        overlap=entry.overlap,
    )


def _claim(mesh: FiniteElementMesh, entry: MeshInterface) -> Claim:
    """Which facets an interface is of."""
    said = f"interface {entry.name!r}"
    if entry.second is not None:
        return Claim(said, (entry.first, entry.second), entry.reach)
    normal = direction_in(mesh, entry.flat, said)
    return Claim(said, (entry.first,), entry.reach, normal, entry.offset)


def _touching(mesh: FiniteElementMesh, joint: MeshJoint) -> set[str]:
    """Surfaces of contacts and ties."""
    names = {name for each in joint.interface for name in (each.first, each.second) if name}
    return names | {name for tie in mesh.ties for name in (tie.slave, tie.master)}


def _per_width(structure: Structure, width: float) -> Structure:
    if width == 1.0:
        return structure
    interface = structure.interface
    return replace(
        structure,
        stiffness=(structure.stiffness / width).tocsc(),
        mass=(structure.mass / width).tocsc(),
        loads={
            name: load / width if name in structure.reactions else load
            for name, load in structure.loads.items()
        },
        reactions={
            name: replace(each, mass=each.mass / width)
            for name, each in structure.reactions.items()
        },
        interface=replace(interface, area=interface.area / width),
        supports=None if structure.supports is None else (structure.supports / width).tocsc(),
    )


def _check_moved(structure: Structure, joint: MeshJoint, mesh: FiniteElementMesh) -> None:
    """Raise `InputError` where supports hold all of what a load acts on, or an output is of."""
    for port in joint.port:
        if not np.abs(structure.loads[port.name]).max(initial=0.0) > 0:
            raise InputError(
                f"port {port.name!r}: all that it acts on is held: it moves nothing"
                + coupled_said(mesh, port.on)
            )
    for output in joint.measured:
        if not np.abs(structure.loads[output.port]).max(initial=0.0) > 0:
            raise InputError(
                f"output {output.name!r}: what it is of is held: it does not move"
                + coupled_said(mesh, output.on)
            )


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
