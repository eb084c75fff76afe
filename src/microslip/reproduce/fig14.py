"""Figure 14: equivalent damping and stiffness over load and frequency."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from microslip.reproduce.drawing import no_answer_area
from microslip.reproduce.fig10 import MESH
from microslip.reproduce.maps import ResponseMap, response_map
from microslip.reproduce.plate import Number, Plate, Trend
from microslip.reproduce.study import Study
from microslip.reproduce.variants import CONSISTENT, PRINTED
from microslip.show.plots.style import DOUBLE, MM, house_style, letters, new_figure

ALIGNED = 0.3
"""Hz within which greatest damping and resonance count as one."""


@house_style
def fig14(study: Study) -> Plate:
    """Maps of both quantities in the printed and the consistent model, with their ridges."""
    figure = new_figure(DOUBLE, 140 * MM)
    axes = figure.subplots(2, 2, sharex=True, sharey=True)
    maps = {case: response_map(study, case) for case in (PRINTED, CONSISTENT)}
    for column, (case, found) in zip(axes.T, maps.items(), strict=True):
        for ax, part, name in zip(
            column, ("imag", "real"), (r"$\gamma_{eq}$", "$k_{eq}$"), strict=True
        ):
            values = getattr(found.equivalent, part)
            image = ax.pcolormesh(
                found.frequency, found.rho, values, cmap="cividis", rasterized=True
            )
            figure.colorbar(image, ax=ax, label=name, aspect=15)
            ax.plot(found.resonance, found.rho, color="white", ls="--", lw=1.1, label="resonance")
            if part == "imag":
                ax.plot(*ridges(found), "k.", ms=2.2, label="ridges of greatest damping")
            ax.grid(False)
        column[0].set_title(case.label, loc="left")
        column[1].set_xlabel("frequency (Hz)")
    for ax in axes[:, 0]:
        ax.set_ylabel(r"$\rho$")
    letters(axes.ravel())
    handles = axes[0, 0].get_legend_handles_labels()[0]
    if any(np.isnan(found.equivalent).any() for found in maps.values()):
        handles.append(no_answer_area())
    legend = figure.legend(handles=handles, loc="outside lower center", ncols=3)
    legend.get_frame().set(facecolor="#bbbbbb", alpha=1)
    consistent = maps[CONSISTENT]
    aligned = {case.key: aligned_range(found) for case, found in maps.items()}
    first = aligned[CONSISTENT.key][0]
    stuck = study.assembly.mode.stiffening
    saturation = {n: float(study.tables[n].k_eq[0]) for n in study.tables}
    return Plate(
        figure,
        "Equivalent damping (a, b) and stiffness (c, d) over ω_sl² that the reduced models find, "
        "over ρ and frequency. Left: as printed, friction alone under the end moment. Right: "
        "consistent, mode-driven. Dashed: resonance; dots: ridges of the damping, where its maxima over "
        "frequency exceed 0.95 of the greatest; blank: no answer in the table.",
        numbers=[
            Number(
                "aligned_rho",
                first,
                f"Smallest ρ at which the greatest damping lies within {ALIGNED:g} Hz of the "
                "resonance; it stays there for every larger ρ, because below its peak γ_eq grows "
                "with amplitude. 'Only at 2.4' does not come out.",
            ),
            Number(
                "k_saturation",
                saturation["moment"],
                "Smallest amplitude of the moment-driven table, which the paper's is. The stuck "
                f"joint has {stuck:.4f} "
                f"and the mode-driven table {saturation['mode']:.4f}.",
            ),
        ],
        trends=[
            _saturates(consistent),
            _least_at_resonance(consistent),
            Trend(
                "damping_meets_resonance",
                "greatest damping and resonance coincide only near ρ = 2.4",
                aligned[CONSISTENT.key][1] < 3.0,
                {"first_and_last_aligned_rho": aligned},
                "They part below an optimum and stay together above it.",
            ),
        ],
        data={
            "rho": consistent.rho.tolist(),
            "greatest_damping_hz": {
                case.key: found.damped_most.tolist() for case, found in maps.items()
            },
        },
    )


def ridges(found: ResponseMap) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Frequency and rho of every high local maximum of gamma_eq over frequency."""
    gamma = found.equivalent.imag
    high = gamma > 0.95 * np.nanmax(gamma, axis=1, keepdims=True)
    middle = gamma[:, 1:-1]
    top = (middle >= gamma[:, :-2]) & (middle >= gamma[:, 2:]) & high[:, 1:-1]
    rows, columns = np.nonzero(top)
    return found.frequency[columns + 1], found.rho[rows]


def aligned_range(found: ResponseMap) -> tuple[float, float]:
    """First and last rho at which the greatest damping lies at the resonance; nan if nowhere."""
    near = np.abs(found.damped_most - found.resonance) < ALIGNED
    if not near.any():
        return float("nan"), float("nan")
    return float(found.rho[near][0]), float(found.rho[near][-1])


def _saturates(found: ResponseMap) -> Trend:
    k = np.nanmin(found.equivalent.real, axis=1)
    enclosed = np.array([peak.inside for peak in found.peaks])
    growth = np.diff(k) / np.diff(found.rho)
    good = np.isfinite(growth) & enclosed[1:] & enclosed[:-1]
    fall = float(-np.diff(k)[good].min(initial=0.0) / np.ptp(k))
    return Trend(
        "k_saturates",
        "the least k_eq over frequency rises monotonically with ρ and levels off",
        fall < MESH and bool(growth[good][-1] < 0.5 * growth[good].max()),
        {
            "rho": found.rho[:: max(len(k) // 10, 1)].tolist(),
            "k_eq": k[:: max(len(k) // 10, 1)].tolist(),
            "largest_fall_over_range": fall,
            "growth_at_last_rho": float(growth[good][-1]),
            "greatest_growth": float(growth[good].max()),
        },
        "Its limit is the stuck joint; at ρ = 5 it is still below it. Loads whose resonance borders "
        "on a jump or on points without an answer are left out.",
    )


def _least_at_resonance(found: ResponseMap) -> Trend:
    least = found.frequency[np.nanargmin(found.equivalent.real, axis=1)]
    distance = np.abs(least - found.resonance)
    return Trend(
        "k_least_at_resonance",
        "at every ρ the least k_eq is at the resonance",
        bool(distance.max() < ALIGNED),
        {"largest_distance_hz": float(distance.max())},
        "k_eq falls with amplitude, which is greatest at resonance.",
    )
