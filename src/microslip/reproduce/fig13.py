"""Figure 13: forced response over load and frequency; resonances against the time domain."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.lines import Line2D

from microslip.reproduce.drawing import no_answer_area
from microslip.reproduce.fig11 import case_style
from microslip.reproduce.maps import ResponseMap, response_map
from microslip.reproduce.peaks import Peak, time_domain_peak
from microslip.reproduce.plate import Number, Plate, Trend
from microslip.reproduce.study import Study
from microslip.reproduce.variants import CONSISTENT, PRINTED, cases
from microslip.show.plots.style import (
    BLACK,
    DOUBLE,
    MM,
    house_style,
    letters,
    new_figure,
)

MARKS: dict[bool, dict[str, Any]] = {
    True: {"marker": "o", "color": BLACK, "mfc": "white", "ls": "none"},
    False: {"marker": "^", "color": BLACK, "mfc": "white", "ls": "none"},
}
"""Peaks of the time domain, by whether points on both sides enclose them."""


@house_style
def fig13(study: Study) -> Plate:
    """Maps of the printed and the consistent model; resonances of all cases."""
    maps = {case: response_map(study, case) for case in cases()}
    checked = {rho: _over_frictionless(study, rho) for rho in study.settings.checked_rhos}
    figure = new_figure(DOUBLE, 145 * MM)
    axes = figure.subplots(2, 2)
    for ax, case in zip(axes[0], (PRINTED, CONSISTENT), strict=True):
        image = _draw_map(ax, maps[case])
        ax.set_title(case.label, loc="left")
    figure.colorbar(image, ax=axes[0], label="$|q|$ over frictionless peak", aspect=15)
    left, right = axes[1]
    for case, found in maps.items():
        left.plot(found.rho, found.resonance, **case_style(case))
        right.semilogy(found.rho, found.height, **case_style(case))
    for ax, attribute in ((left, "frequency"), (right, "amplitude")):
        for rho, peak in checked.items():
            ax.plot(
                rho,
                getattr(peak, attribute),
                **MARKS[peak.inside],
            )
        ax.set_xlabel(r"$\rho$")
    left.set_ylabel("resonance (Hz)")
    right.set_ylabel("peak $|q|$ over frictionless")
    letters(axes.ravel())
    entries = left.get_legend_handles_labels()[0]
    for inside in sorted({peak.inside for peak in checked.values()}, reverse=True):
        name = "time domain" if inside else "time domain, beside a jump: at least"
        entries.append(Line2D([], [], label=name, **MARKS[inside]))
    if any(np.isnan(maps[case].amplitude).any() for case in (PRINTED, CONSISTENT)):
        entries.append(no_answer_area())
    figure.legend(handles=entries, loc="outside lower center", ncols=2)
    consistent = maps[CONSISTENT]
    best = {case.key: _best(found) for case, found in maps.items()}
    errors = {case.key: _peak_errors(found, checked) for case, found in maps.items()}
    return Plate(
        figure,
        f"Forced response over ρ and frequency, over the frictionless peak under the same load: "
        "(a) as printed with friction alone, (b) consistent with the mode-driven table; dashed: "
        "resonance; blank: no answer in the table. (c) Resonance frequency and (d) peak of every "
        "reduced model, and of the time domain (triangle: beside a jump, may be higher). "
        f"ρ = C μPL/M with C = {study.rho_scale:.4g}, the one calibration: the consistent model is "
        "damped most at ρ = 2.4.",
        numbers=[
            Number(
                "best_rho",
                best[CONSISTENT.key],
                "Calibrated: C is chosen for this. As printed with friction alone the same C gives "
                f"{best[PRINTED.key]:.2f}, in the time domain {_best_of(checked):.2f} "
                "(of the loads checked).",
            )
        ],
        trends=[
            _rises(consistent, checked),
            Trend(
                "amplitude_falls_then_rises",
                "the normalised amplitude falls with ρ to an optimum and rises again",
                _valley(np.array([p.amplitude for p in checked.values()])),
                {
                    "rho": list(checked),
                    "time_domain": [p.amplitude for p in checked.values()],
                    "best_rho": best,
                },
                "Little slip dissipates little, and free slip meets little friction.",
            ),
        ],
        data={
            "rho": consistent.rho.tolist(),
            **{
                case.key: {
                    "resonance_hz": found.resonance.tolist(),
                    "peak": found.height.tolist(),
                    "enclosed": [p.inside for p in found.peaks],
                    "against_time_domain": errors[case.key],
                }
                for case, found in maps.items()
            },
            "time_domain": {
                f"{rho:g}": {"resonance_hz": p.frequency, "peak": p.amplitude, "enclosed": p.inside}
                for rho, p in checked.items()
            },
        },
    )


def _over_frictionless(study: Study, rho: float) -> Peak:
    peak = time_domain_peak(study, rho)
    unit = study.frictionless.peak_amplitude / study.frictionless.load * study.moment(rho)
    return Peak(peak.frequency, peak.amplitude / unit, peak.inside)


def _peak_errors(found: ResponseMap, checked: dict[float, Peak]) -> dict[str, dict[str, float]]:
    """Of the peak (relative) and the resonance (Hz) at the loads of the time domain."""
    return {
        f"{rho:g}": {
            "peak": float(np.interp(rho, found.rho, found.height)) / peak.amplitude - 1,
            "resonance_hz": float(np.interp(rho, found.rho, found.resonance)) - peak.frequency,
        }
        for rho, peak in checked.items()
    }


def _draw_map(ax: Axes, found: ResponseMap) -> Any:
    image = ax.pcolormesh(
        found.frequency,
        found.rho,
        found.amplitude,
        cmap="cividis",
        norm=LogNorm(1e-3, 0.15),
        rasterized=True,
    )
    ax.plot(found.resonance, found.rho, color="white", ls="--", lw=1.1)
    ax.grid(False)
    ax.set_xlabel("frequency (Hz)")
    ax.set_ylabel(r"$\rho$")
    return image


def _best(found: ResponseMap) -> float:
    """Rho of the lowest peak, by a parabola through the lowest three in the logarithm."""
    return vertex_of(found.rho, found.height)


def _best_of(checked: dict[float, Peak]) -> float:
    return vertex_of(np.array(list(checked)), np.array([p.amplitude for p in checked.values()]))


def vertex_of(rho: np.ndarray, height: np.ndarray) -> float:
    """Abscissa of the minimum of ``log height``.

    Examples
    --------
    >>> x = np.array([1.0, 2.0, 3.5])
    >>> round(vertex_of(x, np.exp((x - 2.2) ** 2)), 9)
    2.2
    """
    i = int(np.nanargmin(height))
    if i in (0, len(rho) - 1):
        return float(rho[i])
    near = slice(i - 1, i + 2)
    a, b, _ = np.polyfit(rho[near] - rho[i], np.log(height[near]), 2)
    return float(rho[i] - b / (2 * a))


def _valley(height: np.ndarray) -> bool:
    i = int(np.argmin(height))
    return bool(
        0 < i < len(height) - 1
        and (np.diff(height[: i + 1]) < 0).all()
        and (np.diff(height[i:]) > 0).all()
    )


def _rises(found: ResponseMap, checked: dict[float, Peak]) -> Trend:
    dynamic = np.array([p.frequency for p in checked.values()])
    return Trend(
        "resonance_rises",
        "the resonance frequency rises with ρ",
        bool((np.diff(dynamic) > 0).all()),
        {
            "rho": list(checked),
            "time_domain_hz": dynamic.tolist(),
            "consistent_hz": np.interp(list(checked), found.rho, found.resonance).tolist(),
        },
        "Less slip, more stiffness. From ρ = 0 to 0.8 it falls here: near opening the normal "
        "contact force softens the joint.",
    )
