"""The load of an analysis, from what the input file says of it: the one place that knows rho.

An end moment M is given as such, over ``P L``, or as

    rho = C mu P L / M

with a constant C that the file gives or that is calibrated: such that the reduced model is damped
most at a given rho. The inertia load of the sliding mode that corresponds to an end moment is the
same fraction of the load that opens the joint: both shift the resultant of the contact pressure
equally far.

rho = 0 stands for the joint without friction, which is linear as long as it stays closed: any
moment shows its response per unit load. The one chosen keeps it closed, see `gentle_moment`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from microslip.analyses.prepared.prestress import opening_load
from microslip.analyses.reduced.response import Response, forced_response, greatest_damping_load
from microslip.analyses.reduced.table import EquivalentTable
from microslip.analyses.reduced.two_mode import TwoModeModel, two_mode_model
from microslip.errors import MicroslipError
from microslip.pipeline.prepare import DRIVE, Assembly
from microslip.typing import Array

DRIVES = {"moment": DRIVE, "mode": "sliding"}
"""Port that each drive acts on: the end moment (the paper), or the inertia load of the mode."""

GENTLE = 3e-4
"""Peak of the joint without friction over the amplitude whose inertia opens the joint."""

Model = tuple[TwoModeModel, EquivalentTable]
"""A reduced model and the table it reads."""


@dataclass(frozen=True)
class Load:
    """A load of the joint.

    Attributes
    ----------
    rho : float
        ``C mu P L / M``; 0 for the joint without friction. Where the file gives moments, C = 1.
    moment : float
        M, amplitude of the end moment, N m per metre of width.
    """

    rho: float
    moment: float


# rho -----------------------------------------------------------------------------------------------


def strength(assembly: Assembly) -> float:
    """``mu P L``, N m per metre of width: what moments are compared with."""
    return assembly.joint.friction * assembly.moment_unit


def given_scale(assembly: Assembly) -> float:
    """C as the file gives it; nan where it does not."""
    load = assembly.joint.load
    return np.nan if load is None or load.rho_scale is None else load.rho_scale


def calibrated_scale(assembly: Assembly, model: Model, band: Array, rho: float) -> float:
    """C such that a reduced model is damped most at `rho`: its resonance per unit load is lowest.

    Parameters
    ----------
    assembly : Assembly
    model : (TwoModeModel, EquivalentTable)
    band : (n,) array
        Frequencies among which its resonance is looked for, Hz.
    rho : float

    Raises
    ------
    MicroslipError
        Where the table does not hold that load.
    """
    best = greatest_damping_load(*model, band, _held_by(*model))
    return rho * best / strength(assembly)


def _held_by(model: TwoModeModel, table: EquivalentTable) -> tuple[float, float]:
    """Loads whose resonance could lie in the table: from lightly damped to gross slip."""
    scale = model.omega**2 / max(abs(model.force[0]), 1e-300)
    return (1e-5 * table.amplitude[0] * scale, table.amplitude[-1] * scale)


def scale_of_file(assembly: Assembly, models: Mapping[str, Model]) -> float:
    """C as given, else calibrated with the best of the models by variant; nan where it is not needed.

    Raises
    ------
    MicroslipError
        As `calibrated_scale`.
    """
    load, mode = assembly.joint.load, assembly.mode
    if load is None or load.rho is None:
        return np.nan
    if load.rho_scale is not None:
        return load.rho_scale
    if strength(assembly) == 0:
        return 1.0
    name = next(v for v in ("refined", "consistent", "printed") if v in models)
    band = np.linspace(0.9 * mode.sliding_frequency, 1.1 * mode.stuck_frequency, 1201)
    return calibrated_scale(assembly, models[name], band, load.greatest_damping_at)


# moments -------------------------------------------------------------------------------------------


def end_moment(assembly: Assembly, key: str, value: float, scale: float = np.nan) -> float:
    """End moment that a key of the file gives, N m per metre of width.

    Parameters
    ----------
    assembly : Assembly
    key : {"moment", "moment_over_clamp_force_length", "rho"}
    value : float
        Positive.
    scale : float
        C, for rho.

    Raises
    ------
    MicroslipError
        For a rho without scale.
    """
    if key == "moment":
        return value
    if key == "moment_over_clamp_force_length":
        return value * assembly.moment_unit
    if not np.isfinite(scale):
        raise MicroslipError("rho has no scale: the forced response that calibrates it failed")
    return scale * strength(assembly) / value


def loads_of_file(
    assembly: Assembly, scale: float, gentle: Callable[[], float]
) -> tuple[Load, ...]:
    """Loads of the section ``[load]``, in its order.

    Parameters
    ----------
    assembly : Assembly
    scale : float
        C.
    gentle : callable
        End moment that stands for rho = 0.

    Raises
    ------
    MicroslipError
        For a rho without scale.
    """
    load = assembly.joint.load
    if load is None:
        return ()
    limit = strength(assembly)
    if load.rho is None:
        moments = (end_moment(assembly, load.kind, value) for value in load.values)
        return tuple(Load(limit / m, m) for m in moments)
    return tuple(
        Load(rho, end_moment(assembly, "rho", rho, scale) if rho > 0 and limit > 0 else gentle())
        for rho in load.rho
    )


def on_port(assembly: Assembly, drive: str, moment: Array | float) -> Array | float:
    """Amplitude on the port of a drive that is as close to opening the joint as an end moment."""
    if drive == "moment":
        return moment
    opening = opening_of(assembly, DRIVES[drive])
    return moment * opening / assembly.opening_moment


def opening_of(assembly: Assembly, port: str) -> float:
    """Amplitude of a port that opens the joint."""
    p = assembly.prepared
    return opening_load(p.model, p.prestress, port)


# without friction ----------------------------------------------------------------------------------


def frictionless_response(assembly: Assembly, band: Array, moment: float = 1.0) -> Response:
    """Linear response of the joint without friction to an end moment, eq. (18)."""
    linear = two_mode_model(assembly.prepared, "consistent")
    return forced_response(
        linear, None, band, moment, rho=0.0, friction=0.0, variant="frictionless"
    )


def gentle_moment(
    assembly: Assembly, frictionless: Response, tables: Mapping[str, EquivalentTable]
) -> float:
    """End moment that stands for rho = 0: small, so that the joint without friction stays closed.

    Its resonance has the smallest amplitude that is tabulated; where nothing is, `GENTLE` of the
    amplitude whose inertia opens the joint.

    Parameters
    ----------
    assembly : Assembly
    frictionless : Response
        In the band in which the resonance counts, to any moment.
    tables : mapping of str to EquivalentTable
        May be empty.
    """
    if tables:
        amplitude = float(min(table.amplitude[0] for table in tables.values()))
    else:
        mode = assembly.mode
        amplitude = GENTLE * opening_of(assembly, mode.port) / mode.sliding_omega**2
    return float(amplitude / (frictionless.peak_amplitude / frictionless.load))
