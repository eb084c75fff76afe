"""Outputs of a response held to the steady states that it goes through.

The bound of a response is that of its amplitude, of the joint's mode. What else moves it has from the reduced
model (`microslip.analyses.reduced.outputs`), which knows upper modes and the slip of single pairs less well:
about the resonance of an upper mode that model has none of it. A cycle of each steady state tells.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from microslip.analyses.reduced.response import Response
from microslip.analyses.time.scheme import march, time_scheme
from microslip.analyses.time.starts import placed
from microslip.errors import MicroslipError
from microslip.numerics.execute import each, threads
from microslip.numerics.fourier import harmonic, without_drift
from microslip.pipeline.outcome import Caution
from microslip.pipeline.outputs import harmonics_by_name
from microslip.pipeline.prepare import Assembly
from microslip.pipeline.targets import Stepped
from microslip.typing import Array, Complex

SMALL = 0.01
"""Share of the largest size of an output below which it is compared with that share instead of its own."""


def outputs_held(
    assembly: Assembly, curve: Response, states: Mapping[int, Stepped], wanted: float, place: str
) -> list[Caution]:
    """What outputs of a response are off by at its steady states, where that is more than is wanted.

    Parameters
    ----------
    assembly : Assembly
    curve : Response
        With its outputs.
    states : mapping of int to Stepped
        Steady states that it goes through, by index of the frequency.
    wanted : float
        Relative.
    place : str
        Where cautions say to be.
    """
    if not curve.outputs:
        return []

    def motion_of(k: int) -> Complex | None:
        return _first_harmonics(assembly, states[k], curve.load)

    found = zip(sorted(states), each(motion_of, sorted(states), threads()), strict=True)
    known = {k: motion for k, motion in found if motion is not None}
    if not known:
        return []
    marks, motion = list(known), np.array(list(known.values()))
    f = curve.frequency[marks]
    true = harmonics_by_name(assembly, motion, 2 * np.pi * f)
    return [
        _caution(name, f, off, wanted, place)
        for name, shown in curve.outputs.items()
        if (off := _off(np.abs(shown[marks]), np.abs(true[name]))).max() > wanted
    ]


def _off(shown: Array, true: Array) -> Array:
    """Relative differences of sizes."""
    least = SMALL * max(float(true.max()), 1e-300)
    return np.asarray(np.abs(shown - true) / np.maximum(true, least))


def _caution(name: str, f: Array, off: Array, wanted: float, place: str) -> Caution:
    worst, many = int(np.argmax(off)), int((off > wanted).sum())
    most = f"{100 * off[worst]:.2g} %" if off[worst] < 0.995 else f"{off[worst]:.2g} times its size"
    reason = (
        f'output "{name}" is off by up to {most}, at {f[worst]:.6g} Hz, from steady states that the response '
        f"goes through, and by more than {100 * wanted:g} % at {many} of {len(f)} of them: the stated error "
        "is that of the amplitude of the mode"
    )
    advice = "[analysis.time] and [analysis.harmonic] have the outputs of the motion itself"
    return Caution("response", place, reason, advice)


def _first_harmonics(assembly: Assembly, one: Stepped, load: float) -> Complex | None:
    """Of the outputs of all ports over a cycle of a steady state; None where a step has no solution."""
    f, steps = one.frequency, one.steps
    scheme = time_scheme(assembly.prepared, 1 / (f * steps), frequency=f)
    theta = one.state.phase + 2 * np.pi * np.arange(steps + 1) / steps
    try:
        done = march(scheme, placed(one.state, scheme, f, load), load * np.sin(theta))
    except MicroslipError:
        return None
    return np.asarray(harmonic(without_drift(done.output, theta), theta), dtype=complex)
