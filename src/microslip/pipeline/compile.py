"""Compile the kernels once and cache them: ``python -m microslip.pipeline.compile``, run at installation."""

from __future__ import annotations

from microslip.describe.reading import parse_joint
from microslip.pipeline.run import run


def compile_kernels() -> None:
    """Run every compiled path on a small joint."""
    run(
        parse_joint(
            {
                "beams": {"length": 0.25, "thickness": 0.0125, "overlap_half_length": 0.0375},
                "material": {"youngs_modulus": 7e10, "poissons_ratio": 0.3, "density": 2000.0},
                "contact": {"friction": 0.25, "pairs": 21},
                "clamp": {"force": 1e6, "half_length": 0.025},
                "damping": {"beta": 1e-6},
                "load": {"moment": 1.0},
                "analysis": {
                    "cycle": {"count": 2, "steps": 20, "largest": 0.01},
                    "response": {"count": 5},
                    "harmonic": {"frequencies": [165.0, 166.0], "harmonics": 1},
                    "time": {"frequencies": 170.0, "max_cycles": 2, "steps": 20},
                },
            },
            "compile",
        )
    )


if __name__ == "__main__":
    compile_kernels()
