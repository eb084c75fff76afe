"""Steady states that say less than those about them, and are dropped.

A response between steady states is known to a bound. One of these that is known less well itself, though it
agrees with the others, only widens that.
"""

from __future__ import annotations

import numpy as np

from microslip.analyses.reduced.anchors import branches
from microslip.pipeline.doubts import variation
from microslip.pipeline.search import Search


def left_on_the_way(search: Search, wanted: float) -> None:
    """Drop what searches left that is not known well and lies on a branch between two states that are.

    Where what lies between those two then is not what was dropped, as well as both are known, it stays.

    Parameters
    ----------
    search : Search
    wanted : float
        Relative error.
    """
    blurred, dropped = search.blurred(wanted), list[int]()
    for branch in branches(search.anchors, search.lost):
        sure = [int(k) for k in branch if k not in blurred]
        inside = [int(k) for k in branch if sure and sure[0] < k < sure[-1]]
        dropped += [k for k in inside if k in blurred - search.tried - search.unstable]
    before = {k: (search.anchors.pop(k), search.found.pop(k)) for k in dropped}
    now, doubted = search.held(), search.moved
    for k, (anchor, found) in before.items():
        known = max(anchor.doubt, doubted) + now.of_mean[k]
        if not abs(np.log(abs(anchor.amplitude) / abs(now.amplitude[k]))) <= known:
            search.anchors[k], search.found[k] = anchor, found


def known_better_without(search: Search, wanted: float) -> None:
    """Drop steady states, one by one, without which the response at them is known as well as is wanted.

    The worst known first; only where the response without one is that motion to the same error, and known as
    well as is wanted at more frequencies in all. What motions do beside one that is unstable is no doubt, nor
    is what they were seen to vary by for good: such stay.

    Parameters
    ----------
    search : Search
    wanted : float
        Relative error.
    """
    known = _frequencies(search, wanted)
    for k in sorted(search.blurred(wanted), key=lambda k: -search.anchors[k].doubt):
        if k in search.unstable or variation(search.stepping, k, search.found[k]):
            continue
        anchor, found = search.anchors.pop(k), search.found.pop(k)
        now, more = search.held(), _frequencies(search, wanted)
        apart = abs(np.log(abs(anchor.amplitude) / abs(now.amplitude[k])))
        if apart + now.error[k] <= wanted and more > known:
            known = more
        else:
            search.anchors[k], search.found[k] = anchor, found


def _frequencies(search: Search, wanted: float) -> int:
    """How many are known as well as is wanted."""
    return int((search.held().error <= wanted).sum())
