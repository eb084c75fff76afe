"""What may load a joint: ports by name, and what the load of each kind is called and measured in.

A port acts at one far end or at both, or moves what the joint is fixed to. ``[load]`` names the one that
drives it; without a name that is the pair of end moments.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from microslip.describe import units
from microslip.describe.quantities import NAME, Rule, Section, list_of_sections

PortKind = Literal["moment", "force", "base", "pressure"]
MovingKind = Literal["moment", "force", "base"]
"""Kinds of loads on what has no named surfaces."""

PortEnd = Literal["left", "right", "both"]
Direction = Literal["x", "y"]

TAKEN = ("moment", "clamp", "u_clamp_edge", "lift", "sliding", "stuck")
"""Names of ports that every joint has."""


@dataclass(frozen=True)
class LoadKind:
    """A kind of load, in words.

    Attributes
    ----------
    key : str
        Of the input file that gives its amplitude; the coordinate of results has the same name.
    unit : str
        SI, per metre of width where it is a moment or a force.
    symbol, noun : str
        In messages and figures.
    row : str
        Key of its amplitude in the summary.
    parsed : Kind
        How the file writes it.
    output : str
        Unit of what the load does work on.
    """

    key: str
    unit: str
    symbol: str
    noun: str
    row: str
    parsed: units.Kind
    output: str

    def named(self, value: float) -> str:
        """An amplitude in messages.

        Examples
        --------
        >>> KINDS["force"].named(250.0)
        'F = 250 N/m'
        """
        return f"{self.symbol} = {value:.4g} {self.unit}"


KINDS: dict[PortKind, LoadKind] = {
    "moment": LoadKind("moment", "N m/m", "M", "end moment", "moment_n", units.LINE_MOMENT, "rad"),
    "force": LoadKind("force", "N/m", "F", "force", "force_n_per_m", units.LINE_FORCE, "m"),
    "base": LoadKind(
        "acceleration",
        "m/s^2",
        "a",
        "acceleration of the base",
        "acceleration_m_per_s2",
        units.ACCELERATION,
        "kg m/m",
    ),
    "pressure": LoadKind("pressure", "Pa", "p", "pressure", "pressure_pa", units.STRESS, "m^3/m"),
}
"""Loads by the kind of their port."""

KINDS_OF_THE_WHOLE: dict[PortKind, LoadKind] = {
    "moment": replace(KINDS["moment"], unit="N m", row="moment_n_m"),
    "force": replace(KINDS["force"], unit="N", row="force_n"),
    "base": replace(KINDS["base"], output="kg m"),
    "pressure": replace(KINDS["pressure"], output="m^3"),
}
"""The same of a whole structure, not per metre of its width."""


class LoadPort(Section):
    """A load that has a name, wherever it acts."""

    name: str = Field(pattern=NAME, max_length=40)
    """What it is called. [load] says by this name what drives the joint."""
    kind: PortKind = Field(default="force")
    """A moment or a force, a pressure against a surface, or the acceleration of what the joint is fixed to
    ("base"). Which key of [load] gives the amplitude: moment, force, pressure, or acceleration."""

    @property
    def load(self) -> LoadKind:
        """What its load is called and measured in."""
        return KINDS[self.kind]


class Port(LoadPort):
    """A load that the user names, `[[port]]`.

    Examples
    --------
    >>> Port(name="tip", kind="force", at="right").axis
    'y'
    """

    kind: MovingKind = Field(default="force")
    """A moment or a force, or the acceleration of what the joint is fixed to ("base"). Which key of
    [load] gives the amplitude: moment, force, or acceleration."""
    at: PortEnd | None = Field(default=None)
    """At which far end; not of a base. A moment acts at both where it is left out, positive where it
    bends the joint concave up; a force needs it."""
    direction: Direction | None = Field(default=None)
    """Along "x", to the right, or "y", up, which is meant where it is left out; not of a moment. Forces
    along x at both ends pull them apart."""

    @property
    def ends(self) -> tuple[str, ...]:
        """Far ends at which it acts; of a base those that are held."""
        return ("left", "right") if self.at in (None, "both") else (str(self.at),)

    @property
    def axis(self) -> str:
        """Direction of a force or a base."""
        return self.direction or "y"

    @model_validator(mode="after")
    def _fits_kind(self) -> Self:
        if self.kind == "base" and self.at is not None:
            raise Rule("at", "a base moves all that holds the joint: remove it")
        if self.kind == "force" and self.at is None:
            raise Rule("at", 'a force needs it: "left", "right" or "both"')
        if self.kind == "moment" and self.direction is not None:
            raise Rule("direction", "a moment has none: remove it")
        return self


END_MOMENTS = Port(name="end-moments", kind="moment", at="both")
"""What drives a joint whose file names no port."""


Ports = Annotated[tuple[Port, ...], list_of_sections(20, "must be at most 20 sections, [[port]]")]


def check_ports(ports: Sequence[Port], ends: tuple[str, str], springs: bool) -> None:
    """Raise `Rule` where two ports share a name, or a load moves nothing or is held by nothing.

    Parameters
    ----------
    ports : sequence of Port
    ends : pair of str
        What holds the left and the right far end.
    springs : bool
        Whether the pinned ends are held along x.
    """
    names = [port.name for port in ports]
    for k, port in enumerate(ports):
        if port.name in TAKEN:
            raise Rule(f"port.{k}.name", "every joint has a port of this name: choose another")
        if port.name in names[:k]:
            raise Rule(f"port.{k}.name", f"two ports are called {port.name!r}")
        if idle := _idle(port, ends):
            raise Rule(f"port.{k}", idle)
        if not _held(port, ends, springs):
            raise Rule(
                f"port.{k}",
                f"nothing holds the joint against {_what(port)} at ends that are {ends[0]} on the "
                f"left and {ends[1]} on the right{'' if springs else ', without springs along x'}: "
                "clamp an end, see support",
            )


def _what(port: Port) -> str:
    if port.kind == "base":
        return f"the inertia of a base that moves along {port.axis}"
    along = "" if port.kind == "moment" else f" along {port.axis}"
    return f"a {port.kind}{along} at {' and '.join(port.ends)}"


def _idle(port: Port, ends: tuple[str, str]) -> str:
    """Why a load moves nothing; empty where it does."""
    if port.kind == "base":
        return "" if set(ends) != {"free"} else "both ends are free: there is no base that moves"
    held = dict(zip(("left", "right"), ends, strict=True))
    for end in port.ends:
        if held[end] == "clamped" and (port.at != "both" or port.kind == "force"):
            return f"the {end} end is clamped: a load on it moves nothing; see support.{end}"
        if held[end] == "pinned" and port.kind == "force" and port.axis == "y":
            return (
                f"the {end} end is pinned: a force along y on it moves nothing; see support.{end}"
            )
    return ""


def _held(port: Port, ends: tuple[str, str], springs: bool) -> bool:
    """Whether the supports balance the resultant of a load."""
    if "clamped" in ends or (port.kind == "moment" and port.at in (None, "both")):
        return True
    along = port.kind != "moment" and port.axis == "x"
    if ends == ("pinned", "pinned"):
        return not along or springs or (port.kind == "force" and port.at == "both")
    if "pinned" not in ends:
        return False
    pinned = ("left", "right")[ends.index("pinned")]
    return along and springs and port.kind == "force" and port.ends == (pinned,)
