"""What each ingredient of the refined model is worth: errors against the time domain.

    python docs/evidence/refined_ablation.py

Time integration with full contact on the reference joint, 300 steps per cycle; for each model the
solution nearest to it. About ten minutes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.stats import spearmanr

from microslip import Failure, load_joint, opening_load
from microslip.analyses.reduced.refined import load_offset, refined_table
from microslip.analyses.reduced.response import Response, answers, forced_response
from microslip.analyses.reduced.sweep import CONVERGED
from microslip.analyses.reduced.table import EquivalentTable, equivalent_table
from microslip.analyses.reduced.trust import error_indicator
from microslip.analyses.reduced.two_mode import TwoModeModel, two_mode_model
from microslip.analyses.statics.cycle import quasi_static_cycle
from microslip.analyses.statics.held import hold_mode
from microslip.analyses.time.point import Request
from microslip.analyses.time.points import steady_states
from microslip.numerics.execute import each, threads
from microslip.pipeline.prepare import Assembly, assemble

JOINT = Path(__file__).parents[2] / "examples" / "lap_joint.toml"
FREQUENCY = np.arange(165.0, 190.5, 1.0)
RHOS = (0.8, 1.6, 2.4, 3.2, 5.0)
RHO_SCALE = 2.03e-3
"""C of M = C mu P L / rho, as a run of examples/lap_joint.toml finds it."""
STEPS = 300


@dataclass(frozen=True)
class Model:
    """A reduced model under study."""

    name: str
    model: TwoModeModel
    table: EquivalentTable


def tables(a: Assembly) -> dict[str, EquivalentTable]:
    """Moment- and mode-driven quasi-static tables, and prescribed ones without and with inertia."""
    joint = a.prepared
    found = {}
    for drive, port in (("moment", joint.drive), ("mode", a.mode.port)):
        opening = opening_load(joint, port)

        def cycle(share: float, port: str = port, opening: float = opening):
            return quasi_static_cycle(joint, port, share * opening, max_cycles=5)

        cycles = list(each(cycle, np.geomspace(1e-5, 0.95, 48), threads()))
        found[drive] = equivalent_table(cycles, joint, drive)
    top = float(found["mode"].amplitude[-1])
    for name, omega in (("static", 0.0), ("inertia", middle(a))):
        found[name], failures = refined_table(hold_mode(joint, omega, upper=2), 3e-6, top)
        assert not failures, failures
    return found


def middle(a: Assembly) -> float:
    """Reference circular frequency."""
    return 0.5 * (a.mode.sliding_omega + a.mode.stuck_omega)


def models(a: Assembly, tables: dict[str, EquivalentTable]) -> list[Model]:
    """From the paper's model to the refined one, an ingredient at a time."""
    static = load_offset(hold_mode(a.prepared, 0.0), 1e-6)
    dynamic = load_offset(hold_mode(a.prepared, middle(a)), 1e-6)

    def one(offset: float, lossy: float) -> TwoModeModel:
        return replace(two_mode_model(a.prepared, "refined", offset), lossy=lossy)

    smooth = replace(tables["static"], upper=None)
    inertia = replace(tables["inertia"], upper=None)
    printed = two_mode_model(a.prepared, "printed")
    consistent = two_mode_model(a.prepared, "consistent")
    return [
        Model("printed, moment-driven table", printed, tables["moment"]),
        Model("printed, mode-driven table", printed, tables["mode"]),
        Model("consistent, moment-driven table", consistent, tables["moment"]),
        Model("consistent, mode-driven table", consistent, tables["mode"]),
        Model("one coordinate, mode-driven table", one(0.0, 0.0), tables["mode"]),
        Model("+ moment's own bending", one(static, 0.0), tables["mode"]),
        Model("+ q prescribed", one(static, 0.0), smooth),
        Model("+ inertia of the other modes", one(dynamic, 0.0), inertia),
        Model("+ material loss of the contact's share", one(dynamic, 1.0), inertia),
        Model("+ upper harmonics: refined", one(dynamic, 1.0), tables["inertia"]),
        Model("refined without moment's own bending", one(0.0, 1.0), tables["inertia"]),
        Model(
            "refined without inertia",
            one(static, 1.0),
            replace(smooth, upper=None),
        ),
    ]


