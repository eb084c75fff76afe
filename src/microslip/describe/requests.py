"""What may be asked of a joint: one section of the file per analysis, `[analysis.NAME]`.

A section that is left out is not computed. Analyses from outside bring their own section:
`add_section` puts it among the others at run time, with the same messages for what is wrong.
"""

from __future__ import annotations

import keyword
from typing import Annotated, Any, ClassVar, Literal, Self, TypeVar

from pydantic import BaseModel, Field, model_validator
from pydantic.fields import FieldInfo

from microslip.describe.band import AscendingBand, check_ascending
from microslip.describe.excitation import AnyExcitation
from microslip.describe.quantities import (
    Accelerations,
    Count,
    Drive,
    Forces,
    Frequency,
    Harmonics,
    Moments,
    Number,
    OneOrMore,
    Positions,
    Pressures,
    Ratios,
    Rule,
    Section,
    StepsPerCycle,
    check_distinct,
    list_of_sections,
)

MOST_OF_OPENING = 0.85
"""Largest amplitude of the cycles where the file gives none, over the one that opens the joint."""

FEWEST_ADAPTIVE = 5
"""Harmonics that harmonic balance starts from where it chooses their number."""

SAMPLES_OF_A_HARMONIC = 4
"""Samples per period of the highest harmonic that the contact laws need at least."""


LISTS = ("moment_over_clamp_force_length", "moment", "force", "acceleration", "pressure")
"""Keys that can list the amplitudes of cycles."""

CYCLES_EACH, SECONDS_EACH, MARCHED_EACH = 80, 0.6, 320
"""Cycles, and processor time in seconds, that a steady state of method "auto" may take on average, with few
steps and once more with more, and cycles that it may be marched beside, where motions creep."""

Variant = Literal["printed", "consistent", "refined"]
Drives = Annotated[tuple[Drive, ...], OneOrMore]
Variants = Annotated[tuple[Variant, ...], OneOrMore]
ResponseMethod = Literal["reduced", "corrected", "auto"]
BackboneMethod = Literal["quasi_static", "prescribed", "harmonic"]
BackboneMethods = Annotated[tuple[BackboneMethod, ...], OneOrMore]
TimeStart = Literal["raised", "rest", "reduced", "below", "above"]
TimeStarts = Annotated[tuple[TimeStart, ...], OneOrMore]
ModeNumbers = Annotated[tuple[Annotated[Count, Field(ge=1, le=2000)], ...], OneOrMore]


class CycleAnalysis(Section):
    """Quasi-static cycles: stiffness and damping against amplitude M/(PL).

    Under a port that the file names, `smallest` and `largest` are over the amplitude that opens the
    joint or, where none does, that changes the largest reaction by as much as the preload.

    `drives` left out are the end moment and what the forced response reads: `LapJoint.drives`.
    """

    drives: Drives | None = None
    """Driven by what [load] says, "load" (or "moment" where that is one), or by the inertia of the
    sliding mode, "mode". Left out, the load, and the mode where a forced response reads its table."""
    smallest: Number = Field(default=5e-5, gt=0)
    """Smallest amplitude M/(P L); amplitudes are evenly spaced in their logarithm. Begin of the
    table. Of a named port it is over what opens or slides the joint."""
    largest: Number | None = Field(default=None, gt=0)
    """Largest amplitude; left out: 0.85 of overlap_half_length/length, which opens the joint. End
    of the table: there is no answer beyond it. Of a named port it is over what opens or slides the joint."""
    count: Count = Field(default=25, ge=2, le=1000)
    """How many amplitudes. Time in proportion."""
    moment_over_clamp_force_length: Ratios | None = None
    """Each of the amplitudes M/(P L), instead of those three. For cycles at given loads."""
    moment: Moments | None = None
    """Each of the amplitudes as moments, instead of those three. As above."""
    force: Forces | None = None
    """Each of the amplitudes of a force, instead of those three. Where load.port is one, and nothing
    says how much opens the joint."""
    acceleration: Accelerations | None = None
    """Each of the amplitudes of a base, instead of those three. As force."""
    pressure: Pressures | None = None
    """Each of the amplitudes of a pressure, instead of those three. As force."""
    steps: Count = Field(default=300, ge=20, le=100_000)
    """Load steps per cycle. Accuracy of what is dissipated; time in proportion."""
    max_cycles: Count = Field(default=6, ge=2, le=1000)
    """Cycles at most until one repeats the last. Large loads settle slowly."""
    closure: Number = Field(default=1e-5, gt=0, lt=0.1)
    """A cycle repeats the last to this part of the largest reaction of the clamp. As max_cycles."""

    @property
    def listed(self) -> str | None:
        """Key that lists the amplitudes; None where they are spaced."""
        return next((key for key in LISTS if getattr(self, key) is not None), None)

    def amplitudes(self, opening: float = 1.0) -> tuple[float, ...]:
        """Every amplitude, ascending, in the unit of what says them: a list, or ratios.

        `largest` left out is 0.85 of `opening`.

        Examples
        --------
        >>> CycleAnalysis(smallest=0.001, largest=0.1, count=3).amplitudes()
        (0.001, 0.01, 0.1)
        """
        if self.listed is not None:
            return tuple(sorted(set(getattr(self, self.listed))))
        largest = MOST_OF_OPENING * opening if self.largest is None else self.largest
        ratio = largest / self.smallest
        inner = [self.smallest * ratio ** (i / (self.count - 1)) for i in range(1, self.count - 1)]
        return (self.smallest, *inner, largest)

    @model_validator(mode="after")
    def _one_list(self) -> Self:
        check_distinct("drives", self.drives or ())
        range_keys = {"smallest", "largest", "count"} & self.model_fields_set
        lists = [key for key in LISTS if getattr(self, key) is not None]
        if len(lists) > 1:
            raise Rule(lists[1], f"the amplitudes are listed by {lists[0]} already: remove one")
        if lists and range_keys:
            raise Rule(
                lists[0],
                f"lists the amplitudes: remove {', '.join(sorted(range_keys))}",
            )
        if self.largest is not None and self.largest <= self.smallest:
            raise Rule("largest", f"must be above smallest, {self.smallest:g}")
        return self


