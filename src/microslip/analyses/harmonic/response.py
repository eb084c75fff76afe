"""Periodic responses of a joint by harmonic balance: over frequency, over load, and their peaks.

The equations of `harmonic.py` are handed to `continuation.py` with the frequency (Hz) or the load as
parameter. A frequency response is begun by raising the load from zero at its first frequency; then its
branch is followed through folds; then the equations are solved at the frequencies asked for, once for
every time the branch passes them.
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from microslip.analyses.harmonic.equations import (
    Array,
    Complex,
    Evaluation,
    HarmonicProblem,
    LinearOperator,
    evaluate,
    frequency_derivative,
    linear_operator,
    load_derivative,
    padded,
    pull,
    to_complex,
    walking,
    with_harmonics,
)
from microslip.analyses.harmonic.linear import HarmonicSolver
from microslip.errors import MicroslipError
from microslip.numerics.continuation import (
    Branch,
    BranchPoint,
    ContinuationError,
    StepControl,
    crossings,
    first_point,
    fold,
    locate,
    solve_at,
    trace,
)

ACCEPTED = 1e-8
"""Residual of a solution, relative to the largest prestress reaction."""


@dataclass(frozen=True)
class HarmonicPoint:
    """A periodic response.

    Attributes
    ----------
    frequency, load : float
        Hz, and amplitude of the driven port.
    harmonics : int
    w : (n,) array
        Unknowns of the equations.
    output : (H + 1, p) complex array
        Harmonics of the outputs of all ports, change from prestress; the mean first.
    amplitude : complex
        First harmonic of the port ``sliding``, against the load's sine; nan without that port.
    r, v : (2 m, 2 H + 1) arrays
        Coefficients of reactions (N/m) and relative displacements (m), order of `contact/aft.py`.
    status : (m, N) int8 array
        Contact states over the cycle.
    friction_work : (m,) array
        Energy dissipated per cycle at each pair, J per metre of width.
    normal_work : float
        Work of the normal reactions per cycle: an error of truncation, tends to zero with H.
    external_work, material_work : float
        Work per cycle of the load, and of the material damping.
    strain, kinetic : float
        Mean energies of the vibration over a cycle (the static mean left out).
    walk : float
        Drift of the bodies past each other, m per cycle (mean over the pairs).
    pull : float
        Mean force of the supports against sliding over the friction available; where it is large the
        supports have stopped a walk.
    residual : float
        Largest entry of the equations over the largest prestress reaction.
    tail : float
        Share of the last two harmonics in the vibrating reactions (root of sums of squares).
    iterations : int
        Newton steps.
    seconds : float
    """

    frequency: float
    load: float
    harmonics: int
    w: Array
    output: Complex
    amplitude: complex
    r: Array
    v: Array
    status: NDArray[np.int8]
    friction_work: Array
    normal_work: float
    external_work: float
    material_work: float
    strain: float
    kinetic: float
    walk: float
    pull: float
    residual: float
    tail: float
    iterations: int
    seconds: float

    @property
    def phase(self) -> float:
        """Phase of the sliding coordinate against the load, rad."""
        return float(np.angle(self.amplitude))

    @property
    def dissipated(self) -> float:
        """Friction work per cycle, J per metre of width."""
        return float(self.friction_work.sum())


class _Equations:
    """Equations at one point, scaled, with their derivative (`continuation.Linearised`)."""

    def __init__(
        self,
        operator: LinearOperator,
        frequency: float,
        load: float,
        w: Array,
        solver: HarmonicSolver,
        parameter: str,
    ) -> None:
        self.operator = operator
        self.frequency = float(frequency)
        self.load = float(load)
        self.solver = solver
        self.parameter = parameter
        self.scale = operator.problem.force_scale
        self.point: Evaluation = evaluate(operator, load, w)

    @property
    def F(self) -> Array:
        return self.point.F / self.scale

    def solve(self, right: Array, tolerance: float) -> Array:
        return self.solver.linear_solve(
            self.operator, self.point.cycle, right * self.scale, tolerance
        )

    def by_parameter(self) -> Array:
        if self.parameter == "load":
            return load_derivative(self.operator, self.point) / self.scale
        slope = frequency_derivative(self.operator, self.point, self.load)
        return slope * (2 * np.pi / self.scale)


class _Path:
    """What both parameters share (`continuation.Problem`)."""

    def __init__(self, problem: HarmonicProblem, scale: float) -> None:
        self.problem = problem
        self.solver = HarmonicSolver()
        reactions = np.full(problem.shape, 1 / (problem.force_scale**2 * len(problem.pairs)))
        self.weight = np.concatenate([reactions.ravel(), np.zeros(problem.rigid_modes.shape[1])])
        self.parameter_scale = scale


class FrequencyPath(_Path):
    """Response at a given load, the frequency (Hz) as parameter.

    Parameters
    ----------
    problem : HarmonicProblem
    load : float
    scale : float
        Hz that count as a step of length one.
    """

    def __init__(self, problem: HarmonicProblem, load: float, scale: float = 1.0) -> None:
        super().__init__(problem, scale)
        self.load = float(load)

    def at(self, w: Array, frequency: float) -> _Equations:
        """Equations at a frequency."""
        if not frequency > 0:
            raise ContinuationError(f"frequency {frequency:g} Hz must be positive")
        operator = linear_operator(self.problem, 2 * np.pi * frequency)
        return _Equations(operator, frequency, self.load, w, self.solver, "frequency")


class LoadPath(_Path):
    """Response at a given frequency, the load as parameter.

    Parameters
    ----------
    problem : HarmonicProblem
    frequency : float
        Hz.
    scale : float
        Load that counts as a step of length one.
    """

    def __init__(self, problem: HarmonicProblem, frequency: float, scale: float) -> None:
        super().__init__(problem, scale)
        self.frequency = float(frequency)
        self.operator = linear_operator(problem, 2 * np.pi * frequency)

    def at(self, w: Array, load: float) -> _Equations:
        """Equations under a load."""
        return _Equations(self.operator, self.frequency, load, w, self.solver, "load")


def describe(equations: _Equations, iterations: int, seconds: float) -> HarmonicPoint:
    """Everything a user wants to know of a solution."""
    operator, load, point = equations.operator, equations.load, equations.point
    problem = operator.problem
    model = problem.model
    u, q = problem.split(point.w)
    r, v = problem.unfold(u), problem.unfold(point.v)
    output = operator.outputs(u, q, load)
    rest = operator.outputs(*problem.split(problem.rest()), 0.0)
    output[0] -= rest[0]
    h = np.arange(1, problem.harmonics + 1)[:, None]
    R, V = to_complex(r)[1:], to_complex(v)[1:]
    eta = operator.modes(u, q, load)[1:]
    twice_static = _residual_energy(operator, R, load) * np.abs(operator.lag[1:]) ** 2
    damping = h[:, 0] * operator.omega * model.rayleigh[1]
    modal = h**2 * operator.omega * model.modal_damping() * np.abs(eta) ** 2
    status = point.cycle.status
    if problem.half_turn:
        half = np.roll(status[:0:-1], problem.table.samples // 2, axis=1)
        status = np.vstack([half, status])
    amplitude = complex(np.nan)
    if "sliding" in model.ports:
        amplitude = complex(output[1, model.port("sliding")])
    work = np.pi * np.sum(h * (R * V.conj()).imag, axis=0)
    size = np.sum(np.abs(R) ** 2, axis=1)
    return HarmonicPoint(
        frequency=equations.frequency,
        load=load,
        harmonics=problem.harmonics,
        w=point.w,
        output=output,
        amplitude=amplitude,
        r=r,
        v=v,
        status=status,
        friction_work=work[1::2],
        normal_work=float(work[0::2].sum()),
        external_work=float(np.pi * load * -output[1, model.port(problem.port)].imag),
        material_work=float(np.pi * (modal.sum() + (h[:, 0] * damping * twice_static).sum())),
        strain=float(0.25 * (np.sum(model.omega**2 * np.abs(eta) ** 2) + twice_static.sum())),
        kinetic=float(0.25 * np.sum((h * operator.omega * np.abs(eta)) ** 2)),
        walk=float(problem.drift(point.w[u.size :]).mean()),
        pull=pull(problem, point.w),
        residual=float(np.abs(equations.F).max()),
        tail=float(np.sqrt(size[-2:].sum() / max(size.sum(), 1e-300))),
        iterations=iterations,
        seconds=seconds,
    )


def _residual_energy(operator: LinearOperator, R: Complex, load: float) -> Array:
    """Twice the static energy of the truncated modes per harmonic, were they not to lag."""
    problem, model = operator.problem, operator.problem.model
    p = model.port(problem.port)
    pairs = model.residual + np.diag(problem.compliance)
    energy = np.sum(R.conj() * (R @ pairs), axis=1).real
    energy[0] += load**2 * model.port_port[p, p] - 2 * load * (R[0] @ model.port_v[:, p]).real
    return energy


@dataclass(frozen=True)
class HarmonicResponse:
    """Responses along one branch, or two that do not meet in the range.

    Attributes
    ----------
    points : tuple of HarmonicPoint
        In order along the branches; where they fold, the same frequency comes more than once.
    branch_of : tuple of int
        Which branch each point is on.
    branches : tuple of Branch
        As they were followed, to restart from; parameter Hz or load.
    folds : tuple of HarmonicPoint
        Where the parameter turns round.
    failures : tuple of str
        What was not found, and why.
    """

    points: tuple[HarmonicPoint, ...]
    branch_of: tuple[int, ...]
    branches: tuple[Branch, ...]
    folds: tuple[HarmonicPoint, ...]
    failures: tuple[str, ...]


@dataclass(frozen=True)
class Adaptive:
    """Choice of the number of harmonics: four more until the last two are small.

    Attributes
    ----------
    tolerance : float
        Of `HarmonicPoint.tail`.
    most : int
        Harmonics at most.
    """

    tolerance: float = 0.03
    most: int = 21


ADDED = 4
"""Harmonics added at a time."""

PULL = 1e-4
"""`HarmonicPoint.pull` beyond which a joint is let go to walk."""

CONTROL = StepControl(
    first=0.02, smallest=1e-6, largest=0.5, good_iterations=6, tolerance=0.1 * ACCEPTED
)
"""Steps along a response; a step of length one changes every reaction by the prestress's largest."""


