"""The contact solver as the analyses use it: problem, warm state, solution with certificate."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from microslip.brief import Brief
from microslip.contact import planar, tableau
from microslip.contact.active_set import NOT_SOLVED
from microslip.contact.fallbacks import Fallbacks, fallbacks
from microslip.contact.pairs import at_rest
from microslip.contact.problem import Contact, Given, check_flexibility, contact_problem
from microslip.contact.unsolved import why_unsolved
from microslip.errors import ContactError
from microslip.model.flexibility import Flexibility
from microslip.typing import Array, Status

TOLERANCE = 1e-12
"""Inequalities may be violated by this much of the contact pressure before a state changes."""

CERTIFICATE = 1e-8
"""A solution with a larger complementarity residual is an error."""


@dataclass(frozen=True, repr=False)
class Solution(Brief):
    """One solved contact problem.

    Attributes
    ----------
    r, v : (d m,) arrays
        Reactions (N/m) and relative displacements (m), layout of `contact/pairs.py`.
    q : (e,) array
        Coordinates of equilibrium.
    status : (m,) int8 array
        Contact states, numbered as in `contact/pairs.py`.
    residual : float
        Complementarity residual relative to contact pressure and contact displacement.
    iterations : int
    """

    r: Array
    v: Array
    q: Array
    status: Status
    residual: float
    iterations: int


@contextmanager
def singularity_named() -> Iterator[None]:
    """Turn numpy's singular-matrix error into a `ContactError` that says what it means."""
    try:
        yield
    except np.linalg.LinAlgError as error:
        raise ContactError(
            "the contact system is singular: a motion of the bodies is held by neither contact, "
            "friction nor support; add a support or some friction"
        ) from error


@lru_cache(maxsize=1)
def load_kernels() -> None:
    """Load the compiled solver, once in a process, before anything compiled that contains it.

    Code that several compiled functions contain is taken from the one that is loaded first, and two
    of its versions may round differently. With a fixed order every process gives the same bits.
    """
    nothing = np.zeros((2, 0))
    problem = contact_problem(np.eye(2), nothing, np.zeros(0), np.zeros(1), np.ones(1), TOLERANCE)
    memory = tableau.memory(1, 0)
    contact = Contact(at_rest(np.array([True])), np.zeros(2), np.zeros(0), np.zeros(2))
    tableau.restart(problem, memory, contact.status)
    planar.solve(problem, memory, Given(np.zeros(2), np.zeros(0), np.zeros(1)), contact)


class ContactSolver:
    """Planar Signorini–Coulomb contact on one flexibility, warm from call to call.

    Parameters
    ----------
    flexibility : Flexibility
    friction : float or (m,) array
        Coefficient of friction per pair, >= 0.
    force : (m,) array
        Typical contact force of each pair (N/m), the scale of tolerances and of the residual.
    status : (m,) int8 array
        Initial states.

    Notes
    -----
    The state of the solver is ``status``, the tableau of the contact equations and the last solution.
    It affects the speed of the next call, and its result only where friction has more than one.
    """

    def __init__(
        self,
        flexibility: Flexibility,
        friction: float | Array,
        force: Array,
        status: Status,
    ) -> None:
        load_kernels()
        check_flexibility(flexibility.W)
        pairs = len(status)
        if flexibility.W.shape != (2 * pairs, 2 * pairs):
            raise ContactError(
                f"flexibility is {flexibility.W.shape}, {pairs} planar pairs need {2 * pairs} rows"
            )
        self.flexibility = flexibility
        self.friction = np.broadcast_to(np.asarray(friction, dtype=float), (pairs,)).copy()
        if not (np.isfinite(self.friction).all() and (self.friction >= 0).all()):
            raise ContactError("coefficient of friction must be finite and not negative")
        self.force = np.asarray(force, dtype=float)
        e = flexibility.R.shape[1]
        self.problem = contact_problem(
            flexibility.W,
            flexibility.R,
            flexibility.stiffness,
            self.friction,
            self.force,
            TOLERANCE,
        )
        self.memory = tableau.memory(pairs, e)
        self.contact = Contact(
            status=np.array(status, dtype=np.int8),
            r=np.zeros(2 * pairs),
            q=np.zeros(e),
            v=np.zeros(2 * pairs),
        )
        self.refresh()

    @property
    def fallbacks(self) -> Fallbacks:
        """How the problems were solved so far."""
        return fallbacks(self.memory.solved)

    @property
    def status(self) -> Status:
        """Present contact states."""
        return self.contact.status

    @property
    def r(self) -> Array:
        """Present reactions."""
        return self.contact.r

    @property
    def q(self) -> Array:
        """Present coordinates of equilibrium."""
        return self.contact.q

    @property
    def v(self) -> Array:
        """Present relative displacements."""
        return self.contact.v

    def start_from(self, r: Array, q: Array, v: Array) -> None:
        """Take over a solution that belongs to the present states."""
        self.r[:], self.q[:], self.v[:] = r, q, v

    @singularity_named()
    def refresh(self) -> None:
        """Rebuild the tableau from the present states."""
        tableau.restart(self.problem, self.memory, self.status)

    @singularity_named()
    def solve(self, v_free: Array, f_q: Array, vt_old: Array) -> Solution:
        """Solve for the given free displacement; raises `ContactError` where it cannot.

        Parameters
        ----------
        v_free : (2 m,) array
            Relative displacement without contact, m.
        f_q : (e,) array
            Loads on the coordinates of equilibrium.
        vt_old : (m,) array
            Tangential displacement at which each pair sticks.
        """
        given = Given(*(np.ascontiguousarray(a) for a in (v_free, f_q, vt_old)))
        iterations, residual, rule = planar.solve(self.problem, self.memory, given, self.contact)
        if rule == NOT_SOLVED or not residual <= CERTIFICATE:
            raise ContactError(
                f"contact not solved: residual {residual:.1e} after {iterations} iterations; "
                f"{why_unsolved(self.problem, given)}"
            )
        return Solution(
            self.r.copy(), self.v.copy(), self.q.copy(), self.status.copy(), residual, iterations
        )
