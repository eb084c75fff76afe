"""Figure 12: equivalent damping and stiffness that the reduced models find at each frequency."""

from __future__ import annotations

import numpy as np

from microslip.reproduce.fig11 import case_style
from microslip.reproduce.plate import Number, Plate
from microslip.reproduce.settings import PAPER_RHO
from microslip.reproduce.study import Study, dynamic_equivalent
from microslip.reproduce.variants import (
    CONSISTENT,
    PRINTED,
    REFINED,
    Case,
    cases,
    equivalent,
    respond,
)
from microslip.show.plots.curves import draw_curve
from microslip.show.plots.style import BLACK, DOUBLE, MM, house_style, letters, new_figure

CHECKED = 175.0
"""Hz at which the paper gives errors."""


@house_style
def fig12(study: Study) -> Plate:
    """Lines of every case over frequency; points of the time domain."""
    band = study.settings.response_band()
    points = study.time_points(PAPER_RHO, study.settings.time_frequencies)
    frequency = np.array([p.steady.frequency for p in points])
    dynamic = np.array([dynamic_equivalent(study, p) for p in points])
    figure = new_figure(DOUBLE, 95 * MM)
    axes = figure.subplots(1, 2)
    for case in cases():
        values = equivalent(study, case, PAPER_RHO, band)
        response = respond(study, case, PAPER_RHO, band)
        draw_curve(axes[0], response, values.imag, **case_style(case))
        draw_curve(axes[1], response, values.real, **case_style(case))
    for ax, part, name in zip(axes, ("imag", "real"), (r"$\gamma_{eq}$", "$k_{eq}$"), strict=True):
        found = getattr(dynamic, part)
        ax.plot(frequency, found, "o", color=BLACK, mfc="white", label="time domain")
        ax.set_xlim(study.settings.band)
        ax.set_xlabel("frequency (Hz)")
        ax.set_ylabel(name)
    letters(axes)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    at = study.time_point(PAPER_RHO, CHECKED)
    truth = dynamic_equivalent(study, at)
    errors = {c.key: _errors(study, c, at.steady.frequency, truth) for c in cases()}
    why = (
        "The model as printed reads its table at |q_sl|, a share of the motion, and the table is "
        "moment-driven; consistent and mode-driven {0}, refined {1}."
    )
    gamma, k = errors[PRINTED.key]
    better, best = errors[CONSISTENT.key], errors[REFINED.key]
    return Plate(
        figure,
        f"(a) Equivalent damping and (b) stiffness over ω_sl² that each reduced model reads from its "
        f"table at its answer, ρ = {PAPER_RHO:g}, over frequency; points: contact force of the "
        "steady vibrations in the time domain over their amplitude.",
        numbers=[
            Number("rom_gamma_error", gamma, why.format(f"{better[0]:.4f}", f"{best[0]:.4f}")),
            Number("rom_k_error", k, why.format(f"{better[1]:.4f}", f"{best[1]:.4f}")),
        ],
        data={
            "frequency_hz": frequency.tolist(),
            "gamma_eq": dynamic.imag.tolist(),
            "k_eq": dynamic.real.tolist(),
            "errors_at_175_hz": {
                key: {"gamma_eq": value[0], "k_eq": value[1]} for key, value in errors.items()
            },
        },
    )


def _errors(study: Study, case: Case, frequency: float, truth: complex) -> tuple[float, float]:
    """Relative errors of damping and stiffness at one frequency, on the branch swept to."""
    band = np.unique(np.r_[study.settings.response_band(), frequency])
    values = equivalent(study, case, PAPER_RHO, band)
    found = complex(values[np.searchsorted(band, frequency)])
    return abs(found.imag / truth.imag - 1), abs(found.real / truth.real - 1)
