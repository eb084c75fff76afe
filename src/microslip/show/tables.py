"""What was computed, as tables and lines for a terminal: one function per analysis, from its rows."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from rich.markup import escape
from rich.table import Table

from microslip.describe.units import readable
from microslip.results.labels import load_column

MOVES = 1e-6
"""An output smaller than this share of the modal amplitude, in SI units, is said not to move."""

Summary = dict[str, Any]
"""As `microslip.results.summary.summary` gives it, or as it was stored."""


def number(value: float | None, form: str = ".4g") -> str:
    """A number, or a dash where there is none."""
    return "–" if value is None else format(value, form)


def shown(found: Summary) -> tuple[str, str, str]:
    """Name, unit and key in the rows of the output that tables show: the first of the file."""
    first = next(iter(found.get("outputs", ())), None)
    return ("output", "", "") if first is None else (first["name"], first["unit"], first["key"])


def output(row: dict[str, Any], key: str, form: str = ".4g", of: str = "outputs") -> str:
    """Size of an output in a row; a dash where it has none."""
    return number((row.get(of) or {}).get(key), form)


def _table(title: str) -> Table:
    return Table(title=title, title_justify="left", box=None, pad_edge=True)


def cycle_lines(found: Summary) -> Iterator[str]:
    """Greatest equivalent damping of each drive, and cycles that still changed."""
    rows = found["cycles"]
    for drive in dict.fromkeys(row["drive"] for row in rows):
        yield _greatest_damping(found, drive, [row for row in rows if row["drive"] == drive])
    still = [row for row in rows if not row["closed"]]
    if still:
        yield _still_open(still, len(rows))
    odd = [row for row in rows if row["closed"] and row["energy_imbalance"] > UNBALANCED]
    if odd:
        yield _unbalanced(odd, len(rows))


NO_DAMPING = 1e-10
"""Equivalent damping, over the stiffness of the sliding mode: less is rounding."""


def _greatest_damping(found: Summary, drive: str, mine: list[dict[str, Any]]) -> str:
    """Where it is, and whether that lies inside the table."""
    best = max(mine, key=lambda row: row["gamma_eq"])
    if not best["gamma_eq"] > NO_DAMPING:
        return f"  greatest damping   none: the sliding mode takes no energy ({drive}-driven)"
    big = best["gamma_eq"] >= 1e-3
    edge = "" if best not in (mine[0], mine[-1]) else ", the end of the table: widen it"
    return (
        f"  greatest damping   gamma_eq {number(best['gamma_eq'], '.4f' if big else '.2e')} at "
        f"{_moving(found, best)}, {_load(best)} ({drive}-driven{edge})"
    )


def _still_open(still: list[dict[str, Any]], count: int) -> str:
    """Cycles whose energy did not balance when the last one allowed was computed."""
    worst = max(still, key=lambda row: row["energy_imbalance"])
    return (
        f"  [yellow]![/yellow] {len(still)} of {count} cycles did not close: the work of the load "
        f"and of friction still differ by up to {worst['energy_imbalance']:.1%}, at "
        f"{_load(worst)} ({worst['drive']}-driven); raise analysis.cycle.max_cycles"
    )


UNBALANCED = 0.01
"""Share by which the work of the load and of friction may differ in silence where reactions repeat."""


def _unbalanced(odd: list[dict[str, Any]], count: int) -> str:
    """Cycles that repeat, and in which the load does not do the work of friction."""
    worst = max(odd, key=lambda row: row["energy_imbalance"])
    walking = max(odd, key=lambda row: row["walk_m"])
    walk = ""
    if walking["walk_m"] > 0:
        by = readable(walking["walk_m"], "m", 3)
        at = f"at {_load(walking)}, on which the preload works"
        walk = f", or bodies that walk, by up to {by} each cycle, {at}"
    return (
        f"  [yellow]![/yellow] in {len(odd)} of {count} cycles reactions repeat, but the work of the load "
        f"and of friction differ, by up to {worst['energy_imbalance']:.1%}, at {_load(worst)}: small loads, "
        f"beside what still settles after the preload{walk}"
    )


def _load(row: dict[str, Any]) -> str:
    """The load of a row."""
    heading, key = load_column([row])
    symbol, _, unit = heading.partition(", ")
    return f"{symbol} = {number(row[key], '.3g')} {unit}".rstrip()


PEAK = "peak"
"""Column of the output that tables show; its heading is what that is called."""

REMARK = "no answer, or open"
"""Column of what is missing; left out where nothing is."""

FOUND_OFF = "off by"
"""Column of what the model is off by against time integration; left out where it was not held to any."""

LOAD = "load"
"""Column of the load, likewise."""

_COLUMNS: tuple[tuple[str, Callable[[dict[str, Any]], str]], ...] = (
    ("variant", lambda row: row["variant"]),
    (
        LOAD,
        lambda row: number(row["moment_n"] if "moment_n" in row else row[load_column([row])[1]]),
    ),
    ("peak, Hz", lambda row: _peak(row)),
    (PEAK, lambda row: _bound(row) + row["shown"]),
    (
        "of mu = 0",
        lambda row: _bound(row) + number(row["peak_amplitude_over_frictionless"], ".3g"),
    ),
    (FOUND_OFF, lambda row: _found_off(row)),
    (REMARK, lambda row: _unanswered(row)),
)


def response_table(found: Summary) -> Iterator[str | Table]:
    """Band, peaks of every load and variant, and where there is no answer."""
    rows = found["response"]
    table = _table("Forced response")
    rows, (label, unit, key) = found["response"], shown(found)
    with_rho = says_rho(rows)
    if with_rho:
        table.add_column("rho", justify="right", no_wrap=True)
    moment = any("moment_n" in row for row in rows)
    headings = {
        PEAK: f"{label}\nat peak, {unit}",
        LOAD: "M, N m/m" if moment or not rows else load_column(rows)[0],
    }
    empty = {REMARK: not any(map(_unanswered, rows)), FOUND_OFF: not any(map(_was_checked, rows))}
    columns = [c for c in _COLUMNS if not empty.get(c[0])]
    for name, _ in columns:
        table.add_column(
            headings.get(name, name),
            justify="left" if name in ("variant", REMARK) else "right",
            no_wrap=name != REMARK,
        )
    for row in (r | {"shown": output(r, key, of="peak_outputs")} for r in rows):
        style = "yellow" if row["unconverged_points"] or row["peak_at_edge"] else None
        rho = [number(row["rho"], "g")] if with_rho else []
        table.add_row(*rho, *(cell(row) for _, cell in columns), style=style)
    yield table
    for band in found["response_band"]:
        yield (
            f"  band {number(band['from_hz'], '.6g')} to {number(band['to_hz'], '.6g')} Hz, "
            f"{band['origin']}"
        )


def _found_off(row: dict[str, Any]) -> str:
    """The largest error, and at how many of the frequencies there is one where that is not all."""
    found = [check["error"] is not None for check in row.get("checks", ())]
    of_some = "" if all(found) else f" ({sum(found)} of {len(found)})"
    return number(row.get("largest_error_found"), "+.1%") + of_some


def _was_checked(row: dict[str, Any]) -> bool:
    """Whether a response was held against time integration."""
    return bool(row.get("checks"))


def says_rho(rows: list[dict[str, Any]]) -> bool:
    """Whether loads were given by rho."""
    return any("rho" in row for row in rows)


def backbone_table(found: Summary) -> Iterator[Table]:
    """Per mode and method: frequency from the smallest amplitude to the largest, damping ratio at
    the smallest and at its greatest."""
    table = _table("Backbones")
    table.add_column("mode", justify="right")
    table.add_column("method", no_wrap=True)
    for name in ("from, Hz", "to, Hz", "zeta", "greatest", "at"):
        table.add_column(name, justify="right", no_wrap=name != "at")
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
            _moving(found, best),
        )
    yield table


def _moving(found: Summary, row: dict[str, Any]) -> str:
    """The first output that moves in a mode, with its unit."""
    for each in found.get("outputs", ()):
        size = (row.get("outputs") or {}).get(each["key"])
        if size is not None and size * each["unit_in_si"] > MOVES * row["modal_amplitude"]:
            return f"{each['name']} {number(size, '.3g')} {each['unit']}"
    return f"{number(row['modal_amplitude'], '.3g')} kg½ m½"


def harmonic_table(found: Summary) -> Iterator[Table]:
    """Per load: responses, the largest of the stable ones, folds, and what is not stable."""
    table = _table("Harmonic balance")
    label, unit, wanted = shown(found)
    peak = f"{label}\nat peak, {unit}"
    rows = found["harmonic"]
    heading, key = load_column(rows)
    with_rho = says_rho(rows)
    names = (heading, "points", "peak, Hz", peak, "H", "s")
    for name in ("rho", *names) if with_rho else names:
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("folds, Hz", min_width=7)
    table.add_column("not\nstable", no_wrap=True)
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
            output(best, wanted) + (", opens" if best["joint_opens"] else ""),
            str(max(row["harmonics"] for row in mine)),
            number(sum(row["seconds"] for row in mine), ".1f"),
            ", ".join(number(fold, ".2f") for fold in folds),
            str(len(mine) - len(stable)) if len(stable) < len(mine) else "",
        )
    yield table


def dissipated(rows: Sequence[Mapping[str, Any]]) -> tuple[str, str]:
    """Unit and key of the dissipated energy of rows: per metre of width, or of the whole structure."""
    whole = any("dissipated_energy_j" in row for row in rows)
    return ("J", "dissipated_energy_j") if whole else ("J/m", "dissipated_energy_j_per_m")


def time_table(found: Summary) -> Iterator[Table]:
    """Steady states by time integration."""
    table = _table("Time domain")
    label, unit, wanted = shown(found)
    rows = found["time_domain"]
    energy, key_of_energy = dissipated(rows)
    size, lost = f"{label},\n{unit}", f"dissipated,\n{energy}"
    with_rho = says_rho(rows)
    several = any(len(row.get("starts", [])) > 1 for row in rows)
    last = "start" if several else "s"
    names = ("f, Hz", size, "phase, °", lost, "largest\nmultiplier", "cycles", last)
    heading, key = load_column(rows)
    for name in ("rho" if with_rho else heading, *names):
        table.add_column(name, justify="right", no_wrap=True)
    for row in rows:
        table.add_row(
            number(row["rho"], "g") if with_rho else number(row[key], ".3g"),
            number(row["frequency_hz"], ".2f"),
            output(row, wanted),
            number(row.get("phases_deg", {}).get(label), ".1f"),
            number(row[key_of_energy]),
            number(row.get("largest_multiplier"), ".3f"),
            _settled(row, rows),
            row["starts"][0] if several else number(row["seconds"], ".1f"),
            style=None if row["converged"] and row.get("stability") != "unstable" else "yellow",
        )
    yield table


def _settled(row: Summary, rows: list[Summary]) -> str:
    """Cycles to a steady state; what it is where it is none that lasts; steps where most take others."""
    said = [str(row["cycles"])]
    if not row["converged"]:
        said.append("not steady")
    elif row.get("stability") == "unstable":
        said.append("unstable")
    usual = Counter(other.get("steps_per_cycle", 0) for other in rows).most_common(1)[0][0]
    if row.get("steps_per_cycle", 0) != usual:
        said.append(f"{row['steps_per_cycle']} steps")
    return ", ".join(said)


def history_table(found: Summary) -> Iterator[Table]:
    """Histories: largest value of the first output, and what friction took."""
    table = _table("Histories")
    table.add_column("name", no_wrap=True)
    label, unit, wanted = shown(found)
    energy, key = dissipated(found["history"])
    for name in ("until, s", f"largest\n{label}, {unit}", f"dissipated, {energy}", "s"):
        table.add_column(name, justify="right", no_wrap=True)
    for row in found["history"]:
        table.add_row(
            escape(row["name"]) + ("" if row["complete"] else ", ended early"),
            number(row["duration_s"]),
            output(row, wanted, of="peak_outputs"),
            number(row[key]),
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
    """Where there is no answer, or the joint is open."""
    load = row["opens_from_load"]
    opens = "" if load is None else f"opens from {number(load)} on"
    if not row["unconverged_points"]:
        return opens
    span = f"{row['unconverged_from_hz']:.5g}–{row['unconverged_to_hz']:.5g} Hz"
    return f"{opens}, {span}" if opens else f"{row['unconverged_points']} points, {span}"
