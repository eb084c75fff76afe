"""What drives a joint, and whether what the file says of its size fits it."""

from __future__ import annotations

from collections.abc import Sequence

from microslip.describe.amplitude import Load
from microslip.describe.excitation import Excitation
from microslip.describe.ports import END_MOMENTS, LoadPort
from microslip.describe.quantities import Rule
from microslip.describe.requests import CycleAnalysis

WORDS = {
    "moment": "a moment",
    "force": "a force",
    "base": "the motion of a base",
    "pressure": "a pressure",
}
"""Kinds of ports in messages."""


def end_moments(driven: LoadPort) -> bool:
    """Whether a port is the pair of end moments that no file needs to name."""
    return driven is END_MOMENTS


def drive_named(driven: LoadPort, drive: str) -> str:
    """What results call a drive: ``"mode"``; ``"moment"``, or ``"load"`` where it is none.

    Examples
    --------
    >>> tip = LoadPort(name="tip", kind="force")
    >>> drive_named(tip, "load"), drive_named(END_MOMENTS, "load"), drive_named(tip, "mode")
    ('load', 'moment', 'mode')
    """
    if drive == "mode":
        return drive
    return "moment" if driven.kind == "moment" else "load"


def keys_of(driven: LoadPort) -> tuple[str, ...]:
    """Keys that may give an amplitude of a port."""
    if end_moments(driven):
        return ("moment", "moment_over_clamp_force_length", "rho")
    return (driven.load.key,)


def check_loads(
    ports: Sequence[LoadPort],
    driven: LoadPort,
    load: Load | None,
    cycle: CycleAnalysis | None,
    histories: Sequence[Excitation],
) -> None:
    """Raise `Rule` where ``[load]`` names no port, or something that gives a load does not fit it."""
    name = None if load is None else load.port
    if name is not None and name not in [port.name for port in ports]:
        there = ", ".join(port.name for port in ports) or "none"
        raise Rule("load.port", f"there is no [[port]] of this name; there are: {there}")
    given: list[tuple[str, str | None]] = [] if load is None else [("load", load.kind)]
    given += [] if cycle is None else [("analysis.cycle", cycle.listed)]
    for k, entry in enumerate(histories):
        given.append((f"analysis.history.{k}", entry.load_key))
    for section, key in given:
        if key is not None and key not in keys_of(driven):
            raise Rule(f"{section}.{key}", _other_key(driven, key))
    if driven.kind == "moment":
        return
    remedy = f'the load is {WORDS[driven.kind]}: write "load", or leave it out'
    if cycle is not None and "moment" in (cycle.drives or ()):
        raise Rule("analysis.cycle.drives", remedy)
    for k, entry in enumerate(histories):
        if entry.drive == "moment":
            raise Rule(f"analysis.history.{k}.drive", remedy)


def _other_key(driven: LoadPort, key: str) -> str:
    """That a key does not fit a port, and which does."""
    if end_moments(driven):
        return f"equal end moments drive the joint: give moment, or load.port for {key}"
    return f"the port {driven.name!r} is {WORDS[driven.kind]}: give {driven.load.key}"
