"""Which cycles a figure shows, and how it names them."""

from __future__ import annotations

import numpy as np

from microslip.pipeline.run import LapRun
from microslip.results.dataset import table_of


def main_drive(result: LapRun) -> str:
    """The drive that figures of single cycles show: the mode, else what there is; may be empty."""
    solved = [drive for drive, cycles in result.cycles.items() if cycles]
    return "mode" if "mode" in solved else next(iter(solved), "")


def greatest_damping(result: LapRun, drive: str) -> int:
    """Index of the cycle with the largest equivalent damping."""
    table = table_of(result, drive)
    if table is None:
        raise ValueError(f"no cycle driven by {drive!r}")
    load = table.load[int(np.argmax(table.gamma_eq))]
    return int(np.argmin([abs(cycle.amplitude - load) for cycle in result.cycles[drive]]))


def spread(result: LapRun, drive: str, count: int = 4) -> list[int]:
    """Indices of cycles from microslip to beyond the greatest damping, the latter among them.

    Amplitudes about a factor of three apart.
    """
    cycles = result.cycles[drive]
    best = greatest_damping(result, drive)
    top = cycles[best].amplitude
    targets = top * 3.0 ** np.arange(2 - count, 2)
    sizes = np.log([cycle.amplitude for cycle in cycles])
    return sorted({int(np.argmin(np.abs(sizes - np.log(t)))) for t in targets})


def name_of(result: LapRun, drive: str, index: int) -> str:
    """Amplitude of a cycle as figures write it.

    Of a cycle driven by the mode, M_eq is the end moment that loads the interface alike.
    """
    symbol = "M" if drive == "moment" else "M_{eq}"
    moment = result.moments[drive][index] / result.assembly.moment_unit
    return rf"${symbol}/(PL)={scientific(moment)}$"


def scientific(value: float, digits: int = 2) -> str:
    r"""A number for mathtext.

    Examples
    --------
    >>> scientific(0.00217)
    '2.2\\times10^{-3}'
    >>> scientific(0.25)
    '0.25'
    """
    if value == 0 or 0.01 <= abs(value) < 1000:
        return f"{value:.{digits}g}"
    mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
    return rf"{mantissa}\times10^{{{int(exponent)}}}"


def unit_position(result: LapRun) -> np.ndarray:
    """Position of the contact pairs over the clamp's half length."""
    return result.model.position / result.joint.clamp.half_length


def mean_traction(result: LapRun) -> float:
    """P / L_p: what tractions are divided by, as in the paper's figure 5."""
    return result.joint.clamp.force / result.joint.clamp.half_length
