"""A quantity along x, as a table: straight lines between the points, constant beyond the ends.

friction = [["-20 mm", 0.15], ["20 mm", 0.35]]
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from microslip.describe import units

MOST_POINTS = 1000


@dataclass(frozen=True)
class Profile:
    """Values at ascending positions.

    Attributes
    ----------
    x : tuple of float
        m.
    values : tuple of float
    """

    x: tuple[float, ...]
    values: tuple[float, ...]

    def __str__(self) -> str:
        low, high = min(self.values), max(self.values)
        return f"{low:g} to {high:g}, {len(self.x)} points"

    def at(self, x: float) -> float:
        """Value at a position.

        Examples
        --------
        >>> table = Profile((-1.0, 1.0), (0.0, 4.0))
        >>> table.at(0.0), table.at(-3.0), table.at(1.0)
        (2.0, 0.0, 4.0)
        """
        if x <= self.x[0]:
            return self.values[0]
        if x >= self.x[-1]:
            return self.values[-1]
        i = bisect_right(self.x, x) - 1
        share = (x - self.x[i]) / (self.x[i + 1] - self.x[i])
        return self.values[i] + share * (self.values[i + 1] - self.values[i])

    def integral(self, power: int = 0) -> float:
        """``int value x^power dx`` between the first and the last position, power 0 or 1.

        Examples
        --------
        >>> table = Profile((0.0, 3.0), (0.0, 2.0))
        >>> table.integral(), table.integral(1)  # area of the triangle, and its moment
        (3.0, 6.0)
        """
        total = 0.0
        for i in range(len(self.x) - 1):
            a, b = self.x[i], self.x[i + 1]
            p, q = self.values[i], self.values[i + 1]
            if power == 0:
                total += (b - a) * (p + q) / 2
            else:
                total += (b - a) * (p * (2 * a + b) + q * (a + 2 * b)) / 6
        return total

    def mean(self, start: float, stop: float) -> float:
        """Mean value from `start` to `stop`.

        Examples
        --------
        >>> Profile((-1.0, 1.0), (0.0, 4.0)).mean(-3.0, 3.0)
        2.0
        """
        inner = [x for x in self.x if start < x < stop]
        x = (start, *inner, stop)
        return Profile(x, tuple(map(self.at, x))).integral() / (stop - start)


def profile_parser(value_of: Callable[[Any], float], noun: str) -> Callable[[Any], Profile]:
    """Reader of a table of ``[position, value]``.

    Parameters
    ----------
    value_of : callable
        Reads a value, and raises ValueError with what is allowed.
    noun : str
        What the values are, for messages.
    """
    shape = f'a table of at least two points, [["-20 mm", {noun}], ["20 mm", {noun}]]'

    def parse(table: Any) -> Profile:
        if isinstance(table, Profile):
            return table
        if not isinstance(table, list | tuple) or not 2 <= len(table) <= MOST_POINTS:
            raise ValueError(f"must be {shape}")
        points = []
        for number, point in enumerate(table, 1):
            if not isinstance(point, list | tuple) or len(point) != 2:
                raise ValueError(f"point {number} must be a position and a value: {shape}")
            try:
                points.append((units.LENGTH.parse(point[0]), value_of(point[1])))
            except ValueError as error:
                raise ValueError(f"point {number} {error}") from None
            if number > 1 and points[-1][0] <= points[-2][0]:
                raise ValueError(f"point {number} must lie to the right of the one before")
        return Profile(tuple(x for x, _ in points), tuple(v for _, v in points))

    return parse
