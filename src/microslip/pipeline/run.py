"""The main job: from a lap joint's description to its forced response.

Each stage is a function of its inputs; `run_lap_joint` strings them together, reports progress,
records failed points and goes on.
"""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace

import numpy as np
from threadpoolctl import threadpool_limits

from microslip.analyses.backbone.cycles import (
    Backbone,
    CycleControl,
    amplitude_scale,
    geometric,
    prescribed_backbone,
    quasi_static_backbone,
)
from microslip.analyses.backbone.extended_motion import harmonic_backbone
from microslip.analyses.reduced.refined import moment_offset, refined_table
from microslip.analyses.reduced.response import Response, forced_response, greatest_damping_load
from microslip.analyses.reduced.table import DRIVES, EquivalentTable, equivalent_table
from microslip.analyses.reduced.trust import error_indicator
from microslip.analyses.reduced.two_mode import TwoModeModel, two_mode_model
from microslip.analyses.statics.cycle import (
    Cycle,
    Prestress,
    opening_load,
    prestress,
    quasi_static_cycle,
)
from microslip.analyses.statics.joint_modes import JointMode, joint_modes, pick_mode
from microslip.analyses.statics.linear_states import LinearStates, linear_states
from microslip.analyses.statics.prescribed import hold_mode
from microslip.analyses.time.history import History
from microslip.analyses.time.points import Request, TimePoint, steady_states
from microslip.describe.lap import LapJoint
from microslip.errors import ContactError, InputError, MicroslipError, ModelError
from microslip.model.flexibility import Flexibility, static_flexibility, with_compliance
from microslip.model.joint import JointModel, Reducer
from microslip.model.lap import structure_of
from microslip.model.structure import Structure
from microslip.numerics.execute import in_threads, workers
from microslip.pipeline.excitation import prepare_histories
from microslip.pipeline.harmonic import HarmonicRun, loads_of_file, run_harmonic_loads
from microslip.pipeline.histories import contact_compliance, run_histories
from microslip.pipeline.progress import NullProgress, Progress
from microslip.typing import Array


@dataclass(frozen=True)
class JointAssembly:
    """A described joint made ready for every analysis.

    Attributes
    ----------
    joint : LapJoint
    structure : Structure
    reducer : Reducer
    model : JointModel
        Ports: the structure's loads, ``sliding`` and ``stuck`` (modal inertia loads).
    flexibility : Flexibility
        Static, with the contact compliance where the contact is elastic.
    prestress : Prestress
    states : LinearStates
    opening_moment : float
        End moment that opens the joint, N m per metre of width.
    """

    joint: LapJoint
    structure: Structure
    reducer: Reducer
    model: JointModel
    flexibility: Flexibility
    prestress: Prestress
    states: LinearStates
    opening_moment: float

    @property
    def compliance(self) -> Array:
        """Contact compliance of every component of v, m/N; zeros where the contact is rigid."""
        compliance: Array = np.diag(self.flexibility.W - static_flexibility(self.model).W)
        return compliance

    @property
    def moment_unit(self) -> float:
        """P L: moments are reported over it."""
        return self.joint.clamp.force * self.joint.beams.length


@dataclass
class LapRun:
    """Everything a run computed; analyses that were not asked for are empty.

    Attributes
    ----------
    joint : LapJoint
    assembly : JointAssembly
    cycles : dict of str to list of Cycle
        By drive, ascending load.
    moments : dict of str to list of float
        End moment of each cycle; for drive ``mode`` the one as close to opening the joint.
    tables : dict of str to EquivalentTable
    responses : list of Response
    frictionless : Response or None
        The joint without friction under the first load, eq. (18).
    backbones : list of Backbone
        By mode, then method, as asked for.
    harmonic : list of HarmonicRun
        Responses by harmonic balance, one entry per load.
    time_domain : list of TimePoint
    histories : list of History
    moment_offset : float
        c of the refined model, `refined.moment_offset`.
    rho_scale : float
        C in ``rho = C mu P L / M``; nan where loads were given as moments.
    failures : list of str
        Points that could not be solved, and why.
    timings : dict of str to float
        Seconds of wall time per stage.
    interrupted : bool
    """

    joint: LapJoint
    assembly: JointAssembly
    cycles: dict[str, list[Cycle]] = field(default_factory=dict)
    moments: dict[str, list[float]] = field(default_factory=dict)
    tables: dict[str, EquivalentTable] = field(default_factory=dict)
    responses: list[Response] = field(default_factory=list)
    frictionless: Response | None = None
    backbones: list[Backbone] = field(default_factory=list)
    harmonic: list[HarmonicRun] = field(default_factory=list)
    time_domain: list[TimePoint] = field(default_factory=list)
    histories: list[History] = field(default_factory=list)
    moment_offset: float = np.nan
    rho_scale: float = np.nan
    failures: list[str] = field(default_factory=list)
    timings: dict[str, float] = field(default_factory=dict)
    interrupted: bool = False

    @property
    def states(self) -> LinearStates:
        """Sliding and stuck mode."""
        return self.assembly.states

    @property
    def prestress(self) -> Prestress:
        """Contact under the clamp alone."""
        return self.assembly.prestress

    @property
    def model(self) -> JointModel:
        """The reduced model every analysis ran on."""
        return self.assembly.model

    @property
    def structure(self) -> Structure:
        """The finite elements."""
        return self.assembly.structure


