"""How well the steady states of a response are known, each by itself and by those beside it."""

from __future__ import annotations

from collections.abc import Container, Mapping
from dataclasses import replace
from itertools import pairwise

import numpy as np

from microslip.analyses.reduced.anchors import Anchor, vary_between
from microslip.pipeline.stepping import Stepping
from microslip.pipeline.targets import Found
from microslip.pipeline.walk import FINE


def doubted(
    anchors: Mapping[int, Anchor],
    found: Mapping[int, Found],
    ended: Container[int],
    moved: float,
    stepping: Stepping,
) -> dict[int, Anchor]:
    """Anchors, each with how far its amplitude scatters with its past and varies from cycle to cycle.

    Of a motion that has not settled a search cannot tell how far its bodies will walk: as far as others have,
    where that has led. Of motions at rest that beat those beside one may not, and those beside one that does
    not may: each is known no better than the next are.

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
        doubt, varies = one.doubt, variation(stepping, k, found[k])
        if k not in ended and found[k].rest is None and one.change > FINE:
            doubt = max(doubt, moved)
        known[k] = replace(one, doubt=doubt, scatter=found[k].scatter, varies=varies)
    rests = {k: known[k] for k in sorted(known) if found[k].rest is not None}
    for left, right in pairwise(rests):
        for k, beside in ((left, right), (right, left)):
            known[k] = as_doubtful(known[k], rests[beside])
    return known


def variation(stepping: Stepping, k: int, found: Found) -> float:
    """How far the size of a motion varies for good, with more steps where these tell, relative."""
    own = stepping.varies.get(k, 0.0)
    return own if stepping.sought_on.get(k) is not None else max(found.varies, own)


def doubt_with(stepping: Stepping, k: int, doubt: float, found: Found) -> float:
    """How well a motion is known that was sought on with more steps, relative."""
    if not found.varies:
        return max(doubt, stepping.doubt(k))
    # what it varied by with few steps is none of its doubt
    left = found.doubt - found.varies
    return left + variation(stepping, k, found) + stepping.drifts.get(k, 0.0)


def as_doubtful(one: Anchor, other: Anchor) -> Anchor:
    """A steady state that is known no better than another, and may vary from cycle to cycle as much."""
    doubt = max(one.doubt - one.varies, other.doubt - other.varies)
    doubt += max(one.varies, other.varies)
    both = float(vary_between(np.array(one.varies), np.array(other.varies)))
    return replace(one, doubt=doubt, varies=max(one.varies, both))
