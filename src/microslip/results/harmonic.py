"""Results of harmonic balance by name: every response as a row, and all of them as a dataset."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import xarray as xr

from microslip.analyses.harmonic.hill import HillExponents
from microslip.analyses.harmonic.response import HarmonicPoint
from microslip.analyses.time.readings import equivalent_of
from microslip.contact.pairs import touches
from microslip.pipeline.harmonic import HarmonicRun
from microslip.pipeline.outputs import harmonics_by_name
from microslip.pipeline.run import Run
from microslip.results.labels import (
    MODAL,
    load_entry,
    load_named,
    load_variable,
    pair_position,
    rho_entry,
    rho_of,
    variable,
)
from microslip.results.outputs import (
    PARTS,
    lags,
    modal_factor,
    output_coordinates,
    output_variable,
    sizes,
    stacked,
)
from microslip.typing import Complex

Entry = tuple[HarmonicRun, int, HarmonicPoint, HillExponents | None]


def entries(run: Run) -> Iterator[Entry]:
    """Every response with its load, its branch and its stability."""
    for entry in run.harmonic:
        yield from (
            (entry, branch, point, stability)
            for branch, point, stability in zip(
                entry.response.branch_of, entry.points, entry.stability, strict=True
            )
        )


def harmonic_rows(run: Run) -> list[dict[str, Any]]:
    """Entries of the summary, load by load in order along the branches."""
    return [_row(run, *entry) for entry in entries(run)]


def _row(
    run: Run,
    entry: HarmonicRun,
    branch: int,
    point: HarmonicPoint,
    stability: HillExponents | None,
) -> dict[str, Any]:
    found = equivalent_of(point.amplitude, point.frequency, point.load, run.prepared)
    first = {name: y[1] for name, y in outputs_of(run, point).items()}
    slowest = None if stability is None or not len(stability.exponents) else _slowest(stability)
    return {
        **rho_entry(entry.rho),
        **load_entry(run, entry.load),
        "frequency_hz": point.frequency,
        "modal_amplitude": abs(point.amplitude),
        "phase_rad": point.phase,
        "dissipated_energy_j_per_m": point.dissipated,
        "stored_energy_j_per_m": found.stored,
        "k_eq": found.k_eq,
        "gamma_eq": found.gamma_eq,
        "external_work_j_per_m": point.external_work,
        "material_damping_j_per_m": point.material_work,
        "normal_work_j_per_m": point.normal_work,
        "branch": branch,
        "stable": None if stability is None else stability.stable,
        "growth_rate_per_s": None if slowest is None else slowest.real,
        "joint_opens": opens(point),
        "harmonics": point.harmonics,
        "tail": point.tail,
        "estimated_error": point.error if np.isfinite(point.error) else None,
        "walk_m_per_cycle": point.walk,
        "walked_m": point.walked,
        "residual_max": point.residual,
        "iterations": point.iterations,
        "seconds": point.seconds,
        "outputs": sizes(run, first),
        "phases_deg": lags(run, first),
    }


def outputs_of(run: Run, point: HarmonicPoint) -> dict[str, Complex]:
    """Mean and harmonics of every output of a response, by name."""
    omega = 2 * np.pi * point.frequency
    h = np.arange(point.harmonics + 1)
    return harmonics_by_name(run.assembly, point.output, omega, h)


def opens(point: HarmonicPoint) -> bool:
    """Whether at some time no pair touches."""
    return bool((~touches(point.status)).all(axis=0).any())


def _slowest(stability: HillExponents) -> complex:
    """The exponent that grows fastest or decays slowest."""
    return complex(stability.exponents[np.argmax(stability.exponents.real)])


def fold_rows(run: Run) -> list[dict[str, Any]]:
    """Where the branches turn round."""
    return [
        {
            **rho_entry(entry.rho),
            **load_entry(run, entry.load),
            "frequency_hz": fold.frequency,
            "modal_amplitude": abs(fold.amplitude),
            "phase_rad": fold.phase,
            "harmonics": fold.harmonics,
            "residual_max": fold.residual,
            "outputs": sizes(run, {n: y[1] for n, y in outputs_of(run, fold).items()}),
        }
        for entry in run.harmonic
        for fold in entry.response.folds
    ]


_COLUMNS = {
    "modal_amplitude": ("modal_amplitude", MODAL, "first harmonic of q"),
    "phase": ("phase_rad", "rad", "phase of q to the load"),
    "k_eq": ("k_eq", "1", "equivalent stiffness over omega_sl^2"),
    "gamma_eq": ("gamma_eq", "1", "equivalent damping over omega_sl^2"),
    "dissipated_energy": ("dissipated_energy_j_per_m", "J/m", "friction work per cycle"),
    "stored_energy": ("stored_energy_j_per_m", "J/m", "mean stored energy of the contact"),
    "external_work": ("external_work_j_per_m", "J/m", "work of the load per cycle"),
    "material_damping": ("material_damping_j_per_m", "J/m", "loss in the material per cycle"),
    "normal_work": (
        "normal_work_j_per_m",
        "J/m",
        "work of the normal reactions per cycle: an error of truncation",
    ),
    "growth_rate": ("growth_rate_per_s", "1/s", "real part of the least stable exponent"),
    "tail": ("tail", "1", "share of the last two harmonics in the vibrating reactions"),
    "estimated_error": (
        "estimated_error",
        "1",
        "estimated relative error of the amplitude by the harmonics; nan where not asked for",
    ),
    "walk": ("walk_m_per_cycle", "m", "drift of the bodies past each other per cycle"),
    "walked": (
        "walked_m",
        "m",
        "where the bodies stand past each other, from where they were clamped",
    ),
    "residual_max": ("residual_max", "1", "largest residual over the largest prestress reaction"),
    "seconds": ("seconds", "s", "time it took"),
}
_COUNTS = {
    "branch": ("branch", "which branch of its load the response is on"),
    "harmonics": ("harmonics", "harmonics beside the mean"),
    "iterations": ("iterations", "Newton steps"),
}
STABILITY = {False: 0, True: 1, None: 2}


def harmonic_datasets(run: Run) -> dict[str, xr.Dataset]:
    """The group ``harmonic``."""
    return {"harmonic": _dataset(run)} if any(entry.points for entry in run.harmonic) else {}


def _dataset(run: Run) -> xr.Dataset:
    """All responses, the branches as they were followed, and their folds."""
    rows, folds = harmonic_rows(run), fold_rows(run)
    points = [point for _, _, point, _ in entries(run)]
    each = ("point",)
    sliding = run.model.port("sliding")
    most = max((point.harmonics for point in points), default=0)
    Q = np.full((len(points), most + 1), np.nan + 0j)
    for k, point in enumerate(points):
        Q[k, : point.harmonics + 1] = point.output[:, sliding]
    Y = np.full((len(points), len(run.joint.outputs), most + 1), np.nan + 0j)
    for k, point in enumerate(points):
        Y[k, :, : point.harmonics + 1] = stacked(run, outputs_of(run, point), 0)

    def column(of: list[dict[str, Any]], key: str) -> Any:
        return np.array([np.nan if row[key] is None else row[key] for row in of], dtype=float)

    area = run.model.area
    data = {
        **{
            name: variable(
                each,
                column(rows, key),
                unit,
                label,
                **(modal_factor(run) if name == "modal_amplitude" else {}),
            )
            for name, (key, unit, label) in _COLUMNS.items()
        },
        **{
            name: variable(each, np.array([r[key] for r in rows], dtype=np.int64), "1", label)
            for name, (key, label) in _COUNTS.items()
        },
        "stable": variable(
            each,
            np.array([STABILITY[row["stable"]] for row in rows], np.int8),
            "1",
            "whether small disturbances decay",
            flag_values=np.array([0, 1, 2], np.int8),
            flag_meanings="unstable stable unknown",
        ),
        "joint_opens": variable(
            each,
            np.array([row["joint_opens"] for row in rows], np.int8),
            "1",
            "whether at some time no pair touches",
        ),
        "q_harmonics": variable(
            ("point", "harmonic", "part"),
            np.stack([Q.real, Q.imag], axis=-1),
            MODAL,
            "mean and harmonics of q: q = mean + sum Im(Q_h exp(i h theta)); nan beyond the last",
        ),
        "output_harmonics": output_variable(
            ("point", "output", "harmonic"),
            Y,
            "mean and harmonics of the output from prestress; nan beyond the last",
        ),
        "dissipation": variable(
            ("point", "pair"),
            np.array([point.friction_work / area for point in points]).reshape(-1, len(area)),
            "J/m^2",
            "friction work per cycle and area",
        ),
        "fold_amplitude": variable(
            ("fold",), column(folds, "modal_amplitude"), MODAL, "first harmonic of q at the fold"
        ),
        **_branches(run),
    }
    coords = (
        pair_position(run)
        | output_coordinates(run)
        | {
            "frequency": variable(
                each, column(rows, "frequency_hz"), "Hz", "frequency of the load"
            ),
            **rho_of(each, [entry.rho for entry, *_ in entries(run)]),
            load_named(run): load_variable(run, each, [entry.load for entry, *_ in entries(run)]),
            "harmonic": variable(("harmonic",), np.arange(most + 1), "1", "0 is the mean"),
            "part": PARTS,
            "fold_frequency": variable(
                ("fold",), column(folds, "frequency_hz"), "Hz", "frequency of the fold"
            ),
            load_named(run, "fold"): load_variable(
                run,
                ("fold",),
                [entry.load for entry in run.harmonic for _ in entry.response.folds],
                "amplitude of the {} at the fold",
            ),
        }
    )
    return xr.Dataset(data, coords)


def _branches(run: Run) -> dict[str, xr.Variable]:
    """The branches as they were followed, one after the other."""
    ways = [
        (entry.load, number, frequency, amplitude)
        for entry in run.harmonic
        for number, (frequency, amplitude) in enumerate(entry.curves)
    ]
    dims = ("branch_point",)

    def joined(parts: list[Any]) -> Any:
        return np.concatenate(parts) if parts else np.zeros(0)

    sizes = [len(frequency) for _, _, frequency, _ in ways]
    amplitude = joined([q for *_, q in ways])
    return {
        load_named(run, "branch"): load_variable(
            run, dims, np.repeat([load for load, *_ in ways], sizes), "{} of the branch"
        ),
        "branch_number": variable(
            dims, np.repeat([n for _, n, *_ in ways], sizes), "1", "which branch of its load"
        ),
        "branch_frequency": variable(
            dims, joined([f for _, _, f, _ in ways]), "Hz", "frequency along the branch"
        ),
        "branch_amplitude": variable(
            dims, np.abs(amplitude), MODAL, "first harmonic of q along the branch"
        ),
        "branch_phase": variable(dims, np.angle(amplitude), "rad", "phase of q along the branch"),
        **_along_branches(run),
    }


def branch_outputs(run: Run, entry: HarmonicRun) -> list[dict[str, Complex]]:
    """First harmonics of every output along each branch of a load, by name."""
    return [
        harmonics_by_name(run.assembly, motion, 2 * np.pi * frequency)
        for (frequency, _), motion in zip(entry.curves, entry.motions, strict=True)
    ]


def _along_branches(run: Run) -> dict[str, xr.Variable]:
    if not all(entry.motions for entry in run.harmonic):
        return {}
    parts = [stacked(run, y, -1) for entry in run.harmonic for y in branch_outputs(run, entry)]
    label = "first harmonic of the output along the branch"
    dims = ("branch_point", "output")
    return {"branch_output": output_variable(dims, np.concatenate(parts), label)}
