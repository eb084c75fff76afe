"""Independent pieces of work in threads: the compiled kernels release the interpreter."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

A = TypeVar("A")
B = TypeVar("B")


def workers() -> int:
    """Threads to use: the cores this process may run on, at most eight."""
    cores = (
        len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    )
    return max(1, min(8, cores))


def in_threads(function: Callable[[A], B], items: Iterable[A], count: int) -> Iterator[B]:
    """Results in the order of `items`, as soon as each and all before it are done.

    Ctrl-C (or closing the iterator) drops what has not begun.

    Examples
    --------
    >>> list(in_threads(lambda x: x * x, [1, 2, 3], 2))
    [1, 4, 9]
    """
    pool = ThreadPoolExecutor(count)
    try:
        pending = [pool.submit(function, item) for item in items]
        for future in pending:
            yield future.result()
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
