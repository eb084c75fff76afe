"""Reactions of the ends of lap joints, and of joints from matrices: equilibrium, inertia, each other."""

from __future__ import annotations

import json
import tomllib

import numpy as np
import pytest
from matrices_files import as_matrices
from short_lap import SHORT_LAP
from typer.testing import CliRunner

import microslip
from microslip.cli.main import app
from microslip.describe.reading import parse_joint
from microslip.model.lap import structure_of
from microslip.pipeline.outputs import columns, harmonics_by_name
from microslip.pipeline.prepare import assemble

ALL = [
    {"name": f"{what}_{end}", "quantity": quantity, "x": f"{end} end"} | way
    for end in ("left", "right")
    for what, quantity, way in (
        ("along", "reaction", {"direction": "x"}),
        ("hold", "reaction", {"direction": "y"}),
        ("turn", "reaction moment", {}),
    )
]

WEAK = 1e-6
"""Of a load, what rounding carries of the turn of a beam about its pin, which nothing holds."""


def joint(ends, port, outputs=ALL, **more):
    unit = {"base": "acceleration", "moment": "moment"}.get(port["kind"], "force")
    given = tomllib.loads(SHORT_LAP) | {
        "support": dict(zip(("left", "right"), ends, strict=True)),
        "port": port,
        "load": {"port": port["name"], unit: 10.0},
        "output": outputs,
        "analysis": {"cycle": {"count": 2, "steps": 20}},
    }
    return parse_joint(given | more)


def held(assembly, output):
    """Outputs (n, p) of the ends, three each: along, up, turn."""
    places = list(columns(assembly).values())
    return output[..., places].reshape(*output.shape[:-1], 2, 3)


@pytest.mark.parametrize(
    "ends", [("clamped", "pinned"), ("pinned", "pinned"), ("pinned", "clamped")]
)
@pytest.mark.parametrize("direction", ["x", "y"])
def test_ends_hold_what_a_load_pushes_in_statics(ends, direction):
    """Forces and moments balance at every step of a cycle, under moments with pairs that slip."""
    at = "right" if ends[1] == "pinned" else "left"
    if direction == "y" and "pinned" in ends:
        port = {"name": "push", "kind": "moment", "at": at}
    else:
        port = {"name": "push", "kind": "force", "at": at, "direction": direction}
    assembly = assemble(joint(ends, port))
    size = 2e3 if port["kind"] == "force" else 100.0
    cycle = microslip.cycle(assembly.prepared, size, steps=20)
    assert cycle.dissipated > 0 or direction == "x"  # pushed along, the joint sticks
    R = held(assembly, cycle.output)
    side = 1.0 if at == "right" else -1.0
    force = cycle.load if port["kind"] == "force" else 0.0 * cycle.load
    # a positive moment bends the joint concave up: at the right end counter-clockwise, at the left clockwise
    moment = side * cycle.load if port["kind"] == "moment" else -side * 6e-3 * force
    x, y = np.array([-0.213, 0.213]), np.array([-6e-3, 6e-3])
    scale = size if port["kind"] == "force" else size / 0.25
    assert np.abs(R[:, :, 0].sum(axis=1) + force).max() < WEAK * scale
    assert np.abs(R[:, :, 1].sum(axis=1)).max() < WEAK * scale
    turned = R[:, :, 2].sum(axis=1) + R[:, :, 1] @ x - R[:, :, 0] @ y
    assert np.abs(turned + moment).max() < WEAK * scale * 0.25


def test_nothing_is_held_at_rest_but_what_the_clamp_bends():
    assembly = assemble(
        joint(("clamped", "pinned"), {"name": "push", "kind": "moment", "at": "right"})
    )
    prepared, s = assembly.prepared, assembly.prestress.solution
    rest = prepared.flexibility.outputs(prepared.held, s.q, s.r)
    R = held(assembly, rest)
    assert np.abs(R[:, :2].sum(axis=0)).max() < 1e-8 * 1e6


