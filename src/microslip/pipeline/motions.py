"""How far each analysis moved the joint: the column ``motions`` of `microslip.registry.ANALYSES`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from microslip.analyses.reduced.sweep import CONVERGED
from microslip.pipeline.cycle import amplitude_named
from microslip.pipeline.run import Run


@dataclass(frozen=True)
class Motion:
    """The largest motion under one load.

    Attributes
    ----------
    analysis : str
        As in the input file.
    where : str
        Load, frequency, ...: for messages.
    amplitude : complex
        Of the sliding mode's coordinate, kg^0.5 m^0.5, with its phase to the moment: real where both
        are largest at one time.
    load : float
        Amplitude on the driven port: of the end moment, N m per metre of width.
    """

    analysis: str
    where: str
    amplitude: complex
    load: float


def cycle_motions(run: Run) -> Iterator[Motion]:
    """Every cycle asked for by its load; tables that only serve a response are none."""
    asked = run.joint.analysis.cycle
    assert asked is not None
    listed = asked.listed is not None or asked.largest is not None
    if run.joint.analysis.response is not None and not listed:
        return
    port = run.model.port(run.mode.port)
    for drive, cycles in run.cycles.items():
        for cycle, moment in zip(cycles, run.moments[drive], strict=True):
            yield Motion(
                "cycle",
                f"{amplitude_named(run.assembly, moment)}, {drive}-driven",
                float(np.abs(cycle.output[:, port]).max()),
                0.0 if drive == "mode" else moment,
            )


def response_motions(run: Run) -> Iterator[Motion]:
    """Peak of every response."""
    named = run.joint.driven.load.named
    for found in run.responses:
        if (found.flag == CONVERGED).any():
            where = f"{named(found.load)}, {found.peak_frequency:.4g} Hz, {found.variant}"
            phase = np.angle(found.amplitude[found.peak])
            yield Motion("response", where, found.peak_amplitude * np.exp(1j * phase), found.load)


def harmonic_motions(run: Run) -> Iterator[Motion]:
    """Largest response under every load."""
    named = run.joint.driven.load.named
    for found in run.harmonic:
        if found.points:
            top = max(found.points, key=lambda point: abs(point.amplitude))
            where = f"{named(found.load)}, {top.frequency:.4g} Hz"
            yield Motion("harmonic", where, top.amplitude, found.load)


def time_motions(run: Run) -> Iterator[Motion]:
    """Every steady state."""
    named = run.joint.driven.load.named
    for point in run.time_domain:
        steady = point.steady
        where = f"{named(steady.load)}, {steady.frequency:.4g} Hz"
        yield Motion("time", where, steady.amplitude, steady.load)


def history_motions(run: Run) -> Iterator[Motion]:
    """The instants of the largest motion and of the largest load of every history."""
    port = run.model.port(run.mode.port)
    for history in run.histories:
        q = history.output[:, port]
        for signal in (q, history.load):
            top = int(np.argmax(np.abs(signal)))
            load = float(history.load[top]) if history.drive != "mode" else 0.0
            where = f"{history.name!r} at {history.time[top]:.4g} s"
            yield Motion("history", where, float(q[top]), load)
