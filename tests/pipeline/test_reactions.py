"""Reactions of supports: equilibrium with loads and inertia, and the full matrices."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from mesh_files import plates_document, section_document

from microslip.describe.reading import parse_joint
from microslip.errors import InputError
from microslip.model.elasticity import Material
from microslip.model.mesh.assembly import assemble as matrices
from microslip.pipeline.outputs import columns, harmonics_by_name
from microslip.pipeline.prepare import assemble
from microslip.pipeline.run import run
from microslip.results.harmonic import outputs_of as harmonics_of
from microslip.results.time import outputs_of

LENGTH = 0.16
"""From the held end to the loaded one, m."""

WEAK = 1e-6
"""Of a load, what the weak springs carry that hold the place of a body which nothing holds."""

OUTPUTS = [
    {"name": "tip", "on": "right", "direction": "y"},
    {"name": "hold", "quantity": "reaction", "on": "left", "direction": "y"},
    {"name": "along", "quantity": "reaction", "on": "left", "direction": "x"},
    {"name": "turn", "quantity": "reaction moment", "on": "left"},
]


def joint(folder, **more):
    given = section_document(folder) | {"output": OUTPUTS}
    return parse_joint(
        given | {"analysis": {"cycle": {"force": [400.0], "steps": 20}}} | more, "r", folder
    )


ENDS = {"support": [{"on": "left"}, {"on": "right"}]}
"""Nothing is loose: no weak springs hold the place of a body and carry 1e-7 of a load."""

BOTH = [
    {"name": f"{what}_{end}", "quantity": quantity, "on": end} | way
    for end in ("left", "right")
    for what, quantity, way in (
        ("hold", "reaction", {"direction": "y"}),
        ("along", "reaction", {"direction": "x"}),
        ("turn", "reaction moment", {}),
    )
]


def both(assembly, output, what):
    return [output[:, of(assembly, f"{what}_{end}")] for end in ("left", "right")]


def of(assembly, name):
    return next(k for output, k in columns(assembly).items() if output.name == name)


def test_supports_hold_what_loads_push_in_statics(tmp_path):
    """Slipping pairs and all: forces and moments balance at every step, about the middle of the load."""
    port = {"name": "push", "on": "above", "direction": [0.6, 0.8, 0.0]}
    load = {"force": [4e4]}
    cycle = {"cycle": {"force": [4e4], "steps": 20}}
    found = run(joint(tmp_path, port=port, load=load, output=BOTH, analysis=cycle, **ENDS))
    (cycle,) = found.cycles["load"]
    assert cycle.dissipated > 0
    y, x, turn = (both(found.assembly, cycle.output, what) for what in ("hold", "along", "turn"))
    assert np.abs(sum(y) + 0.8 * cycle.load).max() < 1e-9 * 4e4
    assert np.abs(sum(x) + 0.6 * cycle.load).max() < 1e-9 * 4e4
    # middles of the ends at x = -80 and 80 mm, y = -2.5 and 2.5 mm; the load at x = 0, y = 5 mm
    arms = [(-0.08, -7.5e-3), (0.08, -2.5e-3)]
    moment = sum(turn) + sum(
        arm[0] * up - arm[1] * along for arm, up, along in zip(arms, y, x, strict=True)
    )
    assert np.abs(moment).max() < 1e-9 * 4e4 * LENGTH


def test_a_cantilever_holds_its_load(tmp_path):
    found = run(joint(tmp_path))
    (cycle,) = found.cycles["load"]
    held = {name: cycle.output[:, of(found.assembly, name)] for name in ("hold", "along", "turn")}
    assert np.abs(held["hold"] + cycle.load).max() < WEAK * 400
    assert np.abs(held["along"]).max() < WEAK * 400
    assert np.abs(held["turn"] + LENGTH * cycle.load).max() < WEAK * 400 * LENGTH


@pytest.mark.parametrize("axis", ["x", "y"])
def test_supports_move_all_mass_with_a_base(tmp_path, axis):
    port = {"name": "base", "kind": "base", "direction": axis}
    more = {"load": {"acceleration": [10.0]}, "output": BOTH}
    cycle = {"cycle": {"acceleration": [10.0], "steps": 20, "drives": ["load"]}}
    found = run(joint(tmp_path, port=port, analysis=cycle, **more, **ENDS))
    (cycle,) = found.cycles["load"]
    mass = 7850.0 * 2 * 0.095 * 0.005
    along, across = ("along", "hold") if axis == "x" else ("hold", "along")
    held = sum(both(found.assembly, cycle.output, along))
    assert np.abs(held - mass * cycle.load).max() < 1e-8 * 10 * mass
    assert np.abs(sum(both(found.assembly, cycle.output, across))).max() < 1e-8 * 10 * mass


def stuck(assembly, omega):
    """Modal coordinates, and outputs by name, of the model with all touching pairs bonded; per unit load."""
    model, d = assembly.model, assembly.model.dimension
    rows = assembly.prestress.bonded(d)
    p = model.port(assembly.prepared.drive)
    resisted = np.diag(model.omega**2 - omega**2) + 1j * omega * model.damping_matrix()
    give = np.linalg.inv(resisted)
    psi, V = model.mode_v[rows], model.port_v[rows]
    W = model.residual[np.ix_(rows, rows)] + psi @ give @ psi.T
    r = np.linalg.solve(W, V[:, p] + psi @ (give @ model.port_modes[:, p]))
    eta = give @ (model.port_modes[:, p] - psi.T @ r)
    y = model.port_modes.T @ eta + model.port_port[:, p] - V.T @ r
    return eta, harmonics_by_name(assembly, y, omega)


@pytest.mark.parametrize(
    ("frequency", "damping"),
    [
        (60.0, {"alpha": "20 1/s"}),
        (700.0, {"alpha": "20 1/s"}),
        (700.0, {"alpha": "20 1/s", "beta": 1e-6}),
        (700.0, {"ratios": [0.01, 0.03, 0.002]}),
    ],
)
def test_reactions_of_a_vibration_are_those_of_the_full_matrices(tmp_path, frequency, damping):
    """Truncated modes follow without damping: a part of omega beta may be missing.

    All pairs that touch bonded: ``e^T ((1 + i omega beta) K + (i omega alpha - omega²) M + i omega C) u``, C
    what damps the kept modes beside."""
    given = joint(
        tmp_path, damping=damping, mesh={"file": "section.inp", "length_unit": "mm", "modes": 120}
    )
    assembly = assemble(given)
    found, omega = assembly.imported.meshed, 2 * np.pi * frequency
    structure = assembly.structure
    K, M = matrices(found.mesh, Material(210e9, 0.0, 7850.0))
    alpha, beta = assembly.model.rayleigh
    dynamic = (1 + 1j * beta * omega) * K + (1j * alpha * omega - omega**2) * M
    if assembly.model.damping is not None:
        moved = M @ (found.basis @ assembly.reducer.modes.shapes)
        dynamic = dynamic + 1j * omega * sp.csc_array(moved @ assembly.model.damping @ moved.T)
    B = structure.interface.relative[assembly.prestress.bonded(2)]
    T, f = found.basis, structure.loads["tip"]
    inner = (T.T @ dynamic @ T).tocsc()
    system = sp.block_array([[inner, B.T], [B, None]], format="csc")
    x = spla.spsolve(system, np.concatenate([f, np.zeros(B.shape[0])]))[: len(f)]
    out = dynamic @ (T @ x)
    left = np.flatnonzero(found.mesh.points[:, 0] < -0.08 + 1e-9)
    height = found.mesh.points[left, 1] - found.mesh.points[left, 1].mean()
    expected = {
        "hold": out[2 * left + 1].sum(),
        "along": out[2 * left].sum(),
        "turn": -height @ out[2 * left],
    }
    _, ours = stuck(assembly, omega)
    size = {
        "hold": abs(expected["hold"]),
        "along": abs(expected["hold"]),
        "turn": abs(expected["turn"]),
    }
    for name, value in expected.items():
        size = abs(expected["turn" if name == "turn" else "hold"])
        assert abs(ours[name] - value) < (1e-5 + 0.1 * omega * beta) * size, name


def test_reactions_and_inertia_balance_in_the_model(tmp_path):
    """``R = p^T (eta'' + alpha eta') - F``, p the inertia of the kept modes in a rigid motion."""
    assembly = assemble(joint(tmp_path, damping={"alpha": "20 1/s", "beta": "20 us"}))
    found, omega = assembly.imported.meshed, 2 * np.pi * 300.0
    _, M = matrices(found.mesh, Material(210e9, 0.0, 7850.0))
    up = np.tile([0.0, 1.0], len(found.mesh.points))
    p = assembly.reducer.modes.shapes.T @ (found.basis.T @ (M @ up))
    eta, ours = stuck(assembly, omega)
    expected = (20j * omega - omega**2) * (p @ eta) - 1.0
    assert abs(ours["hold"] - expected) < WEAK * abs(expected)


def test_methods_agree_on_reactions(tmp_path):
    """Harmonic balance, time integration and the reduced model at one frequency, with slip."""
    analysis = {
        "cycle": {"count": 3, "steps": 20, "drives": ["load"]},
        "response": {"from": "156 Hz", "to": "160 Hz", "count": 9},
        "reduced": {"amplitudes": 8, "steps": 60},
        "harmonic": {"frequencies": ["156 Hz", "157 Hz"], "harmonics": 3, "stability": False},
        "time": {"frequencies": ["157 Hz"], "steps": 200},
    }
    damping = {"alpha": "20 1/s", "beta": "1 us"}
    found = run(joint(tmp_path, load={"force": [100.0]}, analysis=analysis, damping=damping))
    assert not found.failures, found.failures
    (point,) = found.time_domain
    steady = {name: y[1] for name, y in outputs_of(found, point).items()}
    last = found.harmonic[0].response.points[-1]
    assert last.frequency == pytest.approx(157.0)
    balance = {name: y[1] for name, y in harmonics_of(found, last).items()}
    (response,) = found.responses
    at = int(np.argmin(np.abs(response.frequency - 157.0)))
    # the reduced model answers a little more or less than time integration: the reaction as the tip does
    share = response.outputs["tip"][at] / steady["tip"]
    assert abs(share - 1) < 0.1
    for name in ("hold", "turn"):
        size = abs(steady[name])
        assert abs(balance[name] - steady[name]) < 0.01 * size, name
        assert abs(response.outputs[name][at] / share - steady[name]) < 0.01 * size, name


@pytest.mark.parametrize(
    ("output", "said"),
    [
        ({"on": "right", "direction": "y"}, "no support holds"),
        ({"on": "left"}, "which way is the output"),
        ({"direction": "y"}, "where is the output"),
        ({"on": "left", "direction": "z"}, "no direction z"),
        ({"on": "left", "direction": "y", "at": [0.0, 0.0]}, "is for slip and gap"),
    ],
)
def test_reactions_of_nothing_are_refused(tmp_path, output, said):
    with pytest.raises(InputError, match=said):
        assemble(joint(tmp_path, output=[{"name": "hold", "quantity": "reaction"} | output]))


def test_reactions_of_the_whole_are_newtons(tmp_path):
    """Of a joint in space, 20 mm wide: per metre of width they are those of the whole over it."""
    outputs = [
        {"name": "hold", "quantity": "reaction", "on": "left", "direction": "z"},
        {"name": "turn", "quantity": "reaction moment", "on": "left", "direction": "y"},
    ]
    found = {}
    for width, scale in (("whole", 0.02), ("20 mm", 1.0)):
        given = plates_document(tmp_path) | {"output": outputs, "load": {"force": [50.0 * scale]}}
        given |= {"analysis": {"cycle": {"force": [50.0 * scale], "steps": 20, "drives": ["load"]}}}
        given["mesh"] = given["mesh"] | {"width": width}
        given["preload"] = given["preload"] | {"force": 12e3 / 0.02 * scale}
        done = run(parse_joint(given, "w", tmp_path))
        (cycle,) = done.cycles["load"]
        k = [of(done.assembly, each["name"]) for each in outputs]
        assert np.abs(cycle.output[:, k[0]] + cycle.load).max() < WEAK * 50 * scale
        # a force along z at the arm x turns by -x F about y
        assert np.abs(cycle.output[:, k[1]] - LENGTH * cycle.load).max() < WEAK * 50 * scale
        found[width] = (
            [output.measured.unit for output in done.joint.outputs],
            [o.key for o in done.joint.outputs],
        )
    assert found["whole"] == (["N", "N m"], ["hold_n", "turn_n_m"])
    assert found["20 mm"] == (["N/m", "N m/m"], ["hold_n_per_m", "turn_n_m_per_m"])


@pytest.mark.parametrize("own", [{}, {"stiffness": 5e8}, {"stiffness": 5e8, "shortening": 1e-3}])
def test_reactions_at_rest_have_the_pull_of_a_bolt_on_what_is_held(tmp_path, own):
    """A bolt pulls a supported face, with its force or keeping its length: supports hold nothing in all."""
    bolt = {"on": ["below", "above"], "force": 4e5} | own
    if "shortening" in own:
        del bolt["force"]
    ends = ("left", "right", "below")
    outputs = [
        {"name": f"{way}_{on}", "quantity": "reaction", "on": on, "direction": way}
        for way in "xy"
        for on in ends
    ]
    held = [{"on": on} for on in ends]
    port = {"name": "push", "on": "above", "direction": "x"}
    given = joint(tmp_path, preload=bolt, output=outputs, support=held, port=port)
    assembly = assemble(given)
    prepared, s = assembly.prepared, assembly.prestress.solution
    rest = prepared.flexibility.outputs(prepared.held, s.q, s.r)
    x, y = np.array([rest[k] for k in columns(assembly).values()]).reshape(2, 3)
    force = 4e5 if assembly.bolts is None else float(assembly.bolts.force[0])
    assert abs(y[2]) > 1e-4 * force  # the middle holds, and the ends hold against it
    assert abs(x.sum()) < 1e-8 * force
    assert abs(y.sum()) < 1e-8 * force
