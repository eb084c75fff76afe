"""Entries of ``[[analysis.history]]``: what loads the joint over time, and what is kept of it.

Each kind of signal is a section of its own, told apart by its key ``signal``. All describe the load
of the port that ``[load]`` names, without it the end moment (N m per metre of width), over time;
``drive = "mode"`` turns it into the inertia load of the sliding mode that is as close to opening the
joint. `microslip.pipeline.excitation` makes the load at every step of them.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self, get_args

from pydantic import BeforeValidator, Field, ValidationInfo, field_validator, model_validator

from microslip.describe.amplitude import LoadKey, OneAmplitude
from microslip.describe.band import Band
from microslip.describe.quantities import (
    NAME,
    Count,
    Drive,
    Frequency,
    Number,
    Positions,
    Rule,
    Section,
    StepsPerCycle,
    Time,
)

STEPS = 150
"""Time steps per cycle where the file gives neither them nor the step."""

FEWEST_STEPS = 20
"""Fewer time steps per cycle say nothing about contact."""

UNIVERSAL = (".uff", ".unv", ".uf", ".ufb")
"""How the names of universal files end."""


def is_universal(path: str | Path) -> bool:
    """Whether the name is that of a universal file, and not of a CSV file.

    Examples
    --------
    >>> is_universal("hammer.UFF"), is_universal("hammer.csv")
    (True, False)
    """
    return Path(path).suffix.lower() in UNIVERSAL


def _text(value: object) -> str:
    if not isinstance(value, str | Path) or not str(value).strip():
        raise ValueError('must be the name of a file, for example "load.csv"')
    return str(value)


class Excitation(Section):
    """Keys that every history has."""

    name: str | None = Field(default=None, pattern=NAME, max_length=40)
    """Of the history in results; the kind of signal where left out. Two histories must not have
    the same."""
    drive: Drive = "load"
    """What drives it by [load] ("load", or "moment" where that is one), or the inertia of the sliding
    mode, as close to opening the joint ("mode"). Reduced models see the mode alone."""
    steps: StepsPerCycle | None = None
    """Time steps per cycle of the highest frequency, of signal or sliding mode; 150 where neither
    they nor time_step are given. Accuracy and time."""
    time_step: Time | None = Field(default=None, gt=0)
    """The step itself, instead of steps. Accuracy and time; at least 20 steps per cycle."""
    positions: Positions | None = None
    """Where slip and gap are kept at every step, from the middle of the overlap; the edge of the
    clamp where left out. Results only."""
    field_samples: Count = Field(default=400, ge=0, le=100_000)
    """How many times contact states and tractions of all pairs are kept. Size of results.nc, and
    the maps of the figure."""
    field_from: Time | None = Field(default=None, ge=0)
    """Begin of the part of the history that these samples are spread over. Results only."""
    field_to: Time | None = Field(default=None, gt=0)
    """End of that part; the end of the history where left out. Results only."""

    @property
    def label(self) -> str:
        """Name of the history."""
        return self.name or self.kind

    @property
    def kind(self) -> str:
        """Kind of signal."""
        kind: str = self.signal  # type: ignore[attr-defined]
        return kind

    @property
    def load_key(self) -> LoadKey | None:
        """Which key gives the load; None where the signal has its amplitude in it, or loads nothing."""
        return None

    @property
    def highest_frequency(self) -> float | None:
        """Highest frequency of the signal, Hz; None where it has none of its own."""
        return None

    def resolution(self, sliding: float) -> float:
        """Time step, s.

        Parameters
        ----------
        sliding : float
            Sliding frequency of the joint, Hz.
        """
        frequency = self.resolved_frequency(sliding)
        dt = self.time_step or 1 / (frequency * (self.steps or STEPS))
        self.check_step(frequency)
        return dt

    def resolved_frequency(self, sliding: float) -> float:
        """What `steps` are counted per cycle of, Hz: a motion from rest excites the joint's mode.

        Parameters
        ----------
        sliding : float
            Sliding frequency of the joint, Hz.
        """
        return max(self.highest_frequency or 0.0, sliding)

    def check_step(self, frequency: float) -> None:
        """Raise `Rule` where the given step resolves a cycle too coarsely."""
        longest = 1 / (FEWEST_STEPS * frequency)
        if self.time_step is not None and self.time_step > longest * (1 + 1e-9):
            raise Rule(
                "time_step",
                f"gives {1 / (frequency * self.time_step):.3g} steps per cycle at {frequency:.4g} "
                f"Hz; at least {FEWEST_STEPS} are needed: at most {longest:.3g} s",
            )

    @model_validator(mode="after")
    def _one_step(self) -> Self:
        if self.steps is not None and self.time_step is not None:
            raise Rule("time_step", "fixes the step: remove steps")
        if self.highest_frequency is not None:
            self.check_step(self.highest_frequency)
        if self.field_to is not None and self.field_to <= (self.field_from or 0.0):
            raise Rule("field_to", f"must be after field_from, {self.field_from or 0:g} s")
        return self


class LoadedExcitation(OneAmplitude, Excitation):
    """An excitation with an amplitude: exactly one of three keys, as in ``[load]``."""

    signal: str  # before the keys of each signal


class DrivenExcitation(LoadedExcitation):
    """An excitation that is nothing without its amplitude."""

    @model_validator(mode="after")
    def _one_load(self) -> Self:
        self.check_load()
        return self


class Sine(DrivenExcitation):
    """A sine of constant frequency that starts at rest."""

    signal: Literal["sine"]
    """Kind of the load over time. Which other keys the history has."""
    frequency: Frequency = Field(gt=0)
    """Frequency of the load. Near the resonance the joint slips most."""
    cycles: Number = Field(gt=0, le=1e6)
    """How many periods. Long enough for a steady state: a few over 2 pi times the damping ratio."""

    @property
    def highest_frequency(self) -> float:
        """Frequency of the sine, Hz."""
        return self.frequency


class SteppedSine(Band, DrivenExcitation):
    """A sine that dwells at one frequency after the other, in the order written."""

    signal: Literal["stepped_sine"]
    """Kind of the load over time. Which other keys the history has."""
    cycles: Number = Field(gt=0, le=1e6)
    """Periods at each frequency. Long enough for a steady state: a few over 2 pi times the damping
    ratio."""

    @property
    def highest_frequency(self) -> float | None:
        """Highest of the frequencies, Hz; None where they are not said."""
        return max(self.band()) if self.band_is_complete else None


class SweptSine(DrivenExcitation):
    """A sine whose frequency runs from one value to another, up or down."""

    signal: Literal["swept_sine"]
    """Kind of the load over time. Which other keys the history has."""
    from_: Frequency = Field(gt=0, alias="from")
    """Frequency at the begin. Up and down differ where the response folds."""
    to: Frequency = Field(gt=0)
    """Frequency at the end; below the first for a downward sweep. As from."""
    duration: Time = Field(gt=0)
    """How long it takes. A fast sweep does not reach the peak."""
    sweep: Literal["linear", "log"] = "linear"
    """Whether the frequency grows evenly or by equal ratios. How long it dwells near the
    resonance."""

    @property
    def highest_frequency(self) -> float:
        """Frequency of the higher end, Hz."""
        return max(self.from_, self.to)


class FreeDecay(LoadedExcitation):
    """Free vibration after a start: from the mode's motion, or let go from a load.

    ``start = "mode"`` passes through rest with the velocity of ``modal_amplitude``; ``"static"``
    is let go from the load held still (first loading, with friction), ``"steady"`` from the
    steady state under the load at ``frequency``, when the load passes through zero.
    """

    signal: Literal["free_decay"]
    """Kind of the load over time. Which other keys the history has."""
    start: Literal["mode", "static", "steady"]
    """From the motion of modal_amplitude ("mode"), let go from the load ("static"), or from the
    steady state under the load at frequency ("steady"). What is in the motion besides the first
    mode."""
    modal_amplitude: Number | None = Field(default=None, gt=0)
    """Of the sliding mode, kg^0.5 m^0.5; only for start = "mode", which needs it. How far the
    contact slips at first."""
    frequency: Frequency | None = Field(default=None, gt=0)
    """Of the load before; only for start = "steady", which needs it. As start."""
    duration: Time = Field(gt=0)
    """How long it is followed. Small amplitudes come late."""

    @property
    def highest_frequency(self) -> float | None:
        """Frequency of the steady state it starts from, Hz; None where it starts from none."""
        return self.frequency

    def resolved_frequency(self, sliding: float) -> float:
        """Frequency of the steady state, whose period the step divides, else of the sliding mode, Hz."""
        if self.frequency is None:
            return sliding
        steps = self.steps or STEPS
        if steps * self.frequency < FEWEST_STEPS * sliding:
            raise Rule(
                "steps",
                f"{steps} per cycle at {self.frequency:g} Hz are fewer than {FEWEST_STEPS} per "
                f"cycle of the sliding mode, {sliding:.4g} Hz: give more",
            )
        return self.frequency

    @model_validator(mode="after")
    def _fits_start(self) -> Self:
        wanted = {"mode": {"modal_amplitude"}, "static": set(), "steady": {"frequency"}}[self.start]
        for key in ("modal_amplitude", "frequency"):
            if key in wanted and getattr(self, key) is None:
                raise Rule(key, f'start = "{self.start}" needs it')
            if key not in wanted and getattr(self, key) is not None:
                raise Rule(key, f'has no meaning for start = "{self.start}": remove it')
        if self.start == "steady" and self.time_step is not None:
            raise Rule("time_step", 'start = "steady" needs whole steps per cycle: give steps')
        if self.start != "mode":
            self.check_load()
        elif self.load_key is not None:
            raise Rule(self.load_key, 'has no meaning for start = "mode": remove it')
        return self


class MeasuredSignal(Excitation):
    """A load from a file: CSV with units, or dataset 58 of a universal file."""

    signal: Literal["measured"]
    """Kind of the load over time. Which other keys the history has."""
    file: Annotated[str, BeforeValidator(_text)]
    """CSV with a header like "time [s], moment [N*m/m]", or a universal file (.uff, .unv, .uf,
    .ufb), beside the joint file. The load itself, so there is no moment."""
    column: str | None = Field(default=None, min_length=1)
    """Which column of a CSV file, where it has more than two. Universal files have none."""
    dataset: Count | None = Field(default=None, ge=1)
    """Which dataset 58 of a universal file, where it has more than one. CSV files have none."""
    unit: str | None = Field(default=None, min_length=1)
    """Unit of the values, where the file does not say it. It outranks the file."""
    scale: Number = 1.0
    """Factor on the values. For a calibration, or another width."""

    @field_validator("file")
    @classmethod
    def _beside_the_joint_file(cls, file: str, info: ValidationInfo) -> str:
        folder = (info.context or {}).get("folder", "")
        path = Path(folder) / file
        try:
            what = "" if path.is_file() else "is a folder" if path.is_dir() else "no such file"
        except (OSError, ValueError):  # a name that no file can have
            what = "no such file"
        if what:
            raise ValueError(f"{path}: {what}")
        return str(path)

    @model_validator(mode="after")
    def _fits_format(self) -> Self:
        universal = is_universal(self.file)
        if universal and self.column is not None:
            raise Rule("column", "is for CSV files; a universal file has numbered datasets")
        if not universal and self.dataset is not None:
            raise Rule("dataset", "is for universal files (.uff, .unv); a CSV file has columns")
        return self


AnyExcitation = Annotated[
    Sine | SteppedSine | SweptSine | FreeDecay | MeasuredSignal, Field(discriminator="signal")
]

SIGNALS: dict[str, type[Excitation]] = {
    get_args(kind.model_fields["signal"].annotation)[0]: kind
    for kind in get_args(get_args(AnyExcitation)[0])
}
"""Sections by the kind of signal, as the key ``signal`` names it."""
