"""The reference joint (theory, section 5), which comes with the package."""

from __future__ import annotations

import tomllib
from importlib import resources

from microslip.describe.lap import LapJoint
from microslip.describe.reading import parse_lap_joint


def reference_joint(pairs: int | None = None) -> LapJoint:
    """The lap joint that the documentation and `microslip reproduce` use.

    Parameters
    ----------
    pairs : int, optional
        Contact pairs, 201 by default; fewer for a quick look.

    Examples
    --------
    >>> reference_joint(pairs=21).contact.pairs
    21
    """
    text = resources.files("microslip").joinpath("templates", "reference_joint.toml")
    document = tomllib.loads(text.read_text("utf-8"))
    if pairs is not None:
        document["contact"]["pairs"] = pairs
    return parse_lap_joint(document, "reference joint")
