"""What keywords and element types of Abaqus and CalculiX are to this program."""

from __future__ import annotations

from dataclasses import dataclass

from microslip.model.mesh.finite_elements import FULL, INCOMPATIBLE


@dataclass(frozen=True)
class Solid:
    """How an element type of a deck is computed.

    Attributes
    ----------
    kind : str
        Name of the `ElementType`.
    plane : str or None
        ``"stress"`` or ``"strain"``.
    formulation : str
    remark : str
        What is computed otherwise than the name says; empty where nothing is.
    skin : bool
        Whether it is no body: programs write the faces of bodies so that a group names.
    """

    kind: str
    plane: str | None = None
    formulation: str = FULL
    remark: str = ""
    skin: bool = False


REDUCED = "reduced integration is not used: integrated fully"
HOURGLASS = "reduced integration needs artificial stiffness: computed with incompatible modes"
MODIFIED = "the modified formulation is computed as the ordinary quadratic one"


def _plane(letter: str, plane: str) -> dict[str, Solid]:
    c = f"CP{letter}"
    return {
        f"{c}3": Solid("tri3", plane),
        f"{c}6": Solid("tri6", plane),
        f"{c}6M": Solid("tri6", plane, remark=MODIFIED),
        f"{c}4": Solid("quad4", plane),
        f"{c}4I": Solid("quad4", plane, INCOMPATIBLE),
        f"{c}4R": Solid("quad4", plane, INCOMPATIBLE, HOURGLASS),
        f"{c}8": Solid("quad8", plane),
        f"{c}8R": Solid("quad8", plane, remark=REDUCED),
    }


SOLIDS: dict[str, Solid] = {
    **_plane("S", "stress"),
    **_plane("E", "strain"),
    "C3D4": Solid("tet4"),
    "C3D10": Solid("tet10"),
    "C3D10M": Solid("tet10", remark=MODIFIED),
    "C3D10T": Solid("tet10"),
    "C3D6": Solid("wedge6"),
    "C3D15": Solid("wedge15"),
    "C3D8": Solid("hex8"),
    "C3D8I": Solid("hex8", formulation=INCOMPATIBLE),
    "C3D8R": Solid("hex8", formulation=INCOMPATIBLE, remark=HOURGLASS),
    "C3D20": Solid("hex20"),
    "C3D20R": Solid("hex20", remark=REDUCED),
}
"""Element types that are understood, beside MASS."""

SKINS: dict[str, Solid] = {
    name: Solid(kind, skin=True)
    for kind, names in {
        "line2": ("T3D2", "T2D2"),
        "line3": ("T3D3", "T2D3"),
        "tri3": ("M3D3", "S3", "S3R", "SFM3D3"),
        "tri6": ("M3D6", "S6", "STRI65", "SFM3D6"),
        "quad4": ("M3D4", "M3D4R", "S4", "S4R", "SFM3D4", "SFM3D4R"),
        "quad8": ("M3D8", "M3D8R", "S8", "S8R", "SFM3D8", "SFM3D8R"),
    }.items()
    for name in names
}
"""Element types that are understood where they lie on bodies and have no section of their own; so are plane
ones beside solid ones."""

SILENT = {
    "HEADING",
    "PREPRINT",
    "RESTART",
    "FILE FORMAT",
    "ORIENTATION",
    "END PART",
    "END INSTANCE",
    "END ASSEMBLY",
}
"""Keywords that change nothing of an isotropic elastic structure at one temperature."""

FROM_JOINT_FILE = {
    "AMPLITUDE",
    "CONTACT",
    "CONTACT CONTROLS",
    "CONTACT INCLUSIONS",
    "CONTACT PAIR",
    "CONTACT PROPERTY ASSIGNMENT",
    "DAMPING",
    "FRICTION",
    "SURFACE BEHAVIOR",
    "SURFACE INTERACTION",
}
"""Keywords whose place the joint file takes: contact, friction, damping, loads; a caution names them."""

INSTEAD = {
    "PRE-TENSION SECTION": "name its surface as section of a [[preload]] of the joint file",
    "RIGID BODY": "write it as *COUPLING with *KINEMATIC",
    "KINEMATIC COUPLING": "write it as *COUPLING with *KINEMATIC",
    "DISTRIBUTING COUPLING": "write it as *SURFACE and *COUPLING with *DISTRIBUTING",
    "MPC": "write it as *EQUATION or *TIE",
    "NGEN": "write the nodes out",
    "NFILL": "write the nodes out",
    "NCOPY": "write the nodes out",
    "ELGEN": "write the elements out",
    "ELCOPY": "write the elements out",
    "TRANSFORM": "give supports and equations in global directions",
    "PLASTIC": "the structure is elastic; remove it if stresses stay below yield",
    "SPRING": "give springs in the joint file",
    "SHELL SECTION": "solid elements alone are read",
    "BEAM SECTION": "solid elements alone are read",
}
"""What to write in the place of keywords that are refused."""

COUPLED = (
    "write what it couples as *SURFACE, and *COUPLING, REF NODE=..., SURFACE=... with *DISTRIBUTING"
)
INSTEAD_OF_ELEMENTS = {
    "DCOUP2D": COUPLED,
    "DCOUP3D": COUPLED,
}
"""What to write in the place of element types that are refused."""

USUAL_OF_DISTRIBUTING = {"WEIGHTING METHOD": "UNIFORM", "COUPLING": "CONTINUUM"}
"""Parameters of ``*DISTRIBUTING``, and their values that say what is usual."""

KNOWN = (
    "*NODE, *ELEMENT, *NSET, *ELSET, *SURFACE, *SYSTEM, *MATERIAL, *ELASTIC, *DENSITY, *EXPANSION, "
    "*SOLID SECTION, *TIE, *EQUATION, *COUPLING, *KINEMATIC, *DISTRIBUTING, *MASS, *BOUNDARY, *PART, "
    "*ASSEMBLY, *INSTANCE, *INCLUDE"
)
"""For messages."""

NAMED_SUPPORTS = {
    "ENCASTRE": (0, 1, 2, 3, 4, 5),
    "PINNED": (0, 1, 2),
    "XSYMM": (0, 4, 5),
    "YSYMM": (1, 3, 5),
    "ZSYMM": (2, 3, 4),
}
"""Components that the named supports of a deck hold."""
