"""Loads from which a plate slides away that friction alone holds along its interface."""

from __future__ import annotations

import numpy as np
import pytest
from mesh_files import plates_document
from scipy.optimize import minimize

from microslip.analyses.prepared.prestress import slides_from, sliding_load
from microslip.analyses.prepared.scales import load_scale
from microslip.analyses.statics.cycle import quasi_static_cycle
from microslip.analyses.statics.loading import load_path
from microslip.analyses.statics.start import CARRIED
from microslip.contact.pairs import normal
from microslip.describe.reading import parse_joint
from microslip.errors import ContactError
from microslip.pipeline.prepare import assemble
from microslip.pipeline.run import run

FORCE, FRICTION = 12e3 / 0.02, 0.3


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("sliding")


def driven(folder, direction, **analysis):
    """The plates, the upper one loaded in its plane, at its end."""
    given = plates_document(folder)
    given["port"] = {"name": "tip", "kind": "force", "on": "right", "direction": direction}
    given["load"] = {"force": [1.0]}
    given["analysis"] = analysis or {"cycle": {"force": [1.0]}}
    return parse_joint(given, "sliding", folder)


def test_drawn_along_the_plates_friction_holds_coulombs_force(folder):
    joint = assemble(driven(folder, "x")).prepared
    found = slides_from(joint.model, joint.prestress, "tip", FRICTION)
    assert found == pytest.approx(FRICTION * FORCE, rel=1e-6)
    assert load_scale(joint, "tip") == found


def test_drawn_across_its_end_a_plate_turns_about_the_centre_that_holds_least(folder):
    """Of all turns about centres c in the plane the one with the least ``sum mu r_n |x - c| / |x_end - c_x|``
    gives way first; cones with flat facets are up to 2 % too narrow. By any pressure the bound is larger."""
    a = assemble(driven(folder, "y"))
    joint = a.prepared
    x, r = a.imported.points[:, :2], normal(joint.prestress.solution.r, 3)

    def holds(c):
        return FRICTION * r @ np.linalg.norm(x - c, axis=1) / abs(0.08 - c[0])

    exact = minimize(holds, np.zeros(2), method="Nelder-Mead", options={"xatol": 1e-9}).fun
    found = slides_from(joint.model, joint.prestress, "tip", FRICTION)
    assert 0.975 < found / exact < 1.001
    assert sliding_load(joint.model, joint.prestress, "tip", FRICTION) > 1.2 * exact

    below = quasi_static_cycle(joint, "tip", 0.95 * found, steps=80)
    assert below.residual.max() < 1e-9
    assert below.dissipated > 0
    for beyond in (1.1, 1.19):
        with pytest.raises(ContactError, match="slides bodies away that friction alone holds"):
            quasi_static_cycle(joint, "tip", beyond * exact, steps=80)
    with pytest.raises(ContactError, match="slides bodies away"):
        load_path(joint, {"tip": np.linspace(0, 1.15 * exact, 30)})


def test_what_holds_below_the_limit_is_not_the_springs_that_keep_a_place(folder):
    """They have 1e-8 of the stiffness of the joint: far below what is allowed, until it slides."""
    joint = assemble(driven(folder, "x")).prepared
    loose = joint.model.omega < 1e-3 * joint.model.omega[-1]
    found = quasi_static_cycle(joint, "tip", 0.9 * FRICTION * FORCE, steps=60)
    moved = np.abs(found.output[:, joint.model.port("tip")]).max()
    springs = (joint.model.omega[loose] ** 2).min() * moved
    assert springs < 1e-3 * CARRIED * 0.9 * FRICTION * FORCE


def test_ranges_end_before_it_slides_and_time_needs_no_reduced_model(folder):
    """Without sections of their own cycles reach up to a share of what slides the joint; time integration
    starts from rest where no response is asked for."""
    joint = driven(folder, "x", cycle={"count": 4, "steps": 60}, time={"frequencies": [900.0]})
    done = run(joint)
    assert not done.failures
    largest = done.cycles["load"][-1].amplitude
    assert largest == pytest.approx(0.85 * FRICTION * FORCE, rel=1e-6)
    (point,) = done.time_domain
    assert point.steady.converged
