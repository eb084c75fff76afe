"""Pictures of what a joint file describes, before anything is computed."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from microslip.describe.joint import Joint
from microslip.model.soundness import zero_modes
from microslip.pipeline.geometry import geometry_of
from microslip.pipeline.sources import source_of
from microslip.show.plots.given import interface_figure, motions_figure
from microslip.show.plots.structure import given_figure, marks_of
from microslip.show.plots.style import save


def draw_described(joint: Joint, folder: Path) -> list[Path]:
    """Write ``structure.png``, ``interface_NAME.png`` of every interface and, where something moves without
    stiffness, ``motions.png``; nothing where the nodes have no places.

    Parameters
    ----------
    joint : Joint
    folder : Path
        Made where it does not exist.

    Raises
    ------
    InputError
        Where its files cannot be what they are meant to be.
    """
    source = source_of(joint)
    structure, imported = source.structure, source.imported
    geometry = geometry_of(joint, structure, imported)
    if geometry is None:
        return []
    marks = marks_of(joint, structure, source.preload, source.drive)
    figure = given_figure(geometry, structure, marks, joint.title or "")
    written = save(figure, folder, "structure", ("png",))
    interface = structure.interface
    gap = np.zeros(interface.pairs) if imported is None else imported.pairs.gap
    for surface in geometry.surfaces:
        own = surface.pairs
        figure = interface_figure(geometry, structure, surface, interface.area[own], gap[own])
        written += save(figure, folder, f"interface_{surface.name}", ("png",))
    if imported is not None and imported.zero_modes:
        shapes = zero_modes(structure.stiffness, structure.mass, imported.numbering).shapes
        figure = motions_figure(geometry, shapes, imported.zero_modes)
        written += save(figure, folder, "motions", ("png",))
    return written