def raise_load(
    problem: HarmonicProblem, frequency: float, load: float, control: StepControl = CONTROL
) -> tuple[Array, Branch]:
    """Raise the load from zero at one frequency; returns the unknowns and the branch.

    Raises
    ------
    ContinuationError
        Where the load cannot be reached: names how far it got.
    """
    path = LoadPath(problem, frequency, load)
    start = first_point(path, problem.rest(), 0.0, control)
    branch = trace(path, start, (min(0.0, load), max(0.0, load)), control)
    if branch.points[-1].p != load:
        raise ContinuationError(
            f"harmonic balance at {frequency:.6g} Hz: the load got to {branch.points[-1].p:.4g} of "
            f"{load:.4g} only ({branch.ended}); start farther from the resonance"
        )
    return branch.points[-1].u, branch


def follow_frequency(
    problem: HarmonicProblem,
    load: float,
    band: tuple[float, float],
    *,
    start: BranchPoint | None = None,
    control: StepControl = CONTROL,
    observe: Callable[[BranchPoint], bool] | None = None,
) -> tuple[FrequencyPath, Branch]:
    """Follow the response from the first frequency of the band to the second, through folds.

    Parameters
    ----------
    problem : HarmonicProblem
    load : float
    band : (float, float)
        Hz; the branch is begun at the first, which may be the higher one.
    start : BranchPoint, optional
        Point of an earlier branch of the same problem to go on from.
    """
    first, last = band
    if not (first > 0 and last > 0 and first != last):
        raise MicroslipError(f"the band {first:g} to {last:g} Hz needs two positive frequencies")
    path = FrequencyPath(problem, load)
    if start is None:
        w, _ = raise_load(problem, first, load, control)
        start = first_point(path, w, first, control, np.sign(last - first))
    return path, trace(path, start, (min(band), max(band)), control, observe)


