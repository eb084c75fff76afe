"""Figure 10: equivalent damping and stiffness of the steady vibrations against their amplitude."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import find_peaks

from microslip.reproduce.drawing import STATIC
from microslip.reproduce.plate import Plate, Trend
from microslip.reproduce.settings import PAPER_RHO
from microslip.reproduce.study import Study, dynamic_equivalent
from microslip.reproduce.variants import read_table
from microslip.show.plots.style import (
    BLACK,
    DOUBLE,
    GREY,
    MM,
    house_style,
    letters,
    new_figure,
)

MESH = 0.02
"""Steps of a curve below this share of its range come from pairs changing state one by one."""

FOLD = 170.5
"""Hz; below it the vibrations at the paper's load are on the lower branch of the fold."""


@house_style
def fig10(study: Study) -> Plate:
    """Points of the time domain on the curves of the tables."""
    points = study.time_points(PAPER_RHO, study.settings.time_frequencies)
    amplitude = np.array([abs(p.steady.amplitude) for p in points])
    frequency = np.array([p.steady.frequency for p in points])
    dynamic = np.array([dynamic_equivalent(study, p) for p in points])
    best = study.tables["mode"].amplitude[int(np.argmax(study.tables["mode"].gamma_eq))]
    figure = new_figure(DOUBLE, 85 * MM)
    axes = figure.subplots(1, 2)
    styles = {
        **{d: {**s, "label": f"table, {s['label']}", "marker": None} for d, s in STATIC.items()},
        "friction": {"color": GREY, "ls": ":", "label": "table, end moments, friction alone"},
    }
    for ax, part in zip(axes, ("imag", "real"), strict=True):
        for name, style in styles.items():
            table = study.tables[name]
            grid = np.geomspace(table.amplitude[0], table.amplitude[-1], 300)
            ax.semilogx(grid / best, getattr(read_table(study, name, grid), part), **style)
        below = frequency < FOLD
        for mask, marker in ((below, "<"), (~below, "o")):
            side = "below" if marker == "<" else "above"
            ax.plot(
                amplitude[mask] / best,
                getattr(dynamic, part)[mask],
                marker,
                color=BLACK,
                mfc="white",
                label=f"time domain, {side} {FOLD:g} Hz",
            )
        ax.set_xlabel("modal amplitude $|q|/q^*$\n($q^*$: at the greatest damping)")
    axes[0].set_ylabel(r"$\gamma_{eq}$")
    axes[1].set_ylabel(r"$k_{eq}$")
    letters(axes)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    read = {name: read_table(study, name, amplitude) for name in study.tables}
    return Plate(
        figure,
        f"(a) Equivalent damping and (b) stiffness over ω_sl² against the modal amplitude, over "
        f"that of the greatest damping of the mode-driven table, q*. Tables from quasi-static "
        f"cycles; points from the time domain at ρ = {PAPER_RHO:g}, {frequency.min():g} to "
        f"{frequency.max():g} Hz.",
        trends=[
            *(one_peak(study.tables[name].gamma_eq, name) for name in study.tables),
            *(falls(study.tables[name].k_eq, name) for name in study.tables),
        ],
        data={
            "frequency_hz": frequency.tolist(),
            "modal_amplitude": amplitude.tolist(),
            "gamma_eq": dynamic.imag.tolist(),
            "k_eq": dynamic.real.tolist(),
            **{f"gamma_eq_{n}": v.imag.tolist() for n, v in read.items()},
            **{f"k_eq_{n}": v.real.tolist() for n, v in read.items()},
        },
    )


def one_peak(gamma: NDArray, name: str) -> Trend:
    """Has damping one peak over amplitude, but for steps of the mesh?"""
    padded = np.concatenate([[0.0], gamma, [0.0]])
    peaks = find_peaks(padded, prominence=MESH * gamma.max())[0] - 1
    return Trend(
        f"gamma_one_peak_{name}",
        f"γ_eq has one peak over amplitude (table: {name})",
        len(peaks) == 1 and 0 < peaks[0] < len(gamma) - 1,
        {"greatest": float(gamma.max()), "peaks": len(peaks)},
        "Dissipation grows as the cube of amplitude in partial slip and in proportion in gross slip.",
    )


def falls(k: NDArray, name: str) -> Trend:
    """Does stiffness fall with amplitude, but for steps of the mesh?"""
    rise = float(np.diff(k).max(initial=0.0) / (k.max() - k.min()))
    return Trend(
        f"k_falls_{name}",
        f"k_eq falls monotonically with amplitude (table: {name})",
        rise < MESH,
        {
            "smallest_amplitude": float(k[0]),
            "largest_amplitude": float(k[-1]),
            "largest_rise_over_fall": rise,
        },
        "Slip releases the joint; with the whole contact force it turns negative where the tips "
        "open and close, with friction alone it tends to zero.",
    )
