"""What is known of a response over a part of its band, taken over into a wider one."""

from __future__ import annotations

from typing import Any

import numpy as np

from microslip.analyses.reduced.response import Response
from microslip.analyses.reduced.surface import LoadSurface
from microslip.pipeline.search import Search
from microslip.pipeline.stepping import BY_INDEX, Stepping


def wider(search: Search, surface: LoadSurface, base: Response) -> Search:
    """The same over a band that holds the frequencies of this one; as much may be spent once more.

    Parameters
    ----------
    search : Search
    surface, base : LoadSurface, Response
        Over that band.
    """
    to = [int(k) for k in np.searchsorted(base.frequency, search.base.frequency)]

    def those(known: set[int]) -> set[int]:
        return {to[k] for k in known}

    def these(known: dict[int, Any]) -> dict[int, Any]:
        return {to[k]: one for k, one in known.items()}

    own, begun = search.stepping, search.origins
    of_steps: dict[str, Any] = {name: these(getattr(own, name)) for name in BY_INDEX}
    found = Search(
        surface,
        base,
        search.points,
        Stepping(own.steps, own.unknown, **of_steps),
        anchors=these(search.anchors),
        found=these(search.found),
        origins={to[k]: {j if j < 0 else to[j] for j in one} for k, one in begun.items()},
        lost=these(search.lost),
        fell=those(search.fell),
        tried=those(search.tried),
        ended=those(search.ended),
        moved=search.moved,
        opens=search.opens,
        passed=those(search.passed),
        anew=those(search.anew),
        finer=those(search.finer),
        marched_on=those(search.marched_on),
        firm=those(search.firm),
        past=search.in_all,
    )
    found.take_refined()
    return found