def frequency_response(
    problem: HarmonicProblem,
    load: float,
    frequencies: Sequence[float] | Array,
    *,
    adaptive: Adaptive | None = None,
    control: StepControl = CONTROL,
    observe: Callable[[float], None] | None = None,
    solved: Callable[[float], None] | None = None,
    stop: Callable[[], bool] | None = None,
) -> HarmonicResponse:
    """Responses at given frequencies, on all branches that start at either end of them.

    Parameters
    ----------
    problem : HarmonicProblem
        Its harmonics are used for the branch, and for the points unless `adaptive`.
    load : float
        Amplitude of the driven port.
    frequencies : (n,) array
        Hz, at least two, ascending or descending; the first should be away from the resonance.
    adaptive : Adaptive, optional
        Grow the number of harmonics at each point.
    observe : callable, optional
        Called with every frequency reached along the branch.
    solved : callable, optional
        Called with every frequency at which all responses were looked for.
    stop : callable, optional
        Asked at every point; once it says True, what has been found is returned.

    Raises
    ------
    ContinuationError
        Where not even the first frequency is solved; later failures are in the result.
    """
    wanted = np.asarray(frequencies, dtype=float)
    if len(wanted) < 2 or not np.isfinite(wanted).all():
        raise MicroslipError("a frequency response needs at least two finite frequencies")

    def tell(point: BranchPoint) -> bool:
        if observe is not None:
            observe(point.p)
        return stopped()

    def stopped() -> bool:
        return stop is not None and stop()

    first, last = float(wanted[0]), float(wanted[-1])
    path, branch = follow_frequency(problem, load, (first, last), control=control, observe=tell)
    branches, failures = [branch], []
    if branch.ended != "range":
        failures.append(f"branch at load {load:.4g} from {first:.6g} Hz: {branch.ended}")
    if branch.points[-1].p != last and not stopped():
        try:
            _, other = follow_frequency(problem, load, (last, first), control=control, observe=tell)
        except ContinuationError as error:
            failures.append(str(error))
        else:
            if other.ended != "range":
                failures.append(f"branch at load {load:.4g} from {last:.6g} Hz: {other.ended}")
            branches.append(other)
    ladder = _Ladder(path, control)
    points: list[tuple[int, float, HarmonicPoint]] = []
    for frequency in map(float, wanted):
        if stopped():
            failures.append(f"load {load:.4g}: stopped before {frequency:.6g} Hz")
            break
        guesses = [
            (number, place, guess)
            for number, way in enumerate(branches)
            for guess, place in crossings(way.points, frequency)
        ]
        if not guesses:
            failures.append(f"{frequency:.6g} Hz at load {load:.4g}: not on the branch found")
        for number, place, guess in guesses:
            try:
                try:
                    point = ladder.solve(guess, frequency, adaptive)
                except ContinuationError:
                    nearer = _along(path, branches[number], place, frequency, control)
                    point = ladder.solve(nearer, frequency, adaptive)
            except ContinuationError as error:
                failures.append(f"{frequency:.6g} Hz at load {load:.4g}: {error}")
                continue
            if any(_same(point, old) for _, _, old in points):
                continue
            if point.pull > PULL:
                failures.append(
                    f"{frequency:.6g} Hz at load {load:.4g}: the joint walks, and no steady walk was "
                    f"found; its supports hold it with {point.pull:.1e} of the friction"
                )
            if adaptive is not None and point.tail > adaptive.tolerance:
                failures.append(
                    f"{frequency:.6g} Hz at load {load:.4g}: with {point.harmonics} harmonics the "
                    f"last two still hold {point.tail:.1e} of the vibrating reactions"
                )
            share = abs(frequency - branches[number].points[place].p)
            points.append((number, place + share / (share + 1), point))
        if solved is not None:
            solved(frequency)
    points.sort(key=lambda item: item[:2])
    folds = []
    for way in branches:
        for index in way.folds:
            try:
                turn = fold(path, way, index, control)
                folds.append(describe(path.at(turn.u, turn.p), turn.iterations, 0.0))
            except ContinuationError as error:
                failures.append(f"fold near {way.points[index].p:.6g} Hz: {error}")
    return HarmonicResponse(
        points=tuple(point for _, _, point in points),
        branch_of=tuple(number for number, _, _ in points),
        branches=tuple(branches),
        folds=tuple(folds),
        failures=tuple(failures),
    )


