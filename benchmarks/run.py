"""Speed and growth of the main job. ``make bench`` runs all; ``--quick`` leaves out the growth.

Medians after a warm-up, one thread, ratios measured in this one run. Writes ``benchmarks/results.json``
and ``docs/images/scaling.png``.
"""

from __future__ import annotations

import argparse
import json
import platform
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from microslip import load_joint
from microslip.analyses.backbone.extended_motion import harmonic_backbone
from microslip.analyses.backbone.points import amplitude_scale, geometric
from microslip.analyses.harmonic.problem import harmonic_problem
from microslip.analyses.harmonic.response import frequency_response
from microslip.analyses.reduced.refined import load_offset, refined_table
from microslip.analyses.reduced.response import forced_response
from microslip.analyses.reduced.table import equivalent_table
from microslip.analyses.reduced.two_mode import two_mode_model
from microslip.analyses.statics.cycle import quasi_static_cycle
from microslip.analyses.statics.held import hold_mode
from microslip.analyses.statics.start import prestressed_solver
from microslip.contact.problem import relative_displacement
from microslip.model.modes import factorise, spectral_shift
from microslip.numerics import execute
from microslip.numerics.execute import workers
from microslip.pipeline.cycle import cycle_loads
from microslip.pipeline.prepare import assemble

ROOT = Path(__file__).resolve().parent.parent
EXAMPLE = ROOT / "examples" / "lap_joint.toml"
RESULTS = ROOT / "benchmarks" / "results.json"
PICTURE = ROOT / "docs" / "images" / "scaling.png"
PORTS = {"moment": "moment", "mode": "sliding"}


def median_seconds(work, repeats=5):
    """Median wall time of `work()` after one warm-up call."""
    work()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        work()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def triangular_solve(assembly):
    """Seconds of one sparse forward and backward solve of the full system."""
    s = assembly.structure
    solve = factorise(s.stiffness + spectral_shift(s) * s.mass).solve
    rhs = np.sin(np.arange(s.dofs, dtype=float))
    return median_seconds(lambda: solve(rhs), 21)


def cycle(assembly, drive, load, steps=300, max_cycles=6):
    return quasi_static_cycle(
        assembly.prepared, PORTS[drive], load, steps=steps, max_cycles=max_cycles, closure=1e-5
    )


def step_times(assembly, drive):
    """Milliseconds per quasi-static step at each amplitude of a table."""
    loads, moments = cycle_loads(assembly, drive)
    rows = []
    for load, moment in zip(loads, moments, strict=True):
        result = cycle(assembly, drive, load)
        seconds = median_seconds(lambda load=load: cycle(assembly, drive, load), 3)
        rows.append(
            {
                "moment_over_clamp_force_length": moment / assembly.moment_unit,
                "ms_per_step": 1e3 * seconds / (300 * result.cycles),
                "iterations_per_step": float(result.iterations[1:].mean()),
                "cycles": result.cycles,
            }
        )
    return rows


def step_floor(assembly):
    """Seconds of what a step cannot do without: one solve with the inverse and one product W r."""
    f, m = assembly.prepared.flexibility, assembly.prepared.model.pairs
    touching = int(assembly.prepared.prestress.touching.sum())
    n = 2 * touching + f.R.shape[1]
    rng = np.random.default_rng(1)
    G, b = rng.standard_normal((n, n)), rng.standard_normal(n)
    r = np.zeros(2 * m)
    r[: 2 * touching] = 1.0
    v, v_free, q = np.zeros(2 * m), np.zeros(2 * m), np.zeros(f.R.shape[1])
    problem = prestressed_solver(assembly.prepared).problem

    def once():
        for _ in range(100):
            G @ b
            relative_displacement(problem, v_free, r, q, v)

    return median_seconds(once, 11) / 100


def processor_seconds(work):
    """Processor seconds of this thread: what else the machine does counts less."""
    start = time.thread_time()
    found = work()
    return time.thread_time() - start, found


