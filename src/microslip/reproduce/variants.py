"""The reduced models that the figures compare: every variant with every table.

The one place that knows how a variant is solved. A case is a variant of
`microslip.analyses.reduced.two_mode` with the table it reads; the first is what the paper prints,
friction alone under the end moment.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from microslip.analyses.reduced.curve import evaluate_curve, table_curve
from microslip.analyses.reduced.response import Response, all_amplitudes, forced_response
from microslip.analyses.reduced.sweep import CONVERGED, fixed_point, next_amplitude
from microslip.analyses.reduced.two_mode import VARIANTS, TwoModeModel, two_mode_model
from microslip.reproduce.settings import PORTS
from microslip.reproduce.study import Study
from microslip.typing import Array


@dataclass(frozen=True)
class Case:
    """A reduced model and its table."""

    variant: str
    table: str

    @property
    def key(self) -> str:
        """Name in files."""
        return f"{self.variant}, {self.table}"

    @property
    def label(self) -> str:
        """Name in figures."""
        return f"{self.variant}, {_TABLES[self.table]}"


_TABLES = {
    "friction": "moment-driven, friction alone",
    "moment": "moment-driven",
    "mode": "mode-driven",
    "prescribed": "mode prescribed",
}

PRINTED = Case("printed", "friction")
"""The paper's own: its variant, its drive, its contact force."""

CONSISTENT = Case("consistent", "mode")


REFINED = Case("refined", "prescribed")


def cases() -> tuple[Case, ...]:
    """What the paper prints, every two-mode variant with either drive, and the refined model."""
    two_mode = (v for v in VARIANTS if v != REFINED.variant)
    return (PRINTED, *(Case(v, drive) for v in two_mode for drive in PORTS), REFINED)


def linear_part(study: Study, case: Case) -> TwoModeModel:
    """Linear part of a case, and where its table enters."""
    offset = study.refined.offset if case == REFINED else 0.0
    return two_mode_model(study.assembly.prepared, case.variant, offset)


def respond(study: Study, case: Case, rho: float, frequency: Array) -> Response:
    """Forced response of a case."""
    return forced_response(
        linear_part(study, case),
        study.tables[case.table],
        frequency,
        study.moment(rho),
        rho=rho,
        friction=study.friction,
        variant=case.variant,
    )


def equivalent(study: Study, case: Case, rho: float, frequency: Array) -> NDArray[np.complex128]:
    """``k_eq + i gamma_eq`` that a case reads from its table at its answer; nan without one."""
    model, load = linear_part(study, case), study.moment(rho)
    argument = replace(model, sliding=model.argument)
    response = forced_response(argument, study.tables[case.table], frequency, load)
    offset = load * float(model.argument @ model.offset)
    values = read_table(study, case.table, np.abs(response.amplitude + offset))
    return np.where(response.flag == CONVERGED, values, complex(np.nan, np.nan))


def read_table(study: Study, table: str, amplitude: Array) -> NDArray[np.complex128]:
    """``k_eq + i gamma_eq`` of a table at modal amplitudes, interpolated as the models do."""
    found = study.tables[table]
    curve = table_curve(found)
    out = np.zeros(curve.coefficients.shape[2])
    values = np.zeros(len(amplitude), complex)
    for i, x in enumerate(np.log(np.maximum(amplitude, 1e-300) / found.preload)):
        evaluate_curve(curve, x, out)
        values[i] = out[0] + 1j * out[1]
    return values


def fixed_point_map(
    study: Study, case: Case, rho: float, frequency: float
) -> Callable[[float], float]:
    """The map g of the appendix: the amplitude that answers a table read at an amplitude."""
    found = study.tables[case.table]
    curve = table_curve(found)
    system = fixed_point(linear_part(study, case), curve, found.preload, study.moment(rho))
    out, y = np.zeros(curve.coefficients.shape[2]), np.zeros(2, complex)

    def g(amplitude: float) -> float:
        return float(next_amplitude(amplitude, 2 * np.pi * frequency, system, out, y))

    return g


def solutions(study: Study, case: Case, rho: float, frequency: float) -> Array:
    """Every amplitude in the table with ``g(a) = a``."""
    return all_amplitudes(
        linear_part(study, case), study.tables[case.table], frequency, study.moment(rho)
    )
