"""What joints in space must say, whatever they are described by."""

from __future__ import annotations

from microslip.describe.whole import WideJoint
from microslip.errors import InputError


def check_spatial(joint: WideJoint) -> None:
    """Raise `InputError` where a joint in space has no width, or asks for what there is only in the plane."""
    if joint.given_width is None:
        raise InputError(
            f"{joint.width_in}.width is missing: loads and results in space are per metre of a width; with "
            '"whole" they are the forces themselves'
        )
    response = joint.analysis.response
    if response is not None and response.method != "reduced":
        raise InputError(
            f'analysis.response.method = "{response.method}": is for joints in the plane: take "reduced"'
        )


def width_said(joint: WideJoint) -> list[tuple[str, str]]:
    """What loads and results in space are per metre of: a row of ``microslip check``; none of the whole."""
    if joint.whole:
        return []
    return [("width", f"{joint.width:.4g} m: all forces and energies are per metre of it")]
