"""What became of one analysis: its value, what of it failed, whether it was interrupted."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from threading import Event
from typing import Any, Generic, TypeVar

from microslip.describe.joint import Joint
from microslip.describe.units_of_the_whole import in_whole
from microslip.errors import Caution, Failure, Remark

V = TypeVar("V", covariant=True)
AnyRemark = TypeVar("AnyRemark", bound=Remark)


@dataclass(frozen=True, repr=False)
class Outcome(Generic[V]):
    """Of one analysis.

    Attributes
    ----------
    value : object
        What it found; None where it found nothing at all.
    failures : tuple of Failure
        Points that have no answer, and why.
    cautions : tuple of Caution
        What is answered, and should be known of the answer.
    interrupted : bool
        Ctrl-C ended it: the value is what was finished until then.
    timings : mapping of str to float
        Seconds of wall time of its parts by name, where it has some.
    """

    value: V
    failures: tuple[Failure, ...] = ()
    interrupted: bool = False
    timings: Mapping[str, float] = field(default_factory=dict)
    cautions: tuple[Caution, ...] = ()

    def __repr__(self) -> str:
        what = type(self.value).__name__
        size = f" of {len(self.value)}" if hasattr(self.value, "__len__") else ""
        failed = f", {len(self.failures)} not solved" if self.failures else ""
        return f"Outcome({what}{size}{failed}{', interrupted' if self.interrupted else ''})"


def value_of(done: Mapping[str, Outcome[Any]], name: str) -> Any:
    """Value of an analysis among those that are done; None where it is not, or found nothing."""
    return done[name].value if name in done else None


def in_units_of(joint: Joint, said: AnyRemark) -> AnyRemark:
    """A failure or a caution with the forces of the whole, where the joint is one.

    Analyses know no width and write forces per metre of it.
    """
    if not joint.whole:
        return said
    return replace(
        said,
        where=in_whole(said.where),
        reason=in_whole(said.reason),
        remedy=in_whole(said.remedy),
    )


@contextmanager
def until_interrupted() -> Iterator[Event]:
    """Let a block end early on Ctrl-C, so that what it has found so far is kept.

    The event tells, during the block and afterwards, whether that happened; it is the ``stop`` of
    `microslip.numerics.execute.gather`.

    Examples
    --------
    >>> with until_interrupted() as stop:
    ...     raise KeyboardInterrupt
    >>> stop.is_set()
    True
    """
    stop = Event()
    try:
        yield stop
    except KeyboardInterrupt:
        stop.set()
