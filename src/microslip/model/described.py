"""What was made of a description, kept until it or one of its files changes."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Generic, TypeVar

from microslip.describe.joint import Joint

AnyJoint = TypeVar("AnyJoint", bound=Joint)

Stamps = tuple[tuple[int, int], ...]
"""When each of some files was changed, ns, and its size; zeros of none."""


class Described(Generic[AnyJoint]):
    """A description, the same as another one in the same words: a key of a cache."""

    def __init__(self, joint: AnyJoint) -> None:
        self.joint, self.text = joint, joint.model_dump_json()

    def __hash__(self) -> int:
        return hash(self.text)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Described) and self.text == other.text


def stamps(files: Iterable[str]) -> Stamps:
    """What tells whether files have changed."""
    found = []
    for name in files:
        file = Path(name)
        stat = file.stat() if file.is_file() else None
        found.append((0, 0) if stat is None else (stat.st_mtime_ns, stat.st_size))
    return tuple(found)
