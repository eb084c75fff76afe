"""Method "auto" of bolted plates in space, against steady states of time integration from rest."""

from __future__ import annotations

import numpy as np
import pytest
from mesh_files import matching_document, plates_document

from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.steady import steady_state
from microslip.contact.pairs import SLIP
from microslip.describe.reading import parse_joint
from microslip.pipeline.run import run

CASES = {"plates": (plates_document, 3000.0), "aslant": (matching_document, 2000.0)}


@pytest.fixture(
    scope="module", params=[pytest.param(one, marks=pytest.mark.validate) for one in CASES]
)
def auto(request, tmp_path_factory):
    document, load = CASES[request.param]
    folder = tmp_path_factory.mktemp(request.param)
    asked = {"method": "auto", "count": 31, "points": 60}
    described = document(folder) | {
        "damping": {"beta": "20 us"},
        "analysis": {"cycle": {"largest": 0.5, "count": 8, "steps": 60}, "response": asked},
        "load": {"force": [load]},
    }
    return run(parse_joint(described, "plates", folder))


def test_the_stated_error_holds_in_space(auto):
    """Frequencies that were not sought, with smaller time steps."""
    assert not auto.failures
    (curve,) = auto.responses
    joint = auto.prepared
    assert curve.variant == "auto"
    sought = np.array([one.frequency for one in curve.anchors])
    apart = np.abs(curve.frequency[:, None] - sought).min(axis=1) > 0.02
    free = np.flatnonzero(apart)
    kept, slipped = [], False
    for k in free[np.linspace(0, len(free) - 1, 10).astype(int)]:
        frequency = float(curve.frequency[k])
        scheme = time_scheme(joint, 1 / (300 * frequency), frequency=frequency)
        found = steady_state(scheme, frequency, curve.load, tolerance=1e-4)
        assert found.converged
        slipped |= bool((found.cycle.status == SLIP).any())
        error = abs(abs(curve.amplitude[k]) / abs(found.amplitude) - 1)
        kept.append(error <= curve.error_indicator[k])
    assert slipped
    assert np.mean(kept) >= 0.9
