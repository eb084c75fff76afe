"""What joints from files have in common: loads and outputs that all have a name in the joint file."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Literal, Self, TypeVar

from pydantic import Field, model_validator

from microslip.describe.amplitude import Load
from microslip.describe.driving import check_loads
from microslip.describe.joint import Joint, check_cycle_range, check_requests
from microslip.describe.named import Named, check_drive_is_said, check_names
from microslip.describe.outputs import NamedOutput
from microslip.describe.parts import Damping
from microslip.describe.ports import LoadPort
from microslip.describe.quantities import (
    Frequencies,
    Number,
    OneOrMore,
    Rule,
    check_distinct,
)
from microslip.describe.requests import ModeNumbers

USUAL_QUANTITY: dict[str, Literal["deflection", "rotation"]] = {
    "force": "deflection",
    "moment": "rotation",
}
"""What is reported of the driven port where the file names no output."""


DampingRatios = Annotated[tuple[Annotated[Number, Field(gt=0, lt=0.5)], ...], OneOrMore]


class DampingOrRatio(Damping):
    """Rayleigh damping of the structure: alpha and beta, the damping ratio that it has at two frequencies, or
    those of modes of the stuck joint.

    With ``omega = 2 pi f`` at both, ``alpha = 2 zeta omega_1 omega_2 / (omega_1 + omega_2)`` and
    ``beta = 2 zeta / (omega_1 + omega_2)``.

    Examples
    --------
    >>> own = DampingOrRatio(ratio=0.01, frequencies=["100 Hz", "400 Hz"])
    >>> alpha, beta = own.rayleigh
    >>> omega = 2 * math.pi * 100.0
    >>> round(alpha / (2 * omega) + beta * omega / 2, 12)
    0.01
    """

    ratio: Number | None = Field(default=None, ge=0, lt=0.5)
    """Damping ratio, half of a loss factor, at the two frequencies; less between them, more beyond them.
    Instead of alpha and beta."""
    frequencies: Frequencies | None = None
    """Two frequencies at which ratio holds, about those of interest. With ratio."""
    ratios: DampingRatios | None = None
    """Damping ratios of modes of the joint while it sticks, as tests under small loads have them. One is met
    by beta, two by alpha and beta unless they differ by more than the frequencies, any others by a matrix
    that couples the kept modes. Instead of alpha and beta, which the modes beside them follow by."""
    modes: ModeNumbers | None = None
    """Numbers of the modes that ratios are of; left out, the first ones. 1 is the first that deforms the
    joint."""

    @property
    def rayleigh(self) -> tuple[float, float]:
        """alpha (1/s) and beta (s); 0 where they follow from the modes of the stuck joint."""
        if self.ratio is None or self.frequencies is None:
            return self.alpha, self.beta
        low, high = (2 * math.pi * f for f in self.frequencies)
        return 2 * self.ratio * low * high / (low + high), 2 * self.ratio / (low + high)

    @model_validator(mode="after")
    def _one_or_the_other(self) -> Self:
        if (self.ratio is None) != (self.frequencies is None):
            raise Rule("ratio", "and frequencies, two of them, are given both or not at all")
        if self.frequencies is not None and len(self.frequencies) != 2:
            raise Rule("frequencies", f"must be two, and are {len(self.frequencies)}")
        if self.ratio is not None and {"alpha", "beta"} & self.model_fields_set:
            raise Rule("ratio", "says the damping: remove alpha and beta")
        return self

    @property
    def of_modes(self) -> tuple[tuple[int, float], ...]:
        """Number and damping ratio of each mode of the stuck joint that has one given."""
        ratios = self.ratios or ()
        return tuple(zip(self.modes or range(1, len(ratios) + 1), ratios, strict=True))

    @model_validator(mode="after")
    def _ratios_fit_modes(self) -> Self:
        if self.ratios is None:
            if self.modes is not None:
                raise Rule("modes", "says which modes ratios are of: give ratios")
            return self
        if {"alpha", "beta", "ratio"} & self.model_fields_set:
            raise Rule("ratios", "say the damping: remove alpha, beta and ratio")
        if self.modes is not None:
            check_distinct("modes", self.modes)
            if len(self.modes) != len(self.ratios):
                raise Rule("modes", f"are {len(self.modes)}, and ratios {len(self.ratios)}")
        return self


AnyPort = TypeVar("AnyPort", bound=LoadPort)


def driven_of(ports: Sequence[AnyPort], load: Load | None) -> AnyPort:
    """The port that ``[load]`` names, else the first."""
    name = None if load is None else load.port
    return next((port for port in ports if port.name == name), ports[0])


class NamedJoint(Joint):
    """A joint whose preload, loads and outputs are named in its file."""

    if TYPE_CHECKING:
        preload: tuple[Named, ...]
        port: tuple[LoadPort, ...]
        output: tuple[NamedOutput, ...]
        damping: DampingOrRatio

    @property
    def measured(self) -> tuple[NamedOutput, ...]:
        """Quantities that are reported, and where each is."""
        raise NotImplementedError

    @property
    def outputs(self) -> tuple[NamedOutput, ...]:
        """Quantities that are reported; the first is the one that tables and figures show."""
        return self.measured

    @property
    def ports(self) -> tuple[LoadPort, ...]:
        """Loads that the file names."""
        return self.port

    @property
    def preload_key(self) -> str:
        """Key of the forces that are named, or of the interference that takes their place."""
        return "preload.force" if self.held else "the interference, a negative interface.gap"

    @property
    def driven(self) -> LoadPort:
        """The port that drives the joint, see `driven_of`."""
        return driven_of(self.port, self.load)

    @property
    def held(self) -> tuple[Named, ...]:
        """Loads that are held, as far as the file names them."""
        return self.preload

    @property
    def rayleigh(self) -> tuple[float, float]:
        """alpha and beta of ``C = alpha M + beta K``, 1/s and s."""
        return self.damping.rayleigh

    @property
    def damping_of_modes(self) -> tuple[tuple[int, float], ...]:
        """Number and damping ratio of each mode of the stuck joint that has one given."""
        return self.damping.of_modes


def check_named(joint: NamedJoint) -> None:
    """Raise `Rule` where names, loads and requests of a joint do not fit each other."""
    analysis = joint.analysis
    check_names(joint.held, joint.port, joint.output)
    check_drive_is_said(joint.port, joint.load)
    check_loads(joint.port, joint.driven, joint.load, analysis.cycle, analysis.history)
    said = joint.driven.load
    check_requests(joint, f'{said.key} = "1 {said.unit}"')
    check_cycle_range(joint)
    if not joint.output and joint.driven.kind not in USUAL_QUANTITY:
        what = {"base": "of a base", "pressure": "under a pressure"}[joint.driven.kind]
        raise Rule("output", f"the motion {what} is no output: name one, [[output]]")
