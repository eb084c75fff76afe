"""Figure 8: where the energy goes along the interface, and the hysteresis loops."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from microslip.reproduce.drawing import InterfaceMotion, motion_of_cycle, motion_of_point
from microslip.reproduce.fig7 import FREQUENCY
from microslip.reproduce.friction_force import friction_modal_force
from microslip.reproduce.plate import Number, Plate, Trend
from microslip.reproduce.settings import PAPER_RHO
from microslip.reproduce.study import Study
from microslip.show.plots.dissipation import note_cut_tips
from microslip.show.plots.style import (
    BLACK,
    BLUE,
    DOUBLE,
    MM,
    VERMILLION,
    clamp_edges,
    house_style,
    letters,
    new_figure,
)

STYLES = {
    "time domain": {"color": BLACK, "ls": "-"},
    "quasi-static, moment-driven": {"color": BLUE, "ls": "--"},
    "quasi-static, mode-driven": {"color": VERMILLION, "ls": "-."},
}


@house_style
def fig8(study: Study) -> Plate:
    """Density of dissipation and loops of friction on the sliding mode, at equal amplitude."""
    a, x = study.assembly, study.position
    point = study.time_point(PAPER_RHO, FREQUENCY)
    amplitude = abs(point.steady.amplitude)
    with study.timed("figure_cycles"):
        contacts: dict[str, InterfaceMotion] = {
            "time domain": motion_of_point(point.steady, a.model),
            **{
                f"quasi-static, {drive}-driven": motion_of_cycle(
                    study.static_at(drive, amplitude), a.model
                )
                for drive in ("moment", "mode")
            },
        }
    figure = new_figure(DOUBLE, 80 * MM)
    left, right = figure.subplots(1, 2)
    total = contacts["time domain"].work.sum()
    inner = np.abs(x) < 0.9 * np.abs(x).max()
    top, tips = 0.0, []
    for name, contact in contacts.items():
        density = contact.work / a.model.area / total * study.joint.clamp.half_length
        left.plot(x, density, label=name, **STYLES[name])
        top = max(top, float(density[inner].max()))
        tips.append(density)
        f = friction_modal_force(contact.r, a.structure.interface, a.states)
        unit = a.mode.sliding_omega**2 * amplitude
        right.plot(contact.q / amplitude, f / unit, **STYLES[name])
    clamp_edges(left)
    left.set_xlim(x[0], x[-1])
    left.set_ylim(0, 1.1 * top)
    note_cut_tips(left, x, tips)
    left.set_xlabel("position $x/L_p$")
    left.set_ylabel(r"$L_p\,\mathrm{d}E/\mathrm{d}x\;/\;\Delta E_{\mathrm{dynamic}}$")
    right.set_xlabel(r"sliding coordinate $q\,/\,|q|$")
    right.set_ylabel(r"friction on the mode $f\,/\,(\omega_{sl}^2|q|)$")
    letters((left, right))
    figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    energy = {name: float(c.work.sum()) for name, c in contacts.items()}
    ratio = {
        name: value / energy["time domain"] for name, value in energy.items() if "static" in name
    }
    shares = {
        name: float(c.work[np.abs(x) >= 0.95 * np.abs(x).max()].sum() / c.work.sum())
        for name, c in contacts.items()
    }
    return Plate(
        figure,
        f"Time domain at {FREQUENCY:g} Hz, ρ = {PAPER_RHO:g}, and quasi-static cycles of the same "
        f"modal amplitude. (a) Energy dissipated per cycle and length, over the total of the time "
        "domain; the axis leaves out the very tips. (b) Friction force on the sliding mode "
        "against the sliding coordinate.",
        numbers=[
            Number(
                "loop_area_ratio",
                ratio["quasi-static, moment-driven"],
                "At equal modal amplitude the end moment bends the overlap less than the inertia "
                "of the vibration does; driven along the mode the ratio is "
                f"{ratio['quasi-static, mode-driven']:.3f}.",
            )
        ],
        trends=[inside_slip_zone(contacts, x)],
        data={
            "energy_over_time_domain": ratio,
            "dissipated_j_per_m": energy,
            "share_of_the_tips": shares,
        },
    )


def inside_slip_zone(contacts: dict[str, InterfaceMotion], x: NDArray) -> Trend:
    """Is the greatest dissipation between the edges of each slip zone, not at an edge?"""
    numbers = {}
    for name, contact in contacts.items():
        slips = np.isin(contact.status, (2, 3)).any(axis=0)
        density = contact.work / np.gradient(x)
        for side, half in _HALVES.items():
            zone = np.flatnonzero(slips & half(x) & (np.abs(x) < 0.9 * np.abs(x).max()))
            if len(zone):
                peak = int(np.argmax(density[zone]))
                numbers[f"{name}, {side}"] = {
                    "zone": [float(x[zone[0]]), float(x[zone[-1]])],
                    "peak_at": float(x[zone[peak]]),
                    "interior": bool(0 < peak < len(zone) - 1),
                }
    return Trend(
        "peak_inside_slip_zone",
        "the distribution of dissipation peaks inside the slip zone",
        bool(numbers) and all(n["interior"] for n in numbers.values()),
        numbers,
        "At the edge of contact the pressure vanishes, at the edge of stick the slip does.",
    )


_HALVES: dict[str, Callable[[NDArray], NDArray]] = {
    "left": lambda x: x < 0,
    "right": lambda x: x > 0,
}
