"""The refined model held against the full joint, at the resonance and about half power.

On lap joints drawn at random the refined model errs by more than a per cent about the peak of half of them,
and its own indicator does not tell of which. A steady state of time integration tells, for a tenth of a
second: one at the peak, where it shows in the damping, and one at either side, where a frequency that is
off shows.
"""

from __future__ import annotations

import threading
from collections.abc import Sequence

import numpy as np

from microslip.analyses.reduced.response import Check, Response
from microslip.analyses.reduced.sweep import CONVERGED
from microslip.errors import Caution, MicroslipError
from microslip.numerics.execute import each, threads
from microslip.pipeline.brief_motion import patient_motion
from microslip.pipeline.prepare import Assembly
from microslip.pipeline.walk import DOUBTFUL

HALF_POWER = np.sqrt(0.5)
"""Of the peak, where the others are."""

AGREES = 0.01
"""Relative error of the amplitude above which it is said."""


def checked_at(response: Response, count: int) -> list[int]:
    """Frequencies to hold a response against the full joint, by index: the peak, then half power.

    Parameters
    ----------
    response : Response
    count : int
        How many at most.
    """
    good, peak = response.flag == CONVERGED, response.peak
    if not good.any() or response.peak_at_edge or not good[peak - 1 : peak + 2].all():
        return []
    if response.outgrown is not None:
        good &= ~response.outgrown
    size = np.where(good, np.abs(response.amplitude), 0.0)
    chosen = [peak]
    for side in (np.arange(peak - 1, -1, -1), np.arange(peak + 1, len(size))):
        below = side[size[side] <= HALF_POWER * size[peak]]
        if len(below) and size[below[0]] > 0:
            chosen.append(int(below[0]))
    return chosen[:count]


def checks(
    assembly: Assembly, response: Response, count: int, stop: threading.Event
) -> tuple[Check, ...]:
    """A response held against motions of the full joint, by frequency.

    Parameters
    ----------
    assembly : Assembly
    response : Response
        Of the refined model.
    count : int
        At how many frequencies at most: the peak, then half power.
    stop : Event
        Set on Ctrl-C; then there are none.
    """
    joint = assembly.prepared

    def work(k: int) -> Check:
        f, modelled = float(response.frequency[k]), complex(response.amplitude[k])
        try:
            found = patient_motion(joint, response.load, f, modelled)
        except MicroslipError:
            return Check(f, modelled, 0j, np.nan)
        known = found.doubt <= DOUBTFUL
        return Check(f, modelled, found.amplitude, found.doubt if known else np.nan)

    try:
        return tuple(each(work, sorted(checked_at(response, count)), threads()))
    except KeyboardInterrupt:
        stop.set()
        return ()


def worst_of(response: Response) -> float:
    """Signed error of the check that differs most; nan where there is none."""
    known = [check for check in response.checks if np.isfinite(check.error)]
    return _worst(known).error if known else np.nan


def _worst(known: Sequence[Check]) -> Check:
    return max(known, key=lambda check: abs(check.error))


def not_as_in_time(place: str, response: Response) -> list[Caution]:
    """Where a response differs from the full joint, or could not be held against it."""
    remedy, found = 'take method = "corrected" or "auto" in [analysis.response]', []
    off = [check for check in response.checks if abs(check.error) > AGREES + check.doubt]
    if off:
        worst = _worst(off)
        reason = (
            f"held against time integration at {len(response.checks)} frequencies, its amplitude is off by "
            f"more than {AGREES:.0%} at {len(off)}, most at {worst.frequency:.6g} Hz: {worst.error:+.1%}"
        )
        found.append(Caution("response", place, reason, remedy))
    open_ = [check for check in response.checks if check.doubt > AGREES and check not in off]
    if open_:
        worst = max(open_, key=lambda check: check.doubt)
        reason = (
            "the motion of the full joint was still creeping after hundreds of cycles at "
            + ", ".join(f"{check.frequency:.6g}" for check in open_)
            + f" Hz, its amplitude known to {worst.doubt:.0%}: the model was held against it no better"
        )
        found.append(Caution("response", place, reason, remedy))
    lost = [check.frequency for check in response.checks if np.isnan(check.error)]
    if lost:
        reason = (
            "no steady motion of the full joint was found within 30 cycles at "
            + ", ".join(f"{f:.6g}" for f in lost)
            + " Hz: there the model was not held against it"
        )
        found.append(Caution("response", place, reason, remedy))
    return found
