"""How well the steady states of a response are known, each by itself and by those beside it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Container, Mapping
from dataclasses import replace
from itertools import pairwise

import numpy as np

from microslip.analyses.reduced.anchors import Anchor, branches, vary_between
from microslip.analyses.time.offset import HORIZON
from microslip.analyses.time.watching import goes_on_by
from microslip.pipeline.stepping import Stepping
from microslip.pipeline.targets import TOLERANCE, Found
from microslip.pipeline.walk import FINE


def by_themselves(
    anchors: Mapping[int, Anchor],
    found: Mapping[int, Found],
    ended: Container[int],
    moved: float,
    stepping: Stepping,
) -> dict[int, Anchor]:
    """Anchors, each with how far its amplitude scatters with its past and varies from cycle to cycle.

    Of a motion that has not settled a search cannot tell how far its bodies will walk: as far as others have,
    where that has led, or as far as it goes where it was watched with more steps.

    Parameters
    ----------
    anchors, found : mappings
        By index of their frequency.
    ended : container of int
        Which of them were marched to their end.
    moved : float
        How far others have gone when they were marched, in logarithm.
    stepping : Stepping
        What motions do beside them with more steps.
    """
    known = dict[int, Anchor]()
    for k, one in anchors.items():
        varies = variation(stepping, k, found[k])
        known[k] = replace(one, scatter=found[k].scatter, varies=varies)
        if k not in ended and found[k].rest is None and one.change > FINE:
            settled = one.change <= TOLERANCE
            known[k] = no_better(known[k], min(moved, _to_come(stepping, k)) if settled else moved)
    return known


def doubted(
    alone: Mapping[int, Anchor],
    found: Mapping[int, Found],
    ended: Container[int],
    stepping: Stepping,
) -> dict[int, Anchor]:
    """Anchors as they are known beside the others.

    Of motions at rest that beat those beside one may not, and those beside one that does not may: each is
    known no better than the next are, on its branch. What is known to repeat between two parts them.

    Parameters
    ----------
    alone : mapping
        `by_themselves`.
    found, ended, stepping
        See there.
    """
    known, rest = dict(alone), {k for k, one in found.items() if one.rest is not None}
    told = rest | {k for k, one in alone.items() if _repeats(one, k in ended, k, stepping)}
    beside = defaultdict[int, list[int]](list)
    for run in branches(alone, ()):
        for left, right in pairwise(int(k) for k in run if k in told):
            if rest >= {left, right}:
                beside[left].append(right)
                beside[right].append(left)
    for k, others in beside.items():
        mean = max(_but_for_beats(stepping, j, found[j]) for j in others)
        known[k] = as_doubtful(alone[k], *(alone[j] for j in others), mean=mean)
    return known


def variation(stepping: Stepping, k: int, found: Found | Anchor) -> float:
    """How far the size of a motion varies for good, with more steps where these tell, relative."""
    own = stepping.varies.get(k, 0.0)
    return own if stepping.sought_on.get(k) is not None else max(found.varies, own)


def doubt_with(stepping: Stepping, k: int, found: Found | Anchor) -> float:
    """How well a motion is known with more steps, relative: its mean, and what it varies by."""
    beyond = stepping.strays.get(k, 0.0) - stepping.varies.get(k, 0.0)
    mean = max(beyond, _but_for_beats(stepping, k, found))
    return mean + variation(stepping, k, found)


def no_better(one: Anchor, mean: float) -> Anchor:
    """A steady state whose mean amplitude is known no better than that, relative."""
    return replace(one, doubt=max(one.doubt - one.varies, mean) + one.varies)


def as_doubtful(one: Anchor, *others: Anchor, mean: float = 0.0) -> Anchor:
    """A steady state that is known no better than others, and may vary from cycle to cycle as much.

    What those are not known by, but for so much of their `mean`, may be a beat that was not seen to go on: it
    does not come on top of its own.
    """
    varies = max(a.varies for a in (one, *others))
    doubt = max(max(one.doubt - one.varies, mean) + varies, *(a.doubt for a in others))
    both = vary_between(np.array(one.varies), np.array([a.varies for a in others]))
    return replace(one, doubt=doubt, varies=max(one.varies, float(both.max())))


def _but_for_beats(stepping: Stepping, k: int, found: Found | Anchor) -> float:
    """How well a mean amplitude is known but for beats that were not seen to go on, relative.

    What rings with few steps where bodies rest is no doubt where more steps have told.
    """
    told = stepping.sought_on.get(k) is not None
    rings = found.rings if told and isinstance(found, Found) else 0.0
    return max(found.doubt - found.varies - rings, stepping.drifts.get(k, 0.0))


def _repeats(one: Anchor, ended: bool, k: int, stepping: Stepping) -> bool:
    """Whether a motion is known to repeat, with more steps as well, and others to stay beside it."""
    seen = ended or one.change <= FINE or stepping.watched.get(k, 0) > 0
    varies = one.varies > 0 or stepping.strays.get(k, 0.0) > 0
    return seen and not varies and stepping.sought_on.get(k) is not None


def _to_come(stepping: Stepping, k: int) -> float:
    """What a mean may still drift by, relative: as evenly as where it was watched with more steps."""
    cycles = stepping.watched.get(k, 0)
    return goes_on_by(stepping.drifts[k], cycles, HORIZON) if cycles else np.inf
