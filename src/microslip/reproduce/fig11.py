"""Figure 11: forced response, reduced models against the time domain."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from microslip.analyses.reduced.response import Response, forced_response
from microslip.analyses.reduced.sweep import CONVERGED
from microslip.analyses.reduced.two_mode import two_mode_model
from microslip.analyses.time.point import TimePoint
from microslip.reproduce.peaks import time_domain_peak
from microslip.reproduce.plate import Number, Plate, Trend
from microslip.reproduce.settings import PAPER_RHO
from microslip.reproduce.study import Study
from microslip.reproduce.variants import CONSISTENT, PRINTED, REFINED, Case, cases, respond
from microslip.show.plots.curves import draw_curve
from microslip.show.plots.style import BLACK, DOUBLE, MM, SERIES, house_style, letters, new_figure

LINEAR_OFFSETS = (-4.0, -1.0, -0.2, 0.0, 0.2, 1.0, 4.0)
"""Hz from the sliding frequency at which the frictionless joint is integrated."""


def case_style(case: Case) -> dict[str, Any]:
    """Colour and line of a case, the same in all figures."""
    order = cases().index(case)
    widths = {PRINTED: 1.6, CONSISTENT: 1.6, REFINED: 1.6}
    return {
        "color": SERIES[1 + order % (len(SERIES) - 1)]["color"],
        "ls": ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 1)))[order % 6],
        "lw": widths.get(case, 1.0),
        "label": case.label,
    }


@house_style
def fig11(study: Study) -> Plate:
    """One panel per load; error of every case at every frequency of the time domain."""
    rhos = study.settings.response_rhos
    band = study.settings.response_band()
    figure = new_figure(DOUBLE, 135 * MM)
    axes = figure.subplots(2, 2).ravel()
    linear = _draw_frictionless(axes[0], study)
    errors: dict[float, dict[str, dict[str, Any]]] = {}
    for ax, rho in zip(axes[1:], rhos, strict=False):
        points = study.time_points(rho, time_frequencies(study, rho))
        unit = study.frictionless.peak_amplitude / study.frictionless.load * study.moment(rho)
        for case in cases():
            response = respond(study, case, rho, band)
            draw_curve(ax, response, np.abs(response.amplitude) / unit, **case_style(case))
            errors.setdefault(rho, {})[case.key] = case_errors(study, case, rho, points)
        ax.semilogy(
            [p.steady.frequency for p in points],
            [abs(p.steady.amplitude) / unit for p in points],
            "o",
            color=BLACK,
            mfc="white",
            label="time domain",
        )
        ax.set_yscale("log")
        ax.set_title(rf"$\rho$ = {rho:g}", loc="left")
    for ax in axes:
        ax.set_xlim(study.settings.band)
        ax.set_xlabel("frequency (Hz)")
        ax.set_ylabel("$|q|$ over frictionless peak")
    letters(axes)
    figure.legend(*axes[1].get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return Plate(
        figure,
        "Modal amplitude over frequency, over the peak of the frictionless joint under the same "
        "load. Reduced models by "
        "variant and table: the paper's is the printed one with friction alone. No line where a "
        "model has no answer within its table. (a) Without friction: line, eq. (18).",
        numbers=_numbers(study, errors),
        trends=[linear],
        data={f"errors_rho_{rho:g}": value for rho, value in errors.items()},
    )


def time_frequencies(study: Study, rho: float) -> tuple[float, ...]:
    """Frequencies of the time domain at a load."""
    s = study.settings
    return s.time_frequencies if rho == PAPER_RHO else s.other_frequencies


def _draw_frictionless(ax: Axes, study: Study) -> Trend:
    """The joint without friction: line of eq. (18) and time domain."""
    band = study.settings.response_band()
    model = two_mode_model(study.assembly.prepared, "consistent")
    load = study.moment(0.0)
    centre = study.assembly.mode.sliding_frequency
    points = study.time_points(0.0, [centre + offset for offset in LINEAR_OFFSETS])
    frequency = np.array([p.steady.frequency for p in points])
    found = np.array([abs(p.steady.amplitude) for p in points])
    exact = np.abs(forced_response(model, None, np.sort(frequency), load).amplitude)
    error = found[np.argsort(frequency)] / exact - 1
    line = forced_response(model, None, band, load)
    ax.semilogy(band, np.abs(line.amplitude) / line.peak_amplitude, color="k", lw=1.1)
    ax.semilogy(frequency, found / line.peak_amplitude, "o", color=BLACK, mfc="white")
    ax.set_title(r"$\rho$ = 0", loc="left")
    off = np.abs(np.sort(frequency) - centre) > 0.5
    return Trend(
        "frictionless_agrees",
        "without friction the reduced model agrees with the time domain",
        bool(np.abs(error[off]).max() < 0.01),
        {"frequency_hz": np.sort(frequency).tolist(), "error": error.tolist()},
        "Poles of the time steps are those of the modes.",
    )


def case_errors(study: Study, case: Case, rho: float, points: list[TimePoint]) -> dict[str, Any]:
    """Relative error of a case at every point of the time domain, and the worst and median."""
    frequency = np.array([p.steady.frequency for p in points])
    truth = np.array([abs(p.steady.amplitude) for p in points])
    error = size_at(study, case, rho, frequency) / truth - 1
    good = np.isfinite(error)
    return {
        "frequency_hz": frequency.tolist(),
        "error": [float(e) if np.isfinite(e) else None for e in error],
        "median": float(np.median(np.abs(error[good]))) if good.any() else None,
        "worst": float(np.abs(error[good]).max()) if good.any() else None,
        "worst_hz": float(frequency[good][np.argmax(np.abs(error[good]))]) if good.any() else None,
        "no_answer": int((~good).sum()),
    }


def size_at(study: Study, case: Case, rho: float, frequency: NDArray) -> NDArray:
    """|q| of a case at given frequencies, swept through the band so that branches match.

    nan where it has no answer.
    """
    band = np.unique(np.r_[study.settings.response_band(), frequency])
    response = respond(study, case, rho, band)
    size = np.where(response.flag == CONVERGED, np.abs(response.amplitude), np.nan)
    return np.asarray(size[np.searchsorted(band, frequency)])


def _numbers(study: Study, errors: dict[float, dict[str, dict[str, Any]]]) -> list[Number]:
    peak = time_domain_peak(study, PAPER_RHO)
    sliding = study.assembly.mode.sliding_frequency
    unit = study.frictionless.peak_amplitude / study.frictionless.load * study.moment(PAPER_RHO)
    printed = respond(study, PRINTED, PAPER_RHO, study.settings.response_band())
    worst = errors[PAPER_RHO][PRINTED.key]
    better, best = (errors[PAPER_RHO][case.key] for case in (CONSISTENT, REFINED))
    near = float(size_at(study, PRINTED, PAPER_RHO, np.array([peak.frequency]))[0])
    opening = (
        "At ρ = 0.8 the vibration here comes close to opening the joint and the normal contact "
        "force softens it; the paper's friction force leaves that out, and with friction alone "
        f"the printed model has its resonance {_where(printed)}."
    )
    return [
        Number(
            "sliding_frequency",
            sliding,
            "The prestressed contact here is 1.185 L_p long; bonded over the paper's 1.18 the "
            "same model has 174.63 Hz.",
        ),
        Number("resonance_rho_0_8", peak.frequency, opening),
        Number("resonance_shift", peak.frequency - sliding, opening),
        Number(
            "amplitude_drop",
            1 - peak.amplitude / unit,
            "Follows from the calibration of ρ, which fixes the load.",
        ),
        Number(
            "rom_error_peak",
            abs(near / peak.amplitude - 1),
            "The model as printed with friction alone, at the resonance of the time domain"
            + ("." if np.isfinite(near) else ", where it has no answer.")
            + f" In the median over the band: consistent and mode-driven {_text(better['median'])}, "
            f"refined {_text(best['median'])}.",
        ),
        Number(
            "rom_error_worst",
            worst["worst"],
            f"The model as printed with friction alone; frequencies without an answer "
            f"({worst['no_answer']}) are left out. Consistent and mode-driven "
            f"{_text(better['worst'])}, refined {_text(best['worst'])}.",
        ),
        Number(
            "rom_error_worst_hz",
            worst["worst_hz"],
            "Where the models and the time domain jump at different frequencies.",
        ),
    ]


def _where(response: Response) -> str:
    """Frequency of the resonance, or where it hides beyond the table."""
    beyond = response.unconverged
    if not len(beyond):
        return f"at {response.peak_frequency:.2f} Hz"
    return f"between {beyond.min():.2f} and {beyond.max():.2f} Hz, its peak beyond the table"


def _text(value: float | None) -> str:
    return "no answer" if value is None else f"{100 * value:.1f} %"
