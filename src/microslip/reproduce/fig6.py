"""Figure 6: displacement at the edge of the clamp in time, for several time steps per cycle."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from microslip.analyses.time.point import Request
from microslip.analyses.time.points import solve_request
from microslip.analyses.time.readings import phases
from microslip.analyses.time.steady import SteadyState
from microslip.errors import Failure, MicroslipError
from microslip.numerics.execute import each, threads
from microslip.reproduce.plate import Number, Plate, Trend
from microslip.reproduce.settings import PAPER_RHO
from microslip.reproduce.study import Study
from microslip.show.plots.style import (
    BLACK,
    COLUMN,
    LINES,
    MM,
    SERIES,
    house_style,
    letters,
    new_figure,
)

FREQUENCY = 174.0
"""Hz, the paper's."""

SHOWN = (20, 60, 120)
"""Steps per cycle drawn in time, beside the reference."""

Task = tuple[int, bool]


@house_style
def fig6(study: Study) -> Plate:
    """Displacement over one steady cycle, and its error against the step."""
    a = study.edge_of_clamp()
    guess = study.time_point(PAPER_RHO, FREQUENCY).steady.amplitude
    counts = study.settings.step_counts
    # Finest first: they take longest.
    tasks: list[Task] = [(n, c) for n in sorted(counts, reverse=True) for c in (False, True)]
    study.progress.start("time steps per cycle", len(tasks))

    def one(task: Task) -> SteadyState | Failure:
        steps, matched = task
        request = Request(
            PAPER_RHO,
            FREQUENCY,
            study.moment(PAPER_RHO),
            study.friction,
            guess,
            steps=steps,
            max_cycles=study.settings.max_cycles,
            matched=matched,
        )
        try:
            return solve_request(a.prepared, request).steady
        except MicroslipError as error:
            return Failure("fig6", f"{steps} steps per cycle", str(error))

    found: dict[Task, SteadyState] = {}
    with study.timed("step_study"):
        for task, outcome in zip(tasks, each(one, tasks, threads()), strict=True):
            if isinstance(outcome, Failure):
                study.failures.append(outcome)
            else:
                found[task] = outcome
            study.progress.advance()
    study.progress.finish()
    finest = max(n for n, c in found if c)
    reference = abs(found[finest, True].amplitude)
    error = {task: abs(s.amplitude) / reference - 1 for task, s in found.items()}
    port = a.model.port("edge")

    figure = new_figure(COLUMN, 120 * MM)
    upper, lower = figure.subplots(2, 1)
    unit = float(np.abs(_from_zero(found[finest, False], port)[1]).max())
    for i, n in enumerate([*(n for n in SHOWN if (n, False) in found), finest]):
        theta, signal = _from_zero(found[n, False], port)
        colour = BLACK if n == finest else SERIES[i + 1]["color"]
        upper.plot(theta, signal / unit, color=colour, ls=LINES[-i - 1], label=f"$N_s$ = {n}")
    upper.set_xticks([0, 0.25, 0.5, 0.75, 1], ["0", "π/2", "π", "3π/2", "2π"])
    upper.set_xlabel(r"phase of the moment $\theta$")
    upper.set_ylabel("displacement at $x=L_p$")
    upper.legend(ncols=2)
    for c, style in ((False, SERIES[2]), (True, SERIES[1])):
        shown = sorted(n for n, matched in found if matched is c and (n, c) != (finest, True))
        label = "poles matched" if c else "Newmark's method"
        lower.loglog(
            shown,
            [max(100 * abs(error[n, c]), 1e-3) for n in shown],
            label=label,
            ls="--" if c else "-",
            **style,
        )
    lower.axhline(1, color="k", lw=0.6, ls=":")
    lower.set_xlabel("time steps per cycle $N_s$")
    lower.set_ylabel("error of $|q|$ (%)")
    lower.set_xticks(list(counts), ["" if n == 120 else str(n) for n in counts])
    lower.minorticks_off()
    lower.legend()
    letters((upper, lower))
    enough = [n for n in counts if all(abs(error[m, False]) < 0.01 for m in counts if m >= n)]
    return Plate(
        figure,
        f"Steady horizontal displacement of the lower beam's node at x = L_p over one cycle at "
        f"{FREQUENCY:g} Hz, ρ = {PAPER_RHO:g}, for several numbers N_s of time steps per cycle, "
        f"about its middle and over its amplitude at N_s = {finest}, without its drift over a cycle "
        f"({_walk(found[finest, False], port) / unit:+.2g} of the amplitude: the beams walk past each "
        "other, held by soft springs alone). (b) Difference of the modal amplitude to "
        f"N_s = {finest} with matched poles, of Newmark's method and of modes whose poles are matched.",
        numbers=[
            Number(
                "steps_converged",
                float(min(enough)) if enough else None,
                "First of the series whose amplitude, and that of all finer ones, is within 1 %; "
                "on a flank most of the error is the period that Newmark's method lengthens.",
            )
        ],
        trends=[
            Trend(
                "steps_converge",
                "the response converges with the number of time steps",
                abs(error[counts[-1], False]) < abs(error[counts[-2], False]),
                {f"error_at_{n}": error[n, False] for n in counts if (n, False) in error},
                "Newmark's method is of second order; most of its error is the longer period. The "
                "two finest are compared: in coarser steps the longer period takes this frequency "
                "past the fold, where a guess may settle on either of two states.",
            )
        ],
        data={
            "walk_per_cycle_over_amplitude": _walk(found[finest, False], port) / unit,
            "steps": list(counts),
            "error": [error.get((n, False)) for n in counts],
            "error_poles_matched": [error.get((n, True)) for n in counts],
        },
    )


def _from_zero(steady: SteadyState, port: int) -> tuple[NDArray, NDArray]:
    """Phase over 2 pi from the zero of the moment, and the output there: about its middle, walk out."""
    turn = phases(steady)[:-1] / (2 * np.pi) % 1
    order = np.argsort(turn)
    raw = steady.cycle.output[:, port]
    signal = (raw - _walk(steady, port) * np.linspace(0, 1, len(raw)))[:-1][order]
    signal = signal - 0.5 * (signal.max() + signal.min())
    return np.append(turn[order], 1 + turn[order][0]), np.append(signal, signal[0])


def _walk(steady: SteadyState, port: int) -> float:
    """Drift of an output over one cycle."""
    signal = steady.cycle.output[:, port]
    return float(signal[-1] - signal[0])
