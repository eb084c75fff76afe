"""What is said of bodies that have not come to rest in the motion that is shown."""

from __future__ import annotations

import numpy as np
import pytest

from microslip.pipeline.response import _walk_on

UNKNOWN = (np.nan, np.inf)


@pytest.mark.parametrize(
    ("walks", "says"),
    [
        (
            [(0.01, 6000.0), (-0.03, 9000.0)],
            "rest after about 9e+03, where the amplitude is -3 % off",
        ),
        ([UNKNOWN, (0.01, 6000.0)], "rest after about 6e+03, where the amplitude is +1 % off"),
        ([UNKNOWN, UNKNOWN], "where they come to rest was not found"),
    ],
)
def test_where_bodies_get_to_is_said_as_far_as_it_is_known(walks, says):
    (caution,) = _walk_on("auto", walks)
    assert "at 2 of the frequencies sought for more than 4000 cycles" in caution.reason
    assert caution.reason.endswith(says)


def test_nothing_is_said_where_nothing_walks_on():
    assert _walk_on("auto", []) == []
