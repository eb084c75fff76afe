"""What joints in space must say, whatever they are described by."""

from __future__ import annotations

from microslip.describe.whole import WideJoint
from microslip.errors import InputError


def check_spatial(joint: WideJoint) -> None:
    """Raise `InputError` where a joint in space does not say its width."""
    if joint.given_width is None:
        raise InputError(
            f"{joint.width_in}.width is missing: loads and results in space are per metre of a width; with "
            '"whole" they are the forces themselves'
        )


def width_said(joint: WideJoint) -> list[tuple[str, str]]:
    """What loads and results in space are per metre of: a row of ``microslip check``; none of the whole."""
    if joint.whole:
        return []
    return [("width", f"{joint.width:.4g} m: all forces and energies are per metre of it")]
