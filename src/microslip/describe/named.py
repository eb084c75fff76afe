"""Names of loads and outputs, where the file gives all of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from microslip.describe.amplitude import Load
from microslip.describe.ports import TAKEN
from microslip.describe.quantities import Rule


class Named(Protocol):
    """An entry of a list of sections that has a name."""

    @property
    def name(self) -> str:
        """What it is called."""
        ...


def check_names(
    preloads: Sequence[Named], ports: Sequence[Named], outputs: Sequence[Named]
) -> None:
    """Raise `Rule` where two loads, or two outputs, share a name."""
    taken = [name for name in TAKEN if name not in ("clamp", "moment")]
    for section, entries in (("preload", preloads), ("port", ports)):
        for k, entry in enumerate(entries):
            if entry.name in taken:
                raise Rule(f"{section}.{k}.name", f"{entry.name!r} is taken: choose another")
            taken.append(entry.name)
    names = [output.name for output in outputs]
    for k, name in enumerate(names):
        if name in names[:k]:
            raise Rule(f"output.{k}.name", f"two outputs are called {name!r}")


def check_drive_is_said(ports: Sequence[Named], load: Load | None) -> None:
    """Raise `Rule` where several loads may drive and none is said to."""
    if len(ports) > 1 and (load is None or load.port is None):
        there = ", ".join(port.name for port in ports)
        raise Rule("load.port", f"say which [[port]] drives the joint: one of {there}")
