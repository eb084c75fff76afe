"""Method "auto" beside opening, against time integration: the reference joint, rho = 0.8, 165 to 175 Hz.

    python docs/evidence/near_opening.py [pairs]

The truth is followed down from 180 Hz in steps of a quarter hertz until the branch ends, and sought from
rest at every hertz, and both are marched alone for 4000 cycles, as the bodies walk past each other, with four
times the steps, as these change how fast they do; the nearer of the two counts. Some minutes.
"""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

import numpy as np

from microslip import MicroslipError, parse_joint, run
from microslip.analyses.reduced.response import Response
from microslip.analyses.reduced.sweep import CONVERGED
from microslip.analyses.time.offset import HORIZON
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.starts import placed
from microslip.analyses.time.steady import SteadyState, steady_state
from microslip.analyses.time.watching import watched
from microslip.numerics.execute import each, threads
from microslip.pipeline.run import Run
from microslip.pipeline.targets import REFINEMENT, STEPS

JOINT = Path(__file__).parents[2] / "examples" / "lap_joint.toml"
RHO_SCALE = 2.03e-3
"""C of M = C mu P L / rho, as a run of examples/lap_joint.toml finds it."""
RHO = 0.8
CYCLES, PART = int(HORIZON), 100
"""Cycles marched, and those at the end whose mean counts."""
HERTZ = np.arange(165.0, 175.5, 1.0)


def by_auto(pairs: int | None) -> Run:
    """The response by method "auto"."""
    file = tomllib.loads(JOINT.read_text())
    file["contact"] |= {} if pairs is None else {"pairs": pairs}
    share = RHO_SCALE * file["contact"]["friction"] / RHO
    file["load"] = {"moment_over_clamp_force_length": [share]}
    band = {"from": 165.0, "to": 175.0, "count": 201}
    file["analysis"] = {"response": {"method": "auto", **band}}
    return run(parse_joint(file))


def followed(done: Run, load: float) -> dict[float, SteadyState]:
    """Motions on the branch that comes down from 180 Hz, by frequency, as far as it settles."""
    found, end = {}, None
    for f in np.arange(180.0, 164.9, -0.25):
        scheme = time_scheme(done.prepared, 1 / (f * STEPS), frequency=f)
        try:
            steady = steady_state(scheme, f, load, start=end, max_cycles=400)
        except MicroslipError as error:
            print(f"{f:g} Hz: {error}")
            break
        end = steady.end
        if steady.converged:
            found[float(f)] = steady
    return found


def from_rest(done: Run, curve: Response, k: int) -> SteadyState | None:
    """The steady state from rest, with the guess of the response, if there is one."""
    f = float(curve.frequency[k])
    scheme = time_scheme(done.prepared, 1 / (f * STEPS), frequency=f)
    try:
        steady = steady_state(scheme, f, curve.load, guess=complex(curve.amplitude[k]))
    except MicroslipError:
        return None
    return steady if steady.converged else None


def marched(done: Run, steady: SteadyState | None) -> float:
    """Size of a motion after it was marched alone; nan without one."""
    if steady is None:
        return np.nan
    f = steady.frequency
    scheme = time_scheme(done.prepared, 1 / (f * REFINEMENT * STEPS), frequency=f)
    state = placed(steady.end, scheme, f, steady.load)
    Q, _ = watched(scheme, steady.load, state, CYCLES, steady.phase)
    return float(np.abs(Q[-PART:]).mean())


def main() -> int:
    """Print the table."""
    done = by_auto(int(sys.argv[1]) if len(sys.argv) > 1 else None)
    (curve,) = done.responses
    branch = followed(done, curve.load)
    print("| Hz | auto | stated | followed | from rest | error |\n|---|---|---|---|---|---|")
    for f in HERTZ:
        k = int(np.argmin(np.abs(curve.frequency - f)))
        own = abs(curve.amplitude[k]) if curve.flag[k] == CONVERGED else np.nan
        motions = [branch.get(float(f)), from_rest(done, curve, k)]
        truths = np.array(list(each(lambda one: marched(done, one), motions, threads())))
        error = np.nanmin(np.abs(own / truths - 1)) if np.isfinite(own * truths).any() else np.nan
        assert curve.error_indicator is not None
        print(
            f"| {f:g} | {own:.5g} | {curve.error_indicator[k]:.1e} | {truths[0]:.5g} | "
            f"{truths[1]:.5g} | {error:.1e} |"
        )
    wide = np.mean(~(curve.error_indicator <= 0.01))
    print(
        f"flagged {100 * wide:.1f} %, {len(curve.anchors)} steady states", *done.cautions, sep="\n"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
