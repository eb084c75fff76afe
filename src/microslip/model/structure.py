"""Finite-element structures ready for reduction: matrices, interface and named load vectors.

A `Structure` is all that the rest of the program sees of a mesh: constrained degrees of freedom
are already removed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse as sp
import skfem

from microslip.brief import Brief
from microslip.model.bodies import left_free
from microslip.model.interface import Interface
from microslip.typing import Array, Indices


@dataclass(frozen=True, repr=False)
class Reaction(Brief):
    """What a support holds with, beside ``s^T x`` of its load vector (`microslip.model.reactions`).

    Attributes
    ----------
    mass : (n,) array
        m, of the acceleration.
    pairs : (d m,) array
        B e: how far the motion of the support moves the sides of the pairs.
    loads : mapping of str to float
        e^T f of unit loads that act on what is held, by name.
    """

    mass: Array
    pairs: Array
    loads: Mapping[str, float] = field(default_factory=dict)


@dataclass(frozen=True, repr=False)
class Structure(Brief):
    """Two (or more) bodies with free interfaces.

    Attributes
    ----------
    stiffness, mass : (n, n) sparse
        Free of any contact; per metre of width in 2D.
    interface : Interface
    loads : mapping of str to (n,) array
        Unit load vectors by name. A load is also an output: ``load @ x`` is its conjugate
        displacement.
    free : (n,) int array
        Degree of freedom of the mesh behind each one here.
    meshes : tuple of skfem.MeshQuad
        For pictures; empty where the structure did not come from a mesh.
    motions : (n, e) array, optional
        Rigid motions of the bodies that the fixed degrees of freedom leave free; springs do not
        count as fixed.
    supports : (n, n) sparse, optional
        The part of `stiffness` that springs to the ground add.
    reactions : mapping of str to Reaction
        Loads that are outputs alone: what supports hold with.
    """

    stiffness: sp.csc_matrix
    mass: sp.csc_matrix
    interface: Interface
    loads: Mapping[str, Array]
    free: Indices
    meshes: tuple[skfem.MeshQuad, ...] = field(default=())
    motions: Array | None = None
    supports: sp.csc_matrix | None = None
    reactions: Mapping[str, Reaction] = field(default_factory=dict)

    @property
    def dofs(self) -> int:
        """Number of degrees of freedom."""
        return self.stiffness.shape[0]


def constrain(
    stiffness: sp.csc_matrix,
    mass: sp.csc_matrix,
    interface: Interface,
    loads: Mapping[str, Array],
    fixed: Indices,
    meshes: tuple[skfem.MeshQuad, ...] = (),
    motions: Array | None = None,
    supports: sp.csc_matrix | None = None,
) -> Structure:
    """Remove the degrees of freedom in `fixed` (held at zero), and the motions that they stop."""
    free = np.setdiff1d(np.arange(stiffness.shape[0]), fixed)
    return Structure(
        stiffness=stiffness[free][:, free].tocsc(),
        mass=mass[free][:, free].tocsc(),
        interface=replace(interface, relative=interface.relative[:, free].tocsr()),
        loads={name: load[free] for name, load in loads.items()},
        free=free,
        meshes=meshes,
        motions=None if motions is None else left_free(motions, fixed)[free],
        supports=None if supports is None else supports[free][:, free].tocsc(),
    )
