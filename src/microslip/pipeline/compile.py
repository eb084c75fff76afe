"""Compile the kernels once and cache them: ``python -m microslip.pipeline.compile``, run at installation."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from microslip.analyses.prepared.joint import prepare_joint
from microslip.analyses.time.scheme import march, no_tangents, prestressed_state, time_scheme
from microslip.contact.aft import contact_cycle
from microslip.contact.law import contact_law
from microslip.contact.pairs import STICK
from microslip.contact.path import follow_path
from microslip.contact.path_tangent import path_tangent
from microslip.contact.samples import sample_table
from microslip.contact.solver import ContactSolver
from microslip.describe.reading import parse_joint
from microslip.model.flexibility import Flexibility
from microslip.model.joint import JointModel
from microslip.numerics.execute import each, limited, processes
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


def compile_spatial_paths() -> None:
    """Take one spatial pair along a path and through a cycle; no joint file describes one."""
    none = np.zeros((3, 0))
    flexibility = Flexibility(
        np.eye(3), none, np.zeros(0), np.eye(3), np.zeros((0, 3)), np.zeros((3, 3))
    )
    solver = ContactSolver(flexibility, 0.3, np.ones(1), np.full(1, STICK, np.int8))
    path = np.array([[1.0, 0.0, 0.0], [1.0, 1.0, 0.0]])
    record = follow_path(solver, flexibility, path, np.zeros((1, 2)), where=str, remedy="")
    path_tangent(solver, flexibility, record, path[:, None])
    solver.solve(path[0], np.zeros(0), np.zeros((1, 2)))
    contact_cycle(sample_table(1, 8), np.ones((1, 3, 3)), np.ones(1), np.zeros((1, 2)))


def compile_spatial_steps() -> None:
    """Take one spatial pair in time."""
    model = JointModel(
        position=np.zeros(1),
        area=np.ones(1),
        dimension=3,
        omega=np.ones(2),
        equilibrium_modes=0,
        mode_v=np.eye(3)[:, 1:],
        residual=np.eye(3),
        ports=("press", "drive"),
        port_modes=np.array([[0.0, 1.0], [0.0, 1.0]]),
        port_v=np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 0.0]]),
        port_port=np.zeros((2, 2)),
        rayleigh=(0.01, 0.0),
    )
    joint = prepare_joint(model, contact_law(1, 0.3, None, 3), {"press": 1.0}, "drive")
    scheme = time_scheme(joint, 0.1)
    march(scheme, prestressed_state(scheme), np.ones(3), tangents=no_tangents(scheme, 1))


SHARES = (
    (compile_spatial_steps,),
    (compile_kernels, compile_spatial_paths),
)
"""What each of two processes compiles: about as long, and the second begins with what the first has
no part in."""


def compile_all() -> None:
    """All kernels, in two processes."""
    for _ in each(_run, SHARES, processes(len(SHARES))):
        pass


def _run(share: tuple[Callable[[], None], ...]) -> None:
    with limited(1):  # or two workers would compile the same kernels at the same time
        for work in share:
            work()


if __name__ == "__main__":
    compile_all()
