"""The larger sides of jumps between steady states."""

from types import SimpleNamespace

import numpy as np

from microslip.pipeline.neighbours import larger_sides


def sides(sizes, within, between=0.001):
    anchors = {k: SimpleNamespace(amplitude=complex(size)) for k, size in sizes.items()}
    error = np.full(12, 0.001)
    error[[k for k in range(12) if k not in sizes]] = between
    return [(way, outward[0]) for way, outward in larger_sides(anchors, error, within)]


def test_a_jump_lies_between_neighbours_or_where_nothing_bounds_what_is_between():
    assert sides({0: 1.0, 1: 3.0, 4: 3.1, 5: 1.0}, 1) == [(1, 1), (-1, 4)]
    assert sides({0: 1.0, 2: 3.0}, 1) == []
    assert sides({0: 1.0, 2: 3.0}, 1, np.inf) == [(1, 2)]
    assert sides({0: 1.0, 5: 3.0}, 3, np.inf) == [(1, 5)]


def test_within_some_frequencies_sizes_of_other_branches_are_a_jump_though_all_is_bounded():
    """A flank that is a fifth steeper is none."""
    assert sides({0: 1.0, 3: 3.0}, 3) == [(1, 3)]
    assert sides({0: 1.0, 4: 3.0}, 3) == []
    assert sides({0: 1.0, 3: 1.2}, 3) == []
    assert sides({0: 1.0, 1: 1.2}, 3) == [(1, 1)]
