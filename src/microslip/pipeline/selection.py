"""Results by name: one of several responses, points or curves, by what it is of."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Generic, TypeVar

from microslip.errors import MicroslipError

T = TypeVar("T")

CLOSE = 1e-6
"""Relative difference within which a number is the one asked for."""


class Selection(tuple[T, ...], Generic[T]):
    """A tuple whose items can be asked for by name.

    Parameters
    ----------
    items : iterable
    keys : mapping of str to callable
        What an item is asked for by, and how that is read off it.

    Examples
    --------
    >>> words = Selection(["slip", "stick"], {"first": lambda w: w[0], "length": len})
    >>> words.sel(length=4)
    'slip'
    >>> words.sel(first="s")
    Traceback (most recent call last):
    ...
    microslip.errors.MicroslipError: first='s' leaves 2: say length too, one of 4, 5
    """

    _keys: Mapping[str, Callable[[T], Any]]

    def __new__(
        cls, items: Iterable[T] = (), keys: Mapping[str, Callable[[T], Any]] | None = None
    ) -> Selection[T]:
        """Make the tuple and remember its keys."""
        made = super().__new__(cls, items)
        made._keys = dict(keys or {})
        return made

    def __getnewargs__(self) -> tuple[Any, ...]:
        return tuple(self), self._keys

    def sel(self, **wanted: Any) -> T:
        """The one item that is of everything asked for.

        Numbers may differ by a millionth.

        Raises
        ------
        MicroslipError
            Where there is none, or more than one: names what there is.
        """
        for key in wanted:
            if key not in self._keys:
                known = ", ".join(self._keys)
                raise MicroslipError(f"nothing here is selected by {key!r}, but by {known}")
        left = list(self)
        for key, value in wanted.items():
            found = [item for item in left if _same(self._keys[key](item), value)]
            if not found:
                there = _listed(self._keys[key](item) for item in left)
                raise MicroslipError(f"there is none with {key}={value!r}, but with {there}")
            left = found
        if len(left) == 1:
            return left[0]
        if not left:
            raise MicroslipError("there are none to select from")
        asked = ", ".join(f"{key}={value!r}" for key, value in wanted.items()) or "this"
        for key, read in self._keys.items():
            values = _listed(read(item) for item in left)
            if key not in wanted and ", " in values:
                raise MicroslipError(f"{asked} leaves {len(left)}: say {key} too, one of {values}")
        raise MicroslipError(f"{asked} leaves {len(left)}, which nothing tells apart")


def _same(value: Any, wanted: Any) -> bool:
    numbers = isinstance(value, int | float) and isinstance(wanted, int | float)
    return math.isclose(value, wanted, rel_tol=CLOSE) if numbers else bool(value == wanted)


def _listed(values: Iterable[Any]) -> str:
    """Values that differ, as one would write them."""
    shown = (f"{v:.6g}" if isinstance(v, float) else repr(v) for v in values)
    return ", ".join(dict.fromkeys(shown))
