"""The frequencies of an analysis or a signal: a list of them, or evenly from one to another.

frequencies = ["170 Hz", "175 Hz"]
from = "170 Hz"; to = "180 Hz"; count = 11
"""

from __future__ import annotations

from typing import ClassVar, Self

from pydantic import Field, model_validator

from microslip.describe.quantities import Count, Frequencies, Frequency, Rule, Section


def evenly(start: float, stop: float, count: int) -> tuple[float, ...]:
    """`count` values from `start` to `stop`, both met exactly.

    Examples
    --------
    >>> evenly(170.0, 171.0, 3)
    (170.0, 170.5, 171.0)
    """
    step = (stop - start) / (count - 1)
    return (*(start + i * step for i in range(count - 1)), stop)


def check_ascending(start: float | None, stop: float | None, section: str) -> None:
    """Raise `Rule` where a band of a section does not run upward, Hz."""
    if start is not None and stop is not None and stop <= start:
        raise Rule("to", f"must be above {section}.from, {start:g} Hz")


class Band(Section):
    """Frequencies, Hz: either a list, or all of from, to and count."""

    frequencies: Frequencies | None = None
    """List of frequencies; or from, to and count. Where there is an answer: near the resonance for
    the effect of friction."""
    from_: Frequency | None = Field(default=None, gt=0, alias="from")
    """First frequency, with to and count instead of a list. As frequencies."""
    to: Frequency | None = Field(default=None, gt=0)
    """Last frequency. As frequencies."""
    count: Count | None = Field(default=None, ge=2, le=10_000)
    """How many frequencies, evenly spaced, both ends among them. Each costs as much as the
    others."""

    @property
    def band_is_complete(self) -> bool:
        """Whether enough is given for `band`; in a section that was read it is."""
        return self.frequencies is not None or None not in (self.from_, self.to, self.count)

    def band(self) -> tuple[float, ...]:
        """Frequencies in the order written, Hz.

        Examples
        --------
        >>> Band(from_=171, to=170, count=3).band()
        (171.0, 170.5, 170.0)
        >>> Band(frequencies=[170, 180, 175]).band()
        (170.0, 180.0, 175.0)
        """
        if self.frequencies is not None:
            return self.frequencies
        assert self.from_ is not None
        assert self.to is not None
        assert self.count is not None
        return evenly(self.from_, self.to, self.count)

    @model_validator(mode="after")
    def _one_band(self) -> Self:
        spaced = (self.from_, self.to, self.count)
        if self.frequencies is not None and any(x is not None for x in spaced):
            raise Rule("frequencies", "lists the frequencies: remove from, to and count")
        if self.frequencies is None and None in spaced:
            raise Rule("frequencies", "give a list of frequencies, or from, to and count")
        return self


class AscendingBand(Band):
    """Frequencies of an analysis, Hz, whose order in the file means nothing.

    Attributes
    ----------
    section : str
        Path of the analysis in the file, for messages.
    """

    section: ClassVar[str]

    def band(self) -> tuple[float, ...]:
        """Frequencies, Hz, ascending, each once."""
        if self.frequencies is None:
            return super().band()
        return tuple(sorted(set(self.frequencies)))

    @model_validator(mode="after")
    def _ascending(self) -> Self:
        check_ascending(self.from_, self.to, self.section)
        return self
