"""How finely the paper is computed again: in full, or quickly on a coarser joint."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from microslip.pipeline.sources import DRIVE
from microslip.typing import Array

PORTS = {"moment": DRIVE, "mode": "sliding"}
"""Port that each of the paper's drives acts on: the end moments, or the inertia of the mode."""

PAPER_RHO = 0.8
"""The load of the paper's time-domain figures."""

PAPER_BEST_RHO = 2.4
"""Where the paper finds the greatest damping: the one calibration."""


@dataclass(frozen=True)
class Settings:
    """Meshes, amplitudes, frequencies and loads.

    Attributes
    ----------
    pairs : int
        Contact pairs of the joint.
    meshes : tuple of int
        Contact pairs of the mesh study (figure 3).
    smallest, largest : float
        M/(PL) of the smallest quasi-static cycle, and of the largest over that which opens the joint.
    amplitudes : int
        Quasi-static cycles between them, evenly spaced in the logarithm.
    summit : tuple of float, float, int
        M/(PL) between which more cycles are added, and how many. Interpolation puts the greatest
        damping at a cycle, and the calibration of rho hangs on it.
    prescribed : int
        Cycles with the mode prescribed, of the refined model's table.
    upper_modes : int
        Modes whose superharmonic resonance the refined model looks at.
    cycle_steps : int
        Load steps of a quasi-static cycle.
    time_steps : int
        Time steps per cycle, the paper's.
    step_counts : tuple of int
        Time steps per cycle that figure 6 compares; the last is its reference.
    band : tuple of float
        Hz.
    frequencies : int
        Of a reduced model's response.
    time_frequencies : tuple of float
        Hz, time domain at the paper's load.
    other_frequencies : tuple of float
        Hz, time domain at the other loads of figure 11.
    response_rhos : tuple of float
        Loads of figure 11 with friction.
    map_rhos, map_frequencies : int
        Grid of figures 13 and 14.
    branch_rhos, branch_frequencies : int
        Grid on which solutions are counted (figure 16).
    checked_rhos : tuple of float
        Loads whose resonance is checked in the time domain.
    marched_cycles : int
        Cycles marched from rest, as the paper did.
    max_cycles : int
        Of the accelerated search.
    """

    pairs: int = 201
    meshes: tuple[int, ...] = (41, 61, 81, 101, 151, 201, 301)
    smallest: float = 5e-5
    largest: float = 0.95
    amplitudes: int = 25
    summit: tuple[float, float, int] = (7e-3, 16e-3, 18)
    prescribed: int = 48
    upper_modes: int = 12
    cycle_steps: int = 300
    time_steps: int = 150
    step_counts: tuple[int, ...] = (20, 30, 60, 90, 120, 150, 300, 600)
    band: tuple[float, float] = (165.0, 190.0)
    frequencies: int = 2501
    time_frequencies: tuple[float, ...] = (
        165.0, 168.0, 170.0, 171.0, 172.0, 173.0, 174.0, 175.0, 176.0, 177.0, 178.0, 180.0, 183.0,
        186.0, 190.0,
    )  # fmt: skip
    other_frequencies: tuple[float, ...] = (
        165.0, 170.0, 174.0, 176.0, 177.0, 178.0, 179.0, 180.0, 181.0, 183.0, 186.0, 190.0,
    )  # fmt: skip
    response_rhos: tuple[float, ...] = (0.8, 2.4, 5.0)
    map_rhos: int = 85
    map_frequencies: int = 501
    branch_rhos: int = 22
    branch_frequencies: int = 101
    checked_rhos: tuple[float, ...] = (0.8, 1.2, 1.6, 2.0, 2.4, 3.2, 4.0, 5.0)
    marched_cycles: int = 180
    max_cycles: int = 200

    def cycle_loads(self, opening: float) -> tuple[float, ...]:
        """M/(PL) of the quasi-static cycles, ascending."""
        wide = np.geomspace(self.smallest, self.largest * opening, self.amplitudes)
        return tuple(float(x) for x in np.union1d(wide, np.geomspace(*self.summit)))

    def response_band(self) -> Array:
        """Frequencies of a reduced model's response, Hz."""
        return np.linspace(*self.band, self.frequencies)

    def map_band(self) -> Array:
        """Frequencies of the maps, Hz."""
        return np.linspace(*self.band, self.map_frequencies)

    def rho_range(self, count: int) -> Array:
        """Loads from the paper's least to its greatest friction."""
        return np.linspace(PAPER_RHO, 5.0, count)


FULL = Settings()

QUICK = Settings(
    pairs=101,
    meshes=(41, 81, 101, 151, 201),
    amplitudes=18,
    summit=(7e-3, 16e-3, 10),
    prescribed=28,
    upper_modes=0,
    cycle_steps=200,
    step_counts=(20, 30, 60, 90, 120, 150, 300),
    frequencies=1251,
    time_frequencies=(165.0, 170.0, 172.0, 173.0, 174.0, 175.0, 177.0, 180.0, 185.0),
    other_frequencies=(165.0, 174.0, 177.0, 178.0, 179.0, 181.0, 185.0),
    map_rhos=43,
    map_frequencies=251,
    branch_rhos=11,
    branch_frequencies=51,
    checked_rhos=(0.8, 1.6, 2.4, 5.0),
    marched_cycles=180,
    max_cycles=120,
)
