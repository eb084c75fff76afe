"""A sector of a flange in its sliding and its stuck mode, drawn by PyVista.

python docs/evidence/solid.py FILE
"""

from __future__ import annotations

import sys
from pathlib import Path

from microslip import load_joint
from microslip.pipeline.geometry import geometry_of
from microslip.pipeline.prepare import assemble
from microslip.show.plots.solid import drawn_by
from microslip.show.plots.structure import shapes_figure

ROOT = Path(__file__).parents[2]

DPI = 110
"""Of the picture: smooth colours make large files."""


def main(target: Path) -> None:
    """Assemble the sector, draw its modes."""
    joint = load_joint(ROOT / "examples" / "flange_sector.toml")
    assembly = assemble(joint)
    geometry = geometry_of(joint, assembly.structure, assembly.imported)
    assert geometry is not None
    states, mode = assembly.states, assembly.mode
    shapes = {
        f"sliding, {mode.sliding_frequency:.4g} Hz": states.sliding,
        f"stuck, {mode.stuck_frequency:.4g} Hz": states.stuck,
    }
    with drawn_by("pyvista"):
        figure = shapes_figure(geometry, shapes)
    figure.savefig(
        target, dpi=DPI, metadata={"Software": "microslip"}, pil_kwargs={"optimize": True}
    )


if __name__ == "__main__":
    main(Path(sys.argv[1]))
