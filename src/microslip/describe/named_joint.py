"""What joints from files have in common: loads and outputs that all have a name in the joint file."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal, TypeVar

from microslip.describe.amplitude import Load
from microslip.describe.driving import check_loads
from microslip.describe.joint import Joint, check_cycle_range, check_requests
from microslip.describe.named import Named, check_drive_is_said, check_names
from microslip.describe.outputs import NamedOutput
from microslip.describe.parts import Damping
from microslip.describe.ports import LoadPort
from microslip.describe.quantities import Rule

USUAL_QUANTITY: dict[str, Literal["deflection", "rotation"]] = {
    "force": "deflection",
    "moment": "rotation",
}
"""What is reported of the driven port where the file names no output."""

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
        damping: Damping

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
    def driven(self) -> LoadPort:
        """The port that drives the joint, see `driven_of`."""
        return driven_of(self.port, self.load)

    @property
    def rayleigh(self) -> tuple[float, float]:
        """alpha and beta of ``C = alpha M + beta K``, 1/s and s."""
        return self.damping.alpha, self.damping.beta


def check_named(joint: NamedJoint) -> None:
    """Raise `Rule` where names, loads and requests of a joint do not fit each other."""
    analysis = joint.analysis
    check_names(joint.preload, joint.port, joint.output)
    check_drive_is_said(joint.port, joint.load)
    check_loads(joint.port, joint.driven, joint.load, analysis.cycle, analysis.history)
    said = joint.driven.load
    check_requests(joint, f'{said.key} = "1 {said.unit}"')
    check_cycle_range(joint)
    if not joint.output and joint.driven.kind == "base":
        raise Rule("output", "the motion of a base is no output: name one, [[output]]")