class ResponseAnalysis(Section):
    """Frequency response of the reduced model, over a band in Hz.

    An end of the band that is left out follows from the joint and its loads, and frequencies are
    added to the `count` where a curve is steep.
    """

    from_: Frequency | None = Field(default=None, gt=0, alias="from")
    """Lowest frequency. Left out, it follows from the joint and its loads, so that every peak is
    inside."""
    to: Frequency | None = Field(default=None, gt=0)
    """Highest frequency. As from."""
    count: Count = Field(default=501, ge=2, le=1_000_000)
    """How many frequencies, evenly spaced; more where a curve is steep, if from or to is left out.
    How well the peak is resolved."""
    method: ResponseMethod = "reduced"
    """"reduced": reduced models alone. "corrected": the refined model corrected at forty steady states of
    time integration at most, with a bound of its error at every frequency: seconds. "auto": corrected
    wherever it is not sure of itself, and what the past decides measured. Where the answer must be right: up
    to minutes."""
    error: Number = Field(default=0.01, ge=5e-3, lt=1)
    """Of methods "corrected" and "auto": the relative error to get below, of the amplitude and of the
    first output. More steady states."""
    corrections: Count = Field(default=40, ge=7, le=1000)
    """Of method "corrected": steady states at most, per load. A tenth of a second each where they settle."""
    checks: Count = Field(default=3, ge=0, le=3)
    """Of method "reduced": motions of the full joint to hold it against, a load. Some tenths of a second."""
    points: Count = Field(default=200, ge=8, le=10_000)
    """Of method "auto": steady states at most, per load, and eighty cycles and 0.6 s of processor time each
    on average; as much again with more steps, and four times as much where these begin (pairs that bounce);
    320 cycles more where motions creep, as much once more to follow branches that these lead to, and 0.3 s
    more to march what is unsure in the end; all of it again where the band is widened. Some tenths of a
    second each where the motion settles."""
    variants: Variants = ("refined",)
    """Reduced models: the accurate one, "refined"; as the paper prints it, "printed"; put right,
    "consistent". Each gives a curve per load."""
    tolerance: Number = Field(default=1e-10, gt=0, lt=0.1)
    """Of the fixed-point iteration at each frequency. Hardly any time."""
    max_iterations: Count = Field(default=500, ge=1, le=1_000_000)
    """Of that iteration. Points that need more have no answer."""

    @model_validator(mode="after")
    def _ascending(self) -> Self:
        check_distinct("variants", self.variants)
        if self.method != "reduced" and "refined" not in self.variants:
            raise Rule(
                "method",
                f'is "{self.method}", which puts the model "refined" right: add it to variants',
            )
        check_ascending(self.from_, self.to, "analysis.response")
        return self


class ReducedAnalysis(Section):
    """Which reduced models, and how finely the refined one is tabulated."""

    variant: Variants | None = None
    """The variants here, instead of analysis.response.variants. As there."""
    amplitudes: Count = Field(default=48, ge=4, le=1000)
    """Amplitudes in the table of the refined model. Accuracy between them; time in proportion."""
    steps: Count = Field(default=200, ge=60, le=100_000)
    """Load steps per cycle. Accuracy of the damping; time in proportion."""
    max_cycles: Count = Field(default=4, ge=2, le=1000)
    """Cycles at most until one repeats the last. Large amplitudes settle slowly."""
    upper_modes: Count = Field(default=2, ge=0, le=20)
    """Modes above the sliding one that harmonics may excite. Where three times the frequency of
    the load is near one of them."""

    @model_validator(mode="after")
    def _no_repetition(self) -> Self:
        check_distinct("variant", self.variant or ())
        return self


