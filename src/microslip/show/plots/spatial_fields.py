"""Figures of interfaces in space: pressure, contact states, tractions, dissipation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from microslip.analyses.statics.cycle import Cycle
from microslip.analyses.time.readings import phases
from microslip.contact.fields import contact_fields
from microslip.contact.pairs import SEPARATED, STICK, touches
from microslip.pipeline.run import Run
from microslip.show.plots.interface_maps import (
    Drawn,
    apart_handle,
    by_interface,
    colour_bar,
    draw_arrows,
    draw_field,
    draw_over_cycle,
    draw_states,
    laid_flat,
    never_touching,
    panels,
    state_handles,
    title,
)
from microslip.show.plots.selection import greatest_damping, main_drive, name_of
from microslip.show.plots.style import house_style, letters
from microslip.typing import Array, Mask, Status

MEGA, MICRO = 1e-6, 1e6
"""Pa to MPa, m to µm."""


@house_style
def pressure_figure(run: Run) -> Figure | None:
    """Contact pressure under the preload alone on every interface, on one scale."""
    found = laid_flat(run)
    if not found:
        return None
    figure, axes = panels([chart for _, chart in found])
    shown = None
    for ax, drawn in zip(axes, found, strict=True):
        shown = draw_pressure(ax, run, drawn)
    assert shown is not None
    colour_bar(figure, shown, axes, "pressure (MPa)")
    if not run.prestress.touching.all():
        figure.legend(handles=[apart_handle("does not touch")], loc="outside lower center")
    if len(axes) > 1:
        letters(axes)
    return figure


def draw_pressure(ax: Axes, run: Run, drawn: Drawn) -> ScalarMappable:
    """Pressure under the preload alone on one interface; hatched where it does not touch."""
    own = drawn[0].pairs
    pressure, touching = MEGA * run.prestress.pressure, run.prestress.touching
    shown = draw_field(
        ax,
        drawn,
        pressure[own],
        norm=Normalize(0.0, max(float(pressure.max()), 1e-12)),
        absent=~touching[own],
    )
    ax.set_title(title(drawn, run, "pressure under the preload alone"), loc="left")
    return shown


def shown_cycle(run: Run) -> tuple[str, int, Cycle] | None:
    """The cycle of greatest damping, its drive and its index; None where there is none."""
    drive = main_drive(run)
    if not drive:
        return None
    index = greatest_damping(run, drive)
    return drive, index, run.cycles[drive][index]


@dataclass(frozen=True)
class Turn:
    """Contact over one turn of the load.

    Attributes
    ----------
    load : (s + 1,) array
        The last repeats the first.
    status : (s + 1, m) int8 array
    slip : (s + 1, m, 2) array
        m.
    """

    load: Array
    status: Status
    slip: Array


def spatial_states_figure(run: Run) -> Figure | dict[str, Figure] | None:
    """States of the cycle of greatest damping at both ends of the load and between, and over all of it."""
    found = shown_cycle(run)
    if found is None:
        return None
    drive, index, cycle = found
    turn = Turn(cycle.load, cycle.status, cycle.slip)
    said = f"{name_of(run, drive, index)}, the cycle of greatest damping"
    return by_interface(run, lambda run, drawn: states_of_turn(run, drawn, turn, said))


def spatial_steady_figure(run: Run) -> Figure | dict[str, Figure] | None:
    """The same of the steady state of largest amplitude in time; of one that is not steady where none is."""
    if not run.time_domain:
        return None
    steady = [p for p in run.time_domain if p.steady.converged]
    point = max(steady or run.time_domain, key=lambda p: abs(p.steady.amplitude))
    march = point.steady.cycle
    fields = contact_fields(march.r, march.v, run.prestress.solution.v, run.model.area)
    load = point.steady.load * np.sin(phases(point.steady))
    turn = Turn(load, march.status, fields.slip)
    what = "steady state" if point.steady.converged else "not steady, the cycle"
    driven = run.joint.driven.load.named(point.steady.load)
    said = f"{what} of largest amplitude: {driven}, {point.steady.frequency:.2f} Hz"
    return by_interface(run, lambda run, drawn: states_of_turn(run, drawn, turn, said))


@house_style
def states_of_turn(run: Run, drawn: Drawn, turn: Turn, said: str) -> Figure:
    """States of one interface where the load is largest either way and between, and over the whole turn."""
    figure, axes = panels([drawn[1]] * 4)
    status = turn.status[1:, drawn[0].pairs]
    never = never_touching(status)
    for ax, (step, name) in zip(axes, instants(turn.load), strict=False):
        draw_instant(ax, drawn, turn, step, never)
        ax.set_title(title(drawn, run, name), loc="left")
    draw_over_cycle(axes[3], drawn, status)
    axes[3].set_title(title(drawn, run, "over the whole cycle"), loc="left")
    letters(axes)
    figure.legend(handles=state_handles(never), loc="outside lower center", ncols=5)
    figure.suptitle(said)
    return figure


def instants(load: Array) -> list[tuple[int, str]]:
    """Steps of a cycle that are shown, with what they are: where the load is largest, where it comes back
    through zero, where it is largest the other way."""
    top, bottom = int(np.argmax(load)), int(np.argmin(load))
    after = np.roll(np.arange(len(load) - 1), -top)
    back = int(after[np.argmax(load[after] <= 0)])
    return [
        (top, "load at its largest, slip of the upper side"),
        (max(back, 1), "load back at zero"),
        (bottom, "load at its largest the other way"),
    ]


def draw_instant(ax: Axes, drawn: Drawn, turn: Turn | Cycle, step: int, never: Mask) -> None:
    """States at a step, with arrows of how the upper side slips in it."""
    own = drawn[0].pairs
    status = turn.status[step, own]
    draw_states(ax, drawn, status, never)
    moved = turn.slip[step, own] - turn.slip[step - 1, own]
    draw_arrows(ax, drawn, moved, (status != STICK) & (status != SEPARATED))


def spatial_tractions_figure(run: Run) -> Figure | dict[str, Figure] | None:
    """Traction where the load is largest, and what part of the friction limit it is."""
    return by_interface(run, _tractions)


@house_style
def _tractions(run: Run, drawn: Drawn) -> Figure | None:
    found = shown_cycle(run)
    if found is None:
        return None
    drive, index, cycle = found
    own, step = drawn[0].pairs, int(np.argmax(cycle.load))
    traction, pressure = cycle.traction[step, own], cycle.pressure[step, own]
    size = np.linalg.norm(traction, axis=-1)
    limit = run.prepared.law.friction[own] * pressure
    part = np.divide(size, limit, out=np.zeros_like(size), where=limit > 0)
    touching = touches(cycle.status[step, own])
    figure, axes = panels([drawn[1]] * 2)
    norm = Normalize(0.0, max(MEGA * float(size.max()), 1e-12))
    shown = draw_field(axes[0], drawn, MEGA * size, norm=norm, absent=~touching)
    draw_arrows(axes[0], drawn, traction, touching)
    colour_bar(figure, shown, axes[:1], "traction (MPa)")
    axes[0].set_title(title(drawn, run, "traction on the upper side"), loc="left")
    shown = draw_field(axes[1], drawn, part, norm=Normalize(0.0, 1.0), absent=~touching)
    colour_bar(figure, shown, axes[1:], "traction over friction limit")
    axes[1].set_title(title(drawn, run, r"over the friction limit $\mu p$"), loc="left")
    letters(axes)
    figure.suptitle(
        f"{name_of(run, drive, index)}, the cycle of greatest damping, the load at its largest"
    )
    if not touching.all():
        figure.legend(handles=[apart_handle("open")], loc="outside lower center")
    return figure


def spatial_dissipation_figure(run: Run) -> Figure | dict[str, Figure] | None:
    """Friction work per area over the cycle, and how far each pair slips in it."""
    return by_interface(run, _dissipation)


@house_style
def _dissipation(run: Run, drawn: Drawn) -> Figure | None:
    found = shown_cycle(run)
    if found is None or not found[2].dissipated > 0:
        return None
    drive, index, cycle = found
    own = drawn[0].pairs
    never = never_touching(cycle.status[1:, own])
    work = np.where(never, 0.0, cycle.friction_work[own] / cycle.area[own])
    figure, axes = panels([drawn[1]] * 2)
    norm = Normalize(0.0, max(float(work.max()), 1e-300))
    shown = draw_field(axes[0], drawn, work, norm=norm, absent=never)
    colour_bar(figure, shown, axes[:1], "friction work (J/m²)")
    share = cycle.friction_work[own].sum() / cycle.dissipated
    parts = "" if share > 1 - 1e-9 else f", {share:.0%} of all"
    axes[0].set_title(title(drawn, run, f"dissipation over the cycle{parts}"), loc="left")
    way = MICRO * slipped(cycle)[own]
    norm = Normalize(0.0, max(float(way[~never].max(initial=0.0)), 1e-12))
    shown = draw_field(axes[1], drawn, way, norm=norm, absent=never)
    colour_bar(figure, shown, axes[1:], "slip to and fro (µm)")
    axes[1].set_title(title(drawn, run, "way of the slip over the cycle"), loc="left")
    letters(axes)
    if never.any():
        figure.legend(handles=[apart_handle()], loc="outside lower center")
    figure.suptitle(f"{name_of(run, drive, index)}, the cycle of greatest damping")
    return figure


def slipped(cycle: Cycle) -> Array:
    """(m,) length of the way that the sides of each pair slip over a cycle while they touch, m."""
    steps = np.linalg.norm(np.diff(cycle.slip, axis=0), axis=-1)
    return np.asarray((steps * touches(cycle.status[1:])).sum(axis=0))
