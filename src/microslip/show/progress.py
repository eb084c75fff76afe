"""Bars on the terminal for the pieces of a long computation."""

from __future__ import annotations

from types import TracebackType
from typing import Any, Self

from rich import progress
from rich.console import Console

from microslip.pipeline.progress import NullProgress


class RichProgress:
    """One bar per piece of work, with the time it took or is estimated to take still.

    A context manager: the bars live on the console while it is entered.
    """

    def __init__(self, console: Console) -> None:
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