@pytest.mark.parametrize("axis", ["x", "y"])
def test_ends_move_all_mass_with_a_base(axis):
    port = {"name": "base", "kind": "base", "direction": axis}
    assembly = assemble(joint(("clamped", "clamped"), port))
    cycle = microslip.cycle(assembly.prepared, 10.0, steps=20)
    R = held(assembly, cycle.output).sum(axis=1)
    mass = 2000.0 * 2 * 0.25 * 0.012
    k = "xy".index(axis)
    assert np.abs(R[:, k] - mass * cycle.load).max() < 1e-7 * 10 * mass
    assert np.abs(R[:, 1 - k]).max() < 1e-7 * 10 * mass


@pytest.mark.parametrize(("alpha", "beta"), [(0.0, 0.0), (20.0, 20e-6)])
def test_reactions_and_inertia_balance_in_vibration(alpha, beta):
    """All touching pairs bonded: ``R = p^T (eta'' + alpha eta') - F``, p the inertia of a rigid motion."""
    port = [
        {"name": "tip", "kind": "force", "at": "right", "direction": "y"},
        {"name": "base", "kind": "base", "direction": "y"},
    ]
    given = tomllib.loads(SHORT_LAP) | {
        "support": {"left": "clamped", "right": "free"},
        "port": port,
        "load": {"port": "tip", "force": 10.0},
        "output": ALL[:3],
        "damping": {"alpha": alpha, "beta": beta},
        "analysis": {"cycle": {}},
    }
    assembly = assemble(parse_joint(given))
    model, omega = assembly.model, 2 * np.pi * 70.0
    rows, p = assembly.prestress.bonded(2), assembly.model.port("tip")
    give = 1 / (model.omega**2 - omega**2 + 1j * omega * model.modal_damping())
    psi, V = model.mode_v[rows], model.port_v[rows]
    W = model.residual[np.ix_(rows, rows)] + (psi * give) @ psi.T
    r = np.linalg.solve(W, V[:, p] + psi @ (give * model.port_modes[:, p]))
    eta = give * (model.port_modes[:, p] - psi.T @ r)
    found = harmonics_by_name(
        assembly, model.port_modes.T @ eta + model.port_port[:, p] - V.T @ r, omega
    )
    inertia = -model.port_modes[:, model.port("base")]
    expected = (1j * alpha * omega - omega**2) * (inertia @ eta) - 1.0
    # weak springs hold the place of the free end
    assert abs(found["hold_left"] - expected) < 1e-5 * abs(expected)


def test_matrices_have_the_reactions_of_their_rows_and_springs(tmp_path):
    """The lap joint as matrices: rows of what was held, and springs named by their matrix."""
    lap = joint(("clamped", "pinned"), {"name": "push", "kind": "moment", "at": "right"})
    structure = structure_of(lap)
    given = as_matrices(lap, tmp_path)
    arrays = dict(np.load(tmp_path / "joint.npz", allow_pickle=True))
    outputs = []
    for output in lap.outputs:
        mass = structure.reactions[output.port].mass
        arrays[f"m_{output.name}"] = mass
        outputs.append(
            {
                "name": output.name,
                "quantity": output.quantity,
                "stiffness_row": f"joint.npz:out_{output.name}",
            }
            | ({"mass_row": f"joint.npz:m_{output.name}"} if mass.any() else {})
        )
    springs = structure.supports.diagonal() > 0
    arrays["face"] = springs.astype(float)
    outputs.append({"name": "spring", "quantity": "reaction", "vector": "joint.npz:face"})
    np.savez(tmp_path / "joint.npz", **arrays)
    document = given | {
        "output": outputs,
        "load": {"moment": 10.0},
        "analysis": {"cycle": {"count": 2, "steps": 20}},
    }
    ours = assemble(parse_joint(document, "m", tmp_path))
    theirs = assemble(lap)
    a, b = (microslip.cycle(each.prepared, 100.0, steps=20) for each in (theirs, ours))
    for output, k in columns(theirs).items():
        own = next(j for o, j in columns(ours).items() if o.name == output.name)
        size = np.abs(a.output[:, k]).max()
        assert np.abs(a.output[:, k] - b.output[:, own]).max() < 1e-7 * max(size, 1e-3), output.name
    spring = next(j for o, j in columns(ours).items() if o.name == "spring")
    along = next(k for o, k in columns(theirs).items() if o.name == "along_right")
    size = np.abs(a.output[:, along]).max()
    assert np.abs(b.output[:, spring] - a.output[:, along]).max() < 1e-7 * size
    # dynamics: inertia loads of the modes do on what is held what they do there
    for name in ("sliding", "stuck"):
        for output, k in columns(theirs).items():
            own = next(j for o, j in columns(ours).items() if o.name == output.name)
            x, y = (
                each.model.port_port[at, each.model.port(name)]
                for each, at in ((theirs, k), (ours, own))
            )
            assert abs(abs(x) - abs(y)) < 1e-6 * np.abs(theirs.model.port_port[k]).max(), (
                output.name
            )


