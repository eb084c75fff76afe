"""How a long computation says where it is, without knowing who listens."""

from __future__ import annotations

from types import TracebackType
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from typing import Self

    from rich.console import Console


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


class RichProgress:
    """One bar per piece of work, with the time it took or is estimated to take still.

    A context manager: the bars live on the console while it is entered.
    """

    def __init__(self, console: Console) -> None:
        from rich import progress

        self._bars: Any = progress.Progress(
            progress.TextColumn("{task.description}", markup=False),
            progress.BarColumn(),
            progress.MofNCompleteColumn(),
            progress.TimeRemainingColumn(elapsed_when_finished=True),
            console=console,
        )
        self._task: Any = None

    def start(self, label: str, total: int) -> None:
        """Show a new bar."""
        self.finish()
        self._task = self._bars.add_task(label, total=total)

    def advance(self, n: int = 1) -> None:
        """Move the bar; without one, nothing happens."""
        if self._task is not None:
            self._bars.advance(self._task, n)

    def finish(self) -> None:
        """Fill the bar and leave it."""
        if self._task is not None:
            task = self._bars.tasks[self._bars.task_ids.index(self._task)]
            self._bars.update(self._task, completed=task.total)
            self._bars.stop_task(self._task)
            self._task = None

    def __enter__(self) -> Self:
        self._bars.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._bars.stop()


def progress_on(console: Console, *, quiet: bool = False) -> RichProgress | NullProgress:
    """RichProgress on a terminal; silence where asked for, or where nobody sees them move."""
    return NullProgress() if quiet or not console.is_terminal else RichProgress(console)