class BackboneAnalysis(Section):
    """Natural frequency and damping ratio of modes of the joint against their amplitude.

    `smallest` and `largest` are fractions of the amplitude at which the inertia of the mode opens
    the joint.
    """

    modes: ModeNumbers = (1,)
    """Numbers of modes; 1 is the first that deforms the joint. Which modes friction damps."""
    methods: BackboneMethods = ("quasi_static", "prescribed")
    """Quasi-static modal analysis; the nonlinear mode from cycles with its motion prescribed, and
    by harmonic balance. Cheap, and accurate, and dear."""
    smallest: Number = Field(default=1e-5, gt=0, lt=1)
    """Smallest amplitude over the one whose inertia opens the joint. Begin of the curve."""
    largest: Number = Field(default=MOST_OF_OPENING, gt=0, lt=1)
    """Largest amplitude over that one. End of the curve."""
    count: Count = Field(default=30, ge=2, le=1000)
    """How many amplitudes, evenly spaced in their logarithm. Time in proportion."""
    steps: Count = Field(default=100, ge=20, le=100_000, multiple_of=4)
    """Load steps per cycle, a multiple of 4. Accuracy of the damping; time in proportion."""
    max_cycles: Count = Field(default=4, ge=2, le=1000)
    """Cycles at most until one repeats the last. Large amplitudes settle slowly."""
    harmonics: Count = Field(default=5, ge=1, le=50)
    """Harmonics beside the mean, of "harmonic". Accuracy where pairs open."""

    @model_validator(mode="after")
    def _ascending(self) -> Self:
        check_distinct("methods", self.methods)
        check_distinct("modes", self.modes)
        if self.largest <= self.smallest:
            raise Rule("largest", f"must be above analysis.backbone.smallest, {self.smallest:g}")
        return self


class TimeAnalysis(AscendingBand):
    """Steady states by time integration with full contact: the truth at a few frequencies."""

    section: ClassVar[str] = "analysis.time"

    steps: StepsPerCycle = 150
    """Time steps per cycle that a steady state is sought with. Time goes in proportion."""
    step_refinement: bool = Field(default=True, strict=True)
    """A steady state is sought on from there with eight times the steps, with 16 and 32 where these matter:
    that says what the steps do, and makes it less. As much time again or more; without it nothing says so."""
    positions: Positions | None = None
    """Where slip and gap are reported, from the middle of the overlap; the edge of the clamp where
    left out. Results only."""
    max_cycles: Count = Field(default=400, ge=2, le=100_000)
    """Cycles at most at each frequency until the state repeats. Light damping needs many."""
    tolerance: Number = Field(default=1e-5, gt=0, lt=0.1)
    """The state repeats to this part of its motion. How steady a steady state is."""
    search: Literal["accelerated", "marched"] = "accelerated"
    """Newton's method, or cycle after cycle as in the laboratory. Marching shows what a
    slow sweep would reach."""
    starts: TimeStarts = ("raised",)
    """Where the search starts: at rest with the load "raised" slowly; at "rest" under the whole
    load; from the answer of the "reduced" model; from the steady state at the next frequency "below" or
    "above". Of several, every steady state that differs is reported. Near folds, and where pairs never
    slip."""

    @model_validator(mode="after")
    def _starts_somewhere(self) -> Self:
        check_distinct("starts", self.starts)
        if set(self.starts) <= {"below", "above"}:
            raise Rule(
                "starts",
                'are other frequencies only: add "raised", "rest" or "reduced", where those begin',
            )
        return self


class HarmonicAnalysis(AscendingBand):
    """Periodic responses by harmonic balance, at two frequencies or more, on every branch that the ends of
    the band lie on."""

    section: ClassVar[str] = "analysis.harmonic"

    harmonics: Harmonics = 5
    """Harmonics beside the mean, 1 to 101; or "adaptive": more at each point until the error of its
    amplitude is at most tolerance. Accuracy where pairs open."""
    tolerance: Number = Field(default=3e-3, gt=0, lt=1)
    """Estimated relative error of the amplitude at most. Only for harmonics = "adaptive"."""
    most: Count = Field(default=81, ge=5, le=101)
    """Harmonics at most; 41 without a motion over time beside. Only for harmonics = "adaptive"."""
    samples: Count | None = Field(default=None, ge=16, le=100_000)
    """Samples of the contact per cycle; left out: at least 128, and 24 per harmonic. Accuracy of
    the reactions."""
    stability: bool = Field(default=True, strict=True)
    """Whether small disturbances of each response decay is found out. Half of the time; without it
    no branch is marked unstable."""

    @property
    def branch_harmonics(self) -> int:
        """Harmonics of the branch, from which adaptive ones are raised at each point."""
        return FEWEST_ADAPTIVE if self.harmonics == "adaptive" else self.harmonics

    @model_validator(mode="after")
    def _a_branch_has_two_ends(self) -> Self:
        if len(self.band()) < 2:
            raise Rule(
                "frequencies",
                "a branch is followed from the first to the last of them: give two or more",
            )
        return self

    @model_validator(mode="after")
    def _resolved(self) -> Self:
        for key in ("tolerance", "most"):
            if self.harmonics != "adaptive" and key in self.model_fields_set:
                raise Rule(
                    key, 'is only for harmonics = "adaptive": remove it, or change harmonics'
                )
        needed = SAMPLES_OF_A_HARMONIC * self.branch_harmonics
        if self.samples is not None and self.samples < needed:
            raise Rule(
                "samples",
                f"per cycle do not resolve {self.branch_harmonics} harmonics: take at least "
                f"{needed}, or fewer harmonics",
            )
        return self


