"""Whether a larger branch still has a motion where it is shown to end, asked with still more steps.

How far a branch goes beside a jump depends on the steps more than any of its amplitudes does. A motion that
is there with as few and with `REFINEMENT` times as many may be none with more again, and where it is the last
of its branch all that is shown up to the jump hangs on it.
"""

from __future__ import annotations

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.starts import placed
from microslip.analyses.time.step_refinement import REFINEMENT
from microslip.analyses.time.watching import watched
from microslip.errors import MicroslipError
from microslip.numerics.execute import each, threads
from microslip.pipeline.more_steps import FARTHEST, MARCHED, apart, settled_with
from microslip.pipeline.search import Search
from microslip.pipeline.targets import Stepped


def confirm_ends(joint: PreparedJoint, search: Search) -> int:
    """Ask of the outermost motions of larger branches whether they are there; how many were asked.

    Where one is not, the next one inward is asked, until one is.
    """
    count, load = 0, search.base.load
    while ends := search.open_ends():
        # those with more steps have been asked of with more again
        search.confirmed.update(dict.fromkeys(search.finer.intersection(ends), True))
        asked = [k for k in ends if k not in search.finer]
        states = [search.settled[k] for k in asked]
        found = each(lambda one: is_there(joint, load, one), states, threads())
        for k, (there, cycles) in zip(asked, found, strict=True):
            search.confirmed[k] = there
            search.spent += cycles
        count += len(asked)
    return count


def is_there(joint: PreparedJoint, load: float, one: Stepped) -> tuple[bool, int]:
    """Whether a motion is there with ``REFINEMENT²`` times the steps; what that took, in cycles of its own.

    A periodic one that motions stay beside, or where none settles a motion that stays.
    """
    more = REFINEMENT**2
    try:
        found, stay = settled_with(joint, load, one, more * one.steps)
        spent = more * found.cycles
        if stay is not None:
            near = apart(one.amplitude, found.amplitude) <= FARTHEST
            return near and bool(stay.strays <= FARTHEST), spent + more * stay.cycles
        f = one.frequency
        scheme = time_scheme(joint, 1 / (f * more * one.steps), frequency=f)
        Q, _ = watched(scheme, load, placed(one.state, scheme, f, load), MARCHED)
        off = np.abs(np.abs(Q) / abs(one.amplitude) - 1).max()
    except MicroslipError:
        return False, 0
    return bool(off <= FARTHEST), spent + more * MARCHED
