"""Contact laws over a cycle: microslip's compiled batch against pyHarm's elements, in one run.

    python benchmarks/aft.py

Force and Jacobian of frictional contact with varying normal load and lift-off, at 128 and 1,024
samples per cycle and three harmonics. microslip evaluates 200 planar pairs in one call; pyHarm
(`pip install pyHarm-os`; left out where it is not installed) evaluates one element per call:
``Penalty3D`` is the same law with one more tangential direction, ``Jenkins`` has a constant normal load.
Medians, one thread, after a warm-up. Where a pair never lifts off both programs have the same friction
forces, and the largest difference is printed; after lift-off their sliders start from other places.
"""

from __future__ import annotations

import json
import statistics
import time
import warnings

import numpy as np
from threadpoolctl import threadpool_limits

from microslip.contact.aft import contact_cycle
from microslip.contact.pairs import SEPARATED
from microslip.contact.samples import sample_table

PAIRS, HARMONICS, FRICTION = 200, 3, 0.3
PENALTY, MEAN = 1.0, 1.5


def median_seconds(work, repeats=15):
    work()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def displacements(count):
    """Coefficients (count, 2, 7) of approach and tangential motion: slip and lift-off both occur."""
    rng = np.random.default_rng(0)
    v = rng.standard_normal((count, 2, 2 * HARMONICS + 1))
    v[:, 0] *= rng.uniform(0, 1, count)[:, None]
    v[:, 0, 0] += MEAN
    return v


def compiled(v, samples):
    """Reactions and Jacobians of all pairs in one call."""
    table = sample_table(HARMONICS, samples)
    friction, held = np.full(len(v), FRICTION), np.zeros((len(v), 1))
    return lambda: contact_cycle(table, PENALTY * v, friction, held)


def pyharm_element(name, samples):
    """One element between a node and the ground, and its number of components."""
    import pandas as pd
    from pyHarm.CoordinateSystem import GlobalCoordinateSystem

    if name == "Penalty3D":
        from pyHarm.Elements.NodeToNodeElements.Penalty3D import Penalty3D as Element

        data = {"mu": FRICTION, "N0": MEAN, "k_n": PENALTY, "k_t": PENALTY, "g": 0.0}
        data["dirs"] = [0, 1, 2]
    else:
        from pyHarm.Elements.NodeToNodeElements.Jenkins import Jenkins as Element

        data = {"mu": FRICTION, "N0": MEAN, "k": PENALTY, "dirs": [1], "jac": "analytical"}
    data["connect"] = {"body": [0], "GROUND": [0]}
    waves = [(0, "c")] + [(h, cs) for h in range(1, HARMONICS + 1) for cs in "cs"]
    dofs = pd.DataFrame(
        [
            {"sub": "body", "node_num": 0, "dof_num": d, "harm": h, "cs": cs}
            for h, cs in waves
            for d in range(3)
        ]
    )
    element = Element(HARMONICS, samples, name, data, GlobalCoordinateSystem(3))
    element.generateIndices(dofs)
    return element


def pyharm_unknowns(v):
    """The same motion in pyHarm's order: mean, cos, sin, ..., three components each.

    Its normal displacement opens the contact, from where the preload is in balance.
    """
    x = np.zeros((2 * HARMONICS + 1, 3))
    order = [0] + [k for h in range(1, HARMONICS + 1) for k in (2 * h, 2 * h - 1)]
    x[:, 0], x[:, 1] = -v[0, order], v[1, order]
    x[0, 0] += MEAN / PENALTY
    return x.ravel()


def pyharm_times(samples, v):
    """Milliseconds per element for force and Jacobian, and the forces of `Penalty3D`."""
    times = {}
    forces = None
    for name in ("Penalty3D", "Jenkins"):
        element = pyharm_element(name, samples)
        unknowns = [pyharm_unknowns(pair) for pair in v]

        def work(element=element, unknowns=unknowns):
            out = []
            for x in unknowns:
                out.append(np.asarray(element.evalResidual(x, 1.0)))
                np.asarray(element.evalJacobian(x, 1.0)[0])
            return out

        times[name] = 1e3 * median_seconds(work, 5) / len(v)
        forces = work() if name == "Penalty3D" else forces
    return times, forces


def difference(forces, cycle):
    """Largest difference of the friction forces of both programs, of pairs that never lift off."""
    order = [0] + [k for h in range(1, HARMONICS + 1) for k in (2 * h, 2 * h - 1)]
    theirs = np.array(forces).reshape(len(forces), -1, 3)[:, :, 1]
    ours = cycle.r[: len(forces), 1][:, order]
    touching = (cycle.status[: len(forces)] != SEPARATED).all(axis=1)
    return int(touching.sum()), float(np.abs(theirs - ours)[touching].max() / np.abs(ours).max())


def main():
    rows = []
    v = displacements(PAIRS)
    warnings.filterwarnings("ignore", module="pyHarm")
    with threadpool_limits(1):
        for samples in (128, 1024):
            work = compiled(v, samples)
            row = {"samples": samples, "microslip_us_per_pair": 1e6 * median_seconds(work) / PAIRS}
            try:
                times, forces = pyharm_times(samples, v[:20])
            except ImportError as error:
                row["pyharm"] = f"not installed ({error})"
            else:
                for name, milliseconds in times.items():
                    row[f"pyharm_{name}_us_per_element"] = 1e3 * milliseconds
                    row[f"times_faster_than_{name}"] = (
                        1e3 * milliseconds / row["microslip_us_per_pair"]
                    )
                count, row["largest_difference_of_friction"] = difference(forces, work())
                row["pairs_compared"] = count
            rows.append(row)
    print(json.dumps(rows, indent=2))


if __name__ == "__main__":
    main()