@pytest.mark.parametrize(
    ("output", "said"),
    [
        ({"x": "right end", "direction": "x"}, "the right end is free: no support holds it"),
        ({"x": "middle", "direction": "x"}, 'give "left end" or "right end"'),
        ({"x": "left end"}, "which way does it hold? give x or y"),
        ({"x": "left end", "direction": "x", "side": "top"}, "a support holds the whole end"),
        ({"x": "left end", "direction": "x", "quantity": "slip"}, "direction"),
        ({"x": "left end", "direction": "x", "quantity": "reaction moment"}, "a moment has none"),
    ],
)
def test_reactions_of_nothing_are_refused_by_the_command_line(tmp_path, output, said):
    own = {"name": "hold", "quantity": "reaction"} | output
    rows = "\n".join(f"{key} = {json.dumps(value)}" for key, value in own.items())
    text = (
        SHORT_LAP
        + '[support]\nleft = "clamped"\nright = "free"\n[analysis.cycle]\n[[output]]\n'
        + rows
    )
    text += (
        '\n[[port]]\nname = "tip"\nkind = "force"\nat = "right"\n[load]\nport = "tip"\nforce = 1\n'
    )
    (tmp_path / "joint.toml").write_text(text)
    done = CliRunner().invoke(app, ["check", str(tmp_path / "joint.toml")])
    assert done.exit_code == 2, done.output
    assert said in done.output
    assert isinstance(done.exception, SystemExit)


@pytest.mark.parametrize(
    ("output", "port", "said"),
    [
        (
            {"vector": "joint.npz:moment"},
            None,
            "supports are in the matrices: give its stiffness_row",
        ),
        ({"mass_row": "joint.npz:moment"}, None, "goes with stiffness_row"),
        (
            {"stiffness_row": "joint.npz:moment", "vector": "joint.npz:moment"},
            None,
            "remove vector, node and direction",
        ),
        ({"stiffness_row": "joint.npz:moment", "quantity": "deflection"}, None, "is of a reaction"),
        ({"stiffness_row": "joint.npz:moment"}, "base", "inertia of its own"),
    ],
)
def test_reactions_that_matrices_do_not_have_are_refused(tmp_path, output, port, said):
    lap = joint(("pinned", "pinned"), {"name": "push", "kind": "moment", "at": "right"}, ALL[:1])
    given = as_matrices(lap, tmp_path)
    del given["matrices"]["supports"]
    given["output"] = {"name": "hold", "quantity": "reaction"} | output
    if port:
        given["port"] = {"name": "base", "kind": port, "vector": "joint.npz:moment"}
    with pytest.raises(microslip.InputError, match=said):
        parse_joint(given | {"analysis": {"cycle": {}}}, "m", tmp_path)
