"""The contact solver as the analyses use it: problem, warm state, solution with certificate."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from copy import copy
from dataclasses import dataclass
from functools import lru_cache
from types import ModuleType

import numpy as np

from microslip.brief import Brief
from microslip.contact import planar, spatial, spatial_tableau, spatial_unsolved, tableau, unsolved
from microslip.contact.fallbacks import Counts, fallbacks
from microslip.contact.pairs import at_rest, slip_history
from microslip.contact.problem import Contact, Given, check_flexibility, contact_problem
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


@dataclass(frozen=True)
class Kernels:
    """The compiled solver of pairs of one dimension, and what names the reason where it fails."""

    dimension: int
    method: ModuleType
    tableau: ModuleType
    reasons: ModuleType


PLANAR = Kernels(2, planar, tableau, unsolved)
SPATIAL = Kernels(3, spatial, spatial_tableau, spatial_unsolved)


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
    _solve_nothing(PLANAR)


@lru_cache(maxsize=1)
def load_spatial_kernels() -> None:
    """The same of the spatial solver, which nothing planar waits for."""
    _solve_nothing(SPATIAL)


def loaded(dimension: int) -> Kernels:
    """The kernels for as many components per pair, loaded."""
    if dimension == SPATIAL.dimension:
        load_spatial_kernels()
        return SPATIAL
    load_kernels()
    return PLANAR


def _solve_nothing(kernels: Kernels) -> None:
    d = kernels.dimension
    nothing = np.zeros((d, 0))
    problem = contact_problem(np.eye(d), nothing, np.zeros(0), np.zeros(1), np.ones(1), TOLERANCE)
    memory = kernels.tableau.memory(1, 0)
    contact = Contact(at_rest(np.array([True])), np.zeros(d), np.zeros(0), np.zeros(d))
    kernels.tableau.restart(problem, memory, contact.status)
    given = Given(np.zeros(d), np.zeros(0), slip_history(np.zeros(d), d))
    kernels.method.solve(problem, memory, given, contact)


class ContactSolver:
    """Signorini–Coulomb contact on one flexibility, planar or spatial, warm from call to call.

    How many rows the flexibility has for each pair says which.

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
        pairs = len(status)
        self.kernels = _kernels_for(flexibility.W, pairs)
        check_flexibility(flexibility.W)
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
        d = self.dimension
        self.memory = self.kernels.tableau.memory(pairs, e)
        self.contact = Contact(
            status=np.array(status, dtype=np.int8),
            r=np.zeros(d * pairs),
            q=np.zeros(e),
            v=np.zeros(d * pairs),
        )
        self.refresh()

    def another(self, status: Status) -> ContactSolver:
        """A solver of the same problem in other states, for a fraction of what a new one costs.

        It begins with a copy of this one's tableau, which follows; nothing is solved yet.

        Parameters
        ----------
        status : (m,) int8 array
        """
        other = copy(self)
        other.memory = type(self.memory)(*(a.copy() for a in self.memory))
        other.memory.solved[:] = 0
        other.contact = Contact(
            np.array(status, dtype=np.int8), *(np.zeros_like(a) for a in self.contact[1:])
        )
        with singularity_named():
            self.kernels.tableau.follow(self.problem, other.memory, other.status)
        return other

    @property
    def dimension(self) -> int:
        """Components per contact pair."""
        return self.kernels.dimension

    @property
    def fallbacks(self) -> Counts:
        """How the problems were solved so far."""
        return fallbacks(self.memory.solved, self.dimension)

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
        self.kernels.tableau.restart(self.problem, self.memory, self.status)

    @singularity_named()
    def solve(self, v_free: Array, f_q: Array, vt_old: Array) -> Solution:
        """Solve for the given free displacement; raises `ContactError` where it cannot.

        Parameters
        ----------
        v_free : (d m,) array
            Relative displacement without contact, m.
        f_q : (e,) array
            Loads on the coordinates of equilibrium.
        vt_old : (m,) or (m, 2) array
            Tangential displacement at which each pair sticks, as `pairs.slip_history` gives it.
        """
        given = Given(*(np.ascontiguousarray(a) for a in (v_free, f_q, vt_old)))
        method = self.kernels.method
        iterations, residual, rule = method.solve(self.problem, self.memory, given, self.contact)
        if rule == method.NOT_SOLVED or not residual <= CERTIFICATE:
            raise ContactError(
                f"contact not solved: residual {residual:.1e} after {iterations} iterations; "
                f"{self.why_unsolved(given)}"
            )
        return Solution(
            self.r.copy(), self.v.copy(), self.q.copy(), self.status.copy(), residual, iterations
        )

    def why_unsolved(self, given: Given) -> str:
        """Say why a problem has no solution, or none was found; after a step that was not solved."""
        reasons = self.kernels.reasons
        return str(reasons.why_unsolved(self.problem, given, self.contact))


def _kernels_for(W: Array, pairs: int) -> Kernels:
    """The kernels for as many rows as W has for each pair, loaded."""
    for kernels in (PLANAR, SPATIAL):
        rows = kernels.dimension * pairs
        if W.shape == (rows, rows):
            return loaded(kernels.dimension)
    raise ContactError(
        f"flexibility is {W.shape}: {pairs} planar pairs need {2 * pairs} rows, spatial ones "
        f"{3 * pairs}"
    )
