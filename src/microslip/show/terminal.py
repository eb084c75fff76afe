"""A run on a terminal: what an engineer wants to know first, on one screen."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from microslip.pipeline.run import LapRun
from microslip.results.dataset import summary


def print_summary(result: LapRun, console: Console) -> None:
    """Print frequencies, prestress, greatest damping, responses, failures and timings.

    Parameters
    ----------
    result : LapRun
    console : rich.console.Console
    """
    found = summary(result)
    console.print(f"[bold]{escape(found['title'] or 'Lap joint')}[/bold]")
    _print_model(found, console)
    _print_damping(found, console)
    _print_open_cycles(found, console)
    if found["response"]:
        console.print(_response_table(found))
    if found["backbone"]:
        console.print(_backbone_table(found))
    if found["harmonic"]:
        console.print(_harmonic_table(found))
    if found["time_domain"]:
        console.print(_time_table(found))
    if found["history"]:
        console.print(_history_table(found))
    _print_failures(found, console)
    _print_timings(found, console)


def _number(value: float | None, form: str = ".4g") -> str:
    return "–" if value is None else format(value, form)


def _print_model(found: dict[str, Any], console: Console) -> None:
    model, start = found["model"], found["prestress"]
    console.print(
        f"  natural frequency  {_number(model['sliding_frequency_hz'], '.2f')} Hz sliding, "
        f"{_number(model['stuck_frequency_hz'], '.2f')} Hz stuck",
        highlight=False,
    )
    console.print(
        f"  prestress          contact to "
        f"{_number(start['contact_half_length_over_clamp_half_length'], '.3f')} L_p, peak "
        f"{_number(start['peak_pressure_pa'] / 1e6)} MPa "
        f"({_number(start['peak_pressure_over_mean_clamp_pressure'], '.3f')} times the mean)",
        highlight=False,
    )
    console.print(
        f"  the joint opens at M/(PL) = "
        f"{_number(model['opening_moment_over_clamp_force_length'], '.3g')}",
        highlight=False,
    )


def _print_damping(found: dict[str, Any], console: Console) -> None:
    """Greatest equivalent damping of each drive, and whether it lies inside the table."""
    rows = found["cycles"]
    for drive in dict.fromkeys(row["drive"] for row in rows):
        mine = [row for row in rows if row["drive"] == drive]
        best = max(mine, key=lambda row: row["gamma_eq"])
        edge = "" if best not in (mine[0], mine[-1]) else ", the end of the table: widen it"
        console.print(
            f"  greatest damping   gamma_eq {_number(best['gamma_eq'], '.4f')} at |q| = "
            f"{_number(best['modal_amplitude'], '.3g')} kg½ m½, M/(PL) = "
            f"{_number(best['moment_over_clamp_force_length'], '.3g')} ({drive}-driven{edge})",
            highlight=False,
            soft_wrap=True,
        )


def _print_open_cycles(found: dict[str, Any], console: Console) -> None:
    """Cycles that still changed when the last one allowed was computed."""
    still = [row for row in found["cycles"] if not row["closed"]]
    if still:
        worst = max(still, key=lambda row: row["closure"])
        console.print(
            f"  [yellow]![/yellow] {len(still)} of {len(found['cycles'])} cycles did not close: "
            f"tractions still changed by up to {worst['closure']:.1g} of the largest prestress, at "
            f"M/(PL) = {_number(worst['moment_over_clamp_force_length'], '.3g')} "
            f"({worst['drive']}-driven)",
            highlight=False,
            soft_wrap=True,
        )


_COLUMNS: tuple[tuple[str, Callable[[dict[str, Any]], str]], ...] = (
    ("rho", lambda row: _number(row["rho"], "g")),
    ("variant", lambda row: row["variant"]),
    ("M, N m/m", lambda row: _number(row["moment_n"])),
    ("peak, Hz", lambda row: _number(row["peak_frequency_hz"], ".2f")),
    ("peak |q|", lambda row: _bound(row) + _number(row["peak_modal_amplitude"])),
    (
        "of mu = 0",
        lambda row: _bound(row) + _number(row["peak_amplitude_over_frictionless"], ".3g"),
    ),
    ("no answer", lambda row: _unanswered(row)),
)


def _response_table(found: dict[str, Any]) -> Table:
    table = Table(title="Forced response", title_justify="left", box=None, pad_edge=True)
    for name, _ in _COLUMNS:
        table.add_column(
            name, justify="left" if name in ("variant", "no answer") else "right", no_wrap=True
        )
    for row in found["response"]:
        style = "yellow" if row["unconverged_points"] else None
        table.add_row(*(cell(row) for _, cell in _COLUMNS), style=style)
    return table


def _backbone_table(found: dict[str, Any]) -> Table:
    """Per mode and method: frequency from the smallest amplitude to the largest, damping ratio at
    the smallest and at its greatest."""
    table = Table(title="Backbones", title_justify="left", box=None, pad_edge=True)
    table.add_column("mode", justify="right")
    table.add_column("method", no_wrap=True)
    for name in ("from, Hz", "to, Hz", "zeta", "greatest", "at |q|"):
        table.add_column(name, justify="right", no_wrap=True)
    rows = found["backbone"]
    for key in dict.fromkeys((row["mode"], row["method"]) for row in rows):
        mine = [row for row in rows if (row["mode"], row["method"]) == key]
        best = max(mine, key=lambda row: row["damping_ratio"])
        idle = "" if best["interface_matters"] else ", interface idle"
        table.add_row(
            str(key[0]),
            key[1].replace("_", "-") + idle,
            _number(mine[0]["frequency_hz"], ".2f"),
            _number(mine[-1]["frequency_hz"], ".2f"),
            _number(mine[0]["damping_ratio"], ".2e"),
            _number(best["damping_ratio"], ".2e"),
            _number(best["modal_amplitude"], ".3g"),
        )
    return table


def _harmonic_table(found: dict[str, Any]) -> Table:
    """Per load: responses, the largest of the stable ones, folds, and what is not stable."""
    table = Table(title="Harmonic balance", title_justify="left", box=None, pad_edge=True)
    for name in ("rho", "M/(PL)", "points", "peak, Hz", "peak |q|", "harmonics", "s"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("folds, Hz")
    table.add_column("unstable", no_wrap=True)
    rows, key = found["harmonic"], "moment_over_clamp_force_length"
    for load in dict.fromkeys(row[key] for row in rows):
        mine = [row for row in rows if row[key] == load]
        stable = [row for row in mine if row["stable"] is not False]
        best = max(stable or mine, key=lambda row: row["modal_amplitude"])
        folds = [fold["frequency_hz"] for fold in found["harmonic_folds"] if fold[key] == load]
        table.add_row(
            _number(best["rho"], "g"),
            _number(load, ".3g"),
            str(len(mine)),
            _number(best["frequency_hz"], ".2f"),
            _number(best["modal_amplitude"]) + (", opens" if best["joint_opens"] else ""),
            str(max(row["harmonics"] for row in mine)),
            _number(sum(row["seconds"] for row in mine), ".1f"),
            ", ".join(_number(fold, ".2f") for fold in folds),
            str(len(mine) - len(stable)) if len(stable) < len(mine) else "",
        )
    return table


def _time_table(found: dict[str, Any]) -> Table:
    """Steady states by time integration."""
    table = Table(title="Time domain", title_justify="left", box=None, pad_edge=True)
    for name in ("rho", "f, Hz", "|q|", "phase, rad", "dissipated, J/m", "cycles", "s"):
        table.add_column(name, justify="right", no_wrap=True)
    for row in found["time_domain"]:
        table.add_row(
            _number(row["rho"], "g"),
            _number(row["frequency_hz"], ".2f"),
            _number(row["modal_amplitude"]),
            _number(row["phase_rad"], ".3f"),
            _number(row["dissipated_energy_j_per_m"]),
            str(row["cycles"]) if row["converged"] else f"{row['cycles']}, not steady",
            _number(row["seconds"], ".1f"),
            style=None if row["converged"] else "yellow",
        )
    return table


def _history_table(found: dict[str, Any]) -> Table:
    """Histories: largest sliding coordinate, and what friction took."""
    table = Table(title="Histories", title_justify="left", box=None, pad_edge=True)
    table.add_column("name", no_wrap=True)
    for name in ("until, s", "largest |q|", "at, s", "dissipated, J/m", "s"):
        table.add_column(name, justify="right", no_wrap=True)
    for row in found["history"]:
        table.add_row(
            escape(row["name"]) + ("" if row["complete"] else ", ended early"),
            _number(row["duration_s"]),
            _number(abs(row["peak_modal_coordinate"])),
            _number(row["time_of_peak_s"], ".3g"),
            _number(row["dissipated_energy_j_per_m"]),
            _number(row["seconds"], ".1f"),
            style=None if row["complete"] else "yellow",
        )
    return table


def _bound(row: dict[str, Any]) -> str:
    """Mark of a peak that may go on where there is no answer."""
    return "≥ " if row["peak_beside_unconverged"] else ""


def _unanswered(row: dict[str, Any]) -> str:
    if not row["unconverged_points"]:
        return ""
    return (
        f"{row['unconverged_points']}: {row['unconverged_from_hz']:.2f}–"
        f"{row['unconverged_to_hz']:.2f} Hz"
    )


def _print_failures(found: dict[str, Any], console: Console) -> None:
    if found["interrupted"]:
        console.print("[bold yellow]Interrupted:[/bold yellow] what was finished is shown.")
    failures = found["failures"]
    if not failures:
        return
    console.print(f"[bold red]{len(failures)} not solved[/bold red]")
    for failure in failures:
        console.print(f"  [red]✗[/red] {escape(failure)}", highlight=False, soft_wrap=True)


def _print_timings(found: dict[str, Any], console: Console) -> None:
    timings = dict(found["timings_s"])
    total = timings.pop("total", sum(timings.values()))
    parts = ", ".join(f"{name.replace('_', ' ')} {value:.1f}" for name, value in timings.items())
    console.print(f"  [dim]{total:.1f} s: {escape(parts)}[/dim]", highlight=False)
