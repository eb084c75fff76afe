"""What a description is made of, whatever its kind: structure, loads that are held, contact law, measures.

The one place that knows the kinds of joints; all above it takes a `Source`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import singledispatch

import numpy as np

from microslip.brief import Brief
from microslip.contact.law import ContactLaw, contact_law
from microslip.contact.pairs import normal_rows
from microslip.describe.joint import Joint
from microslip.describe.lap import LapJoint
from microslip.describe.matrices import MatricesJoint
from microslip.describe.mesh import MeshJoint
from microslip.describe.saved_model import ModelJoint
from microslip.errors import InputError
from microslip.model.described_mesh import read_described_mesh
from microslip.model.flexibility import static_flexibility
from microslip.model.imported import GAP, Imported, read_imported
from microslip.model.joint import JointModel
from microslip.model.lap import structure_of
from microslip.model.loose import WEAKEST
from microslip.model.structure import Structure
from microslip.pipeline.saved_model import modal_structure, read_saved
from microslip.typing import Array

DRIVE, PRELOAD = "moment", "clamp"
"""Ports of a lap joint that are driven where the file names no other, and held."""

ON_WEAK_SPRINGS = 1e-2
"""`Source.drifting` of beams with free ends and no clamped one, whose weak springs are 1e-7 of their axial
stiffness: they drift, or swing about a pin, at some thousandths of the eighth frequency, and bend at more
than a hundredth of it."""

SMALL = 1e-9
"""Amplitude of the port of the gaps over that of the preload, where no sides interfere: sums of amplitudes
stay those of loads."""


@dataclass(frozen=True, repr=False)
class Source(Brief):
    """What analyses are prepared from.

    Attributes
    ----------
    structure : Structure
    drive : str
        Port of the excitation.
    preload : mapping of str to float
        Ports that are held, and their amplitudes.
    imported : Imported or None
        Where it came from files of matrices.
    drifting : float
        Circular frequency, over the highest one looked at, below which a motion is no vibration but a body
        that drifts on springs which only hold its place.
    fit : float
        Force that sides press each other with because they interfere, about, N per metre of width; see
        `with_fit`.
    """

    structure: Structure
    drive: str
    preload: Mapping[str, float]
    imported: Imported | None = None
    drifting: float = 0.0
    fit: float = 0.0

    def with_fit(self, model: JointModel) -> Source:
        """The source with the force of its interference, which then counts as a preload.

        It is that of the even pressure p that takes back the interference g in the mean over the pairs of
        areas A, ``p A^T W A = A^T g``, with the flexibility W of the pairs along their normals.

        Raises
        ------
        InputError
            Where there is neither a preload nor interference.
        """
        fit = 0.0
        if self.imported is not None:
            rows, area = normal_rows(model.dimension), model.area
            interference = float(area @ np.maximum(-self.imported.pairs.gap, 0.0))
            W = static_flexibility(model).W[rows, rows]
            fit = interference / float(area @ W @ area) * float(area.sum())
        if not self.preload and not fit > 0:
            raise InputError(
                "preload: nothing presses the sides together: no load does, and no pair has a negative gap"
            )
        return replace(self, fit=fit)

    def with_gaps(self, model: JointModel) -> JointModel:
        """The joint model with the initial gaps.

        They are a port without work on anything: at its amplitude in `held` it moves the sides of every pair
        apart by its gap, ``v_n = ... - g``.
        """
        if GAP not in self.held or self.imported is None:
            return model
        apart = np.zeros((model.dimension * model.pairs, 1))
        apart[normal_rows(model.dimension), 0] = -self.imported.pairs.gap / self.held[GAP]
        return replace(
            model,
            ports=(*model.ports, GAP),
            port_modes=np.pad(model.port_modes, ((0, 0), (0, 1))),
            port_v=np.hstack([model.port_v, apart]),
            port_port=np.pad(model.port_port, ((0, 1), (0, 1))),
            bodies=None
            if model.bodies is None
            else model.bodies.with_ports(np.zeros((1, model.bodies.v.shape[1]))),
        )

    @property
    def held(self) -> Mapping[str, float]:
        """The preload, and the port of the gaps where there are any."""
        if self.imported is None or not self.imported.pairs.gap.any():
            return self.preload
        return {**self.preload, GAP: self.fit + SMALL * sum(self.preload.values())}


@singledispatch
def source_of(joint: Joint) -> Source:
    """What a description is made of.

    Raises
    ------
    InputError
        Where its files cannot be what they are meant to be.
    """
    raise NotImplementedError(f"nothing is made of {type(joint).__name__}")


@source_of.register
def _lap(joint: LapJoint) -> Source:
    ends = {joint.support.left, joint.support.right}
    drifting = ON_WEAK_SPRINGS if "free" in ends and "clamped" not in ends else 0.0
    return Source(
        structure_of(joint), drive_of(joint), {PRELOAD: joint.clamp.force}, drifting=drifting
    )


@source_of.register
def _matrices(joint: MatricesJoint) -> Source:
    found = read_imported(joint)
    # what soft springs hold, and a file says so, is not free
    drifting = WEAKEST if found.structure.supports is None else 0.0
    return Source(found.structure, joint.driven.name, found.preload, found, drifting)


@source_of.register
def _mesh(joint: MeshJoint) -> Source:
    found = read_described_mesh(joint)
    drifting = WEAKEST if found.structure.supports is None else 0.0
    return Source(found.structure, joint.driven.name, found.preload, found, drifting)


@source_of.register
def _saved(joint: ModelJoint) -> Source:
    found = read_saved(joint)
    return Source(modal_structure(found.model), found.drive, found.prestress.preload)


def drive_of(joint: Joint) -> str:
    """Port of the joint model that drives it."""
    return DRIVE if joint.driven_by_end_moments else joint.driven.name


def law_of(joint: Joint, source: Source, model: JointModel) -> ContactLaw:
    """Friction, and the compliance ``1 / (k area)`` of an elastic contact, m/N.

    Raises
    ------
    InputError
        Where nothing gives the friction, or the stiffness of an elastic contact.
    """
    friction: float | Array
    stiffness: tuple[float | Array | None, float | Array | None]
    if source.imported is not None:
        given = joint.contact.friction if isinstance(joint, MatricesJoint) else None
        friction = source.imported.friction(given)
        stiffness = (
            _pair_stiffness(joint, source.imported)
            if isinstance(joint, MatricesJoint)
            else _known_stiffness(source.imported)
        )
    else:
        assert isinstance(joint, LapJoint)
        contact = joint.contact
        elastic = contact.law == "elastic"
        own = contact.normal_stiffness, contact.tangential_stiffness
        stiffness = (own[0], own[1]) if elastic else (None, None)
        mu = contact.friction
        friction = mu if isinstance(mu, float) else np.array([mu.at(x) for x in model.position])
    d = model.dimension
    compliance = np.zeros((model.pairs, d))
    for components, k in zip((slice(0, 1), slice(1, d)), stiffness, strict=True):
        if k is not None:
            compliance[:, components] = (1 / (k * model.area))[:, None]
    return contact_law(model.pairs, friction, compliance.ravel(), d)


def _known_stiffness(found: Imported) -> tuple[Array | None, Array | None]:
    """Normal and tangential stiffness per area of every pair, infinite where it is rigid."""
    table = found.pairs.stiffness
    return table.get("normal_stiffness"), table.get("tangential_stiffness")


def _pair_stiffness(
    joint: MatricesJoint, found: Imported
) -> tuple[float | Array | None, float | Array | None]:
    """Normal and tangential stiffness per area of every pair; None where it is rigid."""
    contact, table = joint.contact, found.pairs.stiffness
    if contact.law == "exact":
        return None, None
    tangential = contact.tangential_stiffness or table.get("tangential_stiffness")
    if tangential is None:
        raise InputError(
            'contact.tangential_stiffness is missing: law = "elastic" needs it, here or as a column of the '
            "pairs"
        )
    return contact.normal_stiffness or table.get("normal_stiffness"), tangential