def harmonic_times(assembly, rho=2.4, count=100, amplitudes=30):
    """Processor seconds of a harmonic response, H = 5, and per amplitude of a harmonic backbone."""
    prepared, mode = assembly.prepared, assembly.mode
    load = 2.03e-3 * assembly.joint.contact.friction * assembly.moment_unit / rho
    problem, band = harmonic_problem(prepared), np.linspace(165, 190, count)
    frequency_response(problem, 1e-3 * load, band[:2])
    response, found = processor_seconds(lambda: frequency_response(problem, load, band))
    scale = amplitude_scale(prepared, mode)
    sizes = geometric(1e-5 * scale, 0.85 * scale, amplitudes)
    backbone, (curve, missed) = processor_seconds(lambda: harmonic_backbone(prepared, mode, sizes))
    return {
        "response_s": response,
        "response_points": len(found.points),
        "response_branch_points": [len(branch.points) for branch in found.branches],
        "backbone_s_per_amplitude": backbone / amplitudes,
        "backbone_points": len(curve.points),
        "not_found": len(found.failures) + len(missed),
    }


def wall(command, repeats=3):
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        subprocess.run(command, check=True, capture_output=True)
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def with_pairs(joint, pairs):
    return joint.model_copy(update={"contact": joint.contact.model_copy(update={"pairs": pairs})})


def growth(joint, counts):
    """Time and memory against the number of contact pairs, each in a process of its own."""
    rows = []
    for pairs in counts:
        code = (
            "import json,sys; sys.path.insert(0, 'benchmarks'); import run; "
            f"print(json.dumps(run.growth_point({pairs})))"
        )
        done = subprocess.run(
            [sys.executable, "-c", code], check=True, capture_output=True, text=True, cwd=ROOT
        )
        rows.append(json.loads(done.stdout.splitlines()[-1]))
    return rows


