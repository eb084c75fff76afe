"""Where a long computation is: bars on a terminal, a line now and then where there is none."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from types import TracebackType
from typing import IO, Any, Self

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


EVERY = 30.0
"""Seconds between two lines of one piece of work, at least."""


class LineProgress(NullProgress):
    """A line at the start and the end of every piece of work, and now and then between.

    Parameters
    ----------
    stream : text stream
    clock : callable
        Seconds from any origin.

    Examples
    --------
    >>> import sys
    >>> progress = LineProgress(sys.stdout, iter([0, 31, 40, 60]).__next__)
    >>> progress.start("cycles", 3)
    cycles ... 0 of 3
    >>> for _ in range(3):
    ...     progress.advance()
    cycles ... 1 of 3, about 1 min left
    >>> progress.finish()
    cycles ... 3 of 3, done in 1 min
    """

    def __init__(self, stream: IO[str], clock: Callable[[], float] = time.monotonic) -> None:
        self._stream = stream
        self._clock = clock
        self._lock = threading.Lock()
        self._label: str | None = None
        self._total = self._done = 0
        self._began = self._said = 0.0

    def start(self, label: str, total: int) -> None:
        """Say that a piece begins."""
        self.finish()
        with self._lock:
            self._label, self._total, self._done = label, total, 0
            self._began = self._said = self._clock()
            self._say("")

    def advance(self, n: int = 1) -> None:
        """Count; say so where the last line is old enough and more is to come."""
        with self._lock:
            if self._label is None:
                return
            self._done = min(self._done + n, self._total)
            if not 0 < self._done < self._total:
                return
            now = self._clock()
            if now - self._said >= EVERY:
                self._said = now
                left = (now - self._began) * (self._total - self._done) / self._done
                self._say(f", about {duration(left)} left")

    def finish(self) -> None:
        """Say how long the piece took."""
        with self._lock:
            if self._label is None:
                return
            how = "done in" if self._done == self._total else "ended after"
            self._say(f", {how} {duration(self._clock() - self._began)}")
            self._label = None

    def _say(self, more: str) -> None:
        line = f"{self._label} ... {self._done} of {self._total}{more}"
        print(line, file=self._stream, flush=True)


def duration(seconds: float) -> str:
    """A duration in the unit that one would say it in.

    Examples
    --------
    >>> duration(0.31), duration(62), duration(5400)
    ('0.3 s', '1 min', '1.5 h')
    """
    if seconds < 9.95:
        return f"{seconds:.1f} s"
    if seconds < 59.5:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 3570 else f"{seconds / 3600:.1f} h"


def progress_on(
    console: Console, *, quiet: bool = False
) -> RichProgress | LineProgress | NullProgress:
    """Bars on a terminal, lines where there is none, silence where asked for."""
    if quiet:
        return NullProgress()
    return RichProgress(console) if console.is_terminal else LineProgress(console.file)
