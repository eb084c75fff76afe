"""What each correction to the paper is worth: one misprint put back at a time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from microslip.analyses.reduced.response import forced_response
from microslip.analyses.reduced.sweep import CONVERGED
from microslip.analyses.reduced.table import EquivalentTable
from microslip.analyses.reduced.two_mode import TwoModeModel, two_mode_model
from microslip.reproduce.fig11 import time_frequencies
from microslip.reproduce.friction_force import friction_table
from microslip.reproduce.peaks import time_domain_peak
from microslip.reproduce.plate import Plate
from microslip.reproduce.study import Study
from microslip.results.response import beside_unconverged
from microslip.show.plots.style import DOUBLE, MM, SERIES, house_style, letters, new_figure

OTHER_BETA = 4.44e-6
"""s, the second of the paper's two constants."""

Model = tuple[TwoModeModel, EquivalentTable]


@dataclass(frozen=True)
class Erratum:
    """One thing taken as printed in a model that is otherwise corrected.

    Attributes
    ----------
    name, printed : str
        Short name, and what is printed against what is right.
    build : callable
        The model with it.
    against : str
        The corrected model it is compared with: ``consistent`` or ``printed form``.
    """

    name: str
    printed: str
    build: Callable[[Study], Model]
    against: str = "consistent"


def _model(study: Study, variant: str, table: str = "mode") -> Model:
    return two_mode_model(study.assembly.prepared, variant), study.tables[table]


def _friction_alone(study: Study) -> EquivalentTable:
    a = study.assembly
    return friction_table(
        study.tables["mode"], study.run.cycles["mode"], a.structure.interface, a.states, a.prepared
    )


def _eq7(study: Study) -> Model:
    model, table = _model(study, "consistent")
    return model, replace(table, gamma_eq=table.gamma_eq / model.omega)


def _eq10(study: Study) -> Model:
    model, table = _model(study, "consistent")
    return model, replace(table, k_eq=np.pi * table.k_eq)


def _eq13(study: Study) -> Model:
    model, table = _model(study, "printed")
    return replace(model, m=np.array([[1.0, 1.0], [model.m[1, 0], 1.0]])), table


def _eq14(study: Study) -> Model:
    model, table = _model(study, "printed")
    stuck = model.k[1, 1]
    return replace(model, k=np.array([[model.k[0, 0], stuck], [stuck, stuck]])), table


def _eq16(study: Study) -> Model:
    return _model(study, "printed")


def _beta(study: Study) -> Model:
    model, table = _model(study, "consistent")
    return replace(model, rayleigh=(model.rayleigh[0], OTHER_BETA)), table


def _alone(study: Study) -> Model:
    return _model(study, "consistent")[0], _friction_alone(study)


def _drive(study: Study) -> Model:
    return _model(study, "consistent", "moment")


def _as_meant(study: Study) -> Model:
    return _model(study, "printed", "friction")


ERRATA: tuple[Erratum, ...] = (
    Erratum("eq. (7)", "γ_eq = W_c/(π ω_n q) for W_c/(π q) beside k in 1/s²", _eq7),
    Erratum("eq. (10)", "k_eq = W_s/q for W_s/(π q)", _eq10),
    Erratum("eq. (13)", "1 for the overlap above the diagonal of m", _eq13, "printed form"),
    Erratum("eq. (14)", "Φ_stᵀKΦ_st for Φ_slᵀKΦ_st off the diagonal of k", _eq14, "printed form"),
    Erratum("eqs. (15), (16)", "a scalar times I for the projected force", _eq16),
    Erratum("β = 4.44e-6 s", "section 2.3, for 7.3e-7 s of section 2.1", _beta),
    Erratum("friction alone", "F_f without the change of pressure", _alone),
    Erratum("moment-driven", "cycles under the end moment for inertia of the mode", _drive),
    Erratum("the method as meant", "(16), friction alone and moment-driven at once", _as_meant),
)


@house_style
def errata(study: Study) -> Plate:
    """Peak and resonance of the model with each erratum, against the time domain."""
    rhos = study.settings.response_rhos
    reference = {
        "consistent": {rho: _error(study, _model(study, "consistent"), rho) for rho in rhos},
        "printed form": {rho: _error(study, _model(study, "printed"), rho) for rho in rhos},
    }
    effect = {e.name: {rho: _error(study, e.build(study), rho) for rho in rhos} for e in ERRATA}
    figure = new_figure(DOUBLE, 95 * MM)
    left, right = figure.subplots(1, 2, sharey=True)
    names = ["corrected", *effect]
    rows = [reference["consistent"], *effect.values()]
    for i, rho in enumerate(rhos):
        style = {**SERIES[i], "ls": "", "label": rf"$\rho$ = {rho:g}"}
        y = np.arange(len(rows)) + 0.22 * (i - 1)
        left.plot([_percent(row[rho]["peak_error"]) for row in rows], y, **style)
        right.plot([_finite(row[rho]["resonance_error_hz"]) for row in rows], y, **style)
    left.set_xscale("symlog", linthresh=10)
    right.set_xscale("symlog", linthresh=1)
    left.set_yticks(np.arange(len(names)), names)
    left.set_ylim(len(names) - 0.5, -0.5)
    left.set_xlabel("error of the peak |q| (%)")
    right.set_xlabel("error of the resonance (Hz)")
    for ax in (left, right):
        ax.axvline(0, color="k", lw=0.6)
    letters((left, right))
    figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return Plate(
        figure,
        "Error of (a) the peak amplitude and (b) the resonance frequency against the time domain, "
        "for the consistent model with the mode-driven table and for the same with one thing as "
        "printed; (13) and (14) belong to the printed form. Linear within ±10 % and ±1 Hz.",
        data={
            "corrected": _rows(reference["consistent"]),
            "printed form": _rows(reference["printed form"]),
            **{
                e.name: {"printed": e.printed, "against": e.against, **_rows(effect[e.name])}
                for e in ERRATA
            },
        },
    )


def _rows(found: dict[float, dict[str, Any]]) -> dict[str, Any]:
    return {f"rho_{rho:g}": value for rho, value in found.items()}


def _percent(value: float | None) -> float:
    return np.nan if value is None else 100 * value


def _finite(value: float | None) -> float:
    return np.nan if value is None else value


def _error(study: Study, model: Model, rho: float) -> dict[str, Any]:
    """Errors of peak, resonance and band; None where the model has no answer there.

    A peak next to points without an answer is a bound.
    """
    truth = time_domain_peak(study, rho)
    points = study.time_points(rho, time_frequencies(study, rho))
    frequency = np.array([p.steady.frequency for p in points])
    band = np.unique(np.r_[study.settings.response_band(), frequency])
    response = forced_response(*model, band, study.moment(rho))
    good = response.flag == CONVERGED
    row: dict[str, Any] = {"no_answer_share": float((~good).mean())}
    if not good.any():
        return {**row, "peak_error": None, "resonance_error_hz": None}
    at = np.searchsorted(band, frequency)
    size = np.abs(response.amplitude[at]) / [abs(p.steady.amplitude) for p in points] - 1
    size = np.abs(size[good[at]])
    return {
        **row,
        "peak_error": response.peak_amplitude / truth.amplitude - 1,
        "resonance_error_hz": response.peak_frequency - truth.frequency,
        "bound": beside_unconverged(response),
        "median_error": float(np.median(size)) if len(size) else None,
        "worst_error": float(size.max()) if len(size) else None,
    }
