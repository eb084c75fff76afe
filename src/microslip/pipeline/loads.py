"""The loads of an analysis, from what the input file says of them.

A load is given in the unit of the port that it drives. An end moment M is given as such, over ``P L``, or as

    rho = C mu P L / M

with a constant C that is the same for every joint (`LapJoint.rho_scale`). The inertia load of the
sliding mode that corresponds to a load is the same fraction of the load that opens the joint:
both shift the resultant of the contact pressure equally far.

rho = 0 stands for the joint without friction, which is linear as long as it stays closed: any
moment shows its response per unit load. The one chosen keeps it closed, see `gentle_moment`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from microslip.analyses.prepared.prestress import opening_load
from microslip.analyses.prepared.scales import load_scale
from microslip.analyses.reduced.resonance import linear_resonance
from microslip.analyses.reduced.response import Response, forced_response
from microslip.analyses.reduced.table import EquivalentTable
from microslip.analyses.reduced.two_mode import two_mode_model
from microslip.describe.ports import KINDS, LoadKind, PortKind
from microslip.errors import MicroslipError
from microslip.pipeline.prepare import Assembly
from microslip.typing import Array

GENTLE = 3e-4
"""Peak of the joint without friction over the amplitude whose inertia opens the joint."""


@dataclass(frozen=True)
class Load:
    """A load of the joint.

    Attributes
    ----------
    rho : float
        ``C mu P L / M``; 0 for the joint without friction, nan where the file does not give rho.
    amplitude : float
        On the driven port: of the end moment M, N m per metre of width.
    kind : str
        Of that port, see `microslip.describe.ports.KINDS`.
    said : LoadKind, optional
        What it is called and measured in; that of `kind` where left out.

    Examples
    --------
    >>> print(Load(np.nan, 50.0), Load(2.4, 52.0), sep="; ")
    M = 50 N m/m; rho = 2.4
    """

    rho: float
    amplitude: float
    kind: PortKind = "moment"
    said: LoadKind | None = None

    def __str__(self) -> str:
        said = self.said or KINDS[self.kind]
        return f"rho = {self.rho:.4g}" if np.isfinite(self.rho) else said.named(self.amplitude)


def loads_of_file(
    assembly: Assembly, tables: Mapping[str, EquivalentTable] | None = None
) -> tuple[Load, ...]:
    """Loads of the section ``[load]``, in its order.

    Parameters
    ----------
    assembly : Assembly
    tables : mapping of str to EquivalentTable, optional
        For rho = 0, see `gentle_moment`.
    """
    joint = assembly.joint
    load = joint.load
    if load is None:
        return ()
    if load.rho is None:
        kind = joint.driven.kind
        return tuple(
            Load(np.nan, joint.end_moment(load.kind, value), kind, joint.driven.load)
            for value in load.values
        )
    linear = assembly.measures.friction == 0
    return tuple(
        Load(rho, gentle_moment(assembly, tables or {}))
        if linear or rho == 0
        else Load(rho, joint.end_moment("rho", rho))
        for rho in load.rho
    )


def port_of(assembly: Assembly, drive: str) -> str:
    """Port that a drive acts on: the driven one, or the inertia load of the mode."""
    return assembly.mode.port if drive == "mode" else assembly.prepared.drive


def on_port(assembly: Assembly, drive: str, load: Array | float) -> Array | float:
    """Amplitude on the port of a drive that is as close to opening the joint as a load.

    Where one of them opens it at no amplitude, that which is the same part of its `load_scale`.

    Raises
    ------
    MicroslipError
        Where the interface does not feel one of them, so that nothing compares them.
    """
    if drive != "mode":
        return load
    p = assembly.prepared
    scales = load_scale(p, assembly.mode.port), load_scale(p, p.drive)
    if not np.isfinite(scales).all():
        raise MicroslipError(
            "the interface does not feel the load or the inertia of the mode, so that nothing says "
            'which inertia is as much as a load: drive by "load" alone'
        )
    return load * scales[0] / scales[1]


def opening_of(assembly: Assembly, port: str) -> float:
    """Amplitude of a port that opens the joint."""
    p = assembly.prepared
    return opening_load(p.model, p.prestress, port, p.law.friction)


# without friction ----------------------------------------------------------------------------------


def frictionless_response(assembly: Assembly, band: Array, moment: float = 1.0) -> Response:
    """Linear response of the joint without friction to the load, eq. (18)."""
    linear = two_mode_model(assembly.prepared, "consistent")
    return forced_response(
        linear, None, band, moment, rho=0.0, friction=0.0, variant="frictionless"
    )


def frictionless_resonance(assembly: Assembly, moment: float = 1.0) -> tuple[float, float]:
    """Resonance of the joint without friction, wherever it lies: Hz, and modal amplitude.

    Infinite without material damping.
    """
    return linear_resonance(two_mode_model(assembly.prepared, "consistent"), moment)


def opening_amplitude(assembly: Assembly) -> float:
    """Modal amplitude at which the inertia of the sliding mode opens the joint."""
    mode = assembly.mode
    return opening_of(assembly, mode.port) / mode.sliding_omega**2


def amplitude_scale(assembly: Assembly) -> float:
    """Modal amplitude whose inertia opens the joint, or that the contact feels as much as the preload."""
    mode = assembly.mode
    return load_scale(assembly.prepared, mode.port) / mode.sliding_omega**2


def gentle_moment(assembly: Assembly, tables: Mapping[str, EquivalentTable]) -> float:
    """End moment that stands for rho = 0: small, so that the joint without friction stays closed.

    Its resonance has the smallest amplitude that is tabulated; where nothing is, `GENTLE` of the
    amplitude whose inertia opens the joint. Without any damping, `GENTLE` of the opening moment.

    Parameters
    ----------
    assembly : Assembly
    tables : mapping of str to EquivalentTable
        May be empty.
    """
    peak = frictionless_resonance(assembly)[1]
    if not np.isfinite(peak):
        return GENTLE * load_scale(assembly.prepared, assembly.prepared.drive)
    if tables:
        amplitude = float(min(table.amplitude[0] for table in tables.values()))
    else:
        amplitude = GENTLE * amplitude_scale(assembly)
    return amplitude / peak
