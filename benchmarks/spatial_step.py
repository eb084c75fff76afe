"""Time of one warm quasi-static step of spatial contact, by pairs and by how much of the interface slips.

A strip of contact as between two half-spaces (Boussinesq's and Cerruti's flexibility), pressed by three
bolts between which it opens, pulled along and across and bent by a load that goes round a cycle of 100
steps. Medians of the steps of one cycle after the first loading, in processor seconds of the one thread that
works, and the slipping and touching pairs in the median.

    python benchmarks/spatial_step.py [--strips 25x8 50x14 100x20] [--loads 0.15 0.3 0.6] [--steps 100]
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from microslip.contact.pairs import FORWARD, SLIP, at_rest, slip_history, touches
from microslip.contact.path import follow_path
from microslip.contact.solver import ContactSolver
from microslip.model.flexibility import Flexibility

POISSON, FRICTION = 0.3, 0.3


def strip(along: int, across: int):
    """Places of the pairs, (m, 2), and their flexibility; the distance across is 1."""
    x, y = np.meshgrid(
        np.linspace(0, along / across, along), np.linspace(0, 1, across), indexing="ij"
    )
    place = np.column_stack([x.ravel(), y.ravel()])
    apart = place[:, None] - place
    r = np.maximum(np.hypot(apart[..., 0], apart[..., 1]), 0.28 / across)
    m = len(place)
    W = np.zeros((m, 3, m, 3))
    W[:, 0, :, 0] = (1 - POISSON) / r
    for a in range(2):
        for b in range(2):
            W[:, 1 + a, :, 1 + b] = POISSON * apart[..., a] * apart[..., b] / r**3
        W[:, 1 + a, :, 1 + a] += (1 - POISSON) / r
    W = W.reshape(3 * m, 3 * m) / m
    return place, 0.5 * (W + W.T)


def pressed(place, W):
    """Flexibility with two ports: three bolts, and a pull along and across with bending."""
    m, length = len(place), place[:, 0].max()
    bolts = -0.15 * np.ones(m)
    for centre in (0.17, 0.5, 0.83):
        bolts += np.exp(-((place[:, 0] - length * centre) ** 2 + (place[:, 1] - 0.5) ** 2) / 0.15)
    press, pull = np.zeros((m, 3)), np.zeros((m, 3))
    press[:, 0] = bolts
    pull[:, 0] = 0.3 * (place[:, 0] / length - 0.5) * bolts
    pull[:, 1] = 0.1 * (1 + place[:, 0] / length)
    pull[:, 2] = 0.05
    loads = W @ np.column_stack([press.ravel(), pull.ravel()])
    return Flexibility(
        W, np.zeros((3 * m, 0)), np.zeros(0), loads, np.zeros((0, 2)), np.zeros((2, 2))
    )


def steps_of_a_cycle(flexibility, pairs, load, steps):
    """Seconds, iterations and states of every step of the cycle after the first loading."""
    none = np.zeros(0)
    start = ContactSolver(flexibility, 0.0, np.ones(pairs), np.full(pairs, FORWARD, np.int8))
    rest = start.solve(flexibility.loads_v[:, 0], none, np.zeros((pairs, 2)))
    scale = np.full(pairs, np.abs(rest.r).max())
    solver = ContactSolver(flexibility, FRICTION, scale, at_rest(touches(rest.status)))
    solver.start_from(rest.r, rest.q, rest.v)
    vt_old = slip_history(rest.v, 3)

    def along(theta):
        return np.column_stack([np.ones(len(theta)), load * np.sin(theta)])

    def go(path):
        return follow_path(solver, flexibility, path, vt_old, where=str, remedy="smaller steps")

    go(along(np.linspace(0, np.pi / 2, 26)))
    cycle = along(np.pi / 2 + 2 * np.pi * np.arange(101) / 100)
    seconds, iterations, status = [], [], []
    for k in range(steps):
        began = time.thread_time()
        record = go(cycle[k : k + 2].copy())
        seconds.append(time.thread_time() - began)
        iterations.append(int(record.iterations[1]))
        status.append(record.status[1])
    return np.array(seconds), np.array(iterations), np.array(status), solver


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--strips", nargs="+", default=["25x8", "50x14", "100x20"])
    parser.add_argument("--loads", nargs="+", type=float, default=[0.15, 0.3, 0.6])
    parser.add_argument("--steps", type=int, default=100)
    asked = parser.parse_args()
    print("| pairs | touching | slipping, median | largest | iterations | median step, ms | hard |")
    print("|---|---|---|---|---|---|---|")
    for name in asked.strips:
        place, W = strip(*map(int, name.split("x")))
        flexibility = pressed(place, W)
        m = len(place)
        for load in asked.loads:
            seconds, iterations, status, solver = steps_of_a_cycle(
                flexibility, m, load, asked.steps
            )
            slips = (status == SLIP).sum(axis=1)
            print(
                f"| {m:,} | {int(np.median(touches(status).sum(axis=1)))} | {int(np.median(slips))} | "
                f"{slips.max()} | {iterations.mean():.1f} | {1e3 * np.median(seconds):.2f} | "
                f"{solver.fallbacks.hard} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
