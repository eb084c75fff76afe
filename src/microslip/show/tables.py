"""What was computed, as tables and lines for a terminal: one function per analysis, from its rows."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

from rich.markup import escape
from rich.table import Table

Summary = dict[str, Any]
"""As `microslip.results.summary.summary` gives it, or as it was stored."""


def number(value: float | None, form: str = ".4g") -> str:
    """A number, or a dash where there is none."""
    return "–" if value is None else format(value, form)


def _table(title: str) -> Table:
    return Table(title=title, title_justify="left", box=None, pad_edge=True)


def cycle_lines(found: Summary) -> Iterator[str]:
    """Greatest equivalent damping of each drive, and cycles that still changed."""
    rows = found["cycles"]
    for drive in dict.fromkeys(row["drive"] for row in rows):
        yield _greatest_damping(drive, [row for row in rows if row["drive"] == drive])
    still = [row for row in rows if not row["closed"]]
    if still:
        yield _still_open(still, len(rows))


def _greatest_damping(drive: str, mine: list[dict[str, Any]]) -> str:
    """Where it is, and whether that lies inside the table."""
    best = max(mine, key=lambda row: row["gamma_eq"])
    edge = "" if best not in (mine[0], mine[-1]) else ", the end of the table: widen it"
    return (
        f"  greatest damping   gamma_eq {number(best['gamma_eq'], '.4f')} at |q| = "
        f"{number(best['modal_amplitude'], '.3g')} kg½ m½, M/(PL) = "
        f"{number(best['moment_over_clamp_force_length'], '.3g')} ({drive}-driven{edge})"
    )


def _still_open(still: list[dict[str, Any]], count: int) -> str:
    """Cycles that still changed when the last one allowed was computed."""
    worst = max(still, key=lambda row: row["closure"])
    return (
        f"  [yellow]![/yellow] {len(still)} of {count} cycles did not close: "
        f"tractions still changed by up to {worst['closure']:.1g} of the largest prestress, at "
        f"M/(PL) = {number(worst['moment_over_clamp_force_length'], '.3g')} "
        f"({worst['drive']}-driven)"
    )


_COLUMNS: tuple[tuple[str, Callable[[dict[str, Any]], str]], ...] = (
    ("variant", lambda row: row["variant"]),
    ("M, N m/m", lambda row: number(row["moment_n"])),
    ("peak, Hz", lambda row: _peak(row)),
    ("peak |q|", lambda row: _bound(row) + number(row["peak_modal_amplitude"])),
    (
        "of mu = 0",
        lambda row: _bound(row) + number(row["peak_amplitude_over_frictionless"], ".3g"),
    ),
    ("no answer", lambda row: _unanswered(row)),
)


def response_table(found: Summary) -> Iterator[str | Table]:
    """Band, peaks of every load and variant, and where there is no answer."""
    rows = found["response"]
    table = _table("Forced response")
    with_rho = says_rho(rows)
    if with_rho:
        table.add_column("rho", justify="right", no_wrap=True)
    for name, _ in _COLUMNS:
        left = name in ("variant", "no answer")
        table.add_column(name, justify="left" if left else "right", no_wrap=name != "no answer")
    for row in rows:
        style = "yellow" if row["unconverged_points"] or row["peak_at_edge"] else None
        rho = [number(row["rho"], "g")] if with_rho else []
        table.add_row(*rho, *(cell(row) for _, cell in _COLUMNS), style=style)
    yield table
    for band in found["response_band"]:
        yield (
            f"  band {number(band['from_hz'], '.6g')} to {number(band['to_hz'], '.6g')} Hz, "
            f"{band['origin']}"
        )


def says_rho(rows: list[dict[str, Any]]) -> bool:
    """Whether loads were given by rho."""
    return any("rho" in row for row in rows)


def backbone_table(found: Summary) -> Iterator[Table]:
    """Per mode and method: frequency from the smallest amplitude to the largest, damping ratio at
    the smallest and at its greatest."""
    table = _table("Backbones")
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
            number(mine[0]["frequency_hz"], ".2f"),
            number(mine[-1]["frequency_hz"], ".2f"),
            number(mine[0]["damping_ratio"], ".2e"),
            number(best["damping_ratio"], ".2e"),
            number(best["modal_amplitude"], ".3g"),
        )
    yield table


def harmonic_table(found: Summary) -> Iterator[Table]:
    """Per load: responses, the largest of the stable ones, folds, and what is not stable."""
    table = _table("Harmonic balance")
    rows, key = found["harmonic"], "moment_over_clamp_force_length"
    with_rho = says_rho(rows)
    names = ("M/(PL)", "points", "peak, Hz", "peak |q|", "harmonics", "s")
    for name in ("rho", *names) if with_rho else names:
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("folds, Hz")
    table.add_column("unstable", no_wrap=True)
    for load in dict.fromkeys(row[key] for row in rows):
        mine = [row for row in rows if row[key] == load]
        stable = [row for row in mine if row["stable"] is not False]
        best = max(stable or mine, key=lambda row: row["modal_amplitude"])
        folds = [fold["frequency_hz"] for fold in found["harmonic_folds"] if fold[key] == load]
        table.add_row(
            *([number(best["rho"], "g")] if with_rho else []),
            number(load, ".3g"),
            str(len(mine)),
            number(best["frequency_hz"], ".2f"),
            number(best["modal_amplitude"]) + (", opens" if best["joint_opens"] else ""),
            str(max(row["harmonics"] for row in mine)),
            number(sum(row["seconds"] for row in mine), ".1f"),
            ", ".join(number(fold, ".2f") for fold in folds),
            str(len(mine) - len(stable)) if len(stable) < len(mine) else "",
        )
    yield table


def time_table(found: Summary) -> Iterator[Table]:
    """Steady states by time integration."""
    table = _table("Time domain")
    rows = found["time_domain"]
    with_rho = says_rho(rows)
    names = ("f, Hz", "|q|", "phase, rad", "dissipated, J/m", "cycles", "s")
    for name in ("rho" if with_rho else "M/(PL)", *names):
        table.add_column(name, justify="right", no_wrap=True)
    for row in rows:
        table.add_row(
            number(row["rho"], "g")
            if with_rho
            else number(row["moment_over_clamp_force_length"], ".3g"),
            number(row["frequency_hz"], ".2f"),
            number(row["modal_amplitude"]),
            number(row["phase_rad"], ".3f"),
            number(row["dissipated_energy_j_per_m"]),
            str(row["cycles"]) if row["converged"] else f"{row['cycles']}, not steady",
            number(row["seconds"], ".1f"),
            style=None if row["converged"] else "yellow",
        )
    yield table


def history_table(found: Summary) -> Iterator[Table]:
    """Histories: largest sliding coordinate, and what friction took."""
    table = _table("Histories")
    table.add_column("name", no_wrap=True)
    for name in ("until, s", "largest |q|", "at, s", "dissipated, J/m", "s"):
        table.add_column(name, justify="right", no_wrap=True)
    for row in found["history"]:
        table.add_row(
            escape(row["name"]) + ("" if row["complete"] else ", ended early"),
            number(row["duration_s"]),
            number(abs(row["peak_modal_coordinate"])),
            number(row["time_of_peak_s"], ".3g"),
            number(row["dissipated_energy_j_per_m"]),
            number(row["seconds"], ".1f"),
            style=None if row["complete"] else "yellow",
        )
    yield table


def _bound(row: dict[str, Any]) -> str:
    """Mark of a peak that may go on where there is no answer."""
    return "≥ " if row["peak_beside_unconverged"] else ""


def _peak(row: dict[str, Any]) -> str:
    """Its frequency; an amplitude that is largest at an end of the band is none."""
    if row["peak_at_edge"]:
        return f"none, rises to {number(row['largest_at_hz'], '.5g')}"
    return number(row["peak_frequency_hz"], ".2f")


def _unanswered(row: dict[str, Any]) -> str:
    if not row["unconverged_points"]:
        return ""
    return (
        f"{row['unconverged_points']}: {row['unconverged_from_hz']:.2f}–"
        f"{row['unconverged_to_hz']:.2f} Hz"
    )
