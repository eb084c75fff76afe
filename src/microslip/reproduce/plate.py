"""What a figure module returns: the drawing, its caption, its numbers and its trends."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

from matplotlib.figure import Figure

from microslip.reproduce.published import PAPER


@dataclass(frozen=True)
class Number:
    """A number of the paper beside the same number here.

    Attributes
    ----------
    key : str
        In `published.PAPER`.
    here : float or None
        None (or nan) where it could not be computed.
    why : str
        One sentence on the difference.
    """

    key: str
    here: float | None
    why: str

    def row(self) -> dict[str, Any]:
        """Plain types for JSON."""
        printed = PAPER[self.key]
        row: dict[str, Any] = {
            "quantity": printed.what,
            "where": printed.where,
            "unit": printed.unit,
            "paper": printed.value,
            "here": self.here,
            "difference": None,
            "difference_percent": None,
            "why": self.why,
        }
        if self.here is None or not math.isfinite(self.here):
            row["here"] = None
        else:
            row["difference"] = self.here - printed.value
            row["difference_percent"] = 100 * (self.here / printed.value - 1)
        return row


@dataclass(frozen=True)
class Trend:
    """A trend that the paper reports, whether it comes out, and the numbers that show it."""

    key: str
    statement: str
    holds: bool
    numbers: dict[str, Any]
    why: str

    def row(self) -> dict[str, Any]:
        """Plain types for JSON."""
        return {
            "statement": self.statement,
            "holds": bool(self.holds),
            "numbers": self.numbers,
            "why": self.why,
        }


@dataclass(frozen=True)
class Plate:
    """A figure done.

    Attributes
    ----------
    figure : Figure
    caption : str
        With its parameters.
    numbers : list of Number
    trends : list of Trend
    data : dict
        What the figure shows, in plain types.
    seconds : dict
        Measured times, which no two runs share.
    """

    figure: Figure
    caption: str
    numbers: list[Number] = field(default_factory=list)
    trends: list[Trend] = field(default_factory=list)
    data: dict[str, Any] = field(default_factory=dict)
    seconds: dict[str, Any] = field(default_factory=dict)
