"""Input deck for CalculiX: one layer of C3D8I hexahedra in plane strain, face-to-face contact.

The layer has two planes of nodes. Those behind follow those in front (`*EQUATION`), and none moves
across the layer, so the strain is plane exactly. The deck is in N, mm and MPa, which suits the
absolute tolerances of ccx (a correction below 1e-8 length units always counts as small). No number
is longer than 20 characters: ccx reads that many and drops the rest, an exponent too.

The first step puts on the clamp with next to no friction, as our prestress does. The next sets the
friction (`*CHANGE FRICTION`). Each load step of ours is one ``*STEP``, over which ccx ramps the moment
and which it may cut where it does not converge: as fixed increments of one long step some diverge.
"""

from __future__ import annotations

import io
from dataclasses import dataclass

import numpy as np

from microslip.errors import ModelError

MM = 1e3
"""Millimetres in a metre."""

NEVER = 1000000
"""Print every so many increments; the end of a step is always printed."""

NEXT_TO_NONE = 1e-9
"""Friction while the clamp is put on; *CHANGE FRICTION needs a friction to change."""


@dataclass(frozen=True)
class Loading:
    """What the deck imposes, SI per metre of width.

    Attributes
    ----------
    clamp : float
        P, N/m.
    moment : float
        Amplitude of the end moment, N m/m.
    spring : float
        Horizontal spring at each end, N/m per metre of width.
    friction : float
    normal_stiffness, tangential_stiffness : float
        Penalty stiffnesses, N/m³.
    steps, cycles : int
        Increments per cycle, and cycles.
    force_tolerance : float
        Largest residual force over the mean force; CalculiX's own default is 5e-3.
    """

    clamp: float
    moment: float
    spring: float
    friction: float
    normal_stiffness: float
    tangential_stiffness: float
    steps: int = 60
    cycles: int = 2
    force_tolerance: float = 1e-5


def write_deck(joint, material, loading, *, layer_mm=1.0):
    """Text of the input deck.

    Parameters
    ----------
    joint : LinearJoint
    material : microslip.model.elasticity.Material
        Plane strain.
    loading : Loading
    layer_mm : float
        Thickness of the layer.

    Raises
    ------
    ModelError
        Where CalculiX cannot pose the problem.
    """
    if material.plane != "strain":
        raise ModelError("a layer held between two planes is in plane strain: material.plane")
    if not loading.friction > 0:
        raise ModelError("ccx changes a friction only to another above 0: contact.friction")
    out = io.StringIO()
    force = layer_mm / MM
    _mesh(out, joint, layer_mm)
    _springs(out, joint, loading.spring * layer_mm / MM**2)
    interaction(out, loading)
    print(
        "*MATERIAL, NAME=BEAM\n*ELASTIC\n"
        f"{material.youngs_modulus / MM**2:.12g}, {material.poissons_ratio:.12g}\n"
        "*SOLID SECTION, ELSET=BEAMS, MATERIAL=BEAM",
        file=out,
    )
    print("*BOUNDARY\nALL, 3, 3", file=out)
    for node in joint.supported + 1:
        print(f"{node}, 2, 2", file=out)
    for step, (friction, factor) in enumerate(load_path(loading)):
        print("*STEP, NLGEOM=NO, INC=1000\n*STATIC\n1., 1., 1e-4, 1.", file=out)
        controls(out, loading)
        if step == 0:
            print("*CLOAD", file=out)
            _forces(out, joint.clamp * loading.clamp * force)
        else:
            print("*CHANGE FRICTION, INTERACTION=JOINT\n*FRICTION", file=out)
            print(f"{friction:.12g}, {loading.tangential_stiffness / MM**3:.12g}", file=out)
            print("*CLOAD", file=out)
            _forces(out, joint.moment * loading.moment * force, factor)
        print(f"*NODE PRINT, NSET=WATCH, FREQUENCY={NEVER}\nU\n*END STEP", file=out)
    return out.getvalue()


def _mesh(out, joint, layer_mm):
    count = len(joint.nodes)
    print("*HEADING\nLap joint, one layer in plane strain; N, mm, MPa\n*NODE, NSET=ALL", file=out)
    for plane, z in ((0, 0.0), (count, layer_mm)):
        for number, (x, y) in enumerate(joint.nodes * MM, 1 + plane):
            print(f"{number}, {x:.12g}, {y:.12g}, {z:.12g}", file=out)
    print("*ELEMENT, TYPE=C3D8I, ELSET=BEAMS", file=out)
    for number, quad in enumerate(joint.quads + 1, 1):
        print(", ".join(str(k) for k in (number, *quad, *(quad + count))), file=out)
    print("*EQUATION", file=out)
    for node in range(1, count + 1):
        for direction in (1, 2):
            print(f"2\n{node + count}, {direction}, 1., {node}, {direction}, -1.", file=out)
    for name, faces, face in (
        ("SLAVE", joint.lower_faces, "S5"),
        ("MASTER", joint.upper_faces, "S3"),
    ):
        print(f"*SURFACE, NAME={name}, TYPE=ELEMENT", file=out)
        for element in faces + 1:
            print(f"{element}, {face}", file=out)
    watched = np.unique(np.r_[joint.end_nodes, joint.lower_nodes, joint.upper_nodes]) + 1
    print("*NSET, NSET=WATCH", file=out)
    listed(out, watched)


def _springs(out, joint, stiffness):
    """One spring to ground in x at each end node: `stiffness` is that of a whole end, N/mm."""
    first = len(joint.quads) + 1
    for number, node in enumerate(joint.end_nodes, first):
        print(f"*ELEMENT, TYPE=SPRING1, ELSET=SPRING{number}\n{number}, {node + 1}", file=out)
        print(f"*SPRING, ELSET=SPRING{number}\n1\n{stiffness * joint.spring[node]:.12g}", file=out)


def interaction(out, loading):
    """Penalty contact between the surfaces SLAVE and MASTER, with next to no friction."""
    print("*SURFACE INTERACTION, NAME=JOINT", file=out)
    print("*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", file=out)
    print(f"{loading.normal_stiffness / MM**3:.12g}\n*FRICTION", file=out)
    print(f"{NEXT_TO_NONE:.12g}, {loading.tangential_stiffness / MM**3:.12g}", file=out)
    print("*CONTACT PAIR, INTERACTION=JOINT, TYPE=SURFACE TO SURFACE\nSLAVE, MASTER", file=out)


def load_path(loading):
    """Friction and factor on the end moment at the end of each ``*STEP``, the clamp's first."""
    theta = 2 * np.pi * np.arange(loading.steps * loading.cycles + 1) / loading.steps
    return [
        (loading.friction if k else NEXT_TO_NONE, float(factor))
        for k, factor in enumerate(np.sin(theta))
    ]


def controls(out, loading):
    """How exactly equilibrium is asked for: of the first nine iterations, and of later ones, where ccx would
    else be content with 2 % of the mean force."""
    tolerance = f"{loading.force_tolerance:.12g}"
    print(f"*CONTROLS, PARAMETERS=FIELD\n{tolerance}, 1e-2, , , {tolerance}", file=out)


def _forces(out, forces, factor=1.0):
    for node, direction in np.argwhere(forces):
        print(f"{node + 1}, {direction + 1}, {factor * forces[node, direction]:.12g}", file=out)


def listed(out, numbers):
    """Numbers, twelve to a line."""
    for start in range(0, len(numbers), 12):
        print(", ".join(map(str, numbers[start : start + 12])), file=out)
