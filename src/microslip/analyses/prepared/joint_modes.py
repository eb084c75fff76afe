"""The modes of a joint by number: each sliding mode with the stuck mode that it becomes.

Both are modes with the pairs that touch at prestress bonded, in the normal direction or in all of
them. Modes that only move the bodies on their supports do not count. Partners are those with the
largest modal assurance, ``(Phi_sl^T M Phi_st)²``; where several sliding modes are most like the same stuck
one, as close modes in space are, each has one of its own, so that the sum of all assurances is largest.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

from microslip.analyses.prepared.prestress import Prestress
from microslip.brief import Brief
from microslip.contact.law import ContactLaw
from microslip.contact.pairs import normal_rows
from microslip.errors import ModelError
from microslip.model.joint import JointModel, bonded_modes
from microslip.model.states import LinearStates, largest_of
from microslip.model.structure import Structure
from microslip.typing import Array, Indices, Mask

ON_SUPPORTS = 0.5
"""Share of the strain energy in the supports beyond which a mode does not deform the joint."""

UNLIKE = 0.2
"""Assurance, over the largest of a sliding mode, up to which a stuck mode is not its partner."""

MODE_PORT = "joint mode"
"""Port of a mode that the model has no port for yet, see `with_mode_port`."""


@dataclass(frozen=True, repr=False)
class JointMode(Brief):
    """A sliding mode and its stuck partner, mass-normalised.

    Attributes
    ----------
    number : int
        From 1, in the order of the sliding frequencies.
    sliding_omega, stuck_omega : float
        rad/s; the stuck joint may be the softer one, where bonding adds the mass of a body that
        slid before.
    sliding, stuck : (k,) arrays
        Shapes, their part in the free-interface modes of the joint model.
    overlap : float
        ``Phi_sl^T M Phi_st``.
    load_on_sliding, load_on_stuck : mapping of str to float
        ``Phi^T p`` of the ports' unit loads.
    port, stuck_port : str
        Ports of the model that are the inertia loads ``M Phi`` and whose outputs are the modal
        coordinates.
    """

    number: int
    sliding_omega: float
    stuck_omega: float
    sliding: Array
    stuck: Array
    overlap: float
    load_on_sliding: Mapping[str, float]
    load_on_stuck: Mapping[str, float]
    port: str = "sliding"
    stuck_port: str = "stuck"

    @property
    def sliding_frequency(self) -> float:
        """Natural frequency of the sliding state, Hz."""
        return self.sliding_omega / (2 * np.pi)

    @property
    def stuck_frequency(self) -> float:
        """Natural frequency of the stuck state, Hz."""
        return self.stuck_omega / (2 * np.pi)

    @property
    def stiffening(self) -> float:
        """``(omega_st/omega_sl)² - 1``: how much of the mode the interface can change."""
        return (self.stuck_omega / self.sliding_omega) ** 2 - 1

    @property
    def assurance(self) -> float:
        """Modal assurance ``(Phi_sl^T M Phi_st)²``: 1 where bonding does not change the shape."""
        return self.overlap**2


def mode_of_structure(
    found: LinearStates, structure: Structure, model: JointModel, number: int = 1
) -> JointMode:
    """The mode of a structure, as the analyses of its joint model take it.

    Parameters
    ----------
    found : LinearStates
    structure : Structure
    model : JointModel
        With the ports of `LinearStates.ports`.
    number : int
    """
    return JointMode(
        number=number,
        sliding_omega=found.sliding_omega,
        stuck_omega=found.stuck_omega,
        sliding=model.port_modes[:, model.port("sliding")],
        stuck=model.port_modes[:, model.port("stuck")],
        overlap=found.overlap,
        load_on_sliding=_loads_on(found.sliding, structure),
        load_on_stuck=_loads_on(found.stuck, structure),
    )


def _loads_on(shape: Array, structure: Structure) -> dict[str, float]:
    """Work of unit loads on a shape; reactions do none."""
    loads = structure.loads.items()
    return {name: float(shape @ load) for name, load in loads if name not in structure.reactions}


def joint_modes(model: JointModel, start: Prestress, law: ContactLaw) -> tuple[JointMode, ...]:
    """All modes of a joint model that deform the joint, in the order of their sliding frequencies.

    Parameters
    ----------
    model : JointModel
    start : Prestress
        Pairs that touch in it are bonded.
    law : ContactLaw
        The bond is behind the compliance of the contact.
    """
    sliding, stuck = _states(model, start, law)
    deforming = np.flatnonzero(sliding.deforms)
    partners = _partners((sliding.shapes[:, deforming].T @ stuck.shapes) ** 2)
    pairs = zip(deforming.tolist(), partners, strict=True)
    return tuple(_pair(model, sliding, stuck, *pair, n) for n, pair in enumerate(pairs, 1))


def driven_mode(
    model: JointModel,
    start: Prestress,
    law: ContactLaw,
    drive: str,
    loads: Collection[str] | None = None,
) -> JointMode:
    """The mode that a port drives: the stuck one that its static load excites most, and the sliding one most
    like it, as `microslip.model.states.linear_states` picks those of a structure.

    `loads` are the ports that load it, all by default: reactions, which do no work, are ports too.

    Raises
    ------
    ModelError
        Where no mode of the joint model deforms the joint.
    """
    sliding, stuck = _states(model, start, law)
    if not (sliding.deforms.any() and stuck.deforms.any()):
        raise ModelError("no mode of this joint model deforms the joint")
    load = model.port_modes[:, model.port(drive)]
    size = np.maximum(stuck.omega, 1e-300) ** 2
    partner = largest_of(np.abs(stuck.shapes.T @ load) / size, stuck.deforms)
    own = largest_of((sliding.shapes.T @ stuck.shapes[:, partner]) ** 2, sliding.deforms)
    return _pair(model, sliding, stuck, own, partner, 1, loads)


def drifting(model: JointModel, start: Prestress, law: ContactLaw, shape: Array) -> float:
    """Share of a shape in sliding motions that deform the supports more than the joint."""
    sliding = _state(model, start.bonded(1), law)
    return float(((sliding.shapes[:, ~sliding.deforms].T @ shape) ** 2).sum())


class _State(NamedTuple):
    """Modes of the sliding or the stuck state, and whether each deforms the joint."""

    omega: Array
    shapes: Array
    deforms: Mask


def _states(model: JointModel, start: Prestress, law: ContactLaw) -> tuple[_State, _State]:
    """The sliding and the stuck state."""
    return (
        _state(model, start.bonded(1), law),
        _state(model, start.bonded(model.dimension), law),
    )


def _state(model: JointModel, held: Indices, law: ContactLaw) -> _State:
    """The state with some components of the pairs bonded."""
    omega, shapes = bonded_modes(model, held, law.compliance)
    return _State(omega, shapes, _support_energy(model, shapes) <= ON_SUPPORTS * omega**2)


def _pair(
    model: JointModel,
    sliding: _State,
    stuck: _State,
    own: int,
    partner: int,
    number: int,
    loads: Collection[str] | None = None,
) -> JointMode:
    """A sliding mode and its stuck partner, by index."""

    def work(shape: Array) -> dict[str, float]:
        on = zip(model.ports, map(float, shape @ model.port_modes), strict=True)
        return {port: amount for port, amount in on if loads is None or port in loads}

    shape, other = sliding.shapes[:, own], stuck.shapes[:, partner]
    return JointMode(
        number=number,
        sliding_omega=float(sliding.omega[own]),
        stuck_omega=float(stuck.omega[partner]),
        sliding=shape,
        stuck=other,
        overlap=float(shape @ other),
        load_on_sliding=work(shape),
        load_on_stuck=work(other),
        port=MODE_PORT,
        stuck_port=f"stuck {MODE_PORT}",
    )


def _partners(assurance: Array) -> list[int]:
    """The stuck mode (column) of each sliding mode (row): one of its own, or, where what is left is unlike
    it, the one most like it.

    Examples
    --------
    >>> _partners(np.array([[0.6, 0.3], [0.5, 0.1]]))
    [1, 0]
    >>> _partners(np.array([[0.9, 0.0], [0.8, 0.1]]))
    [0, 0]
    """
    rows, columns = linear_sum_assignment(assurance, maximize=True)
    own = dict(zip(rows.tolist(), columns.tolist(), strict=True))
    found = []
    for row, each in enumerate(assurance):
        column = own.get(row, -1)
        like = column >= 0 and each[column] > UNLIKE * each.max(initial=0.0)
        found.append(column if like else int(np.argmax(each)))
    return found


def _support_energy(model: JointModel, shapes: Array) -> Array:
    """Strain energy of shapes (columns) in the supports, twice; of nearly rigid modes, where the
    supports are not known."""
    if model.supports is not None:
        return np.einsum("ij,ij->j", shapes, model.supports @ shapes)
    rigid = slice(0, model.equilibrium_modes)
    return np.asarray(model.omega[rigid] ** 2 @ shapes[rigid] ** 2)


def pick_mode(modes: tuple[JointMode, ...], number: int) -> JointMode:
    """The mode of a number.

    Raises
    ------
    ModelError
        Where there is none: names how many there are.
    """
    if not 1 <= number <= len(modes):
        raise ModelError(
            f"there is no mode {number}: this joint model has {len(modes)} modes that deform it, "
            f"1 to {len(modes)} ({modes[0].sliding_frequency:.4g} to "
            f"{modes[-1].sliding_frequency:.4g} Hz); keep more free-interface modes for more"
        )
    return modes[number - 1]


def with_mode_port(model: JointModel, mode: JointMode) -> JointModel:
    """The model with the port of a mode of `joint_modes`: its inertia load and its coordinate."""
    return model.with_modal_ports({mode.port: mode.sliding})


def walking_modes(model: JointModel) -> Mask:
    """Modes that slide the bodies past each other as rigid ones, held by the supports alone."""
    rows = normal_rows(model.dimension)
    normal = np.abs(model.mode_v[rows]).max(axis=0, initial=0.0)
    sideways = np.abs(np.delete(model.mode_v, rows, axis=0)).max(axis=0, initial=0.0)
    if model.supports is None:
        rigid = np.arange(len(model.omega)) < model.equilibrium_modes
    else:
        rigid = np.diag(model.supports) > ON_SUPPORTS * model.omega**2
    return np.asarray(rigid & (normal < 1e-3 * sideways))
