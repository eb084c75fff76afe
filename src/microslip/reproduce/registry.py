"""Every figure of the paper and the function that draws it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from microslip.errors import InputError
from microslip.reproduce.errata import errata
from microslip.reproduce.fig3 import fig3
from microslip.reproduce.fig5 import fig5
from microslip.reproduce.fig6 import fig6
from microslip.reproduce.fig7 import fig7
from microslip.reproduce.fig8 import fig8
from microslip.reproduce.fig9 import fig9
from microslip.reproduce.fig10 import fig10
from microslip.reproduce.fig11 import fig11
from microslip.reproduce.fig12 import fig12
from microslip.reproduce.fig13 import fig13
from microslip.reproduce.fig14 import fig14
from microslip.reproduce.fig15 import fig15
from microslip.reproduce.fig16 import fig16
from microslip.reproduce.plate import Plate
from microslip.reproduce.study import Study
from microslip.reproduce.timing import timing

FIGURES: dict[str, Callable[[Study], Plate]] = {
    "fig3": fig3,
    "fig5": fig5,
    "fig6": fig6,
    "fig7": fig7,
    "fig8": fig8,
    "fig9": fig9,
    "fig10": fig10,
    "fig11": fig11,
    "fig12": fig12,
    "fig13": fig13,
    "fig14": fig14,
    "fig15": fig15,
    "fig16": fig16,
    "timing": timing,
    "errata": errata,
}
"""Figures 1, 2 and 4 are drawings; ``timing`` is section 3.2's paragraph, ``errata`` is ours."""


def chosen(names: Sequence[str]) -> list[str]:
    """Names of figures in the paper's order; none or ``all`` is every one.

    Raises
    ------
    InputError
        For a name that is not a figure; lists those that are.

    Examples
    --------
    >>> chosen(["fig9", "fig3", "fig9"])
    ['fig3', 'fig9']
    """
    if not names or "all" in names:
        return list(FIGURES)
    unknown = [name for name in names if name not in FIGURES]
    if unknown:
        raise InputError(
            f"no figure {', '.join(map(repr, unknown))}: choose from all, {', '.join(FIGURES)}"
        )
    return [name for name in FIGURES if name in names]
