"""What CalculiX printed: displacements (`.dat`), iterations and contact points (`.cvg`)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from ccx_deck import MM

from microslip.errors import ContactError


@dataclass(frozen=True)
class Path:
    """The converged increments, the clamped joint first.

    Attributes
    ----------
    time : (s + 1,) array
        1 after the clamp is on, and one more per load step.
    rotation : (s + 1,) array
        Conjugate of the unit end moment, rad: by how much the far ends turn against each other.
    slip : (s + 1, m) array
        Tangential displacement of the upper body relative to the lower at the nodes, m.
    """

    time: np.ndarray
    rotation: np.ndarray
    slip: np.ndarray


def read_path(dat, joint, increments):
    """Path of a run from its ``.dat`` file.

    Parameters
    ----------
    dat : pathlib.Path
    joint : linear_joint.LinearJoint
        The mesh the deck was written from.
    increments : int
        How many there should be, the clamp's included.

    Raises
    ------
    ContactError
        Where the run stopped before its end.
    """
    times, fields = read_displacements(dat)
    if len(times) != increments:
        raise ContactError(
            f"ccx finished {len(times)} of {increments} increments: it did not converge; see "
            f"{dat.with_suffix('.cvg')}, and try more --steps or softer --normal-stiffness"
        )
    loaded = np.flatnonzero(joint.moment.any(axis=1))
    rotation, slip = [], []
    for u in fields:
        rotation.append(sum(joint.moment[k] @ u[k + 1][:2] for k in loaded) / MM)
        slip.append(
            [
                (u[upper + 1][0] - u[lower + 1][0]) / MM
                for lower, upper in zip(joint.lower_nodes, joint.upper_nodes, strict=True)
            ]
        )
    return Path(np.array(times), np.array(rotation), np.array(slip))


def read_displacements(dat):
    """Times, and for each the displacement (mm) by node number of the deck."""
    times, fields = [], []
    with open(dat, encoding="ascii") as file:
        for line in file:
            if line.lstrip().startswith("displacements"):
                times.append(float(line.rsplit("time", 1)[1]))
                fields.append({})
            elif line.strip():
                node, *components = line.split()
                fields[-1][int(node)] = np.array(components, dtype=float)
    return times, fields


def iterations(cvg):
    """Equilibrium iterations of each ``*STEP``, attempts that were cut included (``.cvg`` file)."""
    return np.unique(_convergence(cvg)[:, 0], return_counts=True)[1]


def contact_points(cvg):
    """Number of contact points that pressed in each iteration, from the ``.cvg`` file."""
    return _convergence(cvg)[:, 4]


def _convergence(cvg):
    rows = [line.split()[:5] for line in cvg.read_text(encoding="ascii").splitlines()]
    return np.array([row for row in rows if len(row) == 5 and row[0].isdigit()], dtype=int)
