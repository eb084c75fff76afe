"""What the interface is made of: friction, and the compliance of the contact itself."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from microslip.brief import Brief
from microslip.errors import ContactError
from microslip.typing import Array


@dataclass(frozen=True, repr=False)
class ContactLaw(Brief):
    """Signorini's and Coulomb's law at every pair, behind a spring where the contact is elastic.

    A penalty contact of stiffness k per area is the exact contact behind the compliance
    ``1 / (k area)``: a Jenkins element is a rigid Coulomb slider in series with ``k_t``.

    Attributes
    ----------
    friction : (m,) array
        Coefficient of friction.
    compliance : (d m,) array
        m/N for every component of v (per metre of width in two dimensions); zero where exact.
    """

    friction: Array
    compliance: Array

    @property
    def exact(self) -> bool:
        """Whether no component is behind a spring."""
        return not self.compliance.any()

    @property
    def frictionless(self) -> bool:
        """Whether no pair has friction."""
        return not self.friction.any()

    def with_friction(self, friction: float | Array) -> ContactLaw:
        """The same contact with another coefficient of friction, one for all or one per pair."""
        return replace(self, friction=_per_pair(friction, len(self.friction)))


def contact_law(
    pairs: int, friction: float | Array, compliance: Array | None = None, dimension: int = 2
) -> ContactLaw:
    """Contact law of m pairs.

    Parameters
    ----------
    pairs : int
    friction : float or (m,) array
    compliance : (d m,) array, optional
        m/N; exact contact when left out.
    dimension : int

    Raises
    ------
    ContactError
        Where a coefficient of friction or a compliance is negative or not finite, or where there is
        another number of them.

    Examples
    --------
    >>> contact_law(2, 0.25).friction
    array([0.25, 0.25])
    """
    give = np.zeros(dimension * pairs) if compliance is None else np.array(compliance, dtype=float)
    if give.shape != (dimension * pairs,):
        raise ContactError(f"compliance has shape {give.shape}, not ({dimension * pairs},)")
    if not (np.isfinite(give).all() and (give >= 0).all()):
        raise ContactError("compliance of the contact must be finite and not negative")
    return ContactLaw(_per_pair(friction, pairs), give)


def _per_pair(friction: float | Array, pairs: int) -> Array:
    given = np.asarray(friction, dtype=float)
    if given.shape not in ((), (1,), (pairs,)):
        raise ContactError(f"friction has shape {given.shape}, not ({pairs},)")
    mu = np.broadcast_to(given, (pairs,)).copy()
    if not (np.isfinite(mu).all() and (mu >= 0).all()):
        raise ContactError("coefficient of friction must be finite and not negative")
    return mu
