"""Independent pieces of work: in order, side by side, and kept when interrupted."""

from __future__ import annotations

import os
import threading
import time

import numpy as np
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from microslip.numerics import execute
from microslip.numerics.execute import (
    Executor,
    NotBegun,
    each,
    gather,
    limited,
    one_thread,
    processes,
    serial,
    threads,
    workers,
)

EVERYWHERE = pytest.mark.parametrize(
    "executor", [serial(), threads(1), threads(3)], ids=["serial", "one thread", "three threads"]
)


def square(x: float) -> float:
    return x * x


def where(_: int) -> tuple[int, str]:
    time.sleep(0.2)
    return os.getpid(), os.environ.get("OMP_NUM_THREADS", "")


def failing(x: int) -> int:
    if x == 2:
        raise ValueError("two")
    return x


@EVERYWHERE
def test_results_are_in_the_order_of_the_items(executor: Executor) -> None:
    def slow_first(x: int) -> int:
        time.sleep(0.05 * (x == 0))
        return x * x

    assert list(each(slow_first, range(5), executor)) == [0, 1, 4, 9, 16]
    assert gather(slow_first, range(5), executor, threading.Event()) == [0, 1, 4, 9, 16]


@EVERYWHERE
def test_an_exception_comes_out_where_its_result_would(executor: Executor) -> None:
    results = each(failing, range(4), executor)
    assert [next(results), next(results)] == [0, 1]
    with pytest.raises(ValueError, match="two"):
        next(results)
    with pytest.raises(ValueError, match="two"):
        gather(failing, range(4), executor, threading.Event())


def test_results_come_as_soon_as_they_are_done() -> None:
    """The first is there while the second waits for it to be taken."""
    taken = threading.Event()

    def second_waits(x: int) -> bool:
        return x == 0 or taken.wait(10)

    results = each(second_waits, range(2), threads(2))
    assert next(results)
    taken.set()
    assert next(results)


def test_closing_drops_what_has_not_begun() -> None:
    begun: list[int] = []
    results = each(begun.append, range(100), threads(1))
    next(results)
    results.close()
    assert len(begun) < 100


def test_processes_are_others_and_as_many_as_asked_for() -> None:
    found = list(each(where, range(4), processes(2)))
    assert len({pid for pid, _ in found} | {os.getpid()}) == 3
    assert {limit for _, limit in found} == {"1"}


def test_processes_give_what_this_one_gives() -> None:
    x = np.linspace(0, 1, 5)
    there = gather(square, list(x), processes(2), threading.Event())
    assert there == [square(value) for value in x]


@pytest.mark.parametrize("count", [1, 2])
def test_interrupted_work_is_kept(monkeypatch: pytest.MonkeyPatch, count: int) -> None:
    """What runs ends at its next point with what it has; what never began is marked."""
    stop, running = threading.Event(), threading.Semaphore(0)

    def until_stopped(x: int) -> str:
        running.release()
        assert stop.wait(10)
        return f"part of {x}"

    def interrupted(pending: object) -> None:
        for _ in range(count):
            assert running.acquire(timeout=10)
        raise KeyboardInterrupt

    monkeypatch.setattr(execute, "wait", interrupted)
    found = gather(until_stopped, range(5), threads(count), stop)
    assert stop.is_set()
    assert found[:count] == [f"part of {k}" for k in range(count)]
    assert found[count:] == [NotBegun(k) for k in range(count, 5)]


def test_interrupted_in_the_calling_thread() -> None:
    stop = threading.Event()

    def piece(x: int) -> int:
        if x == 2:
            raise KeyboardInterrupt
        return x

    assert gather(piece, range(4), serial(), stop) == [0, 1, NotBegun(2), NotBegun(3)]
    assert stop.is_set()


def test_nothing_to_do() -> None:
    assert list(each(square, [], threads(2))) == []
    assert gather(square, [], serial(), threading.Event()) == []


def test_workers_are_the_cores_of_this_process() -> None:
    assert 1 <= workers() <= min(8, os.cpu_count() or 1)


def test_workers_are_limited_and_so_are_those_of_a_thread():
    before = workers()
    with limited(1):
        assert workers() == 1
        assert list(each(lambda _: workers(), [0, 0], threads())) == [1, 1]
        with limited(None):
            assert workers() == 1
    assert workers() == before
    with limited(10_000):
        assert before <= workers() <= (os.cpu_count() or 1)


def test_no_workers_at_all():
    with pytest.raises(ValueError, match="one is the least"), limited(0):
        pass


def blas_threads():
    return [one["num_threads"] for one in threadpool_info() if one["user_api"] == "blas"]


@pytest.mark.parametrize("first", [0, 1])
def test_libraries_have_their_threads_back_once_the_last_has_left(first):
    """In whichever order, as marches in threads of one process do."""
    with threadpool_limits(2, user_api="blas"):
        before = blas_threads()
        inside = [one_thread(), one_thread()]
        for one in inside:
            one.__enter__()
            assert set(blas_threads()) == {1}
        inside[first].__exit__(None, None, None)
        assert set(blas_threads()) == {1}
        inside[1 - first].__exit__(None, None, None)
        assert blas_threads() == before
        assert max(before) > 1
        with pytest.raises(ValueError, match="within"), one_thread():
            raise ValueError("within")
        assert blas_threads() == before
