"""Where motions end after the load was raised from rest, or on the branch that is known.

What is marched is `microslip.pipeline.creep`; here are the starts of it, and what two of them say together.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.time.offset import elsewhere
from microslip.analyses.time.scheme import State, TimeScheme, time_scheme
from microslip.analyses.time.starts import end_of, mixed, placed
from microslip.analyses.time.staying import LEAVES
from microslip.analyses.time.steady import RAISED, raised_state
from microslip.errors import ContactError, JointOpensError, MicroslipError
from microslip.numerics.execute import each, threads
from microslip.pipeline.creep import Crept, Walk, crept
from microslip.pipeline.targets import Found, Lost, Target, known_rest
from microslip.pipeline.walk import RAISED_AGAIN
from microslip.pipeline.walked import kicked


def raised_and_marched(joint: PreparedJoint, targets: Sequence[Target]) -> Iterator[Found | Lost]:
    """Where motions end after the load was raised from rest, in the order of the targets.

    The first, third, ... of them after two ramps: what these differ by is the `scatter` of what is found.
    That of the others is not known (nan), but where bodies have come to rest.
    """

    def work(task: tuple[Target, int]) -> Found | Lost:
        target, ramps = task
        try:
            return _ended(joint, target, (RAISED, RAISED_AGAIN)[:ramps])
        except MicroslipError as error:
            return Lost(str(error), 0, opens=isinstance(error, JointOpensError))

    return each(work, [(one, 2 - i % 2) for i, one in enumerate(targets)], threads())


def _ended(joint: PreparedJoint, target: Target, ramps: Sequence[int]) -> Found:
    """After the load was raised, or where that leads to another branch from the motion that is known.

    A motion that leaves its branch then is none, and would keep the places to which it has walked the bodies:
    the answer is that after the load was raised. So it is where that motion varies by too much to be shown.
    """
    f = target.frequency
    scheme = time_scheme(joint, 1 / (f * target.steps), frequency=f)
    walk = Walk(target.offset)
    ends = _raised_ends(scheme, target, ramps, walk) if target.cold else []
    spent = sum(one.cycles for one in ends) + sum(ramps[: len(ends)])
    own = bool(target.starts) and (not ends or elsewhere(abs(ends[0].amplitude), target.sizes))
    if own:
        ends = _own_ends(scheme, target, walk)
        spent += sum(one.cycles for one in ends)
        # several motions may exist there: by how much two that stay differ is how well one is known
        fallen = ends[-1]
        ends = [one for one in ends if _stays(one, target)]
        if not ends:
            target = replace(target, expected=0.0, most=0.0)
            try:
                ends = _raised_ends(scheme, target, ramps, walk)
                spent += sum(one.cycles for one in ends) + sum(ramps[: len(ends)])
            except MicroslipError:  # that it has fallen is known
                ends = [fallen._replace(doubt=np.inf)]
    # bodies that stick beyond where others come to rest have been put there
    ends = [one for one in ends if one.rest is not None] or ends
    ends.sort(key=lambda end: end.doubt)
    # where bodies come to rest does not depend on how the load was raised
    one, scatter = ends[0], np.nan if known_rest(ends[0].rest, ends[0].ahead) is None else 0.0
    if len(ends) > 1:
        scatter = abs(abs(ends[1].amplitude) / abs(one.amplitude) - 1)
    return Found(
        one.amplitude,
        abs(one.drift),
        one.doubt,
        end_of(one.state, 0.0, scheme, f),
        spent,
        scatter=float(scatter),
        past=0.0,
        rest=one.rest,
        lasts=one.reached if one.rest is not None else 0.0,
        ahead=one.ahead,
        around=one.around,
        own=own,
        varies=one.varies,
        rings=one.rings,
    )


def _stays(one: Crept, target: Target) -> bool:
    """Whether a motion that was marched is still of its branch, and may be shown."""
    return one.varies <= LEAVES and not elsewhere(abs(one.amplitude), target.sizes)


def _own_ends(scheme: TimeScheme, target: Target, walk: Walk) -> list[Crept]:
    """From the starts on the branch that is known; an error where none of them ends.

    Bodies that walk are counted from rest, where that ends on the branch: beside it they have walked before.
    """
    ends, reason = list[Crept](), MicroslipError("no start")
    for start in _own_starts(scheme, target):
        try:
            ends.append(crept(scheme, target.load, start, walk=walk))
        except MicroslipError as error:
            reason = error
            continue
        if target.guess and ends[0].rest is not None and _stays(ends[0], target):
            break
    if not ends:
        raise reason
    return ends


def _raised_ends(
    scheme: TimeScheme, target: Target, ramps: Sequence[int], walk: Walk
) -> list[Crept]:
    """After one ramp or two; after one where that tells enough."""
    ends = list[Crept]()
    for ramp in ramps:
        state = raised_state(scheme, target.frequency, target.load, ramp)
        ends.append(crept(scheme, target.load, state, walk=walk, sizes=target.sizes))
        first = ends[0]
        rests = known_rest(first.rest, first.ahead) is not None
        if rests or elsewhere(abs(first.amplitude), target.sizes):
            break
    return ends


def _own_starts(scheme: TimeScheme, target: Target) -> Iterator[State]:
    """On the branch that is known: rest with the velocity of a guess, if there is one, and from the start.

    A motion that begins with those beside it keeps the tractions that the past has left in them, one that
    begins at rest has others.
    """
    if target.guess:
        begun: State | None = None
        with suppress(ContactError):
            begun = kicked(scheme, target.load, target.guess)
        if begun is not None:
            yield begun
    yield placed(mixed(target.starts[0]), scheme, target.frequency, target.load)
