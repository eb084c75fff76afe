"""What is known while the steady states are sought that hold a response to the truth.

Anchors by index of their frequency, what was lost, what was marched to its end, and what all of it has cost.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.analyses.reduced.anchors import JUMP, Anchor, anchor_at
from microslip.analyses.reduced.response import Response
from microslip.analyses.reduced.surface import LoadSurface
from microslip.analyses.reduced.through_anchors import Held, held
from microslip.analyses.time.offset import BRANCH
from microslip.analyses.time.staying import LEAVES
from microslip.describe.requests import CYCLES_EACH, SECONDS_EACH
from microslip.pipeline.doubts import by_themselves, doubt_with, doubted
from microslip.pipeline.neighbours import around, leaving, within_a_branch
from microslip.pipeline.stepping import ACCURACY, Stepping, refined_anchors, taken
from microslip.pipeline.stepping import BY_INDEX as OF_STEPS
from microslip.pipeline.targets import (
    LEFT,
    REFINEMENT,
    STEPS,
    TOLERANCE,
    Found,
    Lost,
    Stepped,
    Target,
    stepped,
)
from microslip.pipeline.walk import may_be_shown
from microslip.typing import Array

BY_INDEX = ("anchors", "found", "lost")
INDICES = ("fell", "ended", "tried", "finer", "marched_on", "firm")
"""What is known of each frequency, and of some."""

LEAVES_IT = "the motion leaves its branch when it is marched"

VARIES = "the amplitude varies from cycle to cycle, and for good, by up to {:.0%} of its mean"
"""Why there is no steady state where a motion was marched."""


@dataclass
class Search:
    """What is known while anchors are sought."""

    surface: LoadSurface
    base: Response
    points: int
    stepping: Stepping = field(default_factory=Stepping)
    anchors: dict[int, Anchor] = field(default_factory=dict)
    found: dict[int, Found] = field(default_factory=dict)
    origins: dict[int, set[int]] = field(default_factory=dict)
    lost: dict[int, Lost] = field(default_factory=dict)
    fell: set[int] = field(default_factory=set)
    tried: set[int] = field(default_factory=set)
    ended: set[int] = field(default_factory=set)
    marched: int = 0
    moved: float = 0.0
    count: int = 0
    spent: int = 0
    opens: bool = False
    accuracy: float | Array = ACCURACY
    passed: set[int] = field(default_factory=set)
    anew: set[int] = field(default_factory=set)
    finer: set[int] = field(default_factory=set)
    marched_on: set[int] = field(default_factory=set)
    firm: set[int] = field(default_factory=set)
    before: tuple[int, float] | None = None
    past: tuple[int, int, float] = (0, 0, 0.0)
    following: float = 0.0
    watching: float = 0.0
    began: float = field(default_factory=time.process_time)

    @property
    def seconds(self) -> float:
        """Processor time spent."""
        return time.process_time() - self.began

    @property
    def over(self) -> bool:
        """Whether all that may be spent is; since there have been more steps, of more cycles' worth."""
        cycles, seconds = self.before or (0, 0.0)
        most = CYCLES_EACH * self.points * (1 if self.before is None else REFINEMENT)
        dear = self.cycles - cycles >= most or self.seconds - seconds >= self.may_take
        return dear or self.count >= self.points

    @property
    def cycles(self) -> int:
        """Spent on searches, of `steps` each."""
        return self.spent + self.stepping.cycles

    @property
    def in_all(self) -> tuple[int, int, float]:
        """Steady states, cycles and seconds, those of a search over less of the band among them."""
        count, cycles, seconds = self.past
        return count + self.count, cycles + self.cycles + self.marched, seconds + self.seconds

    @property
    def steps(self) -> int:
        """Per cycle."""
        return self.stepping.steps

    @property
    def may_take(self) -> float:
        """Processor time that the search may take, s: more steps take more."""
        return SECONDS_EACH * self.points * self.steps / STEPS

    @property
    def marks(self) -> list[int]:
        """Frequencies that were sought, by index."""
        return sorted({*self.anchors, *self.lost})

    @property
    def states(self) -> dict[int, Stepped]:
        """Steady states by index of their frequency."""
        f, known = self.base.frequency, self.found.keys() & self.anchors.keys()
        return {k: stepped(float(f[k]), self.found[k], self.steps_at(k)) for k in known}

    @property
    def settled(self) -> dict[int, Stepped]:
        """Those whose motion repeats, or varies for good, or whose bodies have come to rest.

        And those of which marching on with more steps has told.
        """
        known = {k for k, one in self.anchors.items() if one.change <= TOLERANCE} | self.marched_on
        return {
            k: one for k, one in self.states.items() if k in known or self.found[k].rest is not None
        }

    def steps_at(self, k: int) -> int:
        """Per cycle, of the steady state at a frequency."""
        return self.stepping.more if k in self.finer else self.steps

    @property
    def refined(self) -> set[int]:
        """Anchors that are steady states with more steps, by index of their frequency."""
        return set(taken(self.settled, self.stepping.sought_on))

    def refine(self, joint: PreparedJoint) -> None:
        """Seek settled anchors on with more steps that are not yet, and know what the steps do."""
        self.seek_on(joint)
        self.take_refined()
        if self.before is None:
            self.before = self.cycles, self.seconds

    def seek_on(self, joint: PreparedJoint) -> None:
        """Seek settled anchors on with more steps that are not yet; those with fewer stay."""
        self.stepping.seek_on(joint, self.base.load, self.settled)
        self._have_strays()

    def _have_strays(self) -> None:
        """Have how far motions stray from anchors in their doubt; what they leave is no steady motion."""
        for k in self.settled:
            anchor, strays = self.anchors[k], self.stepping.strays.get(k, 0.0)
            varies = self.stepping.varies.get(k, 0.0)
            if not may_be_shown(strays, varies):
                left = LEAVES_IT if k in self.marched_on | self.ended else LEFT
                del self.anchors[k], self.found[k]
                reason = VARIES.format(varies) if varies > LEAVES else left
                self.lost[k] = Lost(reason, 0, left=True)
            else:
                doubt = doubt_with(self.stepping, k, self.found[k])
                self.anchors[k] = replace(anchor, doubt=doubt)

    def march_on(self, joint: PreparedJoint, marks: Sequence[int], ends: bool = False) -> None:
        """March anchors with more steps, ends of branches with still more; what leaves is none."""
        chosen = {k: one for k, one in self.states.items() if k in marks}
        march = self.stepping.march_ends if ends else self.stepping.march_on
        self.marched_on |= march(joint, self.base.load, chosen)
        self.count += len(marks)
        self.passed.update(marks)
        self.firm.update(marks if ends else ())
        self.take_refined()

    def steps_tell(self, joint: PreparedJoint, wanted: float) -> bool:
        """Whether the steps put a settled anchor off by more than is wanted."""
        self.seek_on(joint)
        return self.stepping.err_by_more(self.settled, wanted)

    @property
    def unstable(self) -> set[int]:
        """Where the periodic motion is unstable, or none is: what motions do there is known as well."""
        strays = self.stepping.strays
        about = {k for k in self.settled if strays.get(k)}
        return about | {k for k, one in self.lost.items() if one.left}

    def begun_anew(self) -> Search:
        """The same with more steps, and nothing known but what those err by; what was spent counts."""
        return Search(
            self.surface,
            self.base,
            self.points,
            self.stepping.anew(self.settled),
            count=self.count,
            spent=self.spent // REFINEMENT,
            opens=self.opens,
            began=self.began,
        )

    def take_refined(self) -> None:
        """Have the anchors with more steps, where they were sought on, and what is left of the error."""
        self._have_strays()
        self.anchors, self.accuracy = refined_anchors(
            self.surface, self.base.load, self.anchors, self.settled, self.stepping
        )

    def keep_refined(
        self, joint: PreparedJoint, answers: Sequence[tuple[Target, Found | Lost]]
    ) -> None:
        """Learn from answers between or beside anchors with more steps that settle with these themselves.

        Others say nothing that such anchors do not, and are passed over.
        """
        before = self.copied()
        for target, answer in answers:
            if isinstance(answer, Found) and answer.change <= TOLERANCE:
                self.keep(target, answer)
            else:
                self._count(target, answer)
        self.refine(joint)
        points = {target.point for target, _ in answers}
        new = points - self.refined
        self.passed |= new.difference(before.anchors, before.lost)
        # with more steps it may be what was known
        again = (points - new).intersection(before.anchors)
        new |= {k for k in again if not before._larger(k, self.anchors[k].amplitude)}
        self.put_back(new, before)
        self.take_refined()

    def copied(self) -> Search:
        """A copy that shares nothing that may change."""
        own: Any = {k: v.copy() for k, v in vars(self).items() if isinstance(v, dict | set)}
        own["origins"] = {k: set(begun) for k, begun in self.origins.items()}
        return replace(self, stepping=self.stepping.copied(), **own)

    def put_back(self, points: set[int], before: Search) -> None:
        """What another search knows at frequencies, in place of what this one does."""
        for one, other, names in (
            (self, before, BY_INDEX),
            (self.stepping, before.stepping, OF_STEPS),
        ):
            for name in names:
                now, then = getattr(one, name), getattr(other, name)
                for k in points:
                    now.pop(k, None)
                now.update({k: then[k] for k in points.intersection(then)})
        for name in INDICES:
            some = getattr(self, name)
            some -= points
            some |= getattr(before, name) & points
        for k, begun in before.origins.items():
            self.origins[k] |= begun & points

    def keep_anew(
        self, joint: PreparedJoint, answers: Sequence[tuple[Target, Found | Lost]]
    ) -> None:
        """Learn from what was sought anew with more steps, where that is on the branch and then known better.

        Of motions that leave their branch when they are marched nothing is learned so, nor of those at rest
        where bodies are not. What was passed over has to settle with still more, as others do.
        """
        now, before = self.held(), self.copied()
        ends, marks, known = set(self.leaving(now.error)), self.marks, now.of_mean
        for target, answer in answers:
            k = target.point
            self._count(target, answer, REFINEMENT)
            self.anew.add(k)
            if isinstance(answer, Found) and self._may_replace(k, answer, k in ends):
                if k in self.found and self._apart(k, answer) > BRANCH:
                    self.fell.add(k)
                elif k in self.found:
                    self.stepping.replaced(k, self.found[k].amplitude, answer.amplitude)
                self.lost.pop(k, None)
                self.ended.discard(k)
                self.finer.add(k)
                self._take(target, answer)
        self.refine(joint)
        better, refined = self.held().of_mean, self.refined
        for k in self.finer & {target.point for target, _ in answers}:
            if not (better[k] < known[k] if k in marks else k in refined):
                self.put_back({k}, before)
        self.take_refined()

    def _may_replace(self, k: int, answer: Found, ends: bool) -> bool:
        """Whether a motion sought anew is of the branch that is known at a frequency; where none is or it may
        end there, of one beside it."""
        old = self.found.get(k)
        left = k in self.lost and k in self.tried
        walked = old is not None and old.rest is not None and answer.rest is None
        if answer.change > TOLERANCE or left or walked:
            return False
        if k in self.anchors and self._apart(k, answer) <= BRANCH:
            return True
        apart = [self._apart(j, answer) for j in around(set(self.anchors) - {k}, k)]
        return (ends or k not in self.anchors) and min(apart, default=np.inf) <= BRANCH

    def _apart(self, k: int, answer: Found) -> float:
        """Logarithm of the sizes of a motion and of the one that is known at a frequency."""
        return abs(float(np.log(abs(answer.amplitude) / abs(self.anchors[k].amplitude))))

    def held(self) -> Held:
        """The response through the anchors so far; of what may be on its way out nothing is known."""
        now = self.through_anchors()
        now.error[self.leaving(now.error)] = np.inf
        return now

    def through_anchors(self) -> Held:
        """The same, of what may be on its way out too."""
        return held(self.surface, self.base.load, self.doubted(), self.lost, self.accuracy)

    def leaving(self, error: Array) -> list[int]:
        """Where motions may be on their way out: with more steps a branch may end before it does with few."""
        if self.before is None or not self.stepping.sought_on:
            settled = set(self.settled) - self.marched_on
            return leaving(self.anchors, error, settled, self.stepping.staying(self.marched_on))
        staying = self.stepping.staying(self.settled)
        return leaving(self.anchors, error, self.refined - staying, staying)

    def doubted(self) -> dict[int, Anchor]:
        """The anchors, each with how well it is known beside the others, `microslip.pipeline.doubts`."""
        return doubted(self.alone(), self.found, self.ended, self.stepping)

    def alone(self) -> dict[int, Anchor]:
        """The same, whatever is known of those next to each."""
        return by_themselves(self.anchors, self.found, self.ended, self.moved, self.stepping)

    def blurred(self, wanted: float) -> set[int]:
        """Steady states that are themselves not known as well as is wanted."""
        error = self.through_anchors().of_mean
        return {k for k in self.anchors if not error[k] <= wanted}

    def keep_end(self, target: Target, answer: Found | Lost) -> None:
        """Learn where a motion ends that was marched, if that is on the branch that is known there."""
        k = target.point
        self.count += 1
        self.tried.add(k)
        self.marched += answer.cycles
        self.opens = self.opens or answer.opens
        if isinstance(answer, Lost):
            return
        own = [k] if k in self.anchors else around(self.anchors, k)
        apart = [self._apart(j, answer) for j in own]
        left = answer.own and k in self.anchors and min(apart) > BRANCH
        if left:  # the motion that was taken for steady has left its branch
            self._leave(k, abs(answer.amplitude))
        if not may_be_shown(answer.doubt, answer.varies):
            settled = k in self.anchors and self.anchors[k].change <= TOLERANCE
            varies = answer.varies > LEAVES and min(apart, default=0.0) <= BRANCH
            if left or (varies and (answer.own or not settled)):
                self.anchors.pop(k, None)
                self.found.pop(k, None)
                reason = VARIES.format(answer.varies) if varies else LEAVES_IT
                self.lost[k] = Lost(reason, answer.cycles, left=varies)
            return
        if min(apart, default=np.inf) > BRANCH and not left:
            return
        self.ended.add(k)
        if not left and answer.rest is not None and k in self.anchors:
            self.moved = max(self.moved, *apart)
        self.lost.pop(k, None)
        self.finer.discard(k)
        if k not in self.anchors:
            self.fell.discard(k)
        self._take(target, answer)

    def _leave(self, k: int, size: float) -> None:
        """Forget what a branch has from where it was left to where the size jumps, but what has settled."""
        marks = sorted(self.anchors)
        i = marks.index(k)
        for outward in (marks[:i][::-1], marks[i + 1 :]):
            passed: list[int] = []
            for j in outward:
                if abs(np.log(abs(self.anchors[j].amplitude) / size)) <= BRANCH:
                    for gone in passed:
                        del self.anchors[gone], self.found[gone]
                    break
                if j in self.tried or self.anchors[j].change <= TOLERANCE:
                    break
                passed.append(j)
        self.fell.add(k)

    def keep(self, target: Target, answer: Found | Lost) -> None:
        """Learn from an answer."""
        k = target.point
        self._count(target, answer)
        if isinstance(answer, Lost):
            # that motions leave a larger one says nothing of a branch on both sides of it, once
            if k in self.anchors or (
                answer.left and k not in self.fell and within_a_branch(self.anchors, self.lost, k)
            ):
                self.fell.add(k)
            else:
                self.lost[k] = answer
            return
        if k in self.anchors and not self._outgrows(k, answer):
            return
        for known in (self.fell, self.ended, self.tried, self.finer, self.anew):
            known.discard(k)
        self.lost.pop(k, None)
        self._take(target, answer)

    def _outgrows(self, k: int, answer: Found) -> bool:
        """Whether a motion is a larger one than is known at a frequency.

        Not where that was marched to its end on the branch of this, nor where it has left it, as motions
        that do not settle do.
        """
        if not self._larger(k, answer.amplitude):
            return False
        left = k in self.fell and answer.change > TOLERANCE
        return k not in self.ended or not (left or self._apart(k, answer) <= BRANCH)

    def _larger(self, k: int, amplitude: complex) -> bool:
        return abs(amplitude) >= abs(self.anchors[k].amplitude) * (1 + JUMP / 2)

    def _count(self, target: Target, answer: Found | Lost, worth: int = 1) -> None:
        """Take down what an answer has cost, each cycle `worth` so many, and what it began with."""
        self.count += 1
        self.spent += worth * answer.cycles
        self.opens = self.opens or answer.opens
        if not target.cold:  # else it may have been from rest alone
            self.origins.setdefault(target.point, set()).add(target.origin)

    def _take(self, target: Target, answer: Found) -> None:
        k, Q, load = target.point, answer.amplitude, self.base.load
        if k not in self.anchors or self._larger(k, Q):
            # what was started from a smaller motion here may be started anew
            for begun in self.origins.values():
                begun.discard(k)
        self.found[k] = answer
        for told in (self.marched_on, self.firm):
            told.discard(k)
        self.stepping.forget(k)
        if answer.more is not None:
            self.stepping.keep(k, answer.more)
        past = float(np.nan_to_num(answer.past))
        self.anchors[k] = anchor_at(
            self.surface, target.frequency, load, Q, answer.change, answer.doubt, past
        )