def _along(
    path: FrequencyPath, branch: Branch, place: int, frequency: float, control: StepControl
) -> Array:
    """Unknowns at a frequency that the branch passes after a point, in smaller steps than before.

    Raises
    ------
    ContinuationError
        Where those do not get there.
    """
    start = branch.points[place]
    near = replace(start, step=0.1 * start.step)
    bounds = (min(start.p, frequency), max(start.p, frequency))
    way = trace(path, near, bounds, control)
    if way.points[-1].p != frequency:
        raise ContinuationError(f"the branch after {start.p:.6g} Hz was not found again")
    return way.points[-1].u


def _same(one: HarmonicPoint, other: HarmonicPoint) -> bool:
    """The same response, found twice."""
    if one.frequency != other.frequency or one.harmonics != other.harmonics:
        return False
    size = np.abs(other.output[1]).max()
    return bool(np.abs(one.output[1] - other.output[1]).max() <= 1e-4 * size)


class _Ladder:
    """Paths with more and more harmonics, held or walking, each with its factorisation to reuse."""

    def __init__(self, path: FrequencyPath, control: StepControl) -> None:
        self.paths = {(path.problem.harmonics, False): path}
        self.base = path
        self.control = control

    def solve(self, w: Array, frequency: float, adaptive: Adaptive | None) -> HarmonicPoint:
        """Solve with the harmonics of the branch; let go a joint that walks; add harmonics.

        Where the second or the third does not succeed, the point before it is returned; its `pull`
        and its `tail` say so.
        """
        began = clock.perf_counter()
        problem = self.base.problem
        point = self._point(problem, w, frequency, 0, began)
        if point.pull > PULL:
            released, guess = walking(problem, point.w)
            try:
                point = self._point(released, guess, frequency, point.iterations, began)
            except ContinuationError:
                pass
            else:
                problem = released
        while adaptive is not None and point.tail > adaptive.tolerance:
            if problem.harmonics + ADDED > adaptive.most:
                break
            more = with_harmonics(problem, problem.harmonics + ADDED)
            guess = padded(problem, more, point.w)
            try:
                point = self._point(more, guess, frequency, point.iterations, began)
            except ContinuationError:
                break
            problem = more
        return point

    def _point(
        self, problem: HarmonicProblem, w: Array, frequency: float, before: int, began: float
    ) -> HarmonicPoint:
        key = (problem.harmonics, problem.walks)
        if key not in self.paths:
            self.paths[key] = FrequencyPath(problem, self.base.load, self.base.parameter_scale)
        path = self.paths[key]
        _, equations, iterations = solve_at(path, w, frequency, self.control)
        assert isinstance(equations, _Equations)
        return describe(equations, before + iterations, clock.perf_counter() - began)


