"""Pieces that several figures draw: contact states over a cycle, and tractions at a phase."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.patches import Patch
from numpy.typing import NDArray

from microslip.analyses.statics.cycle import Cycle
from microslip.analyses.time.readings import phases
from microslip.analyses.time.steady import SteadyState
from microslip.contact.pairs import normal, tangential
from microslip.model.joint import JointModel
from microslip.numerics.fourier import harmonic
from microslip.reproduce.settings import PORTS
from microslip.show.plots.states import COLOURS
from microslip.show.plots.style import BLACK, DRIVES, GREY, VERMILLION
from microslip.typing import Array

QUARTERS = ((0, "0"), (1, "π/2"), (2, "π"), (3, "3π/2"))
"""Quarters of a cycle and their phases as text."""


STATIC = {drive: DRIVES[drive] for drive in PORTS}
"""Lines of the paper's drives: the end moment, and the inertia of the mode."""


@dataclass(frozen=True)
class InterfaceMotion:
    """Contact over one cycle, phase counted from the zero of the motion (rows: steps).

    Attributes
    ----------
    q : (s + 1,) array
        Sliding coordinate.
    r, v : (s + 1, 2 m) arrays
    status : (s + 1, m) array
    work : (m,) array
        Friction work per cycle.
    """

    q: Array
    r: Array
    v: Array
    status: NDArray[np.int8]
    work: Array

    @property
    def steps(self) -> int:
        """Steps per cycle."""
        return len(self.q) - 1

    def at(self, quarter: int) -> int:
        """Step nearest to a quarter of the cycle."""
        return round(quarter * self.steps / 4)


def motion_of_cycle(cycle: Cycle, model: JointModel) -> InterfaceMotion:
    """Of a quasi-static cycle: load and motion are in phase."""
    q = cycle.output[:, model.port("sliding")]
    return InterfaceMotion(q, cycle.r, cycle.v, cycle.status, cycle.friction_work)


def motion_of_point(steady: SteadyState, model: JointModel) -> InterfaceMotion:
    """Of a steady vibration, its samples turned so that the motion passes zero first."""
    cycle = steady.cycle
    q = cycle.output[:, model.port("sliding")]
    theta = phases(steady)
    steps = len(theta) - 1
    motion = float(np.angle(harmonic(q, theta)))
    shift = round((-motion - theta[0]) / (2 * np.pi / steps)) % steps

    def turned(values: NDArray) -> NDArray:
        rolled = np.roll(values[:-1], -shift, axis=0)
        return np.concatenate([rolled, rolled[:1]])

    return InterfaceMotion(
        turned(q), turned(cycle.r), turned(cycle.v), turned(cycle.status), cycle.friction_work
    )


def no_answer_area() -> Patch:
    """Legend entry of what a map leaves blank."""
    return Patch(facecolor="white", edgecolor=BLACK, linewidth=0.5, label="no answer in the table")


def draw_states(ax: Axes, position: Array, contact: InterfaceMotion) -> None:
    """Map of the contact states: position across, phase upward."""
    edges = np.concatenate([[position[0]], 0.5 * (position[1:] + position[:-1]), [position[-1]]])
    ax.pcolormesh(
        edges,
        np.linspace(0, 2, contact.steps + 1),
        contact.status[1:],
        cmap=ListedColormap(COLOURS),
        norm=BoundaryNorm(np.arange(0.5, 5), 4),
        rasterized=True,
    )
    ax.grid(False)
    ax.set_yticks([0, 0.5, 1, 1.5, 2], ["0", "π/2", "π", "3π/2", "2π"])
    ax.set_xlim(position[0], position[-1])
    ax.set_xlabel("position $x/L_p$")


def draw_tractions(
    ax: Axes,
    position: Array,
    contact: InterfaceMotion,
    step: int,
    area: Array,
    friction: float,
    unit: float,
) -> float:
    """Friction limit ``±mu p`` and traction on the upper body at one step, over a unit (Pa).

    Returns the largest friction limit.
    """
    limit = friction * normal(contact.r[step]) / area / unit
    traction = -tangential(contact.r[step]) / area / unit
    ax.fill_between(position, -limit, limit, color="#dcdcdc", lw=0)
    ax.plot(position, limit, color=GREY, lw=0.9, ls="--", label=r"friction limit $\pm\mu p$")
    ax.plot(position, -limit, color=GREY, lw=0.9, ls="--")
    ax.plot(position, traction, color=VERMILLION, label="traction $f$ on the upper body")
    ax.set_xlim(position[0], position[-1])
    return float(limit.max())


def inner_height(
    contact: InterfaceMotion, position: Array, area: Array, friction: float, unit: float
) -> float:
    """Half height of axes that shows all tractions but the singular ones at the tips."""
    inner = np.abs(position) < 0.9 * np.abs(position).max()
    return float(1.15 * (friction * normal(contact.r) / area / unit)[:, inner].max())
