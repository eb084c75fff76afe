"""Steady states that say less than those about them, and are dropped.

A response between steady states is known to a bound. One of these that is known less well itself, though it
agrees with the others, only widens that.
"""

from __future__ import annotations

import numpy as np

from microslip.analyses.reduced.anchors import branches
from microslip.pipeline.doubts import variation
from microslip.pipeline.neighbours import around
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

    Those whose own doubt is what is left of them, between two that are known; only where the response without
    one is that motion as well as it is known then, and as wanted at more frequencies in all. What was seen of
    a motion stays: that it varies, goes elsewhere with more steps, depends on the past, or comes to rest, as
    others beside it may then.

    Parameters
    ----------
    search : Search
    wanted : float
        Relative error.
    """
    blurred = search.blurred(wanted)
    known = int((search.held().error <= wanted).sum())
    for k in sorted(blurred, key=lambda k: -search.anchors[k].doubt):
        beside = around(set(search.anchors) - {k}, k)
        if _was_seen(search, k, wanted) or len(beside) < 2 or blurred.intersection(beside):
            continue
        before = dict(search.anchors), search.found[k], search.accuracy
        anchor = search.anchors.pop(k)
        del search.found[k]
        search.take_refined()
        now = search.held()
        apart = abs(np.log(abs(anchor.amplitude) / abs(now.amplitude[k])))
        more = int((now.error <= wanted).sum())
        if apart <= now.error[k] <= wanted and more > known:
            known = more
        else:
            search.anchors, search.found[k], search.accuracy = before


def _was_seen(search: Search, k: int, wanted: float) -> bool:
    """Whether a steady state tells of the motion what others do not."""
    anchor, found, stepping = search.anchors[k], search.found[k], search.stepping
    depends = max(np.nan_to_num([anchor.past, found.scatter])) > wanted
    moves = k in search.unstable or stepping.drifts.get(k) or variation(stepping, k, found)
    return bool(depends or moves or found.rest is not None)
