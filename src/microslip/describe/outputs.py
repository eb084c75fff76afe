"""What a user wants to know of the motion: named points of the joint, and a quantity at each.

``x`` counts from the middle of the overlap, to the right. Deflections are positive upward, axial
displacements to the right, rotations counter-clockwise, slip where the upper beam moves to the right
over the lower one, gaps where they open. All are changes from prestress.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal, get_args

from pydantic import BeforeValidator, Field, model_validator

from microslip.describe import units
from microslip.describe.quantities import NAME, Rule, Section, list_of_sections

PREFIX = "output "
"""Of the port that an output is in a joint model, before its name."""


@dataclass(frozen=True)
class Quantity:
    """What is measured at a point.

    Attributes
    ----------
    motion : str
        ``"vertical"``, ``"axial"``, ``"rotation"``, ``"slip"`` or ``"gap"``; ``"reaction"`` and
        ``"reaction moment"``, which are none.
    order : int
        Of its derivative by time: 0, 1 or 2.
    unit : str
        SI.
    shown : str
        What tables and figures show it in.
    key : str
        The same in names of the summary.
    factor : float
        From SI to that.
    """

    motion: str
    order: int
    unit: str
    shown: str
    key: str
    factor: float = 1e3


QUANTITIES: dict[str, Quantity] = {
    "deflection": Quantity("vertical", 0, "m", "mm", "mm"),
    "velocity": Quantity("vertical", 1, "m/s", "mm/s", "mm_per_s"),
    "acceleration": Quantity("vertical", 2, "m/s^2", "m/s²", "m_per_s2", 1.0),
    "axial displacement": Quantity("axial", 0, "m", "mm", "mm"),
    "axial velocity": Quantity("axial", 1, "m/s", "mm/s", "mm_per_s"),
    "axial acceleration": Quantity("axial", 2, "m/s^2", "m/s²", "m_per_s2", 1.0),
    "rotation": Quantity("rotation", 0, "rad", "mrad", "mrad"),
    "angular velocity": Quantity("rotation", 1, "rad/s", "mrad/s", "mrad_per_s"),
    "angular acceleration": Quantity("rotation", 2, "rad/s^2", "rad/s²", "rad_per_s2", 1.0),
    "slip": Quantity("slip", 0, "m", "µm", "um", 1e6),
    "slip velocity": Quantity("slip", 1, "m/s", "mm/s", "mm_per_s"),
    "gap": Quantity("gap", 0, "m", "µm", "um", 1e6),
    "reaction": Quantity("reaction", 0, "N/m", "N/m", "n_per_m", 1.0),
    "reaction moment": Quantity("reaction moment", 0, "N m/m", "N m/m", "n_m_per_m", 1.0),
}
"""Every quantity by the word that the input file has for it."""

QUANTITIES_OF_THE_WHOLE: dict[str, Quantity] = {
    "reaction": Quantity("reaction", 0, "N", "N", "n", 1.0),
    "reaction moment": Quantity("reaction moment", 0, "N m", "N m", "n_m", 1.0),
}
"""Those that are others of a whole structure, not per metre of its width."""

Place = Literal["middle", "left end", "right end", "clamp edge"]
"""Positions that have a name."""

Side = Literal["top", "bottom", "mid-height", "contact"]
"""Where on the height of a beam a point lies."""

BeamName = Literal["lower", "upper"]


def _position(value: Any) -> float | str:
    if isinstance(value, str) and value.strip() in get_args(Place):
        return value.strip()
    words = ", ".join(f'"{word}"' for word in get_args(Place))
    try:
        return units.LENGTH.parse(value)
    except ValueError as error:
        raise ValueError(f"{error}, or one of {words}") from None


Position = Annotated[float | Place, BeforeValidator(_position)]
QuantityName = Literal[
    "deflection",
    "velocity",
    "acceleration",
    "axial displacement",
    "axial velocity",
    "axial acceleration",
    "rotation",
    "angular velocity",
    "angular acceleration",
    "slip",
    "slip velocity",
    "gap",
]
AnyQuantityName = Literal[QuantityName, "reaction", "reaction moment"]
"""Those, and what is known of supports that have a name."""


class NamedOutput(Section):
    """A quantity that is reported under a name, wherever it is."""

    name: str = Field(pattern=NAME)
    """What it is called. Tables, results and figures name it so."""
    quantity: AnyQuantityName = Field(default="deflection")
    """What is measured. Velocities and accelerations are of a vibration: static cycles have none. Reactions
    are of supports: what they hold with."""

    @property
    def port(self) -> str:
        """Port of the joint model whose output it is."""
        return PREFIX + self.name

    @property
    def measured(self) -> Quantity:
        """What is measured."""
        return QUANTITIES[self.quantity]

    @property
    def key(self) -> str:
        """What it is called in the summary, with its unit.

        Examples
        --------
        >>> NamedOutput(name="tip", quantity="slip").key
        'tip_um'
        """
        return f"{self.name}_{self.measured.key}"

    @property
    def across(self) -> bool:
        """Whether it is measured between the two faces in contact."""
        return self.measured.motion in ("slip", "gap")

    @property
    def reacts(self) -> bool:
        """Whether it is what a support holds with."""
        return self.quantity in ("reaction", "reaction moment")

    @property
    def place(self) -> tuple[str, str]:
        """Body and face that it is on, in words; empty where it names none."""
        return "", ""


class Output(NamedOutput):
    """A quantity at a point of the joint, `[[output]]`.

    Examples
    --------
    >>> Output(name="tip", quantity="rotation", x="right end").port
    'output tip'
    """

    quantity: AnyQuantityName = Field(default="deflection")
    """What is measured. Velocities and accelerations are of a vibration: static cycles have none. Reactions
    are of the support of an end: what it holds with."""
    x: Position = Field(default="middle")
    """Where, from the middle of the overlap to the right, or a word. The ends are those of the
    joint, or of the beam that is named."""
    direction: Literal["x", "y"] | None = Field(default=None)
    """Of a reaction: along "x", to the right, or "y", up. What the support of an end pushes with; a moment
    is about the middle of the end, counter-clockwise."""
    beam: BeamName | None = Field(default=None)
    """Which beam. Left out, the one that is there, and over the overlap the mean of both."""
    side: Side | None = Field(default=None)
    """Where on the height of the beam: its top, bottom, mid-height, or the face in contact. Left
    out, the face in contact over the overlap and mid-height elsewhere."""

    @property
    def place(self) -> tuple[str, str]:
        """Body and face that it is on, in words; empty where it names none."""
        return self.beam or "", self.side or ""

    @model_validator(mode="after")
    def _fits_quantity(self) -> Output:
        for key in ("beam", "side"):
            if self.across and getattr(self, key) is not None:
                raise Rule(key, f"{self.quantity} is of both faces in contact: remove it")
        if self.reacts:
            self._check_reaction()
        elif self.direction is not None:
            raise Rule("direction", "is of a reaction: remove it, or name another quantity")
        if self.measured.motion == "rotation" and self.side is not None:
            raise Rule("side", "a section turns as a whole: remove it")
        return self

    def _check_reaction(self) -> None:
        """Raise `Rule` unless an end, and of a force its direction, are given."""
        if self.x not in ("left end", "right end"):
            raise Rule("x", 'a reaction is of a support: give "left end" or "right end"')
        for key in ("beam", "side"):
            if getattr(self, key) is not None:
                raise Rule(key, "a support holds the whole end: remove it")
        if (self.quantity == "reaction") != (self.direction is not None):
            said = (
                "which way does it hold? give x or y"
                if self.direction is None
                else "a moment has none"
            )
            raise Rule("direction", said)


USUAL = (
    Output(name="deflection", quantity="deflection", x="middle"),
    Output(name="rotation", quantity="rotation", x="right end"),
    Output(name="slip", quantity="slip", x="clamp edge"),
)
"""What is reported where the file names no outputs."""


Outputs = Annotated[
    tuple[Output, ...], list_of_sections(100, "must be at most 100 sections, [[output]]")
]


def position_of(output: Output, extents: Mapping[str, tuple[float, float]], clamp: float) -> float:
    """Coordinate of an output, m.

    Parameters
    ----------
    output : Output
    extents : mapping of str to (float, float)
        Where each beam begins and ends, m.
    clamp : float
        Where the clamp ends, m.

    Examples
    --------
    >>> beams = {"lower": (-0.2, 0.05), "upper": (-0.05, 0.2)}
    >>> position_of(Output(name="tip", x="left end"), beams, 0.02)
    -0.2
    >>> position_of(Output(name="tip", x="left end", beam="upper"), beams, 0.02)
    -0.05
    """
    own = [extents[output.beam]] if output.beam else list(extents.values())
    words = {
        "middle": 0.0,
        "left end": min(left for left, _ in own),
        "right end": max(right for _, right in own),
        "clamp edge": clamp,
    }
    return words[output.x] if isinstance(output.x, str) else output.x


def check_outputs(
    outputs: Sequence[Output],
    extents: Mapping[str, tuple[float, float]],
    clamp: float,
    ends: Mapping[str, str],
) -> None:
    """Raise `Rule` where two outputs share a name, one lies off its beam or off the overlap, or a reaction is
    of an end that nothing holds."""
    names = [output.name for output in outputs]
    for k, output in enumerate(outputs):
        if output.name in names[:k]:
            raise Rule(f"output.{k}.name", f"two outputs are called {output.name!r}")
        if output.reacts and ends[str(output.x)] == "free":
            raise Rule(f"output.{k}.x", f"the {output.x} is free: no support holds it")
        x = position_of(output, extents, clamp)
        for what, left, right in _where_it_may_lie(output, extents):
            margin = 1e-9 * (right - left)
            if not left - margin <= x <= right + margin:
                raise Rule(
                    f"output.{k}.x",
                    f"{x:g} m lies off the {what}, which reaches from {left:g} to {right:g} m",
                )


def _where_it_may_lie(
    output: Output, extents: Mapping[str, tuple[float, float]]
) -> list[tuple[str, float, float]]:
    if output.beam:
        places = [(f"{output.beam} beam", *extents[output.beam])]
    else:
        lefts, rights = zip(*extents.values(), strict=True)
        places = [("joint", min(lefts), max(rights))]
    if output.across or output.side == "contact":
        lefts, rights = zip(*extents.values(), strict=True)
        places.append(("overlap", max(lefts), min(rights)))
    return places