def assemble_joint(joint: LapJoint) -> JointAssembly:
    """Mesh, matrices, reduction, prestress and linear states of a described joint.

    Raises
    ------
    ModelError, ContactError
    """
    structure = structure_of(joint)
    modes = min(joint.mesh.modes, structure.dofs // 4)
    reducer = Reducer(structure, modes, (joint.damping.alpha, joint.damping.beta))
    model = reducer.model(structure.loads)
    flexibility = contact_flexibility(joint, model)
    start = prestress(model, flexibility, joint.clamp.force)
    states = linear_states(structure, np.flatnonzero(start.touching), "moment")
    model = reducer.with_ports(model, states.ports(structure))
    flexibility = contact_flexibility(joint, model)
    return JointAssembly(
        joint=joint,
        structure=structure,
        reducer=reducer,
        model=model,
        flexibility=flexibility,
        prestress=start,
        states=states,
        opening_moment=opening_load(model, flexibility, start, "moment"),
    )


def contact_flexibility(joint: LapJoint, model: JointModel) -> Flexibility:
    """Static flexibility of the model, behind the contact stiffness of an elastic contact."""
    flexibility = static_flexibility(model)
    contact = joint.contact
    if contact.law == "exact":
        return flexibility
    compliance = np.zeros(2 * model.pairs)
    if contact.normal_stiffness:
        compliance[0::2] = 1 / (contact.normal_stiffness * model.area)
    if contact.tangential_stiffness:
        compliance[1::2] = 1 / (contact.tangential_stiffness * model.area)
    return with_compliance(flexibility, compliance)


def cycle_loads(assembly: JointAssembly, drive: str) -> tuple[Array, Array]:
    """Amplitudes on the port of a drive, and the end moments they correspond to.

    The modal inertia load that corresponds to an end moment is the same fraction of the load that
    opens the joint: both shift the resultant of the contact pressure equally far.
    """
    moments = np.asarray(assembly.joint.cycle_amplitudes()) * assembly.moment_unit
    if drive == "moment":
        return moments, moments
    a = assembly
    opening = opening_load(a.model, a.flexibility, a.prestress, DRIVES[drive])
    return moments * opening / a.opening_moment, moments


def run_cycles(result: LapRun, drive: str, progress: Progress) -> None:
    """Steady cycles of one drive at every amplitude, and their table, into `result`."""
    a, joint = result.assembly, result.joint
    settings = joint.analysis.cycle
    assert settings is not None
    loads, moments = cycle_loads(a, drive)
    progress.start(f"quasi-static cycles, {drive}-driven", len(loads))
    done: list[Cycle] = []
    kept: list[float] = []
    result.cycles[drive], result.moments[drive] = done, kept

    def one(load: float) -> Cycle | ContactError:
        try:
            return quasi_static_cycle(
                a.model,
                a.flexibility,
                a.prestress,
                DRIVES[drive],
                load,
                joint.contact.friction,
                steps=settings.steps,
                max_cycles=settings.max_cycles,
                closure=settings.closure,
            )
        except ContactError as error:
            return error

    for moment, outcome in zip(moments, in_threads(one, loads, workers()), strict=True):
        if isinstance(outcome, Cycle):
            done.append(outcome)
            kept.append(float(moment))
        else:
            ratio = moment / a.moment_unit
            result.failures.append(f"{drive} cycle at M/(PL) = {ratio:.3g}: {outcome}")
        progress.advance()
    progress.finish()
    if len(done) >= 2:
        result.tables[drive] = equivalent_table(done, a.model, a.states, joint.clamp.force, drive)


TABLE_OF = {"printed": "moment", "consistent": "mode", "refined": "prescribed"}
"""Drive of the table that each variant uses by default: the paper's, and the dynamic ones."""

BELOW = 0.1
"""Smallest amplitude of the refined table over that of the other: there the joint sticks."""


def run_refined(result: LapRun, progress: Progress) -> None:
    """Table of the refined model over the amplitudes of the other tables, into `result`."""
    joint, a = result.joint, result.assembly
    settings = joint.analysis.reduced
    if not result.tables or joint.contact.friction == 0:
        return
    sizes = result.tables.get("mode", next(iter(result.tables.values()))).amplitude
    held = hold_mode(
        a.model,
        a.prestress,
        a.states,
        joint.contact.friction,
        0.5 * (a.states.sliding_omega + a.states.stuck_omega),
        upper=settings.upper_modes,
        compliance=a.compliance,
    )
    smallest = BELOW * float(sizes[0])
    progress.start("cycles, mode prescribed", settings.amplitudes)
    table, failures = refined_table(
        held,
        smallest,
        float(sizes[-1]),
        settings.amplitudes,
        steps=settings.steps,
        cycles=settings.max_cycles,
        advance=progress.advance,
    )
    result.tables["prescribed"] = table
    result.failures += failures
    result.moment_offset = moment_offset(held, smallest)
    progress.finish()


def run_responses(result: LapRun, progress: Progress) -> None:
    """Forced response of every variant and load, into `result`."""
    joint, a = result.joint, result.assembly
    settings = joint.analysis.response
    assert settings is not None
    frequency = np.linspace(settings.from_, settings.to, settings.count)
    rayleigh = (joint.damping.alpha, joint.damping.beta)
    models: dict[str, tuple[TwoModeModel, EquivalentTable]] = {}
    for variant in joint.variants:
        drive = TABLE_OF[variant]
        if drive not in result.tables and variant != "refined":
            drive = next((name for name in result.tables if name != "prescribed"), "")
        if drive in result.tables:
            offset = result.moment_offset if variant == "refined" else 0.0
            models[variant] = (
                two_mode_model(a.states, "moment", rayleigh, variant, offset),
                result.tables[drive],
            )
    if not models:
        result.failures.append("no forced response: no table of equivalent stiffness and damping")
        return
    loads = _response_loads(result, models, frequency)
    progress.start("forced response", len(loads) * len(models))
    linear = two_mode_model(a.states, "moment", rayleigh, "consistent")
    result.frictionless = forced_response(
        linear, None, frequency, loads[0][1], rho=0.0, friction=0.0, variant="frictionless"
    )
    for rho, moment in loads:
        for name, (model, table) in models.items():
            frictionless = rho == 0 or joint.contact.friction == 0
            response = forced_response(
                model,
                None if frictionless else table,
                frequency,
                moment,
                rho=rho,
                friction=0.0 if frictionless else joint.contact.friction,
                variant=name,
                tolerance=settings.tolerance,
                max_iterations=settings.max_iterations,
            )
            if not frictionless and "refined" in models:
                indicator = error_indicator(response, *models["refined"])
                response = replace(response, error_indicator=indicator)
            result.responses.append(response)
            if len(response.unconverged):
                bad = response.unconverged
                result.failures.append(
                    f"{name} response, M = {moment:.4g} N m/m: {len(bad)} of {len(frequency)} "
                    f"points have no answer in the table, {bad.min():.2f} to {bad.max():.2f} Hz"
                )
            progress.advance()
    progress.finish()


def _response_loads(
    result: LapRun, models: dict[str, tuple[TwoModeModel, EquivalentTable]], frequency: Array
) -> list[tuple[float, float]]:
    """Pairs (rho, end moment) of the loads that the input asks for."""
    joint, a = result.joint, result.assembly
    load = joint.load
    assert load is not None
    strength = joint.contact.friction * a.moment_unit
    if load.rho is None:
        moments = joint.load_moments()
        return [(strength / m if m else np.nan, m) for m in moments]
    if load.rho_scale is not None:
        result.rho_scale = load.rho_scale
    elif strength == 0:
        result.rho_scale = 1.0
    else:
        name = next(v for v in ("refined", "consistent", "printed") if v in models)
        band = np.linspace(0.9 * a.states.sliding_frequency, 1.1 * a.states.stuck_frequency, 1201)
        best = greatest_damping_load(*models[name], band, _search_bounds(a, models[name]))
        result.rho_scale = load.greatest_damping_at * best / strength
    top = result.rho_scale * strength
    gentle = _gentle_load(result, frequency)
    return [(r, top / r if r > 0 and top > 0 else gentle) for r in load.rho]


def _gentle_load(result: LapRun, frequency: Array) -> float:
    """Load for the frictionless joint: its peak is the smallest amplitude of the tables."""
    joint, states = result.joint, result.states
    rayleigh = (joint.damping.alpha, joint.damping.beta)
    linear = two_mode_model(states, "moment", rayleigh, "consistent")
    peak = forced_response(linear, None, frequency, 1.0).peak_amplitude
    return float(min(table.amplitude[0] for table in result.tables.values()) / peak)


def _search_bounds(
    a: JointAssembly, model: tuple[TwoModeModel, EquivalentTable]
) -> tuple[float, float]:
    """Loads whose resonance could lie in the table: from lightly damped to gross slip."""
    two_mode, table = model
    force = max(abs(two_mode.force[0]), 1e-300)
    scale = two_mode.omega**2 / force
    return (1e-5 * table.amplitude[0] * scale, table.amplitude[-1] * scale)


def backbone_modes(assembly: JointAssembly) -> list[JointMode]:
    """The modes whose backbones are asked for.

    Raises
    ------
    InputError
        Where the joint has no mode of some number.
    """
    settings = assembly.joint.analysis.backbone
    if settings is None:
        return []
    modes = joint_modes(assembly.model, assembly.prestress, assembly.compliance)
    try:
        return [pick_mode(modes, number) for number in settings.modes]
    except ModelError as error:
        raise InputError(f"analysis.backbone.modes = {list(settings.modes)}: {error}") from None


def run_backbones(result: LapRun, modes: list[JointMode], progress: Progress) -> None:
    """Backbones of the modes by every method, into `result`."""
    joint, a = result.joint, result.assembly
    settings = joint.analysis.backbone
    assert settings is not None
    control = CycleControl(settings.steps, settings.max_cycles)
    for mode in modes:
        scale = amplitude_scale(a.model, a.prestress, mode)
        if not np.isfinite(scale):
            result.failures.append(
                f"backbone of mode {mode.number}: it does not move the interface; at every "
                f"amplitude {mode.stuck_frequency:.6g} Hz with the damping of the material"
            )
            continue
        sizes = geometric(settings.smallest * scale, settings.largest * scale, settings.count)
        for method in settings.methods:
            name = method.replace("_", "-")
            progress.start(f"backbone of mode {mode.number}, {name}", len(sizes))
            what = (a.model, a.prestress, mode, joint.contact.friction, sizes)
            if method == "harmonic":
                found = harmonic_backbone(
                    *what,
                    compliance=a.compliance,
                    harmonics=settings.harmonics,
                    advance=progress.advance,
                )
            else:
                by_cycles = (
                    quasi_static_backbone if method == "quasi_static" else prescribed_backbone
                )
                found = by_cycles(
                    *what, compliance=a.compliance, control=control, advance=progress.advance
                )
            result.backbones.append(found[0])
            result.failures += found[1]
            progress.finish()


def run_harmonic(result: LapRun, progress: Progress) -> None:
    """Periodic responses by harmonic balance under every load, into `result`."""
    joint, a = result.joint, result.assembly
    settings, load = joint.analysis.harmonic, joint.load
    assert settings is not None
    assert load is not None
    loads = list(dict.fromkeys((r.rho, r.load) for r in result.responses))
    if not loads:
        if load.rho is not None and any(load.rho) and load.rho_scale is None:
            result.failures.append(
                "harmonic balance: rho has no scale: the forced response that calibrates it failed"
            )
            return
        loads = loads_of_file(a)
        result.rho_scale = load.rho_scale or np.nan
    run_harmonic_loads(a, settings, loads, result.harmonic, result.failures, progress)


def run_time_domain(result: LapRun, progress: Progress) -> None:
    """Steady states by time integration at every load and frequency, into `result`."""
    joint, a = result.joint, result.assembly
    settings = joint.analysis.time
    assert settings is not None
    responses = {r.load: r for r in result.responses if r.variant == "refined"}
    responses = responses or {r.load: r for r in result.responses if r.variant == "consistent"}
    responses = responses or {r.load: r for r in result.responses}
    requests = []
    for response in responses.values():
        real = np.interp(settings.band(), response.frequency, response.amplitude.real)
        imag = np.interp(settings.band(), response.frequency, response.amplitude.imag)
        for f, guess in zip(settings.band(), real + 1j * imag, strict=True):
            requests.append(
                Request(
                    rho=response.rho,
                    frequency=f,
                    load=response.load,
                    friction=response.friction,
                    guess=complex(guess),
                    steps=settings.steps,
                    tolerance=settings.tolerance,
                    max_cycles=settings.max_cycles,
                    accelerate=settings.search == "accelerated",
                )
            )
    progress.start("time domain", len(requests))
    for outcome in steady_states(a.model, a.prestress, requests, contact_compliance(a), workers()):
        if isinstance(outcome, str):
            result.failures.append(outcome)
        else:
            result.time_domain.append(outcome)
            if not outcome.steady.converged:
                result.failures.append(
                    f"time domain, rho = {outcome.rho:g}, {outcome.steady.frequency:g} Hz: not "
                    f"steady after {outcome.steady.cycles} cycles, last change "
                    f"{outcome.steady.change:.1e}"
                )
        progress.advance()
    result.time_domain.sort(key=lambda p: (p.rho, p.steady.load, p.steady.frequency))
    progress.finish()


def _rho_scale(result: LapRun) -> float:
    """C in ``rho = C mu P L / M``, as calibrated or as given."""
    load = result.joint.load
    given = load.rho_scale if load is not None else None
    return result.rho_scale if given is None else given


@contextmanager
def _timed(timings: dict[str, float], name: str) -> Iterator[None]:
    start = time.perf_counter()
    try:
        yield
    finally:
        timings[name] = timings.get(name, 0.0) + time.perf_counter() - start


def run_lap_joint(joint: LapJoint, progress: Progress | None = None) -> LapRun:
    """Run all the analyses that a lap-joint description asks for.

    Parameters
    ----------
    joint : LapJoint
        From `microslip.load_joint`.
    progress : Progress, optional
        Told of every long step.

    Returns
    -------
    LapRun
        Failed points are listed in ``failures``; Ctrl-C between pieces sets ``interrupted`` and
        keeps what was done.

    Raises
    ------
    MicroslipError
        Where the joint itself cannot be assembled, or a signal cannot be used.
    """
    progress = progress or NullProgress()
    timings: dict[str, float] = {}
    with threadpool_limits(1):
        with _timed(timings, "assemble"):
            progress.start("finite elements, reduction, prestress", 1)
            assembly = assemble_joint(joint)
            progress.advance()
            progress.finish()
        result = LapRun(joint=joint, assembly=assembly, timings=timings)
        prepared = prepare_histories(joint.analysis.history, assembly.states.sliding_frequency)
        modes = backbone_modes(assembly)
        try:
            if modes:
                with _timed(timings, "backbones"):
                    run_backbones(result, modes, progress)
            if joint.analysis.cycle is not None:
                for drive in joint.analysis.cycle.drives:
                    with _timed(timings, f"cycles_{drive}"):
                        run_cycles(result, drive, progress)
            if joint.analysis.response is not None:
                if "refined" in joint.variants:
                    with _timed(timings, "cycles_prescribed"):
                        run_refined(result, progress)
                with _timed(timings, "response"):
                    try:
                        run_responses(result, progress)
                    except ContactError:
                        raise
                    except MicroslipError as error:
                        result.failures.append(f"forced response: {error}")
            if joint.analysis.harmonic is not None:
                with _timed(timings, "harmonic"):
                    run_harmonic(result, progress)
            if joint.analysis.time is not None and result.responses:
                with _timed(timings, "time_domain"):
                    run_time_domain(result, progress)
            if prepared:
                scale = _rho_scale(result)
                with _timed(timings, "histories"):
                    run_histories(
                        assembly, prepared, scale, result.histories, result.failures, progress
                    )
        except KeyboardInterrupt:
            result.interrupted = True
    timings["total"] = sum(timings.values())
    return result
