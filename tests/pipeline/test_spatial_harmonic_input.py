"""Harmonic balance of meshes in space, as a joint file asks for it: an extruded section, bolted plates."""

from __future__ import annotations

import numpy as np
import pytest
from mesh_files import plates_document, section_document

from microslip.describe.reading import parse_joint
from microslip.model.flexibility import harmonic_compliance
from microslip.pipeline.run import run
from microslip.results.dataset import dataset
from microslip.show.figures import figures_of

OTHER_MODES = 1e-5
"""What modes across the section, kept in place of some in its plane, may change, times 1 / (2 zeta)."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("space")


@pytest.mark.validate
def test_extruded_section_answers_as_the_plane_one(folder):
    """On both flanks. Pairs of half the size have another augmentation, which three harmonics still feel."""
    found = []
    for depth in (None, 8.0):
        document = section_document(folder, depth)
        key, (smallest, *_) = next(iter(document["load"].items()))
        document["load"] = {key: [smallest]}
        states = run(parse_joint(document | {"analysis": {"cycle": {"count": 2}}}, "s", folder))
        near = float(states.mode.sliding_omega / (2 * np.pi))
        document["analysis"] = {
            "harmonic": {
                "frequencies": [0.98 * near, 1.02 * near],
                "harmonics": 3,
                "stability": False,
            },
        }
        found.append(run(parse_joint(document, "section", folder)))
    plane, extruded = found
    assert not plane.failures
    assert not extruded.failures
    quality = 1 / (plane.joint.damping.beta * plane.mode.sliding_omega)
    for one, other in zip(plane.harmonic, extruded.harmonic, strict=True):
        for a, b in zip(one.points, other.points, strict=True):
            assert abs(a.amplitude / b.amplitude - 1) < OTHER_MODES * quality
            assert min(a.dissipated, b.dissipated) > 0


def stuck(joint, hertz):
    """First harmonic of the modal coordinate per unit load, all touching pairs bonded: linear algebra."""
    model, omega = joint.model, 2 * np.pi * hertz
    modal, lag = harmonic_compliance(model, omega, 1)
    drive, own = model.port(joint.drive), model.port(joint.coordinate)
    psi, g = model.mode_v, model.port_modes
    W = model.residual * lag[1] + (psi * modal[1]) @ psi.T
    free = model.port_v[:, drive] * lag[1] + psi @ (modal[1] * g[:, drive])
    b = joint.prestress.bonded(3)
    r = np.linalg.solve(W[np.ix_(b, b)], free[b])
    whole = model.port_port[own, drive] * lag[1] + g[:, own] @ (modal[1] * g[:, drive])
    reach = model.port_v[:, own] * lag[1] + psi @ (modal[1] * g[:, own])
    return whole - reach[b] @ r


def test_bolted_plates_from_small_loads_on(folder):
    """A load that nothing slips under: the stuck plates. Backbones by cycles and harmonic balance: 3e-4."""
    document = plates_document(folder)
    document["load"] = {"force": [0.05]}
    document["analysis"] = {
        "harmonic": {"frequencies": [157.0, 165.0], "harmonics": 3},
        "backbone": {"count": 2, "methods": ["prescribed", "harmonic"], "largest": 0.1},
    }
    found = run(parse_joint(document, "plates", folder))
    assert not found.failures
    (entry,) = found.harmonic
    for point, exponents in zip(entry.points, entry.stability, strict=True):
        linear = 0.05 * stuck(found.prepared, point.frequency)
        assert abs(point.amplitude / linear - 1) < 1e-6
        assert exponents.stable
        assert point.pull < 1e-4
    cycles, balance = found.backbones
    assert balance.frequency == pytest.approx(cycles.frequency, rel=3e-4)
    stored = dataset(found)["harmonic"]
    assert stored["dissipation"].shape == (len(entry.points), found.model.pairs)
    assert figures_of(found)["harmonic"](found) is not None
