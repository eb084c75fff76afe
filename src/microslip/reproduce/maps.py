"""A reduced model over the plane of load and frequency."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from microslip.analyses.reduced.sweep import CONVERGED
from microslip.reproduce.peaks import Peak, vertex
from microslip.reproduce.study import Study
from microslip.reproduce.variants import Case, equivalent, respond, solutions
from microslip.typing import Array


@dataclass(frozen=True)
class ResponseMap:
    """One case on the grid (rows: rho, columns: frequency); nan without an answer.

    Attributes
    ----------
    rho, frequency : arrays
    amplitude : (n, k) array
        Over the frictionless peak under the same load.
    equivalent : (n, k) complex array
        ``k_eq + i gamma_eq`` read from the table at the answer.
    slope : (n, k) array
        ``|g'|`` at the answer.
    peaks : list of Peak
        Resonance of every rho, amplitude over the frictionless peak.
    """

    rho: Array
    frequency: Array
    amplitude: Array
    equivalent: NDArray[np.complex128]
    slope: Array
    peaks: list[Peak]

    @property
    def resonance(self) -> Array:
        """Frequency of the resonance of every rho, Hz."""
        return np.array([p.frequency for p in self.peaks])

    @property
    def height(self) -> Array:
        """Amplitude there."""
        return np.array([p.amplitude for p in self.peaks])

    @property
    def damped_most(self) -> Array:
        """Frequency of the greatest gamma_eq of every rho, Hz."""
        return np.asarray(self.frequency[np.nanargmax(self.equivalent.imag, axis=1)])


def response_map(study: Study, case: Case) -> ResponseMap:
    """The case over the whole plane, computed once."""
    return study.once(("map", case), lambda: _compute(study, case))


def _compute(study: Study, case: Case) -> ResponseMap:
    s = study.settings
    rhos, band = s.rho_range(s.map_rhos), s.map_band()
    study.progress.start(f"map, {case.label}", len(rhos))
    amplitude, slope, values, peaks = [], [], [], []
    with study.timed("maps"):
        for rho in rhos:
            response = respond(study, case, float(rho), band)
            unit = study.frictionless.peak_amplitude / study.frictionless.load * response.load
            good = response.flag == CONVERGED
            size = np.where(good, np.abs(response.amplitude) / unit, np.nan)
            amplitude.append(size)
            slope.append(np.where(good, response.contraction, np.nan))
            values.append(equivalent(study, case, float(rho), band))
            peaks.append(vertex(band, size))
            study.progress.advance()
    study.progress.finish()
    return ResponseMap(rhos, band, np.array(amplitude), np.array(values), np.array(slope), peaks)


def solution_counts(study: Study, case: Case) -> tuple[Array, Array, NDArray[np.int64]]:
    """Grid of rho and frequency, and how many solutions there are at each point of it."""
    s = study.settings
    rhos, band = s.rho_range(s.branch_rhos), np.linspace(*s.band, s.branch_frequencies)
    study.progress.start(f"solutions, {case.label}", len(rhos))
    counts = np.zeros((len(rhos), len(band)), np.int64)
    with study.timed("branches"):
        for i, rho in enumerate(rhos):
            counts[i] = [len(solutions(study, case, float(rho), float(f))) for f in band]
            study.progress.advance()
    study.progress.finish()
    return rhos, band, counts
