"""The one place that decides where independent pieces of work run: here, in threads, in processes.

A computation says what its pieces are and hands over an `Executor`. `each` gives their results one
by one; `gather` waits for all of them and keeps what there is when interrupted. Threads are as good
as processes for compiled kernels, which release the interpreter, and share memory; what goes to a
process and comes back must pickle.

An executor is a way to open a `concurrent.futures.Executor`. Clusters offer the same (Dask:
``Executor(client.get_executor)``), and nothing but this module knows.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from concurrent import futures
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor, wait
from contextlib import ExitStack, contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Generic, Protocol, TypeVar

from threadpoolctl import ThreadpoolController, threadpool_limits

A = TypeVar("A")
B = TypeVar("B")


@dataclass(frozen=True)
class Executor:
    """Where pieces of work run.

    Attributes
    ----------
    open : callable or None
        Gives the pool, which is shut down when the pieces are done; None runs them one by one in
        the calling thread.
    """

    open: Callable[[], futures.Executor] | None = None


class Stop(Protocol):
    """Tells running pieces to end at their next point, such as `threading.Event`."""

    def set(self) -> None:
        """Ask them to."""

    def is_set(self) -> bool:
        """Whether they were asked to."""


@dataclass(frozen=True)
class NotBegun(Generic[A]):
    """A piece of work that an interruption came before.

    Attributes
    ----------
    item : object
        What it would have worked on.
    """

    item: A


MOST_WORKERS = 8
"""So many at most where nothing else is said: more share the memory's bandwidth."""

_MOST: ContextVar[int] = ContextVar("most workers", default=MOST_WORKERS)


@contextmanager
def limited(most: int | None) -> Iterator[None]:
    """Let `workers` be at most so many while the block runs; None leaves it as it is.

    Raises
    ------
    ValueError
        Where it is less than one.

    Examples
    --------
    >>> with limited(1):
    ...     workers()
    1
    """
    if most is not None and most < 1:
        raise ValueError(f"{most} workers: one is the least")
    before = _MOST.set(_MOST.get() if most is None else most)
    try:
        yield
    finally:
        _MOST.reset(before)


def workers() -> int:
    """Threads or processes to use: the cores this process may run on, at most eight or `limited`."""
    cores = (
        len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    )
    return max(1, min(_MOST.get(), cores))


def serial() -> Executor:
    """One piece after the other, in the calling thread."""
    return Executor()


def threads(count: int | None = None) -> Executor:
    """So many threads; `workers` where left out."""
    return Executor(
        partial(
            ThreadPoolExecutor,
            count or workers(),
            initializer=_MOST.set,  # a thread begins with a context of its own
            initargs=(_MOST.get(),),
        )
    )


def processes(count: int | None = None) -> Executor:
    """So many fresh processes; `workers` where left out.

    Function, items and results must pickle. Each process computes with one thread, and leaves
    Ctrl-C to the one that started it.
    """
    return Executor(
        partial(
            ProcessPoolExecutor,
            count or workers(),
            mp_context=multiprocessing.get_context("spawn"),
            initializer=_begin_process,
        )
    )


def _begin_process() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.environ["OMP_NUM_THREADS"] = "1"  # for what is still to be loaded
    threadpool_limits(1)


class _OneThread:
    """How many are inside `one_thread`, and what brings back the threads that there were before the first."""

    def __init__(self) -> None:
        self.lock, self.inside, self.limit = threading.Lock(), 0, ExitStack()

    @cached_property
    def libraries(self) -> ThreadpoolController:
        """Those of linear algebra, once loaded."""
        return ThreadpoolController().select(user_api="blas")

    def enter(self) -> None:
        with self.lock:
            if not self.inside:
                self.limit.enter_context(self.libraries.limit(limits=1))
            self.inside += 1

    def leave(self) -> None:
        with self.lock:
            self.inside -= 1
            if not self.inside:
                self.limit.close()


_ONE_THREAD = _OneThread()


@contextmanager
def one_thread() -> Iterator[None]:
    """Linear algebra in the calling thread alone: products of a few hundred rows take longer in several.

    That is the libraries' own number of threads, of the whole process: it is as before once the last that is
    inside has left, in whichever order they do.
    """
    _ONE_THREAD.enter()
    try:
        yield
    finally:
        _ONE_THREAD.leave()


def each(
    function: Callable[[A], B], items: Iterable[A], executor: Executor | None = None
) -> Iterator[B]:
    """Results in the order of `items`, as soon as each and all before it are done.

    Ctrl-C, an exception of a piece, and closing the iterator drop what has not begun and wait for
    what has.

    Parameters
    ----------
    function : callable
    items : iterable
    executor : Executor, optional
        `threads` where left out.

    Examples
    --------
    >>> list(each(abs, [-1, 2, -3], threads(2)))
    [1, 2, 3]
    """
    executor = threads() if executor is None else executor
    if executor.open is None:
        yield from map(function, items)
        return
    pool = executor.open()
    try:
        pending = [pool.submit(function, item) for item in items]
        for future in pending:
            yield future.result()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def gather(
    function: Callable[[A], B], items: Iterable[A], executor: Executor, stop: Stop
) -> list[B | NotBegun[A]]:
    """Results of all pieces; on Ctrl-C those that there are, instead of an exception.

    Then `stop` is set, upon which the pieces that run should end at their next point and return
    what they have; ``stop.is_set()`` says afterwards that it happened.

    Parameters
    ----------
    function : callable
    items : iterable
    executor : Executor
    stop : Stop
        Pieces in processes need one that reaches them (``multiprocessing.Manager().Event()``).

    Returns
    -------
    list
        In the order of the items; `NotBegun` for those that never ran.

    Examples
    --------
    >>> from threading import Event
    >>> gather(abs, [-1, 2], threads(2), Event())
    [1, 2]
    """
    work = list(items)
    if executor.open is None:
        return _one_by_one(function, work, stop)
    pool = executor.open()
    pending: list[futures.Future[B]] = []
    try:
        pending += [pool.submit(function, item) for item in work]
        wait(pending)
    except KeyboardInterrupt:
        stop.set()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
    found: list[B | NotBegun[A]] = [
        NotBegun(item) if future.cancelled() else future.result()
        for item, future in zip(work, pending, strict=False)
    ]
    return found + [NotBegun(item) for item in work[len(pending) :]]


def _one_by_one(function: Callable[[A], B], work: list[A], stop: Stop) -> list[B | NotBegun[A]]:
    """`gather` in the calling thread, where an interrupted piece has nothing to return."""
    found: list[B | NotBegun[A]] = []
    try:
        for item in work:
            found.append(function(item))
    except KeyboardInterrupt:
        stop.set()
    return found + [NotBegun(item) for item in work[len(found) :]]
