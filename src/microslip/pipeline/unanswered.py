"""What a forced response could not say, in the words of the joint."""

from __future__ import annotations

import numpy as np

from microslip.analyses.reduced.resonance import resonance_of
from microslip.analyses.reduced.response import Response
from microslip.analyses.reduced.sweep import OUTSIDE
from microslip.describe.ports import LoadKind
from microslip.errors import Failure
from microslip.pipeline.band import Axis, Curve
from microslip.pipeline.loads import opening_amplitude
from microslip.pipeline.prepare import Assembly

WIDEN = (
    "widen analysis.response.from and to, or leave them out: the band then follows from the joint"
)

NEARLY = 0.95
"""A table that goes to this share of the opening amplitude reaches as far as one can."""


def response_failures(
    assembly: Assembly, response: Response, curve: Curve, axis: Axis
) -> list[Failure]:
    """Failures of one curve: points without an answer, and no peak in the band."""
    place = f"{response.variant}, {curve.load}"
    found = []
    if len(response.unconverged) or _outgrown(response):
        found.append(Failure("response", place, *_unanswered(assembly, response, curve)))
    elif response.peak_at_edge:
        end = axis.low if response.peak == 0 else axis.high
        reason = f"no peak in the band: the amplitude is largest at its edge, {end:.6g} Hz"
        found.append(Failure("response", place, reason, WIDEN))
    return found


def _outgrown(response: Response) -> bool:
    """Whether the branch of the larger amplitudes leaves the table."""
    return response.outgrown is not None and bool(response.outgrown.any())


def _unanswered(assembly: Assembly, response: Response, curve: Curve) -> tuple[str, str]:
    """Reason and remedy of points without an answer."""
    bad, said = response.unconverged, assembly.joint.driven.load
    if not len(bad):
        assert response.outgrown is not None
        bad = response.frequency[response.outgrown]
    points = f"{len(bad)} of {len(response.frequency)} points"
    span = f"{bad.min():.6g} to {bad.max():.6g} Hz"
    if not (response.flag == OUTSIDE).any() and not _outgrown(response):
        reason = f"{points} did not converge, {span}"
        return reason, "raise analysis.response.max_iterations"
    if curve.table is None:
        limit = opening_amplitude(assembly)
        largest = limit / float(np.abs(response.amplitude).max()) * response.load
        reason = f"without friction the vibration opens the joint, {span}"
        return reason, _weaker(said, response.load, largest)
    resonances = resonance_of(curve.model, curve.table)
    if curve.table.amplitude[-1] >= NEARLY * opening_amplitude(assembly):
        largest = resonances.largest_load
        if response.load > largest:
            k = int(np.argmax(resonances.load))
            at = resonances.omega[k] / (2 * np.pi)
            reason = (
                f"its resonance opens the joint: from {said.named(largest)} on it "
                f"outgrows what the clamp holds, near {at:.5g} Hz; {_what(response)} from {span}"
            )
            return reason, _weaker(said, response.load, largest)
        reason = f"the vibration opens the joint: {points} have no answer, {span}"
        return reason, "lower the load, or raise clamp.force"
    reason = f"{points} have no answer in the table, {span}"
    if response.variant == "refined":
        return reason, "lower the load, or see why the table's cycles above were not solved"
    return reason, "lower the load; the refined model's table reaches further"


def _what(response: Response) -> str:
    """What there is in the frequencies that are named."""
    return "no answer" if len(response.unconverged) else "the smaller of two answers"


def _weaker(said: LoadKind, load: float, largest: float) -> str:
    """What keeps a joint closed under a load; everything scales with the clamp force."""
    return (
        f"lower the {said.noun} from {load:.4g} to below {largest:.4g} {said.unit}, or raise clamp.force "
        f"more than {load / largest:.3g} times"
    )
