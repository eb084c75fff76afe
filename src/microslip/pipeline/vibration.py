"""The largest periodic motion that an analysis has found, as a motion of the whole structure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from microslip.analyses.harmonic.points import HarmonicPoint
from microslip.analyses.time.point import TimePoint
from microslip.analyses.time.readings import harmonics_of, phases
from microslip.brief import Brief
from microslip.contact.fields import ContactFields, contact_fields
from microslip.numerics.fourier import to_complex
from microslip.pipeline.motion import PeriodicMotion, periodic_motion, prestressed_shape
from microslip.pipeline.prepare import Assembly
from microslip.pipeline.run import Run
from microslip.typing import Array, Complex, Status

WATCHED = 720
"""Phases at which the coordinate of a motion is looked at."""


@dataclass(frozen=True, repr=False)
class Vibration(Brief):
    """A periodic motion under ``load sin(theta)``.

    Attributes
    ----------
    analysis : str
        ``harmonic`` or ``time``.
    load : float
        Amplitude of the driven port.
    coordinate : (H + 1,) complex array
        Harmonics of the modal coordinate from prestress.
    motion : PeriodicMotion
    theta : (s + 1,) array
        Phases of the load over one turn at which its contact is known, rad.
    contact : ContactFields
        At these phases, (s + 1, m).
    status : (s + 1, m) int8 array
    friction_work : (m,) array
        Energy dissipated per cycle by each pair, J (per metre of width in two dimensions).
    doubt : str
        What keeps it from being a stable periodic motion; empty where nothing does.
    """

    analysis: str
    load: float
    coordinate: Complex
    motion: PeriodicMotion
    theta: Array
    contact: ContactFields
    status: Status
    friction_work: Array
    doubt: str = ""

    def turns(self) -> tuple[float, float]:
        """Phases of the load, rad, at which the modal coordinate is largest, and largest the other way."""
        theta = np.linspace(0, 2 * np.pi, WATCHED, endpoint=False)
        Y = self.coordinate
        q = (np.exp(1j * np.outer(theta, np.arange(1, len(Y)))) @ Y[1:]).imag
        return float(theta[np.argmax(q)]), float(theta[np.argmin(q)])

    def from_prestress(self, assembly: Assembly, theta: Array) -> Array:
        """Displacements (s, n) of the structure at phases of the load, rad."""
        return np.asarray(
            periodic_motion(assembly, self.motion, theta) - prestressed_shape(assembly)
        )


def largest_vibrations(run: Run) -> dict[str, Vibration]:
    """The motion of largest amplitude by harmonic balance and in time, of whatever load, by analysis.

    One without friction only where there is no other, and one that is not stable or not periodic likewise.
    """
    found = {}
    entries = [
        (entry.friction > 0, stability is None or stability.stable, point)
        for entry in run.harmonic
        for point, stability in zip(entry.points, entry.stability, strict=True)
    ]
    if entries:
        _, stable, point = max(entries, key=lambda e: (*e[:2], abs(e[2].amplitude)))
        found["harmonic"] = balanced_vibration(run.assembly, point, "" if stable else "unstable")
    if run.time_domain:
        top = max(
            run.time_domain, key=lambda p: (p.friction > 0, p.settled, abs(p.steady.amplitude))
        )
        found["time"] = steady_vibration(run.assembly, top)
    return found


def balanced_vibration(assembly: Assembly, point: HarmonicPoint, doubt: str = "") -> Vibration:
    """A response of harmonic balance."""
    r, table = to_complex(point.r), point.problem.table
    basis = np.column_stack([table.basis, table.basis[:, 0]])
    return Vibration(
        "harmonic",
        point.load,
        point.output[:, assembly.model.port(point.problem.coordinate)],
        PeriodicMotion(
            point.frequency,
            _ports(assembly, point.problem.port, point.load, len(r)),
            r,
            point.v[:, 0],
        ),
        np.linspace(0, 2 * np.pi, table.samples + 1),
        _fields(assembly, (point.r @ basis).T, (point.v @ basis).T),
        np.vstack([point.status.T, point.status[:, :1].T]),
        point.friction_work,
        doubt,
    )


def steady_vibration(assembly: Assembly, point: TimePoint) -> Vibration:
    """A steady state in time, with all harmonics that its steps tell apart; a walk is left out."""
    steady, model = point.steady, assembly.model
    cycle, theta = steady.cycle, phases(steady)
    count = (len(theta) - 2) // 2
    r = harmonics_of(cycle.r, theta, count)
    doubt = "" if point.settled else "unstable" if steady.converged else "not steady"
    return Vibration(
        "time",
        steady.load,
        harmonics_of(cycle.output[:, model.port(assembly.prepared.coordinate)], theta, count),
        PeriodicMotion(
            steady.frequency,
            _ports(assembly, assembly.prepared.drive, steady.load, len(r)),
            r,
            cycle.v[:-1].mean(axis=0),
        ),
        theta,
        _fields(assembly, cycle.r, cycle.v),
        cycle.status,
        cycle.friction_work,
        doubt,
    )


def _fields(assembly: Assembly, r: Array, v: Array) -> ContactFields:
    return contact_fields(r, v, assembly.prestress.solution.v, assembly.model.area)


def _ports(assembly: Assembly, driven: str, load: float, harmonics: int) -> Complex:
    """Amplitudes of all ports, (H + 1, p): the preload in the mean and the load as a sine."""
    a = np.zeros((harmonics, len(assembly.model.ports)), dtype=complex)
    a[0] = assembly.prepared.held
    a[1] = assembly.model.amplitudes({driven: load})
    return a
