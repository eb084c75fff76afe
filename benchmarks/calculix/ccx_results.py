"""CalculiX run, and what it printed: displacements (`.dat`), iterations and contact points (`.cvg`)."""

from __future__ import annotations

import os
import resource
import shutil
import subprocess
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


def find_ccx():
    """Path of the program; None, and a line that says so, where there is none."""
    ccx = shutil.which("ccx")
    if ccx is None:
        print("CalculiX comparison skipped: no ccx on the path (Debian: apt install calculix-ccx)")
    return ccx


def run_deck(ccx, folder, name, text):
    """Run a deck in a folder, one thread; seconds of processor time.

    Raises
    ------
    ContactError
        Where ccx ends with an error; it has the first of what ccx says.
    """
    for old in folder.glob(f"{name}.*"):
        old.unlink()
    (folder / f"{name}.inp").write_text(text)
    start = _children_seconds()
    with (folder / f"{name}.log").open("w") as log:
        done = subprocess.run(
            [ccx, "-i", name],
            cwd=folder,
            stdout=log,
            stderr=log,
            check=False,
            env={**os.environ, "OMP_NUM_THREADS": "1"},
        )
    if done.returncode:
        said = (folder / f"{name}.log").read_text(errors="replace").split("*ERROR")[-1]
        raise ContactError(
            f"ccx ended with status {done.returncode}: {' '.join(said.split())[:300]}; keep its "
            "files with --out, and try more --steps or a softer penalty"
        )
    return _children_seconds() - start


def _children_seconds():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


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
