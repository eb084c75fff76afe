"""The one calibration of the reproduction: C in ``rho = C mu P L / M``, from the greatest damping."""

from __future__ import annotations

import numpy as np

from microslip.analyses.reduced.response import greatest_damping_load
from microslip.analyses.reduced.table import EquivalentTable
from microslip.analyses.reduced.two_mode import TwoModeModel
from microslip.pipeline.prepare import Assembly
from microslip.typing import Array


def calibrated_scale(
    assembly: Assembly, model: TwoModeModel, table: EquivalentTable, band: Array, rho: float
) -> float:
    """C such that a reduced model is damped most at `rho`: its resonance per unit load is lowest.

    Parameters
    ----------
    assembly : Assembly
    model : TwoModeModel
    table : EquivalentTable
    band : (n,) array
        Frequencies among which its resonance is looked for, Hz.
    rho : float

    Raises
    ------
    MicroslipError
        Where the table does not hold that load.
    """
    scale = model.omega**2 / max(abs(model.force[0]), np.finfo(float).tiny)
    held = 1e-5 * table.amplitude[0] * scale, table.amplitude[-1] * scale
    best = greatest_damping_load(model, table, band, held)
    return rho * best / (assembly.measures.friction * assembly.moment_unit)
