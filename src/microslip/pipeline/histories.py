"""The histories that a joint file asks for: marched in threads, kept when interrupted."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from threading import Event
from typing import TYPE_CHECKING

import numpy as np

from microslip.analyses.reduced.table import DRIVES
from microslip.analyses.statics.cycle import opening_load
from microslip.analyses.time.history import (
    History,
    Recording,
    field_steps,
    nearest_pairs,
    run_history,
    static_state,
)
from microslip.analyses.time.scheme import State, TimeScheme, prestressed_state, time_scheme
from microslip.analyses.time.steady import steady_state
from microslip.describe.excitation import Excitation, FreeDecay, LoadedExcitation
from microslip.errors import MicroslipError
from microslip.model.flexibility import static_flexibility
from microslip.numerics.execute import workers
from microslip.pipeline.excitation import Prepared
from microslip.typing import Array

if TYPE_CHECKING:
    from microslip.pipeline.progress import Progress
    from microslip.pipeline.run import JointAssembly


def end_moment(entry: Excitation, assembly: JointAssembly, rho_scale: float) -> float:
    """Amplitude that an entry asks for, N m per metre of width; 1 where it has none of its own.

    Parameters
    ----------
    entry : Excitation
    assembly : JointAssembly
    rho_scale : float
        C in ``rho = C mu P L / M``.
    """
    if not isinstance(entry, LoadedExcitation) or entry.load_key is None:
        return 1.0
    if entry.moment is not None:
        return entry.moment
    unit = assembly.moment_unit
    if entry.moment_over_clamp_force_length is not None:
        return entry.moment_over_clamp_force_length * unit
    assert entry.rho is not None
    if not np.isfinite(rho_scale):
        raise MicroslipError("rho has no scale: the forced response that calibrates it failed")
    return rho_scale * assembly.joint.contact.friction * unit / entry.rho


def drive_factor(drive: str, assembly: JointAssembly) -> float:
    """Amplitude on the port of a drive per end moment, both as close to opening the joint."""
    if drive == "moment":
        return 1.0
    a = assembly
    opening = opening_load(a.model, a.flexibility, a.prestress, DRIVES[drive])
    return float(opening / a.opening_moment)


def run_histories(
    assembly: JointAssembly,
    prepared: Sequence[Prepared],
    rho_scale: float,
    histories: list[History],
    failures: list[str],
    progress: Progress,
) -> None:
    """March all histories, in threads, into `histories` and `failures` in the order of the file.

    On Ctrl-C each stops at the end of its cycle and is kept as far as it is.
    """
    stop = Event()
    progress.start("histories", sum(p.blocks for p in prepared))

    def one(item: Prepared) -> History | str:
        try:
            return _run(assembly, item, rho_scale, progress, stop)
        except MicroslipError as error:
            return f"history {item.entry.label!r}: {error}"

    pool = ThreadPoolExecutor(workers())
    pending = [pool.submit(one, item) for item in prepared]
    try:
        wait(pending)
    finally:
        stop.set()
        pool.shutdown(wait=True, cancel_futures=True)
        for item, future in zip(prepared, pending, strict=True):
            _collect(item.entry.label, future, histories, failures)
    progress.finish()


def _collect(
    name: str, future: Future[History | str], histories: list[History], failures: list[str]
) -> None:
    label = f"history {name!r}"
    if future.cancelled():
        failures.append(f"{label}: interrupted before it began")
        return
    outcome = future.result()
    if isinstance(outcome, str):
        failures.append(outcome)
        return
    histories.append(outcome)
    if outcome.failure:
        failures.append(f"{label}: {outcome.failure}")
    elif not outcome.complete:
        failures.append(f"{label}: interrupted at t = {outcome.time[-1]:.6g} s")


def _run(
    assembly: JointAssembly, item: Prepared, rho_scale: float, progress: Progress, stop: Event
) -> History:
    entry, a = item.entry, assembly
    factor = drive_factor(entry.drive, a)
    amplitude = factor * end_moment(entry, a, rho_scale)
    scheme = time_scheme(
        a.model,
        a.prestress,
        a.joint.contact.friction,
        item.dt,
        port=DRIVES[entry.drive],
        compliance=contact_compliance(a),
    )
    positions = entry.positions or (a.joint.clamp.half_length,)
    recording = Recording(
        name=entry.label,
        kind=entry.kind,
        drive=entry.drive,
        watched=nearest_pairs(a.model.position, positions),
        kept=field_steps(
            len(item.load) - 1, item.dt, entry.field_samples, entry.field_from, entry.field_to
        ),
        cycle_steps=item.cycle_steps,
    )
    return run_history(
        scheme,
        _start(entry, a, scheme, amplitude),
        item.load * amplitude,
        recording,
        advance=progress.advance,
        stopped=stop.is_set,
    )


def contact_compliance(assembly: JointAssembly) -> Array:
    """Compliance of an elastic contact at every component of the pairs, m/N; zeros where exact."""
    total = assembly.flexibility.W
    return np.asarray(np.diag(total - static_flexibility(assembly.model).W), dtype=float)


def _start(entry: Excitation, a: JointAssembly, scheme: TimeScheme, amplitude: float) -> State:
    """State at t = 0."""
    if not isinstance(entry, FreeDecay):
        return prestressed_state(scheme)
    if entry.start == "mode":
        assert entry.modal_amplitude is not None
        return prestressed_state(scheme, entry.modal_amplitude, a.states.sliding_omega)
    if entry.start == "static":
        return static_state(scheme, a.flexibility, amplitude)
    assert entry.frequency is not None
    # from rest the phase of the cycle is zero, so that it ends as the load passes through zero
    found = steady_state(scheme, entry.frequency, amplitude)
    if not found.converged:
        raise MicroslipError(
            f"the state to start from is not steady after {found.cycles} cycles at "
            f"{entry.frequency:g} Hz, last change {found.change:.1e}: change frequency or moment"
        )
    return found.cycle.state