def truth(
    a: Assembly, model: Model, rho: float
) -> tuple[NDArray[np.float64], NDArray[np.complex128], float]:
    """Frequencies, amplitudes and load of the time domain."""
    mu = a.joint.contact.friction
    load = RHO_SCALE * mu * a.moment_unit / rho
    guess = forced_response(model.model, model.table, FREQUENCY, load).amplitude
    requests = [
        Request(rho, f, load, mu, complex(g), steps=STEPS)
        for f, g in zip(FREQUENCY, guess, strict=True)
    ]
    frequency, amplitude = [], []
    for point in steady_states(a.prepared, requests):
        if isinstance(point, Failure) or not point.steady.converged:
            print("left out:", point if isinstance(point, Failure) else point.steady.frequency)
            continue
        frequency.append(point.steady.frequency)
        amplitude.append(point.steady.amplitude)
    return np.array(frequency), np.array(amplitude), load


def nearest(m: Model, f: float, load: float, Q: complex) -> complex:
    """The answer of a model nearest to the truth; nan where the truth is outside its table."""
    if abs(Q) > m.table.amplitude[-1]:
        return complex(np.nan)
    found = answers(m.model, m.table, f, load)
    if len(found) == 0:
        return complex(np.nan)
    return complex(found[np.argmin(np.abs(found - Q))])


def main() -> None:
    """Print the tables."""
    a = assemble(load_joint(JOINT))
    made = tables(a)
    chain = models(a, made)
    refined = next(m for m in chain if m.name.endswith("refined"))
    indicators: dict[str, list[NDArray[np.float64]]] = {}
    errors: dict[str, list[NDArray[np.float64]]] = {}
    print("| model | " + " | ".join(f"ρ = {r:g}" for r in RHOS) + " |")
    print("|---|" + "---|" * len(RHOS))
    cells: dict[str, list[str]] = {m.name: [] for m in chain}
    for rho in RHOS:
        frequency, Q, load = truth(a, refined, rho)
        peak = int(np.argmax(np.abs(Q)))
        for m in chain:
            answer = np.array([nearest(m, f, load, q) for f, q in zip(frequency, Q, strict=True)])
            error = 100 * (np.abs(answer) / np.abs(Q) - 1)
            phase = np.degrees(np.angle(answer / Q))
            worst = int(np.nanargmax(np.abs(error)))
            lost = int(np.isnan(error).sum())
            cells[m.name].append(
                f"{np.nanmedian(np.abs(error)):.2f} / {error[worst]:+.2f} ({frequency[worst]:.0f} Hz)"
                f" / {error[peak]:+.2f} / {np.nanmax(np.abs(phase)):.1f}°"
                + (f", {lost} without answer" if lost else "")
            )
            response = Response(
                "refined" if m is refined else "other",
                m.table.drive,
                rho,
                load,
                a.joint.contact.friction,
                frequency,
                answer,
                np.zeros(len(Q), int),
                np.zeros(len(Q)),
                np.full(len(Q), CONVERGED),
            )
            estimate = error_indicator(response, refined.model, refined.table)
            errors.setdefault(m.name, []).append(np.abs(answer / Q - 1))
            indicators.setdefault(m.name, []).append(estimate)
    for m in chain:
        print(f"| {m.name} | " + " | ".join(cells[m.name]) + " |")
    print("\nAmplitude error in per cent: median of magnitude / worst (where) / at the peak; worst")
    print(
        "phase error.\n\n| model | rank correlation of indicator and error | error below indicator |"
    )
    print("|---|---|---|")
    for m in chain:
        e, i = np.concatenate(errors[m.name]), np.concatenate(indicators[m.name])
        good = np.isfinite(e) & np.isfinite(i)
        print(
            f"| {m.name} | {spearmanr(e[good], i[good])[0]:.2f} | {np.mean(e[good] <= i[good]):.0%} |"
        )


if __name__ == "__main__":
    main()
