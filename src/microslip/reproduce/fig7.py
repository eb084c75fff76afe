"""Figure 7: contact states and tractions, quasi-static against dynamic at equal amplitude."""

from __future__ import annotations

import numpy as np

from microslip.reproduce.drawing import motion_of_cycle, motion_of_point
from microslip.reproduce.fig5 import draw_cycles
from microslip.reproduce.plate import Number, Plate, Trend
from microslip.reproduce.settings import PAPER_RHO
from microslip.reproduce.study import Study
from microslip.show.plots.style import house_style

FREQUENCY = 174.0
"""Hz, the paper's."""


@house_style
def fig7(study: Study) -> Plate:
    """The steady vibration, and the cycle under the end moment with its modal amplitude."""
    a = study.assembly
    point = study.time_point(PAPER_RHO, FREQUENCY)
    amplitude = abs(point.steady.amplitude)
    with study.timed("figure_cycles"):
        cycle = study.static_at("moment", amplitude)
        along_mode = study.static_at("mode", amplitude)
    contacts = motion_of_cycle(cycle, a.model), motion_of_point(point.steady, a.model)
    figure = draw_cycles(study, contacts, ("quasi-static", "dynamic"))
    same = {
        "moment_driven": float(np.mean(contacts[0].status[1:] == contacts[1].status[1:])),
        "mode_driven": float(
            np.mean(motion_of_cycle(along_mode, a.model).status[1:] == contacts[1].status[1:])
        ),
    }
    best = _greatest_damping(study)
    why = (
        "The paper's q has no unit; over q at 174 Hz and ρ = 0.8 it can be compared. Here that "
        "vibration is further into gross slip, beyond the greatest damping."
    )
    return Plate(
        figure,
        f"Steady contact at equal modal amplitude, {amplitude / best:.2f} times that of the "
        f"greatest γ_eq: quasi-static under M/(PL) = {cycle.amplitude / study.unit:.3g} (ρ there "
        f"would be {PAPER_RHO * study.moment(PAPER_RHO) / cycle.amplitude:.2g}) against time domain "
        f"at {FREQUENCY:g} Hz, ρ = {PAPER_RHO:g}. (a) Contact states, phase counted from the zero "
        "of the motion. (b) Tractions over P/L_p, quasi-static; arrow: friction limit at a tip, beyond "
        "the axes. (c) Dynamic.",
        numbers=[
            Number("gamma_peak_low", best / amplitude, why),
            Number("gamma_peak_high", best / amplitude, why),
            Number("gamma_peak", best / amplitude, why),
        ],
        trends=[
            Trend(
                "states_align",
                "contact states of both analyses align closely at equal amplitude",
                same["moment_driven"] > 0.9,
                {f"equal_share_{name}": share for name, share in same.items()},
                f"{same['moment_driven']:.0%} of pairs and steps are in the same state; "
                f"{same['mode_driven']:.0%} where the cycle is driven by the mode.",
            )
        ],
        data={"modal_amplitude": amplitude, "moment_over_pl": cycle.amplitude / study.unit},
    )


def _greatest_damping(study: Study) -> float:
    table = study.run.tables["moment"]
    return float(table.amplitude[int(np.argmax(table.gamma_eq))])
