"""Meshes of any origin: points, blocks of elements of one type, and what is named in them.

Node and element numbers of the file are kept as labels, for messages; inside, nodes are rows of `points`, and
elements are counted through all blocks in their order.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from microslip.brief import Brief
from microslip.errors import Caution, ModelError
from microslip.model.elasticity import Material
from microslip.model.mesh.element_types import ElementType, element_type
from microslip.typing import Array, Indices

FULL, INCOMPATIBLE = "full", "incompatible"
"""Formulations of an element: its shape functions alone, or incompatible modes beside them."""


@dataclass(frozen=True, repr=False)
class Block(Brief):
    """Elements of one type.

    Attributes
    ----------
    kind : str
        Name of the `ElementType`.
    nodes : (e, k) int array
        Rows of the points of the mesh.
    labels : (e,) int array
        Numbers of the elements in the file.
    formulation : str
        `FULL`, or `INCOMPATIBLE` for linear quadrilaterals and hexahedra that bend.
    """

    kind: str
    nodes: Indices
    labels: Indices
    formulation: str = FULL

    @property
    def type(self) -> ElementType:
        """Shape of the elements."""
        return element_type(self.kind)

    @property
    def count(self) -> int:
        """Number of elements."""
        return len(self.nodes)


@dataclass(frozen=True, repr=False)
class Surface(Brief):
    """Faces of elements.

    Attributes
    ----------
    elements : (f,) int array
        Elements, counted through all blocks.
    faces : (f,) int array
        Face of each, from 0: S1 of Abaqus and CalculiX is 0.
    """

    elements: Indices
    faces: Indices


@dataclass(frozen=True)
class Tie:
    """Two surfaces that do not move against each other.

    Attributes
    ----------
    name : str
    slave, master : str
        Names of surfaces.
    tolerance : float, optional
        Distance up to which they are tied, m.
    where : str
        Place in the file that says so, for messages.
    adjust : bool
        Whether the slave may be moved onto the master.
    """

    name: str
    slave: str
    master: str
    tolerance: float | None = None
    where: str = ""
    adjust: bool = True

    @property
    def said(self) -> str:
        """What messages call it."""
        return f"tie {self.name!r}" + (f" ({self.where})" if self.where else "")


@dataclass(frozen=True)
class Equation:
    """``sum c u = 0`` over components of nodes.

    Attributes
    ----------
    terms : tuple of (int, int, float)
        Row of the points, component from 0, coefficient.
    """

    terms: tuple[tuple[int, int, float], ...]


@dataclass(frozen=True)
class Coupling:
    """A surface that follows a reference node.

    Attributes
    ----------
    name : str
    kind : str
        ``"kinematic"``: as a rigid body; ``"distributing"``: in the mean.
    reference : int
        Row of the points.
    surface : str
    components : tuple of int
        From 0; 3 to 5 are rotations.
    radius : float, optional
        Distance from the reference node up to which nodes of the surface follow, m; all without it.
    """

    name: str
    kind: str
    reference: int
    surface: str
    components: tuple[int, ...]
    radius: float | None = None


@dataclass(frozen=True)
class Section:
    """A material and the elements that are made of it.

    Attributes
    ----------
    elements : str
        Name of the element set.
    material : str
    thickness : float, optional
        Of plane elements, m.
    """

    elements: str
    material: str
    thickness: float | None = None


@dataclass(frozen=True, repr=False)
class FiniteElementMesh(Brief):
    """Points, elements and names.

    Attributes
    ----------
    points : (n, d) array
        Coordinates, d = 2 or 3.
    node_labels : (n,) int array
        Numbers of the nodes in the file.
    blocks : tuple of Block
    node_sets, element_sets : mapping of str to int array
    surfaces : mapping of str to Surface
    materials : mapping of str to Material
    lacking : mapping of str to str
        Materials that cannot be used, and why: an error where they are.
    sections : tuple of Section
    ties, equations, couplings : tuples
    masses : mapping of int to float
        Point masses by row of the points, kg.
    held : (h, 2) int array
        Row of the points and component of what does not move; components from 3 are rotations of
        reference nodes, also in the plane.
    cautions : tuple of Caution
        What should be known of what was read.
    unread : str
        What was not read that may hold something, for errors about what nothing holds.
    """

    points: Array
    node_labels: Indices
    blocks: tuple[Block, ...]
    node_sets: Mapping[str, Indices] = field(default_factory=dict)
    element_sets: Mapping[str, Indices] = field(default_factory=dict)
    surfaces: Mapping[str, Surface] = field(default_factory=dict)
    materials: Mapping[str, Material] = field(default_factory=dict)
    lacking: Mapping[str, str] = field(default_factory=dict)
    sections: tuple[Section, ...] = ()
    ties: tuple[Tie, ...] = ()
    equations: tuple[Equation, ...] = ()
    couplings: tuple[Coupling, ...] = ()
    masses: Mapping[int, float] = field(default_factory=dict)
    held: Indices = field(default_factory=lambda: np.zeros((0, 2), dtype=np.int64))
    cautions: tuple[Caution, ...] = ()
    unread: str = ""

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return self.points.shape[1]

    @property
    def elements(self) -> int:
        """Number of elements."""
        return sum(block.count for block in self.blocks)

    @cached_property
    def starts(self) -> Indices:
        """(b + 1,) number of the first element of each block, and their count."""
        return np.cumsum([0, *(block.count for block in self.blocks)])

    @cached_property
    def element_labels(self) -> Indices:
        """Numbers of all elements in the file."""
        return np.concatenate([np.zeros(0, np.int64), *(block.labels for block in self.blocks)])

    def nodes_of_set(self, name: str) -> Indices:
        """Rows of the points of a node set; raises `ModelError` naming those there are."""
        return _named(self.node_sets, name, "node set")

    def elements_of_set(self, name: str) -> Indices:
        """Elements of a set; raises `ModelError` naming those there are."""
        return _named(self.element_sets, name, "element set")

    def surface(self, name: str) -> Surface:
        """A surface by its name.

        Raises
        ------
        ModelError
            Where there is none, naming those there are, or where it has no faces.
        """
        if name not in self.surfaces:
            there = ", ".join(self.surfaces) or "none"
            raise ModelError(f"no surface {name!r} in the mesh; it has {there}")
        found = self.surfaces[name]
        if not len(found.elements):
            raise ModelError(f"surface {name!r} has no faces: it is empty")
        return found

    @cached_property
    def bodies(self) -> tuple[Indices, ...]:
        """Nodes of each body: elements that share nodes are of one body.

        Examples
        --------
        >>> square = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
        >>> block = Block("quad4", np.array([[0, 1, 2, 3], [4, 5, 6, 7]]), np.array([1, 2]))
        >>> mesh = FiniteElementMesh(np.vstack([square, square + 5.0]), np.arange(8), (block,))
        >>> [body.tolist() for body in mesh.bodies]
        [[0, 1, 2, 3], [4, 5, 6, 7]]
        """
        first = [np.repeat(b.nodes[:, 0], b.nodes.shape[1]) for b in self.blocks]
        other = [b.nodes.ravel() for b in self.blocks]
        n = len(self.points)
        rows, columns = np.concatenate(first), np.concatenate(other)
        graph = sp.coo_matrix((np.ones(len(rows)), (rows, columns)), shape=(n, n))
        count, label = connected_components(graph, directed=False)
        used = np.zeros(n, dtype=bool)
        used[columns] = True
        groups = (np.flatnonzero((label == k) & used) for k in range(count))
        return tuple(group for group in groups if len(group))


def _named(sets: Mapping[str, Indices], name: str, what: str) -> Indices:
    if name not in sets:
        there = ", ".join(sets) or "none"
        raise ModelError(f"no {what} {name!r} in the mesh; it has {there}")
    if not len(sets[name]):
        raise ModelError(f"{what} {name!r} is empty")
    return sets[name]


def said_too(mesh: FiniteElementMesh | None) -> str:
    """The end of a message about what nothing holds."""
    return f"; {mesh.unread}" if mesh is not None and mesh.unread else ""


BENDS_BADLY = {
    "tri3": "linear triangles",
    "tet4": "linear tetrahedra",
    "wedge6": "linear wedges",
    "quad4": "linear quadrilaterals without incompatible modes",
    "hex8": "linear hexahedra without incompatible modes",
}
"""Elements whose bending is not to be trusted: they are far too stiff."""


def bending_cautions(mesh: FiniteElementMesh) -> tuple[Caution, ...]:
    """A word about elements that bend too stiffly.

    Examples
    --------
    >>> block = Block("tri3", np.array([[0, 1, 2]]), np.array([7]))
    >>> mesh = FiniteElementMesh(np.eye(3, 2), np.arange(3), (block,))
    >>> print(bending_cautions(mesh)[0])
    mesh, 1 elements tri3: linear triangles bend too stiffly; use quadratic elements
    """
    out = []
    for kind, what in BENDS_BADLY.items():
        count = sum(b.count for b in mesh.blocks if b.kind == kind and b.formulation == FULL)
        if count:
            boxes = kind in ("quad4", "hex8")
            remedy = "use quadratic elements" + (", or incompatible modes" if boxes else "")
            out.append(
                Caution("mesh", f"{count} elements {kind}", f"{what} bend too stiffly", remedy)
            )
    return tuple(out)
