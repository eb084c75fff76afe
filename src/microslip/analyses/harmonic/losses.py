"""Ways to a response with more harmonics that may lead nowhere: how much of them one search may cost.

One along a neighbouring branch costs as much as dozens of points, with many harmonics as minutes; where a
response is not stable they are lost one after the other. With more than `USUAL` harmonics each counts as much
more as its equations cost, which is their number squared.
"""

from __future__ import annotations

MOST = 8.0
"""Ways lost in one response over frequency."""

USUAL = 13
"""Harmonics up to which a way counts as one."""


class Losses:
    """What has been lost so far.

    Parameters
    ----------
    most : float
        Ways that may be lost.
    usual : int
        Harmonics up to which a way counts as one.

    Examples
    --------
    >>> losses = Losses()
    >>> losses.allow(33), losses.allow(41)
    (True, False)
    >>> losses.add(33)
    >>> losses.allow(13), losses.allow(21)
    (True, False)
    """

    def __init__(self, most: float = MOST, usual: int = USUAL) -> None:
        self.most, self.usual = most, usual
        self.sum = 0.0

    def allow(self, harmonics: int) -> bool:
        """Whether one more may be lost."""
        return self.sum + self._weight(harmonics) <= self.most

    def add(self, harmonics: int) -> None:
        """Count one that is lost."""
        self.sum += self._weight(harmonics)

    def _weight(self, harmonics: int) -> float:
        return max(1.0, (harmonics / self.usual) ** 2)
