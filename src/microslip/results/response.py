"""Forced responses by name: rows of the summary, and a dataset."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import xarray as xr

from microslip.analyses.reduced.response import CONVERGED, Response
from microslip.pipeline.checked import worst_of
from microslip.pipeline.loads import frictionless_resonance
from microslip.pipeline.run import Run
from microslip.results.labels import (
    MODAL,
    load_entry,
    load_named,
    load_variable,
    rho_entry,
    rho_of,
    variable,
)
from microslip.results.outputs import (
    PARTS,
    modal_variable,
    output_coordinates,
    output_variable,
    sizes,
    stacked,
)
from microslip.typing import Array


def frictionless_peak(run: Run, load: float) -> float:
    """Modal amplitude of the joint without friction at its own resonance, under a load.

    Wherever that resonance lies; nan where no damping bounds it.
    """
    _, amplitude = frictionless_resonance(run.assembly, load)
    return amplitude if math.isfinite(amplitude) else math.nan


def response_rows(run: Run) -> list[dict[str, Any]]:
    """One entry of the summary per load and variant."""
    return [_row(run, response) for response in run.responses]


def band_rows(run: Run) -> list[dict[str, Any]]:
    """The band of the forced response, and what it follows from."""
    found = run.value("response")
    if found.axis is None:
        return []
    axis = found.axis
    return [
        {
            "from_hz": axis.low,
            "to_hz": axis.high,
            "points": len(axis.frequency),
            "origin": axis.origin,
        }
    ]


def has_peak(response: Response) -> bool:
    """Whether the largest answer is a peak: there is one, and it is not at an end of the band."""
    return bool((response.flag == CONVERGED).any()) and not response.peak_at_edge


def _row(run: Run, response: Response) -> dict[str, Any]:
    bad, good = response.unconverged, response.flag == CONVERGED
    any_answer, peaks = bool(good.any()), has_peak(response)
    unknown, folded = response.error_indicator, response.frequency[response.folded]
    errors = np.zeros(0) if unknown is None else unknown[good]
    larger = np.zeros(0) if response.larger is None else _answered(response.larger)
    peak = response.peak_amplitude if peaks else math.nan
    return {
        "variant": response.variant,
        "table": response.drive or None,
        **rho_entry(response.rho),
        run.joint.driven.load.row: response.load,
        **load_entry(run, response.load),
        "peak_frequency_hz": response.peak_frequency if peaks else math.nan,
        "peak_modal_amplitude": peak,
        "peak_amplitude_over_frictionless": peak / frictionless_peak(run, response.load),
        "peak_beside_unconverged": peaks and beside_unconverged(response),
        "peak_at_edge": any_answer and not peaks,
        "largest_at_hz": response.frequency[response.peak] if any_answer else math.nan,
        "largest_modal_amplitude": abs(response.amplitude[response.peak])
        if any_answer
        else math.nan,
        "opens_from_load": response.opening_load,
        "unconverged_points": len(bad),
        "unconverged_from_hz": bad.min() if len(bad) else None,
        "unconverged_to_hz": bad.max() if len(bad) else None,
        "two_motions_from_hz": folded.min() if len(folded) else None,
        "two_motions_to_hz": folded.max() if len(folded) else None,
        "larger_does_not_repeat_from_hz": larger.min() if len(larger) else None,
        "larger_does_not_repeat_to_hz": larger.max() if len(larger) else None,
        "points": len(response.frequency),
        "contraction_max": response.contraction.max(),
        "iterations_max": response.iterations.max(),
        "error_indicator_max": errors.max() if len(errors) else None,
        "error_indicator_median": np.median(errors) if len(errors) else None,
        "error_indicator_at_peak": unknown[response.peak]
        if peaks and unknown is not None
        else None,
        "checks": [
            {
                "frequency_hz": check.frequency,
                "modal_amplitude": abs(check.amplitude) if np.isfinite(check.doubt) else math.nan,
                "error": check.error,
                "doubt": check.doubt,
            }
            for check in response.checks
        ],
        "largest_error_found": worst_of(response) if response.checks else None,
        "steady_states": len(response.anchors),
        "unbounded_points": int(np.isinf(errors).sum()),
        "peak_outputs": peak_outputs(run, response) if any_answer else {},
        "peak_output_errors": {n: e[response.peak] for n, e in response.output_errors.items()}
        if any_answer
        else {},
    }


def _answered(response: Response) -> Array:
    """Frequencies that have an answer, Hz."""
    return response.frequency[response.flag == CONVERGED]


def peak_outputs(run: Run, response: Response) -> dict[str, float]:
    """Outputs at the peak: of its largest point, in proportion to the peak between the points."""
    size = abs(response.amplitude[response.peak])
    grow = response.peak_amplitude / size if size else 1.0
    return sizes(run, {n: grow * y[response.peak] for n, y in response.outputs.items()})


def beside_unconverged(response: Response) -> bool:
    """Whether the largest answer is next to a point without one, and so only a lower bound.

    Or next to one where only the smaller of two answers is known.
    """
    around = slice(max(response.peak - 1, 0), response.peak + 2)
    outgrown = response.outgrown is not None and response.outgrown[around].any()
    return bool((response.flag[around] != CONVERGED).any() or outgrown)


def response_datasets(run: Run) -> dict[str, xr.Dataset]:
    """The group ``response``: all curves over the same frequencies."""
    if not run.responses:
        return {}
    anchored = any(response.anchors for response in run.responses)
    return {"response": _dataset(run)} | ({"anchors": _anchors(run)} if anchored else {})


def _anchors(run: Run) -> xr.Dataset:
    """Steady states that the responses by methods "corrected" and "auto" pass through, load after load."""
    found = [(r.load, one) for r in run.responses for one in r.anchors]
    past = [one.past if r.variant == "auto" else np.nan for r in run.responses for one in r.anchors]
    dims, Q = ("anchor",), np.array([one.amplitude for _, one in found])
    missed = np.array([one.correction for _, one in found])
    return xr.Dataset(
        {
            "modal_amplitude": modal_variable(run, dims, np.abs(Q), "amplitude of q"),
            "phase": variable(dims, np.angle(Q), "rad", "phase of q to the load"),
            "stiffness_correction": variable(
                dims, missed.real, "1", "what the table misses of the equivalent stiffness"
            ),
            "damping_correction": variable(
                dims, missed.imag, "1", "what the table misses of the equivalent damping"
            ),
            "change": variable(
                dims, [one.change for _, one in found], "1", "change of the state over a cycle"
            ),
            "doubt": variable(
                dims, [one.doubt for _, one in found], "1", "relative error left of transients"
            ),
            "past_difference": variable(
                dims,
                past,
                "1",
                "relative difference to the amplitude after another past, of method auto",
            ),
            "scatter": variable(
                dims,
                [one.scatter for _, one in found],
                "1",
                "relative difference of amplitudes after the load was raised otherwise, of method auto",
            ),
            "varies": variable(
                dims,
                [one.varies for _, one in found],
                "1",
                "how far the amplitude strays from its mean from cycle to cycle for good, relative",
            ),
        },
        {
            "frequency": variable(dims, [one.frequency for _, one in found], "Hz", "frequency"),
            load_named(run): load_variable(run, dims, [load for load, _ in found]),
        },
    )


def _dataset(run: Run) -> xr.Dataset:
    responses = run.responses
    curves, grid = ("curve",), ("curve", "frequency")

    def stack(values: Sequence[Any]) -> Array:
        return np.stack([np.asarray(v) for v in values])

    data = {
        "modal_amplitude": modal_variable(
            run, grid, stack([np.abs(r.amplitude) for r in responses]), "amplitude of q"
        ),
        **_smaller(run, grid),
        **_larger(run, grid),
        **_outputs(run),
        "phase": variable(
            grid, stack([np.angle(r.amplitude) for r in responses]), "rad", "phase of q to the load"
        ),
        "iterations": variable(
            grid, stack([r.iterations for r in responses]), "1", "evaluations of the fixed point"
        ),
        "contraction": variable(
            grid, stack([r.contraction for r in responses]), "1", "contraction factor |g'|"
        ),
        "flag": variable(
            grid,
            stack([r.flag for r in responses]).astype(np.int8),
            "1",
            "what became of the point",
            flag_values=np.array([0, 1, 2], np.int8),
            flag_meanings="converged not_converged amplitude_above_table",
        ),
    }
    if any(r.error_indicator is not None for r in responses):
        unknown = np.full(len(responses[0].frequency), np.nan)
        estimates = [unknown if r.error_indicator is None else r.error_indicator for r in responses]
        data["error_indicator"] = variable(
            grid,
            stack(estimates),
            "1",
            "relative error of the amplitude: estimate; of methods corrected and auto a bound",
        )
    if any(r.varies is not None for r in responses):
        none = np.zeros(len(responses[0].frequency))
        data["variation"] = variable(
            grid,
            stack([none if r.varies is None else r.varies for r in responses]),
            "1",
            "part of error_indicator that is no error of the mean: what the amplitude is known to vary by "
            "from cycle to cycle, and for good; of methods corrected and auto",
        )
    if run.frictionless is not None:
        reference = run.frictionless
        data["frictionless_compliance"] = variable(
            ("frequency",),
            np.abs(reference.amplitude) / reference.load,
            f"{MODAL} / ({run.joint.driven.load.unit})",
            f"amplitude of q per {run.joint.driven.load.noun} without friction",
        )
    coords = output_coordinates(run) | {
        "part": PARTS,
        "frequency": variable(("frequency",), responses[0].frequency, "Hz", "frequency"),
        "variant": variable(
            curves, [r.variant for r in responses], "1", "variant of the reduced model"
        ),
        "table": variable(
            curves, [r.drive or "none" for r in responses], "1", "drive of the equivalent table"
        ),
        **rho_of(curves, [r.rho for r in responses]),
        load_named(run): load_variable(run, curves, [r.load for r in responses]),
    }
    attrs: dict[str, Any] = {"band": str(run.value("response").axis)}
    if run.joint.says_rho:
        attrs["rho_scale"] = run.rho_scale
    return xr.Dataset(data, coords, attrs)


def _smaller(run: Run, dims: tuple[str, ...]) -> dict[str, xr.Variable]:
    """Where folds have two motions, the smaller one."""
    others = [r.smaller for r in run.responses]
    return _others(run, dims, others, "smaller", "where a fold has two motions, {} of the smaller")


def _larger(run: Run, dims: tuple[str, ...]) -> dict[str, xr.Variable]:
    """Where a smaller motion is shown as the larger does not repeat, the larger, and how it varies."""
    others = [r.larger for r in run.responses]
    label = (
        "where the larger of two motions does not repeat and the smaller is shown, {} of the larger"
    )
    data = _others(run, dims, others, "larger", label)
    if data:
        varies = _answers_of(run, others, lambda r: np.nan if r.varies is None else r.varies)
        said = label.format("what the amplitude is known to vary by from cycle to cycle,")
        data["larger_variation"] = variable(dims, varies, "1", f"{said}; nan elsewhere")
    return data


def _others(
    run: Run, dims: tuple[str, ...], others: Sequence[Response | None], name: str, label: str
) -> dict[str, xr.Variable]:
    """First harmonics of other motions than those shown."""
    if not any(others):
        return {}
    values = _answers_of(run, others, lambda r: r.amplitude)
    label = f"{label}; nan elsewhere"
    amplitude = label.format("amplitude of q")
    return {
        f"{name}_modal_amplitude": modal_variable(run, dims, np.abs(values), amplitude),
        f"{name}_phase": variable(
            dims, np.angle(values), "rad", label.format("phase of q to the load")
        ),
    }


def _answers_of(
    run: Run, others: Sequence[Response | None], value: Callable[[Response], Any]
) -> Array:
    """A value of other motions than those shown, curve by curve; nan where there is none."""
    none = np.full(len(run.responses[0].frequency), np.nan)
    return np.array(
        [none if r is None else np.where(r.flag == CONVERGED, value(r), none) for r in others]
    )


def _outputs(run: Run) -> dict[str, xr.Variable]:
    """First harmonics of all outputs, absolute and per load."""
    if not all(response.outputs for response in run.responses):
        return {}
    dims, said = ("curve", "output", "frequency"), run.joint.driven.load
    values = np.stack([stacked(run, response.outputs, 0) for response in run.responses])
    load = np.array([response.load for response in run.responses])[:, None, None]
    known = [response.output_errors for response in run.responses]
    return {
        **(_output_errors(run, dims) if any(known) else {}),
        "output_amplitude": output_variable(
            dims, values, "first harmonic of the output: y = Im(Y exp(i omega t)), load a sine"
        ),
        f"output_per_{said.key}": output_variable(
            dims, values / load, f"first harmonic of the output per {said.noun}", said.unit
        ),
    }


def _output_errors(run: Run, dims: tuple[str, ...]) -> dict[str, xr.Variable]:
    """Bounds of all outputs of the curves that steady states put right; nan of others."""
    none = np.full((len(run.joint.outputs), len(run.responses[0].frequency)), np.nan)
    errors = [r.output_errors for r in run.responses]
    values = np.stack([stacked(run, one, 0) if one else none for one in errors])
    label = "bound of the relative error of the size of the first harmonic, of methods corrected and auto"
    return {"output_error": variable(dims, values, "1", label)}
