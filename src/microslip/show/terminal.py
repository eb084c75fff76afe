"""A run on a terminal: what an engineer wants to know first, on one screen."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.segment import Segments

from microslip.describe.units import readable
from microslip.pipeline.run import Run
from microslip.registry import column
from microslip.results.labels import load_column
from microslip.results.summary import summary
from microslip.show.tables import Summary, number

WIDEST = 1000
"""Characters that a table may be wide."""


def print_summary(run: Run, console: Console) -> None:
    """Print frequencies, prestress, the table of every analysis, failures and timings.

    Parameters
    ----------
    run : Run
    console : rich.console.Console
    """
    print_found(summary(run), console)


def print_found(found: Summary, console: Console) -> None:
    """Print a summary, also one that was stored."""
    console.print(f"[bold]{escape(found['title'] or 'Joint')}[/bold]")
    _print_joint(found, console)
    for row, table in column("table"):
        if any(found.get(key) for key in row.rows):
            for item in table(found):
                _print(item, console)
    _print_stress(found, console)
    _print_warnings(found, console)
    _print_failures(found, console)
    _print_timings(found, console)


def _print(item: object, console: Console) -> None:
    """A line as it is, however long; a table as wide as its numbers need, which none may cut."""
    if isinstance(item, str):
        console.print(item, highlight=False, soft_wrap=True)
    else:
        free = console.options.update(max_width=WIDEST)
        needed = console.measure(item, options=free).maximum  # type: ignore[arg-type]
        options = console.options.update(width=max(needed, console.width))
        console.print(Segments(console.render(item, options)), crop=False)  # type: ignore[arg-type]


def _print_joint(found: Summary, console: Console) -> None:
    model, start = found["model"], found["prestress"]
    console.print(
        f"  natural frequency  {number(model['sliding_frequency_hz'], '.2f')} Hz sliding, "
        f"{number(model['stuck_frequency_hz'], '.2f')} Hz stuck",
        highlight=False,
    )
    console.print(
        f"  prestress          contact {_extent(start)}, peak "
        f"{number(start['peak_pressure_pa'] / 1e6)} MPa "
        f"({number(_over_mean(start), '.3f')} times the mean)"
        + (", with friction" if start.get("friction") == "with" else ""),
        highlight=False,
    )
    console.print(
        f"  {_opening(model)}",
        highlight=False,
    )
    if (slides := _limit(model, "slides_from_")) is not None:
        console.print(
            f"  friction alone holds its bodies, up to about {slides}",
            highlight=False,
        )


def _extent(start: dict[str, Any]) -> str:
    """How far the contact reaches under the preload."""
    if "contact_from_to_m" in start:
        left, right = start["contact_from_to_m"]
        return f"from {readable(left, 'm', 4)} to {readable(right, 'm', 4)}"
    return f"to {number(start['contact_half_length_over_clamp_half_length'], '.3f')} L_p"


def _over_mean(start: dict[str, Any]) -> float | None:
    """Largest pressure over the mean one, or over that of the clamp."""
    of = "_clamp" if "peak_pressure_over_mean_clamp_pressure" in start else ""
    value: float | None = start[f"peak_pressure_over_mean{of}_pressure"]
    return value


def _opening(model: dict[str, Any]) -> str:
    """What opens the joint."""
    if (opens := _limit(model, "opening_")) is None:
        return "no amplitude of the load opens the joint"
    return f"the joint opens at {opens}"


def _limit(model: dict[str, Any], prefix: str) -> str | None:
    """An amplitude of the load in words; None where there is none."""
    own = {k.removeprefix(prefix): v for k, v in model.items() if k.startswith(prefix)}
    if not own:
        return None
    heading, key = load_column([own])
    symbol, _, unit = heading.partition(", ")
    return None if own[key] is None else f"{symbol} = {number(own[key], '.3g')} {unit}".rstrip()


def _print_stress(found: Summary, console: Console) -> None:
    """The largest of all motions; nothing where nothing moved, or an older version did not judge."""
    stress = found.get("stress")
    if not stress or stress["largest_deflection_m"] is None:
        return
    bends = stress["largest_bending_stress_pa"]
    console.print(
        f"  bending stress     {'not known' if bends is None else readable(bends, 'Pa', 3)}, "
        f"deflection {readable(stress['largest_deflection_m'], 'm', 3)} "
        f"({escape(stress['where'])})",
        highlight=False,
        soft_wrap=True,
    )


def _print_warnings(found: Summary, console: Console) -> None:
    for warning in found.get("warnings", []):
        console.print(f"  [yellow]![/yellow] {escape(warning)}", highlight=False, soft_wrap=True)


def _print_failures(found: Summary, console: Console) -> None:
    if found["interrupted"]:
        console.print("[bold yellow]Interrupted:[/bold yellow] what was finished is shown.")
    failures = found["failures"]
    if not failures:
        return
    console.print(f"[bold red]{len(failures)} not solved[/bold red]")
    for failure in failures:
        console.print(f"  [red]✗[/red] {escape(failure)}", highlight=False, soft_wrap=True)


def _print_timings(found: Summary, console: Console) -> None:
    timings = dict(found["timings_s"])
    total = timings.pop("total", sum(timings.values()))
    parts = ", ".join(f"{name.replace('_', ' ')} {value:.1f}" for name, value in timings.items())
    console.print(f"  [dim]{total:.1f} s: {escape(parts)}[/dim]", highlight=False)
