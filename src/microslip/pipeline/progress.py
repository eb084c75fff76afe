"""How a long computation says where it is, without knowing who listens."""

from __future__ import annotations

from types import TracebackType
from typing import Protocol, Self


class Progress(Protocol):
    """Told about one piece of work after another."""

    def start(self, label: str, total: int) -> None:
        """Begin a piece of work of `total` equal steps; ends the one before it."""

    def advance(self, n: int = 1) -> None:
        """`n` more steps are done."""

    def finish(self) -> None:
        """The piece of work is done."""


class NullProgress:
    """Progress that nobody watches."""

    def start(self, label: str, total: int) -> None:
        """Ignore it."""

    def advance(self, n: int = 1) -> None:
        """Ignore it."""

    def finish(self) -> None:
        """Ignore it."""

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        pass
