"""What is said of a reduced table that does not begin at the stuck joint."""

from __future__ import annotations

import numpy as np
import pytest

from microslip import reference_joint
from microslip.analyses.reduced.table import EquivalentTable
from microslip.pipeline.prepare import assemble
from microslip.pipeline.reduced import off_where_it_sticks


@pytest.fixture(scope="module")
def assembly():
    return assemble(reference_joint(pairs=11))


def table(assembly, off):
    """A table whose first resonance is off the stuck frequency by a share."""
    mode = assembly.mode
    stuck = (mode.stuck_omega / mode.sliding_omega * (1 + off)) ** 2 - 1
    amplitude = np.geomspace(1e-6, 1e-3, 4)
    return EquivalentTable(
        drive="prescribed",
        load=np.ones(4),
        amplitude=amplitude,
        k_eq=stuck * np.array([1.0, 0.9, 0.6, 0.3]),
        gamma_eq=np.zeros(4),
        cross=np.zeros(4, complex),
        dissipated=np.zeros(4),
        stored=np.zeros(4),
        preload=1e6,
        omega=mode.sliding_omega,
    )


def test_a_table_that_begins_at_the_stuck_joint_needs_no_caution(assembly):
    assert off_where_it_sticks(assembly, table(assembly, 0.0), 1e-6) == ()
    assert off_where_it_sticks(assembly, table(assembly, 5e-4), 1e-6) == ()


@pytest.mark.parametrize("off", [-0.02, 0.003])
def test_a_table_that_begins_elsewhere_is_doubted(assembly, off):
    (caution,) = off_where_it_sticks(assembly, table(assembly, off), 1e-6)
    assert f"{off:+.2%} off" in caution.reason
    assert "does not move in its cycles as it does in the stuck mode" in caution.reason


def test_a_table_that_begins_where_it_slips_is_not_judged(assembly):
    assert off_where_it_sticks(assembly, table(assembly, -0.02), 1e-7) == ()
