"""What runs found, side by side: what belongs together, and the numbers of each."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from microslip.analyses.reduced.response import Response
from microslip.analyses.reduced.table import EquivalentTable
from microslip.describe.outputs import NamedOutput
from microslip.describe.ports import KINDS, KINDS_OF_THE_WHOLE
from microslip.errors import InputError
from microslip.pipeline.run import Run
from microslip.results.cycle import table_of
from microslip.results.response import beside_unconverged, has_peak, peak_outputs

NO_PEAK = "no peak in the band"

NO_LIMIT = "none"
"""Said of the load that opens a joint which no load opens."""


@dataclass(frozen=True)
class Named:
    """A run and what it is called beside others.

    Attributes
    ----------
    name : str
        Of its folder.
    run : Run
    """

    name: str
    run: Run

    @property
    def label(self) -> str:
        """Name and title, for legends."""
        title = self.run.joint.title
        return f"{self.name}: {title}" if title else self.name


@dataclass(frozen=True)
class Quantity:
    """One number of every run.

    Attributes
    ----------
    name : str
    unit : str
        Empty where it has none.
    values : tuple of float or str or None
        In the order of the runs: None where a run did not look for it, words where it did and there
        is none.
    bounds : tuple of bool
        Whether a value is only a lower bound.
    """

    name: str
    unit: str
    values: tuple[float | str | None, ...]
    bounds: tuple[bool, ...] = ()

    def changes(self) -> tuple[float, ...]:
        """Relative change of each value from the first run's; nan where one of the two is no number.

        Examples
        --------
        >>> Quantity("peak", "Hz", (200.0, 190.0, None)).changes()
        (0.0, -0.05, nan)
        """
        first = self.values[0]
        return tuple(_change(first, value) for value in self.values)


def _change(first: float | str | None, value: float | str | None) -> float:
    if isinstance(first, float) and isinstance(value, float) and first != 0:
        return (value - first) / abs(first)
    return math.nan


# -- what belongs together ---------------------------------------------------------------------


@dataclass(frozen=True)
class Curve:
    """What a forced response is matched by.

    Attributes
    ----------
    variant : str
        Of the reduced model.
    kind : str
        Key that gives the load, the same in all runs that are driven by one kind of load; else that of
        its amplitude, as ``moment``.
    load : float
        Value of that key, six digits.
    whole : bool
        Whether it is of a whole structure, and not per metre of width.

    Examples
    --------
    >>> Curve("refined", "force", 20.0).load_label
    'F = 20 N/m'
    """

    variant: str
    kind: str
    load: float
    whole: bool = False

    @property
    def load_label(self) -> str:
        """The load as the files give it."""
        if self.kind == "rho":
            return f"rho = {self.load:g}"
        if self.kind == "moment_over_clamp_force_length":
            return f"M/(PL) = {self.load:g}"
        kinds = KINDS_OF_THE_WHOLE if self.whole else KINDS
        said = next(said for said in kinds.values() if said.key == self.kind)
        return f"{said.symbol} = {self.load:g} {said.unit}"


def curves(runs: Sequence[Named]) -> list[dict[Curve, Response]]:
    """Forced responses of every run by what they are matched by.

    Loads of one kind, moments say, match where files that give them by the same key give the same
    value; else where their amplitudes are the same. Those of two kinds never match; ends at which a
    force acts are keys of the joint files, which are compared by themselves.
    """
    keys: dict[str, set[str]] = {}
    for joint in (each.run.joint for each in runs if each.run.responses):
        own = joint.driven.load.key
        keys.setdefault(own, set()).add(own if joint.load is None else joint.load.kind)
    shared = {own: given.pop() if len(given) == 1 else own for own, given in keys.items()}
    found = []
    for each in runs:
        kind = shared.get(each.run.joint.driven.load.key, "")
        whole = each.run.joint.whole
        found.append(
            {Curve(r.variant, kind, _load(each.run, r, kind), whole): r for r in each.run.responses}
        )
    return found


def _load(run: Run, response: Response, kind: str) -> float:
    ratio = response.load / run.assembly.moment_unit
    values = {"rho": response.rho, "moment_over_clamp_force_length": ratio}
    return float(f"{values.get(kind, response.load):.6g}")


def shared_output(runs: Sequence[Named], static: bool = False) -> NamedOutput | None:
    """The first output of the first run that all others have by its name and quantity.

    Parameters
    ----------
    runs : sequence of Named
    static : bool
        Whether rates, which quasi-static cycles do not know, are left out.
    """
    others = [{(o.name, o.quantity) for o in each.run.joint.outputs} for each in runs[1:]]
    for output in runs[0].run.joint.outputs:
        if static and output.measured.order:
            continue
        if all((output.name, output.quantity) in other for other in others):
            return output
    return None


def named_output(run: Run, output: NamedOutput) -> NamedOutput:
    """A run's own output of the name of another run's."""
    return next(own for own in run.joint.outputs if own.name == output.name)


# -- what was found ----------------------------------------------------------------------------


def quantities(runs: Sequence[Named]) -> list[Quantity]:
    """Frequencies, opening load, greatest damping, peaks and backbones, side by side.

    Those that only one run looked for are left out, but for peaks: a load that has no partner is listed
    with a gap.
    """
    found = [*_joint(runs), *_damping(runs), *_peaks(runs), *_backbones(runs)]
    return [row for row in found if any(value is not None for value in row.values)]


def _joint(runs: Sequence[Named]) -> Iterator[Quantity]:
    every = [each.run for each in runs]
    yield Quantity("sliding frequency", "Hz", tuple(r.mode.sliding_frequency for r in every))
    yield Quantity("stuck frequency", "Hz", tuple(r.mode.stuck_frequency for r in every))
    yield from _opening(every)
    peak = tuple(float(r.prestress.pressure.max()) / 1e6 for r in every)
    yield Quantity("peak pressure, clamp alone", "MPa", peak)


def _opening(runs: Sequence[Run]) -> Iterator[Quantity]:
    """Amplitude that opens the joint, of every kind of load that drives more than one run."""
    for said in dict.fromkeys((*KINDS.values(), *KINDS_OF_THE_WHOLE.values())):
        limits = [r.assembly.opening_moment if r.joint.driven.load == said else None for r in runs]
        if sum(limit is not None for limit in limits) < 2:
            continue
        yield Quantity(f"opening {said.key}", said.unit, tuple(map(_limit, limits)))
        if said.key == "moment":
            units = (r.assembly.moment_unit for r in runs)
            ratios = [m if m is None else m / PL for m, PL in zip(limits, units, strict=True)]
            yield Quantity("opening M/(PL)", "", tuple(map(_limit, ratios)))


def _limit(amplitude: float | None) -> float | str | None:
    if amplitude is None:
        return None
    return float(amplitude) if math.isfinite(amplitude) else NO_LIMIT


def _damping(runs: Sequence[Named]) -> Iterator[Quantity]:
    """Greatest equivalent damping of every drive that more than one run has cycles of."""
    for drive in (*(said.key for said in KINDS.values()), "mode"):
        tables = [_table(each.run, drive) for each in runs]
        if sum(table is not None for table in tables) > 1:
            best = tuple(None if t is None else float(np.max(t.gamma_eq)) for t in tables)
            yield Quantity(f"greatest gamma_eq, {drive}-driven", "", best)


def _table(run: Run, drive: str) -> EquivalentTable | None:
    """Equivalent table of the mode, or of the driven port where its load has that key."""
    if drive == "mode":
        return table_of(run, drive)
    joint = run.joint
    return table_of(run, joint.drive_named("load")) if joint.driven.load.key == drive else None


def _peaks(runs: Sequence[Named]) -> Iterator[Quantity]:
    """Frequency of every peak, and the output that all have there."""
    answered = [each for each in runs if each.run.responses]
    if len(answered) < 2:
        return
    by_run = curves(runs)
    output = shared_output(answered)
    several = len({curve.variant for found in by_run for curve in found}) > 1
    for curve in dict.fromkeys(curve for found in by_run for curve in found):
        mine = [found.get(curve) for found in by_run]
        name = f"{curve.load_label}, {curve.variant}" if several else curve.load_label
        bounds = tuple(r is not None and has_peak(r) and beside_unconverged(r) for r in mine)
        yield Quantity(f"peak, {name}", "Hz", tuple(_frequency(r) for r in mine))
        if output is not None:
            sizes = tuple(_size(e.run, r, output) for e, r in zip(runs, mine, strict=True))
            label = f"{output.name} there"
            yield Quantity(label, output.measured.shown, sizes, bounds)


def _frequency(response: Response | None) -> float | str | None:
    if response is None:
        return None
    return float(response.peak_frequency) if has_peak(response) else NO_PEAK


def _size(run: Run, response: Response | None, output: NamedOutput) -> float | None:
    if response is None or not has_peak(response):
        return None
    size = peak_outputs(run, response).get(named_output(run, output).key)
    return None if size is None else float(size)


def _backbones(runs: Sequence[Named]) -> Iterator[Quantity]:
    """Of modes and methods that more than one run has: greatest damping ratio, lowest frequency."""
    by_run = [
        {(b.mode.number, b.method): b for b in each.run.backbones if b.points} for each in runs
    ]
    for key in dict.fromkeys(key for found in by_run for key in found):
        mine = [found.get(key) for found in by_run]
        if sum(backbone is not None for backbone in mine) < 2:
            continue
        name = f"mode {key[0]}, {key[1].replace('_', '-')}"
        lowest = tuple(None if b is None else float(b.frequency.min()) for b in mine)
        greatest = tuple(None if b is None else float(100 * b.damping_ratio.max()) for b in mine)
        yield Quantity(f"{name}: lowest frequency", "Hz", lowest)
        yield Quantity(f"{name}: greatest damping", "%", greatest)


def names_of(folders: Sequence[Path]) -> tuple[str, ...]:
    """What runs are called: their folders, as short as tells them apart.

    Parameters
    ----------
    folders : sequence of pathlib.Path

    Raises
    ------
    InputError
        Where a folder is given twice.

    Examples
    --------
    >>> names_of([Path("a/out"), Path("b/out")])
    ('a/out', 'b/out')
    """
    whole = [folder.resolve() for folder in folders]
    for i, folder in enumerate(whole):
        if folder in whole[:i]:
            raise InputError(f"{folders[i]}: is given twice; name folders of different runs")
    names = ["/".join(folder.parts[-1:]) for folder in whole]
    depth = 1
    while len(set(names)) < len(names):
        depth += 1
        names = ["/".join(folder.parts[-depth:]) for folder in whole]
    return tuple(names)
