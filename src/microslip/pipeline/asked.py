"""What each analysis will compute, in a line: the column ``request`` of `microslip.registry.ANALYSES`.

Every function takes a joint that asks for its analysis and yields names and values for
``microslip check``.
"""

from __future__ import annotations

from collections.abc import Iterator

from microslip.describe.joint import Joint
from microslip.describe.requests import CYCLES_EACH, MARCHED_EACH
from microslip.describe.units import readable
from microslip.pipeline.cost import rough_frequency
from microslip.pipeline.excitation import prepare_histories

Line = tuple[str, str]
"""Name and value."""


def cycle_request(joint: Joint) -> Iterator[Line]:
    """Amplitudes of the quasi-static cycles, and what drives them."""
    amplitudes = joint.cycle_amplitudes()
    low, high = amplitudes[0], amplitudes[-1]
    drives = " and ".join(joint.drives)
    said, asked = joint.driven.load, joint.analysis.cycle
    if joint.driven_by_end_moments:
        span = f"M/(P L) {low:.3g} to {high:.3g}"
    elif asked is not None and asked.listed:
        span = f"{said.symbol} {low:.3g} to {high:.3g} {said.unit}"
    else:
        span = f"{low:.3g} to {high:.3g} of what opens the joint, slides it, or loads it as the preload"
    yield "quasi-static cycles", f"{len(amplitudes)} amplitudes, {span}, driven by {drives}"


def response_request(joint: Joint) -> Iterator[Line]:
    """Band and variants of the reduced models."""
    asked = joint.analysis.response
    assert asked is not None
    if asked.from_ is None and asked.to is None:
        band = f"{asked.count} frequencies and more, in a band that follows from the joint"
    else:
        ends = ["the joint's" if end is None else f"{end:g} Hz" for end in (asked.from_, asked.to)]
        band = f"{asked.count} frequencies, {ends[0]} to {ends[1]}"
    yield "response", band
    yield "reduced models", ", ".join(joint.variants)
    if asked.method == "auto":
        each = (
            f"{CYCLES_EACH} cycles each on average, as many again with more steps, {MARCHED_EACH} more "
            "where motions creep"
        )
        most = f"at most {asked.points} steady states in time per load, {each}"
        yield "put right", f"{most}, to an error of {asked.error:g}"
    if asked.method == "corrected":
        most = f"at most {asked.corrections} steady states in time per load"
        yield "corrected", f"{most}, to an error of {asked.error:g}"


def backbone_request(joint: Joint) -> Iterator[Line]:
    """Modes, amplitudes and methods of the backbones."""
    asked = joint.analysis.backbone
    assert asked is not None
    numbers = ", ".join(map(str, asked.modes))
    methods = ", ".join(method.replace("_", "-") for method in asked.methods)
    yield "backbones", f"mode {numbers}: {asked.count} amplitudes, {methods}"


def harmonic_request(joint: Joint) -> Iterator[Line]:
    """Band and harmonics of harmonic balance."""
    asked = joint.analysis.harmonic
    assert asked is not None
    adaptive = asked.harmonics == "adaptive"
    number = f"{asked.branch_harmonics} to {asked.most}" if adaptive else str(asked.harmonics)
    yield "harmonic balance", f"{_span(asked.band())}, {number} harmonics"


def time_request(joint: Joint) -> Iterator[Line]:
    """Frequencies and steps of time integration."""
    asked = joint.analysis.time
    assert asked is not None
    yield "steady states in time", f"{_span(asked.band())}, {asked.steps} steps per cycle"


def history_request(joint: Joint) -> Iterator[Line]:
    """Steps of every history.

    Raises
    ------
    InputError
        Where a signal cannot be used.
    """
    kind = joint.driven.load.parsed
    for item in prepare_histories(joint.analysis.history, rough_frequency(joint), kind):
        steps = len(item.load) - 1
        yield (
            f"history {item.entry.label!r}",
            f"about {steps} steps of {readable(item.dt, 's')}, {readable(steps * item.dt, 's')}",
        )


def _span(band: tuple[float, ...]) -> str:
    return f"{len(band)} frequencies, {band[0]:g} to {band[-1]:g} Hz"
