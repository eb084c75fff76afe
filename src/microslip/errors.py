"""Errors a caller can name, and failures that results carry.

An error stops what was asked for: its message says where it went wrong and what to try. A failure is
what an analysis says of a point that it could not solve while the others go on. A caution stands beside an
answer, or a number of the input file, that is possible and unlikely.
"""

from __future__ import annotations

from dataclasses import dataclass


class MicroslipError(Exception):
    """Base of all errors that microslip raises on purpose."""


class InputError(MicroslipError):
    """Something the user wrote cannot be used: which file, key and value, and what is allowed."""


class ContactError(MicroslipError):
    """A contact problem has no solution that the solver could prove."""


class JointOpensError(ContactError):
    """The load is larger than the clamped joint can carry in static equilibrium."""


class ModelError(MicroslipError):
    """Matrices or a mesh that cannot make a joint model."""


@dataclass(frozen=True)
class Remark:
    """Something said of a point: of which stage, where, why, and what to try.

    Attributes
    ----------
    stage : str
        Analysis it is about, as it is called in the input file: ``cycle``, ``harmonic``, ...
    where : str
        Key and value, load, frequency, amplitude, mode: which point; empty where it is all of it.
    reason : str
        What happened, or what is doubtful.
    remedy : str
        What to try; empty where the reason says it or nothing helps.
    """

    stage: str
    where: str
    reason: str
    remedy: str = ""

    def __str__(self) -> str:
        place = ", ".join(part for part in (self.stage, self.where) if part)
        return f"{place}: {self.reason}" + (f"; {self.remedy}" if self.remedy else "")


@dataclass(frozen=True)
class Failure(Remark):
    """Something asked for that has no answer; attributes of `Remark`.

    Examples
    --------
    >>> print(Failure("backbone", "mode 2, amplitude 0.1", "no frequency of its own"))
    backbone, mode 2, amplitude 0.1: no frequency of its own
    """


@dataclass(frozen=True)
class Caution(Remark):
    """Something that has an answer, and that an engineer should doubt; attributes of `Remark`.

    Its stage is ``input`` for what the joint file says, ``cost`` for what a run takes, else the
    analysis whose answer it is about.

    Examples
    --------
    >>> print(Caution("response", "M = 50 N m/m", "the bending stress is 1.2 GPa", "lower the load"))
    response, M = 50 N m/m: the bending stress is 1.2 GPa; lower the load
    """
