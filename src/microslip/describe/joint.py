"""What every description of a joint has, whatever the joint is made from: loads, analyses, outputs.

A lap joint is described by its dimensions (`microslip.describe.lap`), another by matrices of a finite
element program (`microslip.describe.matrices`). What loads them and what is asked of them is the same.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from microslip.describe.amplitude import RHO_CONSTANT, Load, LoadKey
from microslip.describe.driving import drive_named, end_moments
from microslip.describe.excitation import Excitation
from microslip.describe.outputs import NamedOutput
from microslip.describe.ports import END_MOMENTS, LoadPort
from microslip.describe.quantities import Rule, Section
from microslip.describe.requests import MOST_OF_OPENING, Requests


class Joint(Section):
    """A joint as a user describes it. SI units throughout.

    The fields are those of each kind of joint, in the order of its file.
    """

    unnamed: ClassVar[str] = "a joint"
    """What a joint without a title is called."""

    modes_key: ClassVar[str] = "matrices.modes"
    """Key of the number of modes."""

    pairs_key: ClassVar[str] = "interface.pairs"
    """Key of the contact pairs."""

    if TYPE_CHECKING:
        title: str | None
        load: Load | None
        analysis: Requests

    @property
    def preload_key(self) -> str:
        """Key of what holds it together."""
        return "preload.force"

    @property
    def whole(self) -> bool:
        """Whether forces, moments and energies are of the whole structure, and not per metre of width."""
        return False

    @property
    def outputs(self) -> tuple[NamedOutput, ...]:
        """Points whose motion is reported; the first is the one that tables and figures show."""
        raise NotImplementedError

    @property
    def ports(self) -> tuple[LoadPort, ...]:
        """Loads that the file names."""
        raise NotImplementedError

    @property
    def rayleigh(self) -> tuple[float, float]:
        """alpha and beta of ``C = alpha M + beta K``, 1/s and s."""
        raise NotImplementedError

    @property
    def damping_of_modes(self) -> tuple[tuple[int, float], ...]:
        """Number and damping ratio of each mode of the stuck joint that `rayleigh` is to follow from."""
        return ()

    @property
    def modes_kept(self) -> int:
        """Free-interface modes that stay dynamic."""
        raise NotImplementedError

    @property
    def frictionless(self) -> bool:
        """Whether no contact pair has friction."""
        raise NotImplementedError

    @property
    def clamp_force_length(self) -> float:
        """P L, N m per metre of width: what end moments are measured by; nan where there is none."""
        return float("nan")

    @property
    def files(self) -> tuple[str, ...]:
        """Files that the joint itself comes from; none where the description says all."""
        return ()

    @property
    def driven(self) -> LoadPort:
        """The port that drives the joint: that of ``[load]``, else the end moments."""
        name = None if self.load is None else self.load.port
        return next((port for port in self.ports if port.name == name), END_MOMENTS)

    @property
    def driven_by_end_moments(self) -> bool:
        """Whether no named port drives it."""
        return end_moments(self.driven)

    @property
    def variants(self) -> tuple[str, ...]:
        """Reduced models asked for; none where no response is."""
        response, reduced = self.analysis.response, self.analysis.reduced
        if response is None:
            return ()
        return response.variants if reduced.variant is None else reduced.variant

    @property
    def drives(self) -> tuple[str, ...]:
        """What drives the quasi-static cycles; none where they are not asked for.

        Left out it is the load, and the mode where the consistent model reads its table.
        """
        cycle = self.analysis.cycle
        if cycle is None:
            return ()
        needed = ("load", "mode") if "consistent" in self.variants else ("load",)
        wanted = needed if cycle.drives is None else cycle.drives
        return tuple(dict.fromkeys(self.drive_named(drive) for drive in wanted))

    def drive_named(self, drive: str) -> str:
        """What results call a drive of the file, see `microslip.describe.driving.drive_named`."""
        return drive_named(self.driven, drive)

    def cycle_amplitudes(self) -> tuple[float, ...]:
        """Every quasi-static cycle, ascending; none where cycles are not asked for.

        Amplitudes where the file lists them, else over the one that opens the joint.
        """
        cycle = self.analysis.cycle
        return () if cycle is None else cycle.amplitudes(1.0)

    @property
    def rho_scale(self) -> float:
        """C in ``rho = C mu P L / M``: that of the file, else the same for every joint."""
        load = self.load
        return RHO_CONSTANT if load is None or load.rho_scale is None else load.rho_scale

    @property
    def says_rho(self) -> bool:
        """Whether a load of this description is given by rho."""
        sections = (self.load, *self.analysis.history)
        return any(getattr(section, "rho", None) is not None for section in sections)

    def end_moment(self, key: LoadKey, value: float) -> float:
        """Amplitude that a key gives, on the driven port: as written.

        Parameters
        ----------
        key : {"moment", "moment_over_clamp_force_length", "rho", "force", "acceleration"}
        value : float
            Positive.
        """
        return value

    def history_load(self, entry: Excitation) -> float | None:
        """Amplitude of the load of a history, as `end_moment`; None where no key of it gives one."""
        key = entry.load_key
        return None if key is None else self.end_moment(key, getattr(entry, key))

    def load_amplitudes(self) -> tuple[float, ...]:
        """Amplitudes of the loads on the driven port; rho = 0 has none and is left out."""
        if self.load is None:
            return ()
        kind = self.load.kind
        return tuple(self.end_moment(kind, value) for value in self.load.values if value > 0)


def check_requests(joint: Joint, example: str = 'moment = "50 N*m/m"') -> None:
    """Raise `Rule` where an analysis lacks what it starts from.

    Parameters
    ----------
    joint : Joint
    example : str
        A load as one would write it.
    """
    _response_has_its_inputs(joint, example)
    _variants_are_said_once(joint)
    analysis = joint.analysis
    if analysis.time is not None and analysis.response is None:
        if "reduced" in analysis.time.starts:
            raise Rule(
                "analysis.time.starts",
                '"reduced" is the motion of the reduced model: add a section [analysis.response]; it may be '
                "empty",
            )
        _has_load(joint, "analysis.time", example)
    if analysis.harmonic is not None:
        _has_load(joint, "analysis.harmonic", example)


def check_cycle_range(joint: Joint) -> None:
    """Raise `Rule` where the range of the cycles' amplitudes descends."""
    amplitudes = joint.cycle_amplitudes()
    if amplitudes and amplitudes[-1] < amplitudes[0]:
        raise Rule(
            "analysis.cycle.smallest",
            f"must be below the largest amplitude, by default {MOST_OF_OPENING:g} of the one "
            f"that opens the joint: {amplitudes[-1]:.4g}",
        )


