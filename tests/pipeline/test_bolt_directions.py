"""Bolts that pull aslant, sideways or the wrong way round, on a plate that friction alone holds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mesh_files import plates_document

from microslip.analyses.prepared.balance import friction_taken, without_slide
from microslip.analyses.statics.cycle import quasi_static_cycle
from microslip.analyses.statics.start import prestressed_solver
from microslip.contact.pairs import slip_history
from microslip.describe.reading import parse_joint
from microslip.errors import ContactError, InputError
from microslip.model.described_mesh import read_described_mesh
from microslip.pipeline.fitness import hardly_pressed
from microslip.pipeline.motion import motion_from_prestress
from microslip.pipeline.outputs import columns
from microslip.pipeline.prepare import assemble
from microslip.results.cycle import walk_of_cycle

FORCE, FRICTION = 12e3 / 0.02, 0.3


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("directions")


def pulled(folder, *ways, output=()):
    """The plates with a bolt of 12 kN along each of some directions of the force on the head."""
    given = plates_document(folder)
    given["preload"] = [
        {"name": f"bolt{k}", "on": ["head", "nut"], "force": FORCE, "direction": way}
        for k, way in enumerate(ways)
    ]
    given["analysis"] = {"cycle": {"force": [10.0]}}
    given["output"] = list(output)
    return assemble(parse_joint(given, "directions", folder))


def test_a_bolt_that_pulls_aslant_slides_the_plates_with_the_tangent_of_its_angle(folder):
    """Of what friction holds, mu F cos a, it takes F sin a, in the prestress already: the next step changes
    nothing."""
    way = np.array([0.03, 0.04, -1.0])
    found = pulled(folder, list(way))
    p = found.prepared
    loads = p.model.amplitudes(p.prestress.preload)
    assert friction_taken(p.model, loads, FRICTION) == pytest.approx(0.05 / FRICTION, rel=2e-3)
    assert any("with 17% of what friction can hold" in str(each) for each in found.doubts)
    assert any("off the normals of head and nut" in str(each) for each in found.doubts)

    along = FORCE / np.linalg.norm(way)
    r = p.prestress.solution.r.reshape(-1, 3)
    assert r[:, 0].sum() == pytest.approx(along, rel=1e-9)
    assert np.linalg.norm(r[:, 1:].sum(axis=0)) == pytest.approx(0.05 * along, rel=1e-6)
    assert (np.linalg.norm(r[:, 1:], axis=1) <= FRICTION * r[:, 0] + 1e-9 * along).all()
    solver = prestressed_solver(p)
    given = p.flexibility.loads_v @ loads, p.flexibility.loads_q @ loads
    step = solver.solve(*given, slip_history(solver.v, 3)).r.reshape(-1, 3)
    assert np.abs(step - r).max() < 1e-9 * np.abs(r).max()


def test_friction_and_preload_may_be_changed_afterwards(folder):
    """What friction takes is found anew; fields scale with the preload."""
    p = pulled(folder, [0.05, 0.0, -1.0]).prepared
    r = p.prestress.solution.r
    other = p.with_friction(0.1).prestress.solution.r
    assert np.abs(other - r).max() > 1e-3 * np.abs(r).max()
    assert other.reshape(-1, 3)[:, 1:].sum(axis=0) == pytest.approx(
        r.reshape(-1, 3)[:, 1:].sum(axis=0), rel=1e-6, abs=1e-6 * np.abs(r).sum()
    )
    again = p.with_friction(0.1).with_friction(FRICTION).prestress.solution.r
    assert np.abs(again - r).max() < 1e-9 * np.abs(r).max()
    twice = p.with_preload({"bolt0": 2 * FORCE}).prestress.solution.r
    assert np.abs(twice - 2 * r).max() < 1e-8 * np.abs(r).max()


def test_reactions_of_supports_have_no_share_of_what_friction_took(folder):
    """The shear of a bolt aslant is in the prestress that outputs are from: supports hold the load alone."""
    hold = {"quantity": "reaction", "on": "left"}
    outputs = [{"name": f"hold_{way}", "direction": way, **hold} for way in "xyz"]
    found = pulled(folder, [0.05, 0.0, -1.0], output=outputs)
    p = found.prepared
    load = 0.5 * found.opening_moment
    cycle = quasi_static_cycle(p, "tip", load, steps=60)
    at = {output.name: k for output, k in columns(found).items()}
    x, y, z = (cycle.output[:, at[f"hold_{way}"]] for way in "xyz")
    assert np.abs(x).max() < 1e-5 * load
    assert np.abs(y).max() < 1e-5 * load
    assert np.abs(z + cycle.load).max() < 1e-5 * load


def test_a_bolt_along_the_normals_slides_nothing(folder):
    p = pulled(folder, [0, 0, -1]).prepared
    loads = p.model.amplitudes(p.prestress.preload)
    assert friction_taken(p.model, loads, FRICTION) == 0.0
    held = p.flexibility.loads_q @ loads
    np.testing.assert_array_equal(without_slide(p.model, loads, held), held)


@pytest.mark.parametrize(
    ("ways", "said"),
    [
        # one bolt of two pulls across: F against mu F
        (([1, 0, 0], [0, 0, -1]), "with 3.33 times what friction can hold"),
        (([1, 0, 0], [0, 0, -1]), "'bolt0': its direction is 90° off the normals of head and nut"),
        # at 0.4 / 0.3 of what holds
        (([0.4, 0, -1],), "with 1.33 times what friction can hold"),
        (([0, 0, -1], [0, 0, -1], [0, 0.001, 1]), "'bolt2': its direction pulls head and nut off"),
        (([0, 0, 1],), "'bolt0': its direction pulls head and nut off"),
    ],
)
def test_bolts_that_hold_nothing_are_refused_and_named(folder, ways, said):
    if len(ways) == 3:
        assert said in " ".join(map(str, pulled(folder, *ways).doubts))
        return
    with pytest.raises((ContactError, InputError)) as caught:
        pulled(folder, *ways)
    assert said in str(caught.value)


def test_a_plate_that_walks_takes_the_work_of_its_bolt(folder):
    """Bent to and fro it creeps the way the bolt pulls it, and friction takes what load and bolt do."""
    found = pulled(folder, [0.05, 0, -1])
    p = found.prepared
    cycle = quasi_static_cycle(p, "tip", 0.8 * found.opening_moment, steps=120, max_cycles=60)
    moved = cycle.output[-1, p.model.port("bolt0")] - cycle.output[0, p.model.port("bolt0")]
    walked = walk_of_cycle(cycle)
    assert walked > 1e-9
    assert cycle.imbalance > 0.01
    assert cycle.external_work + FORCE * moved == pytest.approx(cycle.dissipated, rel=2e-3)
    assert FORCE * moved == pytest.approx(FORCE * 0.05 / np.hypot(1, 0.05) * walked, rel=0.05)

    at = np.array([0, 30, 90, 120])
    shapes, tip = motion_from_prestress(found, cycle, at), cycle.output[at, p.model.port("tip")]
    drawn = shapes @ found.structure.loads["tip"]
    np.testing.assert_allclose(drawn, tip, atol=1e-6 * np.abs(tip).max())


@pytest.mark.parametrize(("share", "said"), [(1.0, False), (0.02, False), (5e-3, True)])
def test_contact_that_takes_next_to_nothing_of_the_bolts_is_doubted(folder, share, said):
    found = pulled(folder, [0, 0, -1])
    start = found.prestress
    less = replace(start, solution=replace(start.solution, r=share * start.solution.r))
    doubts = [str(each) for each in hardly_pressed(found.joint, less, found.bolts)]
    assert any("the contact takes 0.005 of its largest force" in each for each in doubts) == said


def test_a_material_without_its_unit_is_doubted(folder):
    given = plates_document(folder)
    given["material"] = {"youngs_modulus": 210.0, "poissons_ratio": 0.3, "density": 7850.0}
    found = read_described_mesh(parse_joint(given, "material", folder))
    assert any("it has E = 210 Pa" in str(each) for each in found.cautions)
    given["material"]["youngs_modulus"] = "210 GPa"
    found = read_described_mesh(parse_joint(given, "material", folder))
    assert not any("it has E" in str(each) for each in found.cautions)
