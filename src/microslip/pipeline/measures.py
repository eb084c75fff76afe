"""What positions, pressures and amplitudes of a joint are measured by in summaries and figures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from microslip.analyses.prepared.prestress import Prestress
from microslip.contact.fields import contact_extent
from microslip.contact.law import ContactLaw
from microslip.contact.pairs import normal
from microslip.describe.joint import Joint
from microslip.describe.lap import LapJoint
from microslip.model.joint import JointModel


@dataclass(frozen=True)
class Measures:
    """Measures of a joint: of a lap joint those of its clamp, of another those of its interface.

    Attributes
    ----------
    half_length : float
        What positions are over, m.
    centre : float
        Where that has its middle, m.
    force : float
        What presses the sides together, N per metre of width.
    edge : float
        Where slip is kept at every step where the file names no position, m.
    friction : float
        Mean coefficient of friction.
    clamp : bool
        Whether there is a clamp of known dimensions.
    area : float
        What the force is spread over, m per metre of width.
    """

    half_length: float
    centre: float
    force: float
    edge: float
    friction: float
    clamp: bool
    area: float

    @property
    def mean_pressure(self) -> float:
        """Force over the area, Pa: what pressures and tractions are over."""
        return self.force / self.area

    @property
    def symbol(self) -> str:
        """Of the half length, in figures."""
        return "L_p" if self.clamp else "L_c"


def measures_of(joint: Joint, model: JointModel, start: Prestress, law: ContactLaw) -> Measures:
    """The measures of a prepared joint."""
    if isinstance(joint, LapJoint):
        clamp = joint.clamp
        half = clamp.half_length
        return Measures(half, clamp.centre, clamp.force, half, joint.friction, True, 2 * half)
    x = model.position
    per_metre = model.dimension == 2 and not joint.whole
    return Measures(
        half_length=0.5 * float(model.area.sum() if per_metre else np.ptp(x)),
        centre=0.5 * float(x.min() + x.max()),
        force=float(normal(start.solution.r, model.dimension).sum()),
        edge=float(contact_extent(x, start.touching)[1]),
        friction=float(np.average(law.friction, weights=model.area)),
        clamp=False,
        area=float(model.area.sum()),
    )
