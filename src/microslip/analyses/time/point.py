"""A steady state that is asked for, and one that is found."""

from __future__ import annotations

import math
from dataclasses import dataclass

from microslip.analyses.time.classify import LOOKED, Motion
from microslip.analyses.time.floquet import Multipliers
from microslip.analyses.time.starts import Start
from microslip.analyses.time.steady import SteadyState


@dataclass(frozen=True)
class Request:
    """One steady state to find.

    Attributes
    ----------
    rho : float
        A label; nan where the load was not given by it.
    friction : float or None
        Coefficient of friction of all pairs; None leaves them the joint's own.
    frequency, load : float
        Hz, amplitude of the driving load.
    guess : complex
        First harmonic of the modal coordinate to start from.
    steps, max_cycles : int
        `max_cycles` of the search; see `patient`.
    tolerance : float
    accelerate : bool
    stability : bool
        Find out whether a steady state is stable, and by how much it may be off the periodic one; some
        three cycles more. A motion that leaves an unstable one is followed.
    matched : bool
        Matched poles; False for the error of the steps that Newmark's method has.
    classify : bool
        Say what a motion is that is not periodic; some hundred cycles more.
    finer : bool
        Seek what does not settle, or is unstable, with more steps before it is called so.
    said : str
        The load in messages; its number where left out.
    start : Start, optional
        The end of another steady state (`SteadyState.end`) to start from instead of the guess.
    refinement : int
        So many times the steps with which a settled state is sought on at the end
        (`microslip.analyses.time.step_refinement`); 1 leaves it as it is found.
    past : str
        What there was before: ``raised``, rest and the load raised over `RAISED` cycles; ``rest``, rest and
        the whole load at once; ``reduced``, prestress and the velocity of the guess. Only a name where
        there is a start.
    """

    rho: float
    frequency: float
    load: float
    friction: float | None
    guess: complex
    steps: int = 150
    tolerance: float = 1e-5
    max_cycles: int = 400
    accelerate: bool = True
    stability: bool = True
    matched: bool = True
    classify: bool = True
    finer: bool = True
    refinement: int = 1
    said: str = ""
    start: Start | None = None
    past: str = "reduced"

    @property
    def patient(self) -> bool:
        """Whether a search may take as many cycles as a look at the motion does, `LOOKED`.

        If so, what does not settle is sought with more steps, and what repeats after it was looked at is
        settled as well.
        """
        return self.max_cycles >= LOOKED

    @property
    def place(self) -> str:
        """Load and frequency, in messages."""
        load = (
            f"rho = {self.rho:g}"
            if math.isfinite(self.rho)
            else self.said or f"load {self.load:.4g}"
        )
        return f"{load}, {self.frequency:g} Hz"


@dataclass(frozen=True)
class TimePoint:
    """A steady state with the request it answers.

    Attributes
    ----------
    rho, friction : float
        `friction` is the median of the pairs'.
    steady : SteadyState
    stability : Multipliers or None
        Where asked for and converged.
    error : float
        By how much the state may be off the periodic one, over the size of the vibration; nan where
        not known.
    walked, lasts, ahead : float
        How far bodies that walk move past each other until they come to rest, m, in about how many cycles,
        and by how much the amplitude still changes until then, relative, where they have not within
        `microslip.analyses.time.offset.HORIZON` cycles: the motion is that after so many. Zero where they do
        not walk.
    motion : Motion or None
        What it is, where the search ended without a periodic motion that lasts.
    pasts : tuple of str
        Starts that lead to it.
    left : TimePoint or None
        An unstable periodic motion that the search met first, and left.
    steps : int
        Steps per cycle that it was found with; where they are more than those asked for, the samples of
        its cycle are those asked for all the same.
    place_error : float
        Part of `error` that is of the place where bodies that walk rest.
    steps_error : float
        By how much the first harmonic may be off because of them, relative: what so many have changed it by
        from the fewer ones before; nan where not known.
    steps_change : float
        What they have changed it by in all, from those that the search began with.
    unrefined : str
        Why it is not known, where more steps were tried.
    """

    rho: float
    friction: float
    steady: SteadyState
    stability: Multipliers | None = None
    error: float = float("nan")
    walked: float = 0.0
    lasts: float = 0.0
    ahead: float = 0.0
    motion: Motion | None = None
    pasts: tuple[str, ...] = ()
    left: TimePoint | None = None
    steps: int = 0
    place_error: float = 0.0
    steps_error: float = float("nan")
    steps_change: float = float("nan")
    unrefined: str = ""

    @property
    def settled(self) -> bool:
        """Whether it is periodic, and not known to be unstable."""
        return self.steady.converged and self.verdict != "unstable"

    @property
    def verdict(self) -> str:
        """``stable``, ``unstable`` or ``undecided``; empty where not known."""
        return "" if self.stability is None else self.stability.verdict
