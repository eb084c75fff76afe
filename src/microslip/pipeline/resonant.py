"""Table of the refined model from resonances of the full joint.

Prescribed cycles give all motion but that of one mode the inertia of the first harmonic at one frequency.
That is right where the joint is its own image under a half turn, so that its contact force has no mean and no
even harmonics, and its sliding mode is like the stuck one, as on a lap joint in the plane. Elsewhere, and in
space above all, the mean and the upper harmonics move modes that lie below the resonance, with a stiffness
that is negative at its frequency, and a load moves close modes beside its own. The full joint knows all of
that: under the load M at omega its steady motion, of amplitude Q in the joint's coordinate, has with
``A = Q + c M``

    kappa(|A|) = ((s phi^T p + D c) M/A - D) / omega_st²,
    D = omega_st² (1 + i omega beta) - omega² + i omega alpha,

with the stuck mode phi (`microslip.analyses.reduced.two_mode.stuck_model`). Where the joint sticks kappa
vanishes and the model is exact. The load is raised from there in steps, each motion followed from those
before (`microslip.pipeline.followed`). In the plane, and where that finds none, it is sought from rest, at
the resonance that the one before leads to expect: where the joint softens that lies above its own, on the
side of the resonance that has one answer. A dozen motions are a table, and between them and for other loads
the response takes microseconds a point.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from microslip.analyses.prepared.direct import direct_motion
from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.prepared.scales import load_scale
from microslip.analyses.reduced.refined import missed
from microslip.analyses.reduced.table import EquivalentTable
from microslip.analyses.reduced.two_mode import TwoModeModel
from microslip.errors import ContactError, Failure, MicroslipError
from microslip.pipeline.brief_motion import BriefMotion, brief_motion
from microslip.pipeline.followed import UNDAMPED, Followed, followed
from microslip.pipeline.walk import DOUBTFUL
from microslip.typing import Array, Complex

GENTLE = 0.02
"""First load over the smallest one that is asked for, ..."""

STICKS = 1e-3
"""... or less, so that the stuck joint resonates at this share of the amplitude that opens it."""

ROOM = 1.1
"""Last load over the largest."""

RISE, STRIDE = 1.8, 4.0
"""Factor between loads, and between those below the first share."""

FEWEST = 4
"""Motions that are a table."""

VISITS = 3
"""Motions under one load at most, each at the resonance that the one before tells."""

QUARTER = 0.5
"""``|Re Z / Im Z|`` below which a motion is at resonance."""

APART = 1.03
"""Amplitudes closer than by this factor are one."""

STICKING = (0.01, 0.1)
"""Amplitudes over the smallest at which kappa falls in proportion, as partial slip does."""

ASTRAY, AGAIN = 0.3, 2
"""Logarithm of a followed motion's load over the one asked for beyond which it is sought again, and how many
are sought at most."""

MISSED, FILLED = 0.01, 4
"""Error of interpolation over what resists the motion beyond which another is sought between two, and how
many at most."""

REACHED = 0.98
"""Share of the last load that the motions have to reach, or it is sought once more."""

LOST = 2
"""Loads in a row without a motion after which the rest is left, but for the first ones below what is asked:
there a joint that hardly damps may take longer to settle than is tried."""


@dataclass(frozen=True)
class Resonance:
    """A steady motion of the full joint near resonance.

    Attributes
    ----------
    load, omega : float
        Of the driven port, and rad/s.
    amplitude, kappa : complex
        A, and the contact force over ``omega_st² A``.
    doubt : float
        Of kappa, absolute: what is not known of A, times ``|Z| / omega_st²``.
    detuning : float
        ``|Re Z / Im Z|``.
    motion : (p,) complex array
        Outputs over A, without what the load moves besides the mode.
    """

    load: float
    omega: float
    amplitude: complex
    kappa: complex
    doubt: float
    detuning: float
    motion: Complex


def resonant_table(
    joint: PreparedJoint,
    model: TwoModeModel,
    loads: Sequence[float],
    *,
    asked: float = 0.0,
    advance: Callable[[], None] = lambda: None,
) -> tuple[EquivalentTable, list[Failure]]:
    """Tabulate the contact force at resonances of the full joint.

    Parameters
    ----------
    joint : PreparedJoint
        With a mode.
    model : TwoModeModel
        Its `microslip.analyses.reduced.two_mode.stuck_model`.
    loads : sequence of float
        Amplitudes of the driven port, ascending from one under which the joint sticks, see `steps_of`.
    asked : float
        Smallest load that answers are asked for: a motion missed under a smaller one is no failure.
    advance : callable
        Called after every load.

    Returns
    -------
    table : EquivalentTable
        ``load`` is that of each motion.
    failures : list of Failure
        Loads under which no steady motion was found.

    Raises
    ------
    ContactError
        Where fewer than `FEWEST` motions are steady.
    """
    found: list[Resonance] = []
    failures: list[Failure] = []
    past: list[Followed] = []
    lost = 0
    for load in loads:
        why, one = "", _followed(joint, model, load, past)
        more = [] if one is None else [_told(joint, model, one)]
        if one is None:
            more, why = _raised(joint, model, found, load)
        else:
            past = _with(past, one)
        found += more
        advance()
        lost = 0 if more else lost + bool(found or load >= asked)
        if not more and load >= asked:
            where = f"resonance of the full joint under a load of {load:.4g}"
            failures.append(Failure("reduced", where, why))
        if lost == LOST:
            break
    if past and lost == 0 and max(one.load for one in past) < REACHED * loads[-1]:
        one = _followed(joint, model, loads[-1], past)
        if one is not None:
            found.append(_told(joint, model, one))
            past = _with(past, one)
    found += [_told(joint, model, one) for one in _filled(joint, model, past)]
    chosen = _apart(found)
    if len(chosen) < FEWEST:
        said = "".join(f"; {failure.where}: {failure.reason}" for failure in failures[:1])
        raise ContactError(
            f"only {len(chosen)} motions of the full joint at resonance are steady, too few for a table"
            f"{said}; ask for [analysis.time] or [analysis.harmonic]"
        )
    return _table(joint, model, chosen), failures


def sticking_load(joint: PreparedJoint, model: TwoModeModel) -> float:
    """Load under which the stuck joint resonates at `STICKS` of the amplitude whose inertia opens it, or
    whose inertia the contact feels as much as the preload; 0 where it feels none.

    Parameters
    ----------
    joint : PreparedJoint
        With a mode.
    model : TwoModeModel
        Its stuck oscillator.
    """
    mode = joint.principal()
    scale = load_scale(joint, mode.stuck_port) / model.omega**2
    share = abs(joint.model.port_modes[:, joint.model.port(joint.coordinate)] @ mode.stuck)
    loss = complex(model.linear_stiffness(model.omega)).imag or UNDAMPED * model.omega**2
    push = abs(model.force[0])
    return STICKS * scale * share * loss / push if 0 < scale < np.inf and push > 0 else 0.0


def steps_of(loads: Sequence[float], sticking: float) -> list[float]:
    """Loads under which motions are sought, ascending: from sticking up, those asked for among them.

    Parameters
    ----------
    loads : sequence of float
        Asked for, > 0.
    sticking : float
        See `sticking_load`.

    Examples
    --------
    >>> steps = steps_of([1.0, 2.0], 0.1)
    >>> len(steps), 1.0 in steps, 2.0 in steps, round(steps[-1], 3)
    (11, True, True, 2.2)
    >>> [round(x, 4) for x in steps_of([1.0, 2.0], 0.002)[:3]]
    [0.002, 0.0063, 0.02]
    """
    asked = sorted(set(loads))
    low, high = GENTLE * asked[0], ROOM * asked[-1]
    between = _geometric(low, high, RISE)[:-1]
    beside = [x for x in between if min(abs(np.log(x / a)) for a in asked) > np.log(RISE) / 3]
    if 0 < sticking < low:
        beside += _geometric(sticking, low, STRIDE)[:-1]
    return sorted([*beside, *asked, high])


def _geometric(low: float, high: float, factor: float) -> list[float]:
    """From one load to another, by no more than a factor."""
    count = int(np.ceil(np.log(high / low) / np.log(factor))) + 1
    return [float(x) for x in np.geomspace(low, high, count)]


def _followed(
    joint: PreparedJoint, model: TwoModeModel, load: float, past: Sequence[Followed]
) -> Followed | None:
    """The motion at resonance that those before lead to; None where there is none, or another load is its.

    In the plane none is: contact steps are so cheap there that motions from rest cost a few seconds.
    """
    if joint.model.dimension == 2:
        return None
    try:
        for _ in range(AGAIN):
            one = followed(joint, model, load, past)
            if one is None:
                return None
            Z = complex(model.linear_stiffness(one.omega)) / model.omega**2 + one.kappa
            if abs(Z.real) <= QUARTER * abs(Z.imag) and abs(np.log(one.load / load)) <= ASTRAY:
                return one
            past = _with(past, one)
    except MicroslipError:
        pass
    return None


def _filled(joint: PreparedJoint, model: TwoModeModel, known: Sequence[Followed]) -> list[Followed]:
    """Motions between those that are known, where interpolation misses `MISSED` of what resists them."""
    past, more = list(known), list[Followed]()
    while len(past) >= FEWEST and len(more) < FILLED:
        size = np.log([abs(one.amplitude) for one in past])
        kappa = np.array([one.kappa for one in past])
        linear = model.linear_stiffness(np.array([one.omega for one in past]))
        resists = np.abs(linear / model.omega**2 + kappa)
        # what neighbours miss over their distance, with the cube of it
        span = np.pad(size[2:] - size[:-2], 1, mode="edge")
        error, gap = 8 * missed(size, kappa) / resists / span**3, np.diff(size)
        score = np.maximum(error[:-1], error[1:]) * gap**3 * (gap > 2 * np.log(APART))
        k = int(np.argmax(score))
        if score[k] <= MISSED:
            break
        below = past[: k + 2]
        one = _followed(joint, model, float(np.sqrt(below[-2].load * below[-1].load)), below)
        if one is None or not size[k] < np.log(abs(one.amplitude)) < size[k + 1]:
            break
        more.append(one)
        past.insert(k + 1, one)
    return more


def _with(past: Sequence[Followed], one: Followed) -> list[Followed]:
    """By amplitude, without those that are next to it: too close to lay a line through."""
    apart = [
        each
        for each in past
        if abs(np.log(abs(each.amplitude) / abs(one.amplitude))) > np.log(APART)
    ]
    return sorted([*apart, one], key=lambda each: abs(each.amplitude))


def _told(joint: PreparedJoint, model: TwoModeModel, one: Followed) -> Resonance:
    Z = complex(model.linear_stiffness(one.omega)) + model.omega**2 * one.kappa
    direct = direct_motion(joint, joint.drive, np.array([one.omega]), stuck=True)[0]
    return Resonance(
        load=one.load,
        omega=one.omega,
        amplitude=one.amplitude,
        kappa=one.kappa,
        doubt=one.doubt,
        detuning=abs(Z.real) / max(abs(Z.imag), 1e-300),
        motion=(one.output - direct * one.load) / one.amplitude,
    )


def _raised(
    joint: PreparedJoint, model: TwoModeModel, known: Sequence[Resonance], load: float
) -> tuple[list[Resonance], str]:
    """Motions from rest under one load, the last one at resonance, and why there are none."""
    last = max(known, key=lambda one: abs(one.amplitude), default=None)
    kappa = 0j if last is None else last.kappa
    found: list[Resonance] = []
    why = ""
    for _ in range(VISITS):
        omega = model.omega * float(np.sqrt(max(1 + kappa.real, 0.05)))
        D, c = complex(model.linear_stiffness(omega)), float(model.offset[0])
        loss = max((D + model.omega**2 * kappa).imag, D.imag) or UNDAMPED * model.omega**2
        expected = (model.force[0] + D * c) * load / (1j * loss) - c * load
        try:
            motion = brief_motion(joint, load, omega / (2 * np.pi), complex(expected))
        except MicroslipError as error:
            why = str(error)
            break
        if not motion.doubt <= DOUBTFUL:
            why = "the joint opens" if motion.opens else "no steady motion within the cycles tried"
            break
        found.append(_reading(joint, model, load, omega, motion))
        if found[-1].detuning <= QUARTER:
            break
        kappa = found[-1].kappa
    return found, why


def _reading(
    joint: PreparedJoint, model: TwoModeModel, load: float, omega: float, motion: BriefMotion
) -> Resonance:
    D, c = complex(model.linear_stiffness(omega)), float(model.offset[0])
    A = motion.amplitude + c * load
    Z = complex((model.force[0] + D * c) * load / A)
    kappa = (Z - D) / model.omega**2
    direct = direct_motion(joint, joint.drive, np.array([omega]), stuck=True)[0]
    return Resonance(
        load=load,
        omega=omega,
        amplitude=A,
        kappa=kappa,
        doubt=abs(Z) * motion.doubt / model.omega**2,
        detuning=abs(Z.real) / max(abs(Z.imag), 1e-300),
        motion=(motion.output - direct * load) / A,
    )


def _apart(found: Sequence[Resonance]) -> list[Resonance]:
    """By amplitude, of several close ones that nearest to resonance."""
    chosen: list[Resonance] = []
    for one in sorted(found, key=lambda one: abs(one.amplitude)):
        if chosen and abs(one.amplitude) < APART * abs(chosen[-1].amplitude):
            chosen[-1] = min(chosen[-1], one, key=lambda each: each.detuning)
        else:
            chosen.append(one)
    return chosen


def _table(
    joint: PreparedJoint, model: TwoModeModel, found: Sequence[Resonance]
) -> EquivalentTable:
    size: Array = np.array([abs(one.amplitude) for one in found])
    kappa: Complex = np.array([one.kappa for one in found])
    omega = np.array([one.omega for one in found])
    first, share = size[0], np.array(STICKING)
    size = np.concatenate([first * share, size])
    # the model gives the elastic share the material's loss
    beta = model.rayleigh[1]
    kappa = np.concatenate([kappa[0] * share, kappa - 1j * omega * beta * kappa.real])
    uncertainty = missed(np.log(size), kappa)
    uncertainty[len(share) :] += [one.doubt for one in found]
    own = size**2 * model.omega**2
    pad = [0] * len(share)
    return EquivalentTable(
        drive="prescribed",
        preload=joint.prestress.force,
        omega=model.omega,
        load=np.array([one.load for one in found])[[*pad, *range(len(found))]]
        * np.concatenate([share, np.ones(len(found))]),
        amplitude=size,
        k_eq=kappa.real,
        gamma_eq=np.maximum(kappa.imag, 0.0),
        cross=np.zeros(len(size), complex),
        dissipated=np.pi * own * np.maximum(kappa.imag, 0.0),
        stored=0.5 * own * kappa.real,
        uncertainty=uncertainty,
        motion=np.array([one.motion for one in found])[[*pad, *range(len(found))]],
    )
