"""The contact solver as the analyses use it: problem, warm state, solution with certificate."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from microslip.contact import planar, tableau
from microslip.errors import ContactError
from microslip.model.flexibility import Flexibility
from microslip.typing import Array

TOLERANCE = 1e-12
"""Inequalities may be violated by this much of the contact pressure before a state changes."""

CERTIFICATE = 1e-8
"""A solution with a larger complementarity residual is an error."""


@dataclass(frozen=True)
class Solution:
    """One solved contact problem.

    Attributes
    ----------
    r, v : (d m,) arrays
        Reactions (N/m) and relative displacements (m), layout of `interface.py`.
    q : (e,) array
        Coordinates of equilibrium.
    status : (m,) int8 array
        1 stick, 2 forward slip, 3 backward slip, 4 separation.
    residual : float
        Complementarity residual relative to contact pressure and contact displacement.
    iterations : int
    """

    r: Array
    v: Array
    q: Array
    status: NDArray[np.int8]
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
        status: NDArray[np.int8],
    ) -> None:
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
        self.status = np.array(status, dtype=np.int8)
        e = flexibility.R.shape[1]
        self.problem = tableau.problem(
            flexibility.W,
            flexibility.R,
            flexibility.stiffness,
            self.friction,
            self.force,
            TOLERANCE,
        )
        self.memory = tableau.memory(pairs, e)
        self.r = np.zeros(2 * pairs)
        self.q = np.zeros(e)
        self.v = np.zeros(2 * pairs)
        self.refresh()

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
        iterations, residual, rule = planar.solve(
            self.problem,
            self.memory,
            np.ascontiguousarray(v_free),
            np.ascontiguousarray(f_q),
            np.ascontiguousarray(vt_old),
            self.status,
            self.r,
            self.q,
            self.v,
        )
        if rule == planar.NOT_SOLVED or not residual <= CERTIFICATE:
            raise ContactError(
                f"contact not solved: residual {residual:.1e} after {iterations} iterations; "
                "try smaller load steps, or check that the load does not open the joint"
            )
        return Solution(
            self.r.copy(), self.v.copy(), self.q.copy(), self.status.copy(), residual, iterations
        )
