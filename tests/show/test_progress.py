"""Lines where there is no terminal: at the start, now and then, and at the end; by a clock of the test."""

from __future__ import annotations

from io import StringIO
from threading import Thread

import pytest

from microslip.show.progress import LineProgress, duration


class Clock:
    def __init__(self) -> None:
        self.now = 1000.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def stream() -> StringIO:
    return StringIO()


def lines(stream: StringIO) -> list[str]:
    return stream.getvalue().splitlines()


def test_a_long_stage(clock: Clock, stream: StringIO) -> None:
    """100 steps of 5 s: a line every 30 s, each with 5 s for every step that is left."""
    progress = LineProgress(stream, clock)
    progress.start("cycles", 100)
    for _ in range(100):
        clock.now += 5
        progress.advance()
    progress.finish()
    first, *between, last = lines(stream)
    assert first == "cycles ... 0 of 100"
    assert last == "cycles ... 100 of 100, done in 8 min"
    assert between == [
        f"cycles ... {n} of 100, about {duration(5.0 * (100 - n))} left" for n in range(6, 100, 6)
    ]


def test_a_short_stage_is_two_lines(clock: Clock, stream: StringIO) -> None:
    progress = LineProgress(stream, clock)
    progress.start("cycles", 1000)
    for _ in range(1000):
        clock.now += 0.01
        progress.advance()
    progress.finish()
    progress.finish()
    assert lines(stream) == ["cycles ... 0 of 1000", "cycles ... 1000 of 1000, done in 10 s"]


def test_a_stage_that_ends_early_says_how_far_it_came(clock: Clock, stream: StringIO) -> None:
    progress = LineProgress(stream, clock)
    progress.advance()
    progress.finish()
    progress.start("first", 3)
    progress.advance(2)
    clock.now += 2
    progress.start("second", 1)
    progress.advance(5)
    progress.finish()
    assert lines(stream) == [
        "first ... 0 of 3",
        "first ... 2 of 3, ended after 2.0 s",
        "second ... 0 of 1",
        "second ... 1 of 1, done in 0.0 s",
    ]


def test_each_line_can_be_seen_at_once(clock: Clock) -> None:
    """A log that is written to a file is looked at while the run lasts."""

    class Held(StringIO):
        flushed = ""

        def flush(self) -> None:
            self.flushed = self.getvalue()

    stream = Held()
    LineProgress(stream, clock).start("cycles", 2)
    assert stream.flushed == "cycles ... 0 of 2\n"


def test_pieces_in_threads_report_to_one(clock: Clock, stream: StringIO) -> None:
    progress = LineProgress(stream, clock)
    progress.start("histories", 4000)
    threads = [Thread(target=lambda: [progress.advance() for _ in range(1000)]) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    progress.finish()
    assert lines(stream)[-1] == "histories ... 4000 of 4000, done in 0.0 s"
