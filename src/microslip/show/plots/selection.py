"""Which cycles a figure shows, and how it names them."""

from __future__ import annotations

import numpy as np

from microslip.pipeline.run import Run
from microslip.results.cycle import table_of
from microslip.results.labels import over_clamp


def main_drive(run: Run) -> str:
    """The drive that figures of single cycles show: the mode, else what there is; may be empty."""
    solved = [drive for drive, cycles in run.cycles.items() if cycles]
    return "mode" if "mode" in solved else next(iter(solved), "")


def greatest_damping(run: Run, drive: str) -> int:
    """Index of the cycle with the largest equivalent damping."""
    table = table_of(run, drive)
    if table is None:
        raise ValueError(f"no cycle driven by {drive!r}")
    load = table.load[int(np.argmax(table.gamma_eq))]
    return int(np.argmin([abs(cycle.amplitude - load) for cycle in run.cycles[drive]]))


def spread(run: Run, drive: str, count: int = 4) -> list[int]:
    """Indices of cycles from microslip to beyond the greatest damping, the latter among them.

    Amplitudes about a factor of three apart.
    """
    cycles = run.cycles[drive]
    best = greatest_damping(run, drive)
    top = cycles[best].amplitude
    targets = top * 3.0 ** np.arange(2 - count, 2)
    sizes = np.log([cycle.amplitude for cycle in cycles])
    return sorted({int(np.argmin(np.abs(sizes - np.log(t)))) for t in targets})


def name_of(run: Run, drive: str, index: int) -> str:
    """Amplitude of a cycle as figures write it.

    Of a cycle driven by the mode, M_eq is the load that loads the interface alike.
    """
    said = run.joint.driven.load
    symbol = f"{said.symbol}_{{eq}}" if drive == "mode" else said.symbol
    if not over_clamp(run):
        return rf"${symbol}={scientific(run.moments[drive][index], 3)}$ {said.unit}"
    moment = run.moments[drive][index] / run.assembly.moment_unit
    return rf"${symbol}/(PL)={scientific(moment)}$"


def load_label(run: Run, rho: float, moment: float) -> str:
    """A load as the user gave it."""
    if np.isfinite(rho):
        return rf"$\rho$ = {rho:g}"
    load = run.joint.load
    if load is not None and load.kind == run.joint.driven.load.key:
        said = run.joint.driven.load
        return f"${said.symbol}$ = {moment:.4g} {said.unit}"
    return rf"$M/(PL)={scientific(moment / run.assembly.moment_unit)}$"


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


def unit_position(run: Run) -> np.ndarray:
    """Position of the contact pairs over the half length of the clamp, or of the interface."""
    return run.model.position / run.assembly.measures.half_length


def unit_centre(run: Run) -> float | None:
    """Middle of the clamp over its half length; None where there is no clamp."""
    measures = run.assembly.measures
    return measures.centre / measures.half_length if measures.clamp else None


def position_label(run: Run) -> str:
    """What `unit_position` is called on axes."""
    return f"position $x/{run.assembly.measures.symbol}$"


def pressure_unit(run: Run) -> str:
    """What `mean_pressure` is called on axes."""
    return f"(P/2{run.assembly.measures.symbol})"


def mean_pressure(run: Run) -> float:
    """P / (2 L_p), the mean pressure of the clamp: what pressures and tractions are divided by."""
    return run.assembly.measures.mean_pressure
