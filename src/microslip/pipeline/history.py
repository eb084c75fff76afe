"""The histories that a joint file asks for: marched side by side, kept when interrupted."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from threading import Event
from typing import Any

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
from microslip.describe.excitation import Excitation, FreeDecay
from microslip.errors import Failure, MicroslipError
from microslip.numerics.execute import NotBegun, gather, threads
from microslip.pipeline.excitation import Prepared
from microslip.pipeline.loads import on_port, port_of
from microslip.pipeline.outcome import Outcome
from microslip.pipeline.prepare import Assembly
from microslip.pipeline.progress import Progress


def run_histories(
    assembly: Assembly, done: Mapping[str, Outcome[Any]], progress: Progress
) -> Outcome[tuple[History, ...]]:
    """All histories, in the order of the file.

    On Ctrl-C each stops at the end of its cycle and is kept as far as it is.
    """
    signals, stop = assembly.signals, Event()
    progress.start("histories", sum(signal.blocks for signal in signals))

    def one(signal: Prepared) -> History | MicroslipError:
        try:
            return march_history(assembly, signal, progress.advance, stop)
        except MicroslipError as error:
            return error

    found: list[History] = []
    failures: list[Failure] = []
    outcomes = gather(one, signals, threads(), stop)
    for signal, outcome in zip(signals, outcomes, strict=True):
        fail = partial(Failure, "history", repr(signal.entry.label))
        if isinstance(outcome, NotBegun):
            failures.append(fail("interrupted before it began"))
        elif isinstance(outcome, MicroslipError):
            failures.append(fail(str(outcome)))
        else:
            found.append(outcome)
            if outcome.failure:
                failures.append(fail(outcome.failure))
            elif not outcome.complete:
                failures.append(fail(f"interrupted at t = {outcome.time[-1]:.6g} s"))
    progress.finish()
    return Outcome(tuple(found), tuple(failures), stop.is_set())


def march_history(
    assembly: Assembly, signal: Prepared, advance: Callable[[], None], stop: Event
) -> History:
    """One history, as far as it comes.

    Parameters
    ----------
    assembly : Assembly
    signal : Prepared
    advance : callable
        Called after every cycle.
    stop : Event
        Ends it after the cycle it is in.

    Raises
    ------
    MicroslipError
        Where it cannot begin.
    """
    a, entry = assembly, signal.entry
    drive = a.joint.drive_named(entry.drive)
    amplitude = float(on_port(a, drive, amplitude_of(entry, a)))
    scheme = time_scheme(a.prepared, signal.dt, port=port_of(a, drive))
    positions = entry.positions or (a.measures.edge,)
    recording = Recording(
        name=entry.label,
        kind=entry.kind,
        drive=drive,
        watched=nearest_pairs(a.model.position, positions),
        kept=field_steps(
            len(signal.load) - 1, signal.dt, entry.field_samples, entry.field_from, entry.field_to
        ),
        cycle_steps=signal.cycle_steps,
    )
    return run_history(
        scheme,
        _start(entry, a, scheme, amplitude),
        signal.load * amplitude,
        recording,
        advance=advance,
        stopped=stop.is_set,
    )


def amplitude_of(entry: Excitation, assembly: Assembly) -> float:
    """Load that an entry asks for; 1 where its signal has the amplitude in it."""
    amplitude = assembly.joint.history_load(entry)
    return 1.0 if amplitude is None else amplitude


def _start(entry: Excitation, a: Assembly, scheme: TimeScheme, amplitude: float) -> State:
    """State at t = 0."""
    if not isinstance(entry, FreeDecay):
        return prestressed_state(scheme)
    if entry.start == "mode":
        assert entry.modal_amplitude is not None
        return prestressed_state(scheme, entry.modal_amplitude, a.mode.sliding_omega)
    if entry.start == "static":
        return static_state(scheme, amplitude)
    assert entry.frequency is not None
    # from rest the phase of the cycle is zero, so that it ends as the load passes through zero
    found = steady_state(scheme, entry.frequency, amplitude)
    if not found.converged:
        raise MicroslipError(
            f"the state to start from is not steady after {found.cycles} cycles at "
            f"{entry.frequency:g} Hz, last change {found.change:.1e}: change frequency or moment"
        )
    return found.cycle.state
