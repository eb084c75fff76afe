"""Whether what a file says of a prepared joint can be one: numbers, signs, names, and its own prestress.

A file may have been changed by hand, or written by another program. What is no number, has a sign that
it cannot have or names a port that is not there is found by itself; what is left is held against the
prestress in the same file, which must solve the contact problem of the model,

    v = loads_v a + R q - W r,   r_n >= 0,   v_n <= 0,   r_n v_n = 0,   p = r_n / area,

so that a turned sign, a changed unit or a lost column shows.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from microslip.analyses.prepared.joint import PreparedJoint
from microslip.contact.pairs import normal
from microslip.typing import Array

CLOSE = 1e-7
"""Part of what it is a sum of by which a quantity may be off: solved to 1e-9, and rounded."""

SYMMETRIC = 1e-9
"""Part of the largest entry by which a symmetric matrix may be none."""

DRIVES = 1e-6
"""Part of the largest damping by which some motion may gain energy: rounding of a matrix from a file."""

WORDS = (
    *("format", "program_version", "units", "drive", "ports", "preload_ports"),
    *("mode_port", "mode_stuck_port", "mode_load_on_sliding_ports", "mode_load_on_stuck_ports"),
)
"""Entries that are text."""


def faults_of_entries(entries: Mapping[str, Array]) -> Iterator[str]:
    """What cannot be of entries by themselves: numbers that are none."""
    for name, value in entries.items():
        if name in WORDS:
            continue
        if value.dtype.kind not in "fiub":
            yield f"{name} is {value.dtype}, and must be numbers"
        elif not np.isfinite(value).all():
            yield f"{name} holds what is no number (nan or infinite)"


def faults_of_joint(joint: PreparedJoint) -> Iterator[str]:
    """What cannot be of a joint whose arrays have the right sizes; the first is the one to say."""
    yield from _signs(joint)
    yield from _symmetries(joint)
    yield from _names(joint)
    yield from _sizes(joint)
    yield from _prestress(joint)


def _signs(joint: PreparedJoint) -> Iterator[str]:
    model, mode = joint.model, joint.mode
    held = model.omega[: model.equilibrium_modes]
    checks = [
        ("area", (model.area > 0).all(), "must be positive"),
        ("friction", (joint.law.friction >= 0).all(), "must not be negative"),
        ("compliance", (joint.law.compliance >= 0).all(), "must not be negative"),
        ("rayleigh", min(model.rayleigh) >= 0, "must not be negative: it would drive the joint"),
        ("omega", (np.diff(model.omega) >= 0).all() and (held >= 0).all(), "must ascend from zero"),
        (
            "omega",
            (model.omega[model.equilibrium_modes :] > 0).all(),
            "must be positive beyond the equilibrium_modes",
        ),
        ("residual", (np.diag(model.residual) >= 0).all(), "must not be negative on its diagonal"),
    ]
    if mode is not None:
        checks.append(
            ("mode", min(mode.sliding_omega, mode.stuck_omega) > 0, "has frequencies that are none")
        )
    yield from (f"{name} {said}" for name, good, said in checks if not good)


def _symmetries(joint: PreparedJoint) -> Iterator[str]:
    model = joint.model
    for name in ("residual", "port_port", "supports", "damping"):
        value = getattr(model, name)
        if value is None:
            continue
        off = np.abs(value - value.T).max(initial=0.0)
        if off > SYMMETRIC * np.abs(value).max(initial=0.0):
            yield f"{name} is not symmetric"
    if model.damping is not None:
        size = np.abs(model.damping_matrix()).max(initial=0.0)
        if np.linalg.eigvalsh(model.damping_matrix())[0] < -DRIVES * size:
            yield "damping must not be negative with rayleigh: it would drive the joint"
    if model.image is not None and sorted(model.image.tolist()) != list(range(model.pairs)):
        yield "image must be a permutation of the pairs"


def _names(joint: PreparedJoint) -> Iterator[str]:
    ports = joint.model.ports
    if len(set(ports)) < len(ports):
        yield "ports has a name twice"
    named = [("drive", joint.drive), *(("preload_ports", name) for name in joint.prestress.preload)]
    if joint.mode is not None:
        named += [("mode_port", joint.mode.port), ("mode_stuck_port", joint.mode.stuck_port)]
        for state in ("sliding", "stuck"):
            on = getattr(joint.mode, f"load_on_{state}")
            named += [(f"mode_load_on_{state}_ports", name) for name in on]
    for entry, name in named:
        if name not in ports:
            yield f"{entry} names {name!r}, which is none of the ports: {', '.join(ports)}"
    if joint.mode is not None and joint.drive not in joint.mode.load_on_sliding:
        yield f"mode_load_on_sliding_ports has no {joint.drive!r}, which drives the joint"


def _sizes(joint: PreparedJoint) -> Iterator[str]:
    """Sizes of what a model may be without."""
    model, mode, bodies = joint.model, joint.mode, joint.model.bodies
    k, n = len(model.omega), model.dimension * model.pairs
    wanted: list[tuple[str, Array, tuple[int, ...]]] = []
    if mode is not None:
        wanted += [("mode_sliding", mode.sliding, (k,)), ("mode_stuck", mode.stuck, (k,))]
    if bodies is not None:
        e = bodies.v.shape[-1]
        wanted += [
            ("bodies_v", bodies.v, (n, e)),
            ("bodies_ports", bodies.ports, (len(model.ports), e)),
            ("bodies_modes", bodies.modes, (k, e)),
        ]
    for name, value, shape in wanted:
        if value.shape != shape:
            yield f"{name} is {value.shape}, and must be {shape}"


def _prestress(joint: PreparedJoint) -> Iterator[str]:
    """Whether the prestress solves the contact problem of the model."""
    f, s, a = joint.flexibility, joint.prestress.solution, joint.held
    d, model = joint.model.dimension, joint.model
    terms = (a * f.loads_v).sum(axis=1), f.R @ s.q, -f.W @ s.r
    size = np.abs(f.W) @ np.abs(s.r) + np.abs(f.loads_v) @ np.abs(a)
    off = float(np.abs(sum(terms) - s.v).max(initial=0.0))
    reach = float(size.max(initial=0.0))
    if not off <= CLOSE * reach:
        yield (
            f"prestress_v is not what the model has under prestress_r and the preload, by {off:.2g} m: one "
            "of residual, mode_v, omega, port_modes, port_v, compliance, preload and prestress was changed"
        )
    p, v = normal(s.r, d), normal(s.v, d)
    most = np.abs(s.r).max(initial=0.0)
    if not most > 0:
        yield "prestress_r presses nowhere"
        return
    if (p < -CLOSE * most).any():
        yield "prestress_r pulls: normal reactions are positive where the sides press"
    if (v > CLOSE * reach).any():
        yield "prestress_v goes through: normal displacements are negative where the sides are apart"
    if (np.minimum(p / most, -v / reach) > CLOSE).any():
        yield "prestress_r presses where prestress_v is apart"
    if not np.allclose(joint.prestress.pressure * model.area, p, rtol=1e-6, atol=CLOSE * most):
        yield "prestress_pressure is not prestress_r over area"
