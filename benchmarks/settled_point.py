"""Where the time of a settled time point goes, on the reference joint with 201 pairs. Some ten seconds.

Processor seconds of raising the load over ten cycles, of the search, of the stability of what it found and
of seeking that on with more steps, and of these what is spent in cycles with deviations; twelve points
between 170 and 190 Hz. The whole is that without more steps.

    python benchmarks/settled_point.py
"""

from __future__ import annotations

import time
from collections import Counter
from math import nan
from typing import Any
from unittest.mock import patch

import numpy as np
from threadpoolctl import threadpool_limits

from microslip import prepare, reference_joint
from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.time import half_period, stability, steady
from microslip.analyses.time.point import Request, TimePoint
from microslip.analyses.time.scheme import March, contact_memory, march, time_scheme
from microslip.analyses.time.stability import settling_error
from microslip.analyses.time.steady import RAISED
from microslip.analyses.time.step_refinement import REFINEMENT, with_finer_steps

LOADS, FREQUENCIES, STEPS = (1e-4, 1.5e-4, 3e-4), (170.0, 176.0, 181.0, 190.0), 150
"""M/(PL), Hz and steps per cycle."""


def spent(joint: PreparedJoint, frequency: float, load: float) -> dict[str, float]:
    """Seconds of each part, and the cycles of the search."""
    found: Counter[str] = Counter()

    def timed(*arguments: Any, **options: Any) -> March:
        began = time.thread_time()
        done = march(*arguments, **options)
        if options.get("tangents") is not None:
            found["with deviations"] += time.thread_time() - began
        return done

    with patch.object(steady, "march", timed), patch.object(half_period, "march", timed):
        scheme = time_scheme(joint, 1 / (frequency * STEPS), frequency=frequency)
        memory = contact_memory(scheme)
        marks = [time.thread_time()]
        start = steady.raised_state(scheme, frequency, load, RAISED, memory)
        marks.append(time.thread_time())
        point, known = steady.linearised_state(scheme, frequency, load, start=start, memory=memory)
        marks.append(time.thread_time())
        stable = stability.stability_of(scheme, point, memory=memory)
        marks.append(time.thread_time())
        request = Request(nan, frequency, load, None, 0j, STEPS, refinement=REFINEMENT)
        settled = TimePoint(nan, nan, point, stable, settling_error(point, stable), steps=STEPS)
        finer = with_finer_steps(joint, request, settled, known)
        marks.append(time.thread_time())
    parts = zip(("raising", "search", "stability", "more steps"), np.diff(marks), strict=True)
    whole = {"whole": marks[3] - marks[0], "with more steps": marks[4] - marks[0]}
    return {**dict(parts), **found, **whole, "cycles": point.cycles, "steps": finer.steps}


def main() -> None:
    """Print medians."""
    with threadpool_limits(1):
        joint = prepare(reference_joint())
        spent(joint, FREQUENCIES[0], LOADS[0] * 1e6 * 0.2515)
        rows = [spent(joint, f, load * 1e6 * 0.2515) for load in LOADS for f in FREQUENCIES]
    for name in rows[0]:
        values = [row[name] for row in rows]
        print(f"{name}: median {np.median(values):.3g}, {min(values):.3g} to {max(values):.3g}")


if __name__ == "__main__":
    main()