def _has_load(joint: Joint, analysis: str, example: str) -> None:
    if joint.load is None:
        raise Rule(
            "load",
            f"the section is missing and {analysis} needs it: write for example [load] with {example}",
        )


def _response_has_its_inputs(joint: Joint, example: str) -> None:
    from_cycles = [variant for variant in joint.variants if variant != "refined"]
    if from_cycles and joint.analysis.cycle is None:
        raise Rule(
            "analysis.response",
            f"the {from_cycles[0]} model is computed from the cycles: add a section "
            "[analysis.cycle]; it may be empty",
        )
    if joint.analysis.response is not None:
        _has_load(joint, "analysis.response", f"{example}, or leave analysis.response out")
    if joint.load is not None and joint.frictionless and any(joint.load.rho or ()):
        raise Rule(
            "load.rho", "without contact.friction rho is 0: give the moment, or some friction"
        )


def _variants_are_said_once(joint: Joint) -> None:
    response, reduced = joint.analysis.response, joint.analysis.reduced
    if reduced.variant is None:
        return
    if response is None:
        raise Rule(
            "analysis.reduced.variant",
            "is for the forced response: add a section [analysis.response]; it may be empty",
        )
    if "variants" in response.model_fields_set:
        raise Rule(
            "analysis.reduced.variant",
            "the variants are in analysis.response.variants already: remove one of the two",
        )
