"""What a forced response could not say, in the words of the joint."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from microslip.analyses.reduced.response import Response
from microslip.analyses.reduced.sweep import OUTSIDE
from microslip.describe.joint import Joint
from microslip.errors import Caution, Failure
from microslip.pipeline.band import Axis, Curve
from microslip.pipeline.loads import opening_amplitude
from microslip.pipeline.prepare import Assembly

WIDEN = (
    "widen analysis.response.from and to, or leave them out: the band then follows from the joint"
)

NEARLY = 0.95
"""A table that goes to this share of the opening amplitude reaches as far as one can."""


def response_failures(response: Response, curve: Curve, axis: Axis) -> list[Failure]:
    """What one curve has no answer for: points, or a peak in the band.

    Points where the vibration opens the joint are answered so, see `opening_of`.
    """
    place = f"{response.variant}, {curve.load}"
    found = []
    bad = response.unconverged
    if len(bad) and not np.isfinite(response.opening_load):
        found.append(Failure("response", place, *_unanswered(response)))
    elif response.peak_at_edge and not np.isfinite(response.opening_load):
        end = axis.low if response.peak == 0 else axis.high
        reason = f"no peak in the band: the amplitude is largest at its edge, {end:.6g} Hz"
        found.append(Failure("response", place, reason, WIDEN))
    return found


def _unanswered(response: Response) -> tuple[str, str]:
    """Reason and remedy of points without an answer in a joint that stays closed."""
    bad = response.unconverged
    points = f"{len(bad)} of {len(response.frequency)} points"
    span = f"{bad.min():.6g} to {bad.max():.6g} Hz"
    if not (response.flag == OUTSIDE).any():
        reason = f"{points} did not converge, {span}"
        return reason, "raise analysis.response.max_iterations"
    if response.variant in ("corrected", "auto"):
        more = {"corrected": "corrections", "auto": "points"}[response.variant]
        reason = f"{points} have no answer, {span}: no steady state is known there"
        return reason, f"raise analysis.response.{more}, or lower the load"
    reason = f"{points} have no answer in the table, {span}"
    if response.variant == "refined":
        return reason, "lower the load, or see why the table's cycles above were not solved"
    return reason, "lower the load; the refined model's table reaches further"


def with_opening(assembly: Assembly, response: Response, curve: Curve) -> Response:
    """The response with the load from which on its resonance opens the joint, where this one does."""
    if not ((response.flag == OUTSIDE).any() or _outgrown(response)):
        return response
    limit = opening_amplitude(assembly)
    if curve.table is None:
        largest = limit / float(np.abs(response.amplitude).max()) * response.load
        return replace(response, opening_load=largest)
    if curve.table.amplitude[-1] < NEARLY * limit:
        return response
    return replace(response, opening_load=min(curve.resonance.largest_load, response.load))


def opening_of(assembly: Assembly, response: Response, curve: Curve) -> list[Caution]:
    """That the joint opens under a load, where and from which load on; nothing where it does not."""
    if not np.isfinite(response.opening_load):
        return []
    bad, said = response.unconverged, assembly.joint.driven.load
    if not len(bad):
        assert response.outgrown is not None
        bad = response.frequency[response.outgrown]
    span = f"{bad.min():.6g} to {bad.max():.6g} Hz"
    place = f"{response.variant}, {curve.load}"
    if curve.table is None:
        reason = f"without friction the vibration opens the joint, {span}"
    elif response.load > response.opening_load:
        at = curve.resonance.omega[int(np.argmax(curve.resonance.load))] / (2 * np.pi)
        what = "it is open" if len(response.unconverged) else "the smaller of two answers is shown"
        reason = (
            f"its resonance opens the joint: from {said.named(response.opening_load)} on "
            f"it outgrows what the clamp holds, near {at:.5g} Hz; {what} from {span}"
        )
    else:
        reason = f"the vibration opens the joint, {span}"
        return [
            Caution(
                "response", place, reason, f"lower the load, or raise {assembly.joint.preload_key}"
            )
        ]
    remedy = _weaker(assembly.joint, response.load, response.opening_load)
    return [Caution("response", place, reason, remedy)]


def two_motions(response: Response, curve: Curve) -> list[Caution]:
    """That two motions are answers at some frequencies, of which the larger is shown."""
    if response.smaller is None:
        return []
    at = response.folded
    ratio = np.abs(response.smaller.amplitude[at] / response.amplitude[at])
    least, f = int(np.argmin(ratio)), response.frequency[at]
    span = f"{f.min():.6g} to {f.max():.6g} Hz"
    reason = (
        f"two steady motions are answers at {len(at)} frequencies, {span}, and the larger is shown: "
        f"the other has down to {ratio[least]:.3g} of its amplitude, at {f[least]:.6g} Hz"
    )
    remedy = (
        "from rest, or as the frequency rises, the joint may move by the smaller; [analysis.harmonic] "
        "follows both and says which are stable"
    )
    return [Caution("response", f"{response.variant}, {curve.load}", reason, remedy)]


def _outgrown(response: Response) -> bool:
    """Whether the branch of the larger amplitudes leaves the table."""
    return response.outgrown is not None and bool(response.outgrown.any())


def _weaker(joint: Joint, load: float, largest: float) -> str:
    """What keeps a joint closed under a load; everything scales with the clamp force."""
    said = joint.driven.load
    return (
        f"lower the {said.noun} from {load:.4g} to below {largest:.4g} {said.unit}, or raise "
        f"{joint.preload_key} more than {load / largest:.3g} times"
    )
