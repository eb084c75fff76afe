"""The reduced models that the figures compare: every variant with every table.

The one place that knows how a variant is solved. A case is a variant of `microslip.reduced` with
the table it reads; the first is what the paper prints, friction alone under the end moment.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from microslip.backbone import DRIVES
from microslip.reduced import (
    CONVERGED,
    VARIANTS,
    Response,
    TwoModeModel,
    _respond,
    _system,
    all_amplitudes,
    evaluate_curve,
    forced_response,
    table_curve,
    two_mode_model,
)
from microslip.reproduce.study import Study

Array = NDArray[np.float64]


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
}

PRINTED = Case("printed", "friction")
"""The paper's own: its variant, its drive, its contact force."""

CONSISTENT = Case("consistent", "mode")


def cases() -> tuple[Case, ...]:
    """What the paper prints, and every variant with either drive."""
    return (PRINTED, *(Case(variant, drive) for variant in VARIANTS for drive in DRIVES))


def two_mode(study: Study, case: Case) -> TwoModeModel:
    """Linear part of a case."""
    return two_mode_model(study.assembly.states, "moment", study.rayleigh, case.variant)


def respond(study: Study, case: Case, rho: float, frequency: Array) -> Response:
    """Forced response of a case."""
    return forced_response(
        two_mode(study, case),
        study.tables[case.table],
        frequency,
        study.moment(rho),
        rho=rho,
        friction=study.friction,
        variant=case.variant,
    )


def equivalent(study: Study, case: Case, rho: float, frequency: Array) -> NDArray[np.complex128]:
    """``k_eq + i gamma_eq`` that a case reads from its table at its answer; nan without one."""
    model = two_mode(study, case)
    argument = replace(model, sliding=model.argument)
    table = study.tables[case.table]
    response = forced_response(argument, table, frequency, study.moment(rho))
    values = read_table(study, case.table, np.abs(response.amplitude))
    return np.where(response.flag == CONVERGED, values, np.nan)


def read_table(study: Study, table: str, amplitude: Array) -> NDArray[np.complex128]:
    """``k_eq + i gamma_eq`` of a table at modal amplitudes, interpolated as the models do."""
    found = study.tables[table]
    curve = table_curve(found)
    out = np.zeros(4)
    values = np.zeros(len(amplitude), complex)
    for i, x in enumerate(np.log(np.maximum(amplitude, 1e-300) / found.clamp)):
        evaluate_curve(curve.knots, curve.coefficients, x, out)
        values[i] = out[0] + 1j * out[1]
    return values


def fixed_point_map(
    study: Study, case: Case, rho: float, frequency: float
) -> Callable[[float], float]:
    """The map g of the appendix: the amplitude that answers a table read at an amplitude."""
    found = study.tables[case.table]
    system = _system(two_mode(study, case), table_curve(found), found.clamp, study.moment(rho))
    out, y = np.zeros(4), np.zeros(2, complex)

    def g(amplitude: float) -> float:
        return float(_respond(amplitude, 2 * np.pi * frequency, system, out, y))

    return g


def solutions(study: Study, case: Case, rho: float, frequency: float) -> Array:
    """Every amplitude in the table with ``g(a) = a``."""
    return all_amplitudes(
        two_mode(study, case), study.tables[case.table], frequency, study.moment(rho)
    )
