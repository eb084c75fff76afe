"""Bolted plates from an ANSYS archive: the joint that they are from a deck."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from mesh_files import plates, plates_document
from model.mesh.write_cdb import write_cdb
from same_joint import SAME, differ

from microslip.describe.reading import parse_joint
from microslip.model.mesh.facets import facets_of
from microslip.pipeline.prepare import assemble


def test_components_are_surfaces_of_a_joint(tmp_path):
    document = plates_document(tmp_path)
    mesh = plates()
    components = {name: facets_of(mesh, name).nodes for name in mesh.surfaces}
    write_cdb(replace(mesh, node_sets={**mesh.node_sets, **components}), tmp_path / "plates.cdb")
    deck = assemble(parse_joint(document, "deck", tmp_path))
    document["mesh"] = document["mesh"] | {"file": "plates.cdb"}
    archive = assemble(parse_joint(document, "archive", tmp_path))
    assert archive.model.pairs == deck.model.pairs
    for name in ("sliding_omega", "stuck_omega", "overlap"):
        assert differ(getattr(deck.mode, name), getattr(archive.mode, name)) < SAME
    assert differ(deck.prestress.pressure, archive.prestress.pressure) < SAME
    assert np.isfinite(archive.opening_moment)
    assert differ(deck.opening_moment, archive.opening_moment) < SAME
