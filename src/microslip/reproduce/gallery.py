"""The report as Markdown: figures with captions, and the tables of numbers, trends and times."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any


def gallery(report: dict[str, Any], images: str = "figures") -> str:
    """Every figure with its caption.

    Parameters
    ----------
    report : dict
        As in ``reproduction.json``.
    images : str
        Folder of the images, seen from the page.
    """
    parts = ["# Figures\n"]
    for name, entry in report["figures"].items():
        parts.append(f"## {title(name)}\n\n![{title(name)}]({images}/{name}.png)\n")
        parts.append(f"{_escaped(entry['caption'])}\n")
    return "\n".join(parts)


def tables(report: dict[str, Any]) -> str:
    """Numbers, trends, effect of the errata, and times."""
    return "\n".join(
        part
        for part in (_numbers(report), _trends(report), _errata(report), _times(report))
        if part
    )


def title(name: str) -> str:
    """Heading of a figure.

    Examples
    --------
    >>> title("fig3"), title("errata")
    ('Figure 3', 'Errata')
    """
    return f"Figure {name[3:]}" if name.startswith("fig") else name.capitalize()


def value(x: float | None, digits: int = 4) -> str:
    """A number, or a dash where there is none.

    Examples
    --------
    >>> value(0.0912345), value(None)
    ('0.09123', '–')
    """
    return "–" if x is None else f"{x:.{digits}g}"


def _escaped(text: str) -> str:
    return text.replace("|", r"\|").replace("*", r"\*").replace("_", r"\_")


def _table(header: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> str:
    lines = ["| " + " | ".join(header) + " |", "|" + "---|" * len(header)]
    lines += ["| " + " | ".join(_escaped(cell) for cell in row) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def _numbers(report: dict[str, Any]) -> str:
    rows = []
    for row in report["numbers"].values():
        unit = f" {row['unit']}" if row["unit"] else ""
        difference, percent = row["difference"], row["difference_percent"]
        if percent is None:
            shown = "–"
        elif abs(percent) < 1e-6:
            shown = "none"
        else:
            shown = f"{difference:+.3g}{unit}" + ("" if "Hz" in unit else f" ({percent:+.3g} %)")
        rows.append(
            (
                row["quantity"],
                row["where"],
                f"{value(row['paper'])}{unit}",
                f"{value(row['here'], 5)}{unit if row['here'] is not None else ''}",
                shown,
                row["why"],
            )
        )
    if not rows:
        return ""
    header = ("quantity", "section, figure", "paper", "here", "difference", "why")
    return "## Numbers\n\n" + _table(header, rows)


def _trends(report: dict[str, Any]) -> str:
    rows = [
        ("holds" if row["holds"] else "**does not hold**", row["statement"], row["why"])
        for row in report["trends"].values()
    ]
    if not rows:
        return ""
    text = _table(("", "trend", "why"), rows).replace(r"\*", "*")
    return "## Trends\n\n" + text


def _errata(report: dict[str, Any]) -> str:
    effects = report["figures"].get("errata", {}).get("data", {})
    if not effects:
        return ""
    rhos = [key for key in effects["corrected"] if key.startswith("rho_")]
    rows = []
    for name, found in effects.items():
        cells = [name, found.get("printed", "")]
        for rho in rhos:
            bound = "≥ " if found[rho].get("bound") else ""
            cells.append(f"{bound}{_percent(found[rho]['peak_error'])}, {_hertz(found[rho])}")
        rows.append(tuple(cells))
    header = ("as printed", "what", *(f"peak, resonance at ρ = {rho[4:]}" for rho in rhos))
    note = (
        "Error against the time domain of the peak amplitude and of the resonance frequency: of the "
        "corrected model, of the printed form with its misprints corrected, and of the corrected "
        "model with one thing as printed. ≥: the peak borders on frequencies without an answer in the "
        "table.\n\n"
    )
    return "## Errata\n\n" + note + _table(header, rows)


def _percent(x: float | None) -> str:
    return "no answer" if x is None else f"{100 * x:+.3g} %"


def _hertz(row: dict[str, Any]) -> str:
    shift = row["resonance_error_hz"]
    return "" if shift is None else f"{shift:+.2f} Hz"


def _times(report: dict[str, Any]) -> str:
    found = report["timings"].get("table")
    if not found:
        return ""
    rows = [
        (
            row["what"],
            value(row["paper_s"], 5),
            value(row["here_s"], 3),
            f"{row['ratio']:,.0f}",
        )
        for row in found.values()
    ]
    return "## Times\n\n" + _table(("analysis", "paper, s", "here, s", "ratio"), rows)