def amplitude_sweep(
    problem: HarmonicProblem,
    frequency: float,
    loads: Sequence[float] | Array,
    *,
    control: StepControl = CONTROL,
) -> HarmonicResponse:
    """Responses at one frequency under rising loads, all that the branch passes.

    Raises
    ------
    MicroslipError
        Where the loads are not positive.
    """
    wanted = np.asarray(loads, dtype=float)
    if len(wanted) < 1 or not (wanted > 0).all():
        raise MicroslipError("an amplitude sweep needs loads above zero")
    path = LoadPath(problem, frequency, float(wanted.max()))
    start = first_point(path, problem.rest(), 0.0, control)
    branch = trace(path, start, (0.0, float(wanted.max())), control)
    failures = [] if branch.ended == "range" else [f"branch at {frequency:.6g} Hz: {branch.ended}"]
    points = []
    for load in wanted:
        guesses = crossings(branch.points, float(load))
        if not guesses:
            failures.append(f"load {load:.4g} at {frequency:.6g} Hz: not on the branch found")
        for guess, _ in guesses:
            began = clock.perf_counter()
            try:
                _, equations, iterations = solve_at(path, guess, float(load), control)
            except ContinuationError as error:
                failures.append(f"load {load:.4g} at {frequency:.6g} Hz: {error}")
                continue
            assert isinstance(equations, _Equations)
            points.append(describe(equations, iterations, clock.perf_counter() - began))
    folds = [fold(path, branch, index, control) for index in branch.folds]
    return HarmonicResponse(
        points=tuple(points),
        branch_of=(0,) * len(points),
        branches=(branch,),
        folds=tuple(describe(path.at(turn.u, turn.p), turn.iterations, 0.0) for turn in folds),
        failures=tuple(failures),
    )


