"""Figure 5: contact states and tractions of a quasi-static cycle, first loading and steady."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from microslip.contact.fields import contact_extent
from microslip.contact.pairs import normal, tangential, touches
from microslip.reproduce.drawing import (
    QUARTERS,
    InterfaceMotion,
    draw_states,
    draw_tractions,
    inner_height,
    motion_of_cycle,
)
from microslip.reproduce.plate import Number, Plate, Trend
from microslip.reproduce.study import Study
from microslip.show.plots.states import handles
from microslip.show.plots.style import DOUBLE, MM, clamp_edges, house_style, new_figure

MOMENT = 7e-4
"""M/(PL) at which the reference joint has the paper's contact at peak moment."""


@house_style
def fig5(study: Study) -> Plate:
    """States and tractions of the first and of the steady cycle."""
    a, load = study.assembly, MOMENT * study.unit
    with study.timed("figure_cycles"):
        first = study.static_cycle("moment", load, max_cycles=1)
        steady = study.static_cycle("moment", load)
    contacts = motion_of_cycle(first, a.model), motion_of_cycle(steady, a.model)
    figure = draw_cycles(study, contacts, ("first cycle", "steady cycle"))
    ends = [
        contact_extent(study.position, touches(contacts[1].status[contacts[1].at(q)]))
        for q in (1, 3)
    ]
    rest = contact_extent(study.position, a.prestress.touching)
    limit = study.friction * normal(a.prestress.solution.r).sum() / study.joint.clamp.force
    spacing = float(np.diff(study.position).max())
    sign = "The growing side is the left one under a positive moment, mirrored to the paper's text."
    return Plate(
        figure,
        f"Quasi-static cycle under the end moment, M/(PL) = {MOMENT:g}, "
        f"{study.settings.time_steps} steps. (a) Contact states over position and phase in the "
        "first cycle from prestress and in the steady cycle. (b) Friction limit ±μp and traction "
        "f over P/L_p in the first cycle at four phases of the moment. (c) Same in the steady "
        "cycle. Axes leave out the singular pressure at the very tips of the beams.",
        numbers=[
            Number(
                "friction_limit",
                float(limit),
                "Sum of μ times the prestress reactions over P: equilibrium of the clamp.",
            ),
            Number(
                "prestress_extent",
                float(rest[1]),
                f"Last touching pair (spacing {spacing:.3f} L_p); the receding-contact solution "
                "of a layer gives 1.1955.",
            ),
            Number("receding_end", float(ends[0][1]), f"One spacing is {spacing:.3f} L_p. {sign}"),
            Number("growing_end", float(-ends[0][0]), f"One spacing is {spacing:.3f} L_p. {sign}"),
            Number(
                "static_cycles",
                float(steady.cycles - 1),
                "The cycle whose successor changes no reaction by more than 1e-6 of the largest.",
            ),
        ],
        trends=[
            Trend(
                "contact_mirrors",
                "the contact under -M mirrors that under +M",
                bool(np.isclose(ends[0][0], -ends[1][1]) and np.isclose(ends[0][1], -ends[1][0])),
                {"positive_peak": list(ends[0]), "negative_peak": list(ends[1])},
                "Half-turn symmetry of the joint.",
            ),
            _locked_in(contacts[1]),
        ],
    )


def _locked_in(contact: InterfaceMotion) -> Trend:
    """Traction that is left at zero moment."""
    traction = tangential(contact.r[contact.at(2)])
    peak = tangential(contact.r[contact.at(1)])
    share = float(np.abs(traction).max() / np.abs(peak).max())
    return Trend(
        "locked_in",
        "shear traction stays locked in at zero moment",
        share > 0.01,
        {"largest_at_zero_over_largest_at_peak": share},
        "Pairs that slipped at the peak stick with their traction as the moment falls.",
    )


def draw_cycles(
    study: Study, contacts: tuple[InterfaceMotion, InterfaceMotion], names: tuple[str, str]
) -> Figure:
    """Two cycles: state maps above, tractions at the quarters of each below."""
    a, x = study.assembly, study.position
    unit = study.joint.clamp.force / study.joint.clamp.half_length
    area = a.model.area
    figure = new_figure(DOUBLE, 150 * MM)
    parts: Any = figure.subfigures(3, 1, height_ratios=[1.25, 1, 1])
    top, rows = parts[0], parts[1:]
    maps = top.subplots(1, 2, sharey=True)
    for ax, contact, name in zip(maps, contacts, names, strict=True):
        draw_states(ax, x, contact)
        clamp_edges(ax)
        ax.set_title(name, loc="left")
    maps[0].set_title(f"(a)  {names[0]}", loc="left")
    maps[0].set_ylabel(r"phase $\theta$")
    edges = maps[0].get_legend_handles_labels()[0]
    top.legend(handles=[*handles(), *edges], loc="outside lower center", ncols=5)
    height = max(inner_height(c, x, area, study.friction, unit) for c in contacts)
    for row, letter, contact, name in zip(rows, "bc", contacts, names, strict=True):
        axes = row.subplots(1, 4, sharey=True)
        for ax, (quarter, phase) in zip(axes, QUARTERS, strict=True):
            step = contact.at(quarter)
            largest = draw_tractions(ax, x, contact, step, area, study.friction, unit)
            ax.set_title(rf"$\theta$ = {phase}", loc="left")
            if largest > height:
                ax.set_title(f"↑ tip {largest:.2g}", loc="right")
            ax.set_ylim(-height, height)
            ax.set_xlabel("$x/L_p$")
        axes[0].set_title(f"({letter})  {name}, θ = 0", loc="left")
        axes[0].set_ylabel("traction over $P/L_p$")
    shown, labels = axes[0].get_legend_handles_labels()
    figure.legend(shown, labels, loc="outside lower center", ncols=2)
    return figure