def growth_point(pairs):
    """One point of the growth study: run in a fresh process for its peak memory."""
    with threadpool_limits(1):
        joint = with_pairs(load_joint(EXAMPLE), pairs)
        start = time.perf_counter()
        assembly = assemble(joint)
        assembled = time.perf_counter() - start
        load = cycle_loads(assembly, "mode")[0][len(joint.cycle_amplitudes()) // 2]
        result = cycle(assembly, "mode", load)
        seconds = median_seconds(lambda: cycle(assembly, "mode", load), 3)
        return {
            "pairs": assembly.prepared.model.pairs,
            "dofs": assembly.structure.dofs,
            "assemble_s": assembled,
            "ms_per_step": 1e3 * seconds / (300 * result.cycles),
            "triangular_solve_ms": 1e3 * triangular_solve(assembly),
            "peak_memory_mib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        }


def exponent(rows, key):
    """Slope of log(key) against log(pairs) over the upper half of the range."""
    half = rows[len(rows) // 2 - 1 :]
    x = np.log([row["pairs"] for row in half])
    return float(np.polyfit(x, np.log([row[key] for row in half]), 1)[0])


def plot_growth(rows, path):
    from matplotlib.figure import Figure

    figure = Figure(figsize=(3.35, 3.1), layout="constrained")
    axes = figure.add_subplot()
    pairs = [row["pairs"] for row in rows]
    for key, unit, label, marker, color in (
        ("assemble_s", 1.0, "assembly and reduction", "^", "#009E73"),
        ("triangular_solve_ms", 1e-3, "sparse triangular solve", "s", "#D55E00"),
        ("ms_per_step", 1e-3, "quasi-static step", "o", "#0072B2"),
    ):
        axes.loglog(
            pairs,
            [unit * row[key] for row in rows],
            marker=marker,
            color=color,
            label=f"{label}, exponent {exponent(rows, key):.1f}",
        )
    axes.set(xlabel="contact pairs", ylabel="time, s")
    axes.set_xticks(pairs, [str(p) for p in pairs], minor=False)
    axes.minorticks_off()
    figure.legend(loc="outside lower center", fontsize=7, frameon=False)
    figure.savefig(path, dpi=200)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="no growth study, no wall times")
    parser.add_argument("--redraw", action="store_true", help="only the picture, from the results")
    options = parser.parse_args()
    if options.redraw:
        plot_growth(json.loads(RESULTS.read_text())["growth"], PICTURE)
        return
    joint = load_joint(EXAMPLE)
    found = {
        "machine": platform.processor() or platform.machine(),
        "python": platform.python_version(),
    }
    with threadpool_limits(1):
        assembly = assemble(joint)
        prepared, mode = assembly.prepared, assembly.mode
        reference = triangular_solve(assembly)
        found["dofs"], found["contact_pairs"] = assembly.structure.dofs, prepared.model.pairs
        found["triangular_solve_ms"] = 1e3 * reference
        floor = step_floor(assembly)
        found["step_floor_ms"] = 1e3 * floor
        tables = {}
        for drive in ("moment", "mode"):
            rows = step_times(assembly, drive)
            typical = statistics.median(row["ms_per_step"] for row in rows)
            found[f"quasi_static_{drive}"] = {
                "median_ms_per_step": typical,
                "worst_ms_per_step": max(row["ms_per_step"] for row in rows),
                "over_triangular_solve": typical / (1e3 * reference),
                "by_amplitude": rows,
            }
            loads = cycle_loads(assembly, drive)[0]
            picked = loads[np.linspace(0, len(loads) - 1, 20).round().astype(int)]

            def table(picked=picked, drive=drive):
                cycles = [cycle(assembly, drive, load) for load in picked]
                return equivalent_table(cycles, prepared, drive)

            tables[drive] = table()
            found[f"table_20x300_{drive}_s"] = median_seconds(table, 3)
        found["refined_table_s"] = {}
        held = hold_mode(prepared, 0.5 * (mode.sliding_omega + mode.stuck_omega), upper=2)
        top = float(tables["mode"].amplitude[-1])
        for threads in (1, workers()):
            start = time.perf_counter()
            tables["prescribed"], _ = refined_table(
                held, 1e-5, top, executor=execute.threads(threads)
            )
            found["refined_table_s"][str(threads)] = time.perf_counter() - start
        offset = load_offset(held, 1e-6)
        frequency = np.linspace(165, 190, 20001)
        for variant, drive in (
            ("printed", "moment"),
            ("consistent", "mode"),
            ("refined", "prescribed"),
        ):
            model = two_mode_model(prepared, variant, offset)
            amplitude = tables[drive].amplitude
            middle = amplitude[len(amplitude) // 2]
            load = 0.02 * middle * model.omega**2 / abs(model.force[0])
            seconds = median_seconds(
                lambda m=model, t=tables[drive], f=load: forced_response(m, t, frequency, f), 7
            )
            response = forced_response(model, tables[drive], frequency, load)
            found[f"reduced_{variant}"] = {
                "points_per_second": len(frequency) / seconds,
                "converged_points": int((response.flag == 0).sum()),
                "points": len(frequency),
            }
        found["harmonic"] = harmonic_times(assembly)
    if not options.quick:
        binary = str(Path(sys.executable).with_name("microslip"))
        found["help_s"] = wall([binary, "--help"], 5)
        out = str(Path(tempfile.gettempdir()) / "microslip-bench-output")
        found["run_s"] = wall([binary, "run", str(EXAMPLE), "--out", out, "--force", "--quiet"])
        rows = growth(joint, (51, 101, 201, 401, 801))
        found["growth"] = rows
        found["growth_exponents"] = {
            key: exponent(rows, key)
            for key in ("ms_per_step", "assemble_s", "triangular_solve_ms", "peak_memory_mib")
        }
        plot_growth(rows, PICTURE)
        RESULTS.write_text(json.dumps(found, indent=1) + "\n")
    print(json.dumps(found, indent=1))


if __name__ == "__main__":
    main()
