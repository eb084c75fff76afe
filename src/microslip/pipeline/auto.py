"""The refined model put right by time integration where it is not sure of itself.

Steady states of the full joint are found where the response under a load is least known: first at its
resonance, half-power points and ends, from the answers of the refined model, then in the middle of the
stretches of frequencies whose bound (`analyses.reduced.through_anchors`) is above what the file asks for,
each started from the states to either side. At the finest every frequency is one. Where the size jumps
between two frequencies, the smaller is sought again from the larger: a branch is followed to its end, and the
jump lies where that is. The search ends when the bound holds everywhere, or with what it may cost.

Where the first of them show that their time steps err by more than is asked for, all of it begins anew with
four times as many. What has settled is sought on with four times the steps (`more_steps`), and is none where
motions leave it then. In the end the response has what these say, further ones are sought where it is unsure,
and what stays unsure itself is sought anew with more steps. Where the larger motions do not repeat, smaller
ones that do are shown (`smaller`).
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from microslip.analyses.reduced.response import Response, held_to, larger_within
from microslip.analyses.reduced.surface import Contours, contours, largest, load_surface
from microslip.analyses.reduced.sweep import CONVERGED
from microslip.describe.requests import CYCLES_EACH, ResponseAnalysis
from microslip.pipeline import choosing, forget
from microslip.pipeline.band import Curve
from microslip.pipeline.marched import raised_and_marched
from microslip.pipeline.outputs_held import OutputsHeld
from microslip.pipeline.prepare import Assembly
from microslip.pipeline.search import Search
from microslip.pipeline.smaller import Outgrown, with_smaller
from microslip.pipeline.targets import REFINEMENT, STEPS, Found, Lost, Target
from microslip.pipeline.walk import sought, what_it_is
from microslip.pipeline.wider import wider
from microslip.typing import Array, Mask

FILLS = 0.25
"""Share of the time that a search may take, on top of it, for states between those too far apart."""

WATCHES = 0.5
"""The same, for marching what is itself unsure in the end."""

SAID = 2
"""Of so many motions that are not steady it is said what they are."""


class Anchored(NamedTuple):
    """A response held to steady states.

    Attributes
    ----------
    response : Response
        With the bounds of its error and of its outputs.
    lost : tuple of str
        Where none was found, and why.
    opens : bool
        Whether that opens the joint.
    spent : str
        When the search ended, in words.
    walks : tuple of (float, float)
        Of bodies that have come to rest, how far they have walked past each other, m, and in how many cycles;
        a pair for each steady state.
    walks_on : tuple of (float, float)
        Of bodies that have not come to rest in the motion that is shown, by how much the amplitude changes
        until they do, relative, and in how many cycles; a pair for each steady state, nan where that is not
        found.
    search : Search
        What is known, for a wider band: of the larger motions.
    outgrown : tuple of Outgrown
        Where smaller ones are shown, as the larger do not repeat.
    """

    response: Response
    lost: tuple[str, ...]
    opens: bool
    spent: str
    walks: tuple[tuple[float, float], ...]
    walks_on: tuple[tuple[float, float], ...]
    search: Search
    outgrown: tuple[Outgrown, ...] = ()


def anchored_response(
    assembly: Assembly,
    settings: ResponseAnalysis,
    case: Curve,
    base: Response,
    stop: threading.Event,
    advance: Callable[[int], None],
    known: Search | None = None,
) -> Anchored:
    """A response of the refined model held to steady states.

    Parameters
    ----------
    assembly : Assembly
    settings : ResponseAnalysis
    case : Curve
        The refined model under a load.
    base : Response
        What it says, at the frequencies wanted.
    stop : Event
        Set on Ctrl-C, which ends the search; what is known then is returned.
    advance : callable
        Told how many points have been sought.
    known : Search, optional
        Over a part of the band, all of whose frequencies this has.
    """
    assert case.table is not None
    surface = load_surface(case.model, case.table, base.frequency, base.load)
    outputs = OutputsHeld(assembly, case.model, case.table)
    first = search = Search(surface, base, settings.points)
    guess = largest(contours(surface, base.load))
    outgrown, over = tuple[Outgrown, ...](), False
    try:
        if known is not None:
            first = search = wider(known, surface, base)
            begin = choosing.ends(search, guess)
        else:
            begin = choosing.first(search, guess)
        advance(_learn(assembly, search, begin))
        # what that costs has to leave some for the rest
        may = REFINEMENT * max(search.count / search.points, search.seconds / search.may_take) < 1
        if known is None and may and search.steps_tell(assembly.prepared, settings.error):
            first, search = search, search.begun_anew()
            advance(_learn(assembly, search, choosing.first(search, guess)))
        while not search.over:
            beside = outputs.error_of_first(_response(search), search.states, search.lost)
            picks = choosing.least_known(search, guess, settings.error, beside)
            if not picks:
                break
            advance(_learn(assembly, search, picks))
            if not search.tried and (ends := choosing.walking(search)):
                advance(_march(assembly, search, ends, settings.error))
        _fill(assembly, search, guess, advance)
        _to_their_ends(assembly, search, guess, settings.error, advance)
        _fill(assembly, search, guess, advance)
        search.refine(assembly.prepared)
        # with more steps there may be more to see than there was with fewer
        while sought_more := _refine_on(assembly, search, guess, settings.error):
            advance(sought_more)
        larger, over = search, search.over
        search, outgrown = with_smaller(assembly.prepared, search, guess, settings.error, advance)
    except KeyboardInterrupt:
        stop.set()
        larger = search = max(first, search, key=lambda one: len(one.anchors))
        search.take_refined()
    count, cycles, seconds = search.in_all
    steps = "" if search.steps == STEPS else f" of {search.steps} steps"
    spent = f"{count} steady states, {cycles} cycles{steps} and {seconds:.0f} s"
    said, (walks, walks_on) = _said(assembly, search, stop), _walks(search)
    within = np.zeros(len(base.frequency), bool)
    for one in outgrown:
        within |= one.holds(base.frequency)
    ended = over or stop.is_set()
    unseen = [k for k in choosing.unfilled(search) if ended or within[k]]
    forget.known_better_without(search, settings.error)
    response = outputs.response(_response(search, unseen), search.states, search.lost)
    if outgrown:
        above = outputs.response(_response(larger), larger.states, larger.lost)
        response = replace(response, larger=larger_within(above, response.amplitude, within))
    return Anchored(response, said, search.opens, spent, walks, walks_on, larger, outgrown)


def _learn(assembly: Assembly, search: Search, targets: list[Target]) -> int:
    """Steady states at targets; how many were sought."""
    for target, answer in zip(targets, sought(assembly.prepared, targets), strict=True):
        search.keep(target, answer)
    return len(targets)


def _answers(assembly: Assembly, targets: list[Target]) -> list[tuple[Target, Found | Lost]]:
    """Steady states at targets, each with its own."""
    return list(zip(targets, sought(assembly.prepared, targets), strict=True))


def _march(assembly: Assembly, search: Search, targets: list[Target], wanted: float) -> int:
    """Where the motions at targets end; how many were marched."""
    _to_an_end(assembly, search, targets)
    forget.left_on_the_way(search, wanted)
    return len(targets)


def _to_an_end(assembly: Assembly, search: Search, targets: list[Target]) -> None:
    """Where the motions at targets end."""
    ended = raised_and_marched(assembly.prepared, targets)
    for target, answer in zip(targets, ended, strict=True):
        search.keep_end(target, answer)


def _response(search: Search, unseen: Sequence[int] = ()) -> Response:
    """What is known; nothing bounds what is `unseen`, by index."""
    base, now = search.base, search.through_anchors()
    unbounded = [*unseen, *search.leaving(now.error)]
    response = held_to(base, "auto", now, search.doubted(), unbounded)
    marks = np.array(sorted(search.anchors), dtype=int)
    if not len(marks):
        return response
    below = np.array([search.found[k].fell or k in search.fell for k in marks])
    middle = 0.5 * (marks[1:] + marks[:-1])
    beside = below[np.searchsorted(middle, np.arange(len(base.frequency)))]
    fell = (response.flag == CONVERGED) & beside
    return replace(response, outgrown=fell if fell.any() else None)


def _fill(
    assembly: Assembly, search: Search, guess: Contours, advance: Callable[[int], None]
) -> None:
    """Seek what lies between states too far apart where all is spent, as nothing bounds it then: that was so
    before they were closer, or what was between them has been left."""
    began = search.seconds
    while search.over and search.seconds - began < FILLS * search.may_take:
        picks = choosing.between_far(search, guess)
        if not picks:
            return
        advance(_learn(assembly, search, picks))


def _to_their_ends(
    assembly: Assembly,
    search: Search,
    guess: Contours,
    wanted: float,
    advance: Callable[[int], None],
) -> None:
    """March what is not known well; follow branches that this has led to as far as they go beside others.

    The latter may cost as much as the search, on top of that.
    """
    cycles = search.cycles + CYCLES_EACH * search.points
    while True:
        while ends := choosing.to_march(search, wanted):
            advance(_march(assembly, search, ends, wanted))
        picks = choosing.beside_larger(search, guess)
        if not picks or search.following >= search.may_take or search.cycles >= cycles:
            return
        began = search.seconds
        advance(_learn(assembly, search, picks))
        search.following += search.seconds - began


def _refine_on(assembly: Assembly, search: Search, guess: Contours, wanted: float) -> int:
    """Learn more of what has been sought on with more steps; how many were sought or marched, none if enough.

    At last where branches end: also when all that a search may cost is spent.
    """
    joint = assembly.prepared
    if not search.over:
        if moving := choosing.to_march_on(search):
            search.march_on(joint, moving)
            return len(moving)
        picks = choosing.beside_larger(search, guess)
        if picks := picks or choosing.between_refined(search, guess, wanted):
            search.keep_refined(joint, _answers(assembly, picks))
            return len(picks)
    if watched := _watch(assembly, search, wanted):
        return watched
    if not search.over and (picks := choosing.anew(search, guess, wanted)):
        search.keep_anew(joint, _answers(assembly, picks))
        return len(picks)
    if ends := choosing.ends_to_march(search, wanted):
        search.march_on(joint, ends, ends=True)
    return len(ends)


def _watch(assembly: Assembly, search: Search, wanted: float) -> int:
    """March what is itself unsure: to its end where that is not known, else with more steps; how many were.

    On top of what the rest may cost.
    """
    if search.watching >= WATCHES * search.may_take:
        return 0
    joint, count = assembly.prepared, search.count
    cycles, began = search.cycles, search.seconds
    if ends := choosing.unended(search, wanted):
        _to_an_end(assembly, search, ends)
        search.refine(joint)
    elif unsure := choosing.to_watch(search, wanted):
        search.march_on(joint, unsure)
    took, (before, then) = search.seconds - began, search.before or (0, 0.0)
    search.watching += took
    search.count = count
    search.before = before + search.cycles - cycles, then + took
    return len(ends or unsure)


def _said(assembly: Assembly, search: Search, stop: threading.Event) -> tuple[str, ...]:
    """Where no steady state was found, and of the first what the motion is."""
    said: list[str] = []
    for k in sorted(search.lost):
        answer, frequency = search.lost[k], float(search.base.frequency[k])
        reason = answer.reason
        if answer.steady is not None and len(said) < SAID and not stop.is_set():
            reason += f": {what_it_is(assembly.prepared, frequency, answer.steady, search.steps)}"
        said.append(f"{frequency:.6g} Hz: {reason}")
    return tuple(said)


def _walks(
    search: Search,
) -> tuple[tuple[tuple[float, float], ...], tuple[tuple[float, float], ...]]:
    """See `Anchored.walks` and `Anchored.walks_on`."""
    found = search.found.values()
    walks = tuple(
        (float(np.linalg.norm(one.rest)), one.lasts)
        for one in found
        if one.rest is not None and not one.ahead
    )
    return walks, tuple((one.ahead, one.lasts) for one in found if one.ahead)


def other_pasts(response: Response, wanted: float) -> Array:
    """Frequencies, Hz, that are sure, and where another past leads to an amplitude that differs by more."""
    doubtful = unsure(response, wanted)
    found = [one.frequency for one in response.anchors if one.past > wanted]
    return np.setdiff1d(found, doubtful)


def unsure(response: Response, wanted: float) -> Array:
    """Frequencies, Hz, whose stated error is above what is wanted."""
    return response.frequency[_unsure(response, wanted)]


def varying(response: Response, wanted: float) -> Array:
    """Those of them, Hz, where that is because motions vary from cycle to cycle, and for good.

    Without what the steady state there varies by, or those to either side do, the error is not above.
    """
    assert response.error_indicator is not None
    varies = 0.0 if response.varies is None else response.varies
    known = response.error_indicator - varies <= wanted
    return response.frequency[_unsure(response, wanted) & known]


def _unsure(response: Response, wanted: float) -> Mask:
    assert response.error_indicator is not None
    return (response.flag == CONVERGED) & ~(response.error_indicator <= wanted)