def resonance_peak(
    path: FrequencyPath, branch: Branch, control: StepControl = CONTROL
) -> HarmonicPoint:
    """The point of largest sliding amplitude on a branch: where it stops growing along the arc.

    Raises
    ------
    ContinuationError
        Where the branch has no peak between its ends.
    """
    slopes = [_growth_of_amplitude(path, point) for point in branch.points]
    peaks = [i for i in range(len(slopes) - 1) if slopes[i] > 0 >= slopes[i + 1]]
    if not peaks:
        low, high = branch.parameters.min(), branch.parameters.max()
        raise ContinuationError(f"no resonance peak between {low:.6g} and {high:.6g} Hz")
    best = max(peaks, key=lambda i: abs(_sliding(path, branch.points[i])))
    began = clock.perf_counter()
    peak = locate(
        path,
        branch.points[best],
        branch.points[best + 1],
        lambda point: _growth_of_amplitude(path, point),
        control,
    )
    return describe(path.at(peak.u, peak.p), peak.iterations, clock.perf_counter() - began)


def resonance_locus(
    problem: HarmonicProblem,
    loads: Sequence[float] | Array,
    band: tuple[float, float],
    control: StepControl = CONTROL,
) -> tuple[list[HarmonicPoint], list[str]]:
    """Peaks of the frequency responses under several loads, and the loads that failed."""
    peaks, failures = [], []
    for load in loads:
        try:
            path, branch = follow_frequency(problem, float(load), band, control=control)
            peaks.append(resonance_peak(path, branch, control))
        except ContinuationError as error:
            failures.append(f"load {load:.4g}: {error}")
    return peaks, failures


def sliding_amplitudes(problem: HarmonicProblem, load: float, branch: Branch) -> Complex:
    """First harmonic of the sliding coordinate at every point of a branch over frequency."""
    path = FrequencyPath(problem, load)
    return np.array([_sliding(path, point) for point in branch.points])


def _sliding(path: FrequencyPath, point: BranchPoint) -> complex:
    operator = linear_operator(path.problem, 2 * np.pi * point.p)
    output = operator.outputs(*path.problem.split(point.u), path.load)
    return complex(output[1, path.problem.model.port("sliding")])


def _growth_of_amplitude(path: FrequencyPath, point: BranchPoint) -> float:
    """Slope of the sliding amplitude along the branch, by a small step of its tangent."""
    step = 1e-6
    u, p = point.u + step * point.tangent_u, point.p + step * point.tangent_p
    ahead = BranchPoint(u, p, point.tangent_u, point.tangent_p, point.step, 0, 0.0)
    return (abs(_sliding(path, ahead)) - abs(_sliding(path, point))) / step