class Requests(Section):
    """The table `[analysis]`: what to compute. A section left out is not computed."""

    cycle: CycleAnalysis | None = None
    response: ResponseAnalysis | None = None
    reduced: ReducedAnalysis = Field(default_factory=ReducedAnalysis)
    backbone: BackboneAnalysis | None = None
    harmonic: HarmonicAnalysis | None = None
    time: TimeAnalysis | None = None
    history: Annotated[
        tuple[AnyExcitation, ...], list_of_sections(1000, "must be sections, [[analysis.history]]")
    ] = ()

    @property
    def asked(self) -> tuple[str, ...]:
        """Names of the analyses asked for; `reduced` holds settings of the response and is none.

        Examples
        --------
        >>> Requests(cycle={}, time={"frequencies": 170}).asked
        ('cycle', 'time')
        """
        names = (name for name in type(self).model_fields if name != "reduced")
        return tuple(name for name in names if getattr(self, name, None))

    @model_validator(mode="after")
    def _distinct_names(self) -> Self:
        labels = [entry.label for entry in self.history]
        for k, label in enumerate(labels):
            if label in labels[:k]:
                raise Rule(f"history.{k}.name", f"two histories are called {label!r}: give names")
        return self


def cycles_and_response() -> Requests:
    """What is computed where the file has no `[analysis]`."""
    return Requests(cycle=CycleAnalysis(), response=ResponseAnalysis())


# Sections from outside. `Requests` stays one class, so that joints pickle and `isinstance` holds; a
# model that holds it has compiled its fields and is compiled anew with them.

_Holder = TypeVar("_Holder", bound=type[BaseModel])
_HOLDERS: list[type[BaseModel]] = []
_ADDED: set[str] = set()


def holds_requests(model: _Holder) -> _Holder:
    """Class decorator of a description with a field of `Requests`: it takes sections added later."""
    _HOLDERS.append(model)
    return model


def add_section(name: str, model: type[Section]) -> None:
    """Let joint files have an optional section `[analysis.NAME]`.

    Files that are read from then on may have it; ``joint.analysis.NAME`` is None for those that do
    not.

    Parameters
    ----------
    name : str
        Key in the file and attribute of `Requests`.
    model : type of Section
        What the section may hold. Defined at the top of a module, where joints are to be pickled.

    Raises
    ------
    ValueError
        Where the name is taken, or cannot be an attribute.

    Examples
    --------
    >>> class Toy(Section):
    ...     count: Count = Field(default=3, ge=1)
    >>> add_section("toy", Toy)
    >>> Requests.model_validate({"toy": {"count": 5}}).toy
    Toy(count=5)
    >>> remove_section("toy")
    """
    if not name.isidentifier() or keyword.iskeyword(name) or name.startswith("_"):
        raise ValueError(f"{name!r} cannot be the name of a section")
    if name in Requests.model_fields or hasattr(Requests, name):
        raise ValueError(f"there is an analysis.{name} already")
    model.model_rebuild()  # one that is not complete fails here, where nothing has changed yet
    annotation: Any = model | None
    Requests.model_fields[name] = FieldInfo.from_annotated_attribute(annotation, None)
    setattr(Requests, name, None)  # for joints that were read before
    _ADDED.add(name)
    _rebuild()


def remove_section(name: str) -> None:
    """Take back what `add_section` added.

    Raises
    ------
    ValueError
        Where no section of that name was added.
    """
    if name not in _ADDED:
        raise ValueError(f"no section analysis.{name} was added")
    _ADDED.remove(name)
    del Requests.model_fields[name]
    delattr(Requests, name)
    _rebuild()


def _rebuild() -> None:
    models: list[type[BaseModel]] = [Requests, *_HOLDERS]
    for model in models:
        model.model_rebuild(force=True)
