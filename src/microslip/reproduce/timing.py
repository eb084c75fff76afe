"""The timing paragraph: what each analysis takes here, beside the paper."""

from __future__ import annotations

import time
from typing import Any

import numpy as np
from matplotlib.patches import Patch

from microslip.analyses.time.scheme import march, prestressed_state, time_scheme
from microslip.numerics.execute import workers
from microslip.reproduce.fig7 import FREQUENCY
from microslip.reproduce.plate import Number, Plate
from microslip.reproduce.published import PAPER_SECONDS
from microslip.reproduce.settings import FULL, PAPER_RHO
from microslip.reproduce.study import Study
from microslip.reproduce.variants import PRINTED, respond
from microslip.show.plots.style import (
    BLACK,
    BLUE,
    DOUBLE,
    GREY,
    MM,
    house_style,
    letters,
    new_figure,
)

PAPER: dict[str, Any] = {"facecolor": "#d0d0d0", "edgecolor": GREY, "lw": 0.5}

STEADY = 0.01
"""Relative change of the dissipated energy between cycles that the paper calls steady."""


@house_style
def timing(study: Study) -> Plate:
    """March from rest as the paper did; seconds of this, of the tables and of a sweep."""
    energies, seconds = _marched(study)
    change = np.abs(np.diff(energies)) / energies[1:]
    cycles = 2 + np.arange(len(change))
    late = cycles[change >= STEADY]
    steady = int(late.max()) + 1 if len(late) else 2
    accelerated = study.time_point(PAPER_RHO, FREQUENCY).steady
    remaining = float(energies[-1] / accelerated.cycle.dissipated)
    band = study.settings.response_band()
    start = time.perf_counter()
    respond(study, PRINTED, PAPER_RHO, band)
    ours = {
        "time_domain_one_frequency": seconds,
        "quasi_static": study.timings["cycles_moment"],
        "sweep": time.perf_counter() - start,
    }
    found = study.run.cycles["moment"]
    figure = new_figure(DOUBLE, 75 * MM)
    left, right = figure.subplots(1, 2)
    left.semilogy(cycles, 100 * change, color=BLACK)
    left.axhline(100 * STEADY, color="k", lw=0.6, ls=":")
    left.set_xlabel("cycle from rest")
    left.set_ylabel(r"change of $\Delta E$ (%)")
    _bars(right, ours, as_fine=study.settings.pairs >= FULL.pairs)
    letters((left, right))
    figure.legend(
        handles=[
            Patch(facecolor=BLUE, label=f"here, {study.assembly.model.pairs} contact pairs"),
            Patch(**PAPER, label="as the paper reports, its problem and computer"),
        ],
        loc="outside lower center",
        ncols=2,
    )
    return Plate(
        figure,
        f"(a) Change of the dissipated energy from cycle to cycle, marched from rest at "
        f"{FREQUENCY:g} Hz, ρ = {PAPER_RHO:g}, {study.settings.time_steps} steps per cycle. "
        f"(b) Wall time with {study.assembly.model.pairs} contact pairs beside the paper's: "
        f"{len(energies)} marched cycles on one core; "
        f"{len(found)} quasi-static amplitudes of {study.settings.cycle_steps} steps, on "
        f"{workers()} cores; a sweep of {len(band)} frequencies on one.",
        numbers=[
            Number(
                "cycles_to_steady",
                float(steady) if steady <= len(energies) else None,
                "From rest, the first cycle from which ΔE changes by less than 1 %; "
                f"after {len(energies)} it is still {100 * abs(remaining - 1):.1f} % off. The "
                f"accelerated search takes {accelerated.cycles} cycles to a change of 1e-5.",
            )
        ],
        data={
            "cycles_accelerated": accelerated.cycles,
            "marched_over_accelerated_energy": remaining,
            "change_of_last_marched_cycle": float(change[-1]),
        },
        seconds={
            "accelerated_one_frequency": accelerated.seconds,
            "table": {
                key: {
                    "what": what,
                    "paper_s": paper,
                    "here_s": ours[key],
                    "ratio": paper / ours[key],
                }
                for key, (paper, what) in PAPER_SECONDS.items()
            },
        },
    )


def _marched(study: Study) -> tuple[np.ndarray, float]:
    """Dissipated energy of every cycle from rest, and the seconds they took."""
    a, steps = study.assembly, study.settings.time_steps
    dt = 1 / (FREQUENCY * steps)
    scheme = time_scheme(a.prepared, dt, frequency=FREQUENCY)
    wave = study.moment(PAPER_RHO) * np.sin(2 * np.pi * np.arange(steps + 1) / steps)
    state, energies = prestressed_state(scheme), []
    count = study.settings.marched_cycles
    study.progress.start("time domain, marched from rest", count)
    start = time.perf_counter()
    for _ in range(count):
        cycle = march(scheme, state, wave)
        state = cycle.state
        energies.append(cycle.dissipated)
        study.progress.advance()
    seconds = time.perf_counter() - start
    study.progress.finish()
    return np.array(energies), seconds


def _bars(ax: Any, ours: dict[str, float], as_fine: bool) -> None:
    """Seconds of both; how many times faster only where the problem is no coarser."""
    for i, (key, (paper, what)) in enumerate(PAPER_SECONDS.items()):
        ax.barh(i + 0.2, paper, 0.36, left=1e-3, **PAPER)
        ax.barh(i - 0.2, ours[key], 0.36, color=BLUE, left=1e-3)
        if as_fine:
            ax.text(1.3 * ours[key], i - 0.2, f"{paper / ours[key]:,.0f} times", va="center")
        ax.text(1.5e-3, i + 0.5, what, va="center")
    ax.set_xscale("log")
    ax.set_xlim(1e-3, 1e6)
    ax.set_ylim(2.8, -0.6)
    ax.set_yticks([])
    ax.set_xlabel("wall time (s)")
