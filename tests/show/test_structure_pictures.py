"""What pictures of structures say in their legends: bodies, bolts, supports."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import ROOT
from matplotlib.colors import to_rgb
from mesh_files import section_document

from microslip import load_joint
from microslip.describe.reading import parse_joint
from microslip.model.soundness import zero_modes
from microslip.pipeline.geometry import geometry_of
from microslip.pipeline.sources import source_of
from microslip.show.plots.given import simple_motions
from microslip.show.plots.interface_maps import panels
from microslip.show.plots.motions import rounded
from microslip.show.plots.structure import given_figure, listed, marks_of
from microslip.show.plots.style import BLUE, house_style


def described(name):
    """Geometry and structure of an example, what loads it, and its picture."""
    return drawn_of(load_joint(ROOT / "examples" / f"{name}.toml"))


def drawn_of(joint):
    source = source_of(joint)
    geometry = geometry_of(joint, source.structure, source.imported)
    marks = marks_of(joint, source.structure, source.preload, source.drive)
    return geometry, source, given_figure(geometry, source.structure, marks, "")


def legend(figure):
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_plane_strain_is_said_and_not_drawn_on_every_node():
    """All nodes of the extruded joint are held across; the pins alone in another direction as well."""
    geometry, _, figure = described("extruded_joint")
    said = legend(figure)
    assert "all held along z" in said
    assert "held in some directions" in said
    (pins,) = [line for line in figure.axes[0].lines if line.get_marker() == "D"]
    drawn = len(pins.get_xdata())
    assert 0 < drawn < 0.05 * len(geometry.points)
    assert drawn == (geometry.held.sum(axis=1) == 2).sum()


def test_bodies_that_move_have_their_names():
    geometry, source, figure = described("mesh_plates")
    assert "preload bolt" in legend(figure)
    assert "all held" not in " ".join(legend(figure))
    shapes = zero_modes(source.structure.stiffness, source.structure.mass, None).shapes
    names = list(simple_motions(geometry, shapes))
    assert names == [f"UPPER {way} {axis}" for way in ("along", "about") for axis in "xyz"]


def test_a_temperature_is_not_drawn_as_forces_on_every_node(tmp_path):
    document = section_document(tmp_path)
    document["material"]["thermal_expansion"] = 12e-6
    document["preload"] = [document["preload"] | {"name": "bolt"}]
    cold = drawn_of(parse_joint(document, "mesh", tmp_path))[2]
    document["preload"].append({"name": "warm", "temperature": 20.0})
    warm = drawn_of(parse_joint(document, "mesh", tmp_path))[2]
    assert legend(warm) == legend(cold)
    assert len(warm.axes[0].texts) == len(cold.axes[0].texts)


def test_names_of_many_bolts_are_shortened():
    assert listed(["a"]) == "a"
    assert listed([f"bolt_{k}" for k in range(1, 13)]) == "bolt_1 to bolt_12"
    assert rounded(9.96e5) == "1,000,000"


class FlatChart:
    """A map of given size, mm."""

    def __init__(self, wide, tall):
        self.extent, self.margins = np.array([wide, tall]), np.array([2.0, 2.0])


@house_style
def test_titles_of_tall_maps_have_room():
    """Four maps higher than wide: their titles do not overlap, and stay inside the figure."""
    figure, axes = panels([FlatChart(40.0, 60.0)] * 4)
    titles = [
        ax.set_title("(a)  load at its largest, slip of the upper side", loc="left") for ax in axes
    ]
    figure.draw_without_rendering()
    boxes = [title.get_window_extent() for title in titles]
    for k, box in enumerate(boxes):
        assert not any(box.overlaps(other) for other in boxes[k + 1 :])
        assert box.x1 <= figure.bbox.x1


def test_a_bolt_that_keeps_its_length_is_drawn_as_its_two_forces(tmp_path):
    """Vertical ones towards each other on its two places, and not the forces of the elements beside them."""
    document = section_document(tmp_path)
    document["preload"] |= {"name": "bolt", "holds": "length"}
    geometry, source, figure = drawn_of(parse_joint(document, "mesh", tmp_path))
    aslant = geometry.forces(source.structure.loads["bolt"])
    assert np.abs(aslant[:, 0]).max() > 0.05 * np.abs(aslant[:, 1]).max()
    arrows = [text for text in figure.axes[0].texts if text.arrow_patch is not None]
    blue = [a for a in arrows if a.arrow_patch.get_edgecolor()[:3] == to_rgb(BLUE)]
    tips = np.array([arrow.xy for arrow in blue])
    ways = tips - np.array([arrow.xyann for arrow in blue])
    assert len(blue) == 2
    assert np.abs(ways[:, 0]).max() < 0.02 * np.abs(ways[:, 1]).min()
    up, down = (int(k) for k in np.argsort(tips[:, 1]))
    assert ways[up, 1] > 0 > ways[down, 1]
    assert tips[:, 0] == pytest.approx(0.0, abs=1e-3)
