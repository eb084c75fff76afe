"""Bolts of a joint from a mesh, tightened in any order, against dense matrices and another solver."""

from __future__ import annotations

import json
import shutil

import numpy as np
import pytest
from mesh_files import faces_where, graded, grid, on_body, spot, two_bodies
from model.mesh.write_inp import write_inp
from scipy.optimize import nnls
from typer.testing import CliRunner

from microslip.cli.check import app as check
from microslip.cli.run import app as command
from microslip.contact.pairs import normal_rows
from microslip.describe.reading import parse_joint
from microslip.errors import ContactError, InputError
from microslip.model.mesh.boundary import with_surfaces
from microslip.pipeline.prepare import assemble

PLACES = (-30.0, 0.0, 30.0)
"""Of the bolts along the overlap, mm."""


def plates():
    """Two plates of 20 mm that overlap by 90 mm, with places for three bolts; mm."""
    edges = [(p - 5, p + 5, 2) for p in PLACES]
    along = graded(
        (-45, -35, 1), edges[0], (-25, -5, 2), edges[1], (5, 25, 2), edges[2], (35, 45, 1)
    )
    lower = grid((np.r_[-80.0, -60.0, along], [-10.0, -5.0, 0.0, 5.0, 10.0], [-5.0, -2.5, 0.0]))
    upper = grid((np.r_[along, 60.0, 80.0], [-10.0, -5.0, 5.0, 10.0], [0.0, 6.0]))
    mesh = two_bodies(lower, upper)

    surfaces = {
        "lower_contact": on_body(mesh, "lower", spot(0.0, -45, 45)),
        "upper_contact": on_body(mesh, "upper", spot(0.0, -45, 45)),
        "left": faces_where(mesh, lambda p: p[:, 0] < -80 + 1e-9),
        "right": faces_where(mesh, lambda p: p[:, 0] > 80 - 1e-9),
    }
    for k, place in enumerate(PLACES):
        surfaces[f"head{k}"] = faces_where(mesh, spot(6.0, place - 5, place + 5, 5.0))
        surfaces[f"nut{k}"] = faces_where(mesh, spot(-5.0, place - 5, place + 5, 5.0))
    return with_surfaces(mesh, surfaces)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("bolts")
    write_inp(plates(), folder / "plates.inp")
    return folder


def document(bolts, gap=0.0):
    return {
        "kind": "mesh",
        "mesh": {"file": "plates.inp", "length_unit": "mm", "width": "1 m", "modes": 12},
        "support": {"on": "left"},
        "spring": [{"on": "right", "direction": axis, "stiffness": "1e10 Pa/m"} for axis in "xyz"],
        "interface": {
            "first": "lower_contact",
            "second": "upper_contact",
            "friction": 0.3,
            "gap": gap,
        },
        "preload": bolts,
        "port": {"name": "tip", "kind": "force", "on": "right", "direction": "z"},
        "load": {"force": [5.0]},
        "analysis": {"cycle": {"force": [5.0]}},
        "output": {"name": "tip", "on": "right", "direction": "z"},
    }


def bolt(k, **more):
    return {"name": f"bolt{k}", "on": [f"head{k}", f"nut{k}"], "direction": [0, 0, -1]} | more


def assembled(bolts, folder, gap=0.0):
    return assemble(parse_joint(document(bolts, gap), "bolts", folder))


class Dense:
    """The plates with all degrees of freedom; contact as nonnegative least squares of its energy."""

    def __init__(self, folder, gap=0.0):
        constant = [bolt(k, force=1e3) for k in range(3)]
        found = assembled(constant, folder)
        s = found.structure
        self.K = s.stiffness.toarray()
        self.N = s.interface.relative.toarray()[normal_rows(3)]
        self.g = [s.loads[f"bolt{k}"] for k in range(3)]
        self.gap = gap

    def solve(self, K, load):
        """Displacements under ``K x = load - N^T r``, ``r >= 0``, ``N x <= gap``, ``r (N x - gap) = 0``."""
        soft = np.linalg.solve(K, np.column_stack([load, self.N.T]))
        free, W = self.N @ soft[:, 0] - self.gap, self.N @ soft[:, 1:]
        L = np.linalg.cholesky(0.5 * (W + W.T))
        r, _ = nnls(L.T, np.linalg.solve(L, free), maxiter=10_000)
        return soft[:, 0] - soft[:, 1:] @ r

    def tightened(self, order, force, stiffness):
        """Forces in the end: each bolt in its turn is a constant force, and afterwards a spring."""
        K, held = self.K.copy(), np.zeros(len(self.K))
        length = {}
        for step in sorted(set(order)):
            now = [k for k in range(3) if order[k] == step]
            x = self.solve(K, held + sum(force[k] * self.g[k] for k in now))
            for k in now:
                length[k] = force[k] / stiffness[k] + self.g[k] @ x
                K += stiffness[k] * np.outer(self.g[k], self.g[k])
                held += stiffness[k] * length[k] * self.g[k]
        x = self.solve(K, held)
        return np.array([stiffness[k] * (length[k] - self.g[k] @ x) for k in range(3)])


def drawn(seed):
    rng = np.random.default_rng(seed)
    order = rng.permutation(3) + 1 if seed % 2 else rng.integers(1, 3, 3)
    return [int(k) for k in order], rng.uniform(2e3, 2e4, 3), 10 ** rng.uniform(7, 9, 3)


@pytest.mark.parametrize(("seed", "gap"), [(1, 0.0), (2, 0.0), (3, 2e-6), (4, -1e-6)])
def test_bolts_change_each_others_force_as_dense_matrices_say(folder, seed, gap):
    order, force, stiffness = drawn(seed)
    bolts = [bolt(k, force=force[k], stiffness=stiffness[k], order=order[k]) for k in range(3)]
    found = assembled(bolts, folder, gap).bolts
    expected = Dense(folder, gap).tightened(order, force, stiffness)
    np.testing.assert_allclose(found.force, expected, rtol=1e-6)
    last = [k for k in range(3) if order[k] == max(order)]
    np.testing.assert_allclose(found.force[last], force[last], rtol=1e-9)


@pytest.mark.parametrize("seed", [5, 6])
def test_bolts_together_have_their_forces_whatever_their_stiffness(folder, seed):
    """As constant forces have them, contact without friction knows no way."""
    _, force, stiffness = drawn(seed)
    keeping = [bolt(k, force=force[k], stiffness=stiffness[k]) for k in range(2)]
    found = assembled([*keeping, bolt(2, force=force[2])], folder)
    constant = assembled([bolt(k, force=force[k]) for k in range(3)], folder)
    np.testing.assert_allclose(found.bolts.force, force[:2], rtol=1e-9)
    pressure = constant.prestress.pressure
    assert np.abs(found.prestress.pressure - pressure).max() < 1e-7 * pressure.max()


def test_a_rigid_bolt_is_the_limit_of_stiff_ones(folder):
    """What a bolt of stiffness k loses to a later one differs by a term in 1 / k."""
    _, force, _ = drawn(7)
    left = []
    for stiffness in (1e11, 1e12, None):
        more = {} if stiffness is None else {"stiffness": stiffness}
        bolts = [bolt(k, force=force[k], order=k + 1, holds="length", **more) for k in range(3)]
        left.append(assembled(bolts, folder).bolts.force[:2])
    near, nearer = (np.abs(each - left[2]) for each in left[:2])
    np.testing.assert_allclose(near / nearer, 10, rtol=0.15)


def test_a_bolt_that_keeps_its_length_raises_frequencies(folder):
    """Rayleigh: a spring between the plates lowers no frequency of the same contact."""
    force = [1e4] * 3
    constant, keeping = (
        assembled([bolt(k, force=force[k], **more) for k in range(3)], folder)
        for more in ({}, {"stiffness": 1e8})
    )
    assert (constant.prestress.touching == keeping.prestress.touching).all()
    assert keeping.mode.sliding_omega > constant.mode.sliding_omega * (1 - 1e-9)
    assert keeping.mode.stuck_omega > constant.mode.stuck_omega * (1 - 1e-9)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"force": 1e4, "section": "head0"}, "give on, two places or surfaces, or section"),
        ({"force": 1e4, "pressure": 1e6}, "give one of force, shortening, a pressure"),
        ({"force": 1e4, "holds": "force", "stiffness": 1e8}, "is of a bolt that keeps its length"),
        ({"shortening": "1 um", "holds": "force"}, "what is shortened keeps its length"),
        ({"pressure": 1e6, "stiffness": 1e8, "direction": None}, "and this is a pressure"),
        ({"force": 1e4, "stiffness": "1e8 N"}, "stiffness"),
    ],
)
def test_descriptions_that_fit_nothing_are_refused(folder, given, said):
    with pytest.raises(InputError, match=said):
        assembled([bolt(0, **given)], folder)


def test_a_bolt_that_another_loosens_is_named(folder):
    """A stiff, lightly tightened bolt at the same place as one that compresses the plates much more."""
    bolts = [
        bolt(0, force=100.0, stiffness=1e9, order=1),
        bolt(0, force=5e4, stiffness=1e9, order=2) | {"name": "other"},
    ]
    with pytest.raises(ContactError, match=r"bolt 'bolt0' comes loose"):
        assembled(bolts, folder)


def test_forces_are_said_by_the_command_line(folder, tmp_path):
    shutil.copy(folder / "plates.inp", tmp_path)
    (tmp_path / "joint.toml").write_text(
        """
kind = "mesh"
[mesh]
file = "plates.inp"
length_unit = "mm"
width = "1 m"
modes = 12
[[support]]
on = "left"
[[interface]]
first = "lower_contact"
second = "upper_contact"
friction = 0.3
[[preload]]
name = "one"
on = ["head0", "nut0"]
direction = [0, 0, -1]
force = "12 kN/m"
stiffness = "1e8 N/m/m"
[[preload]]
name = "two"
on = ["head1", "nut1"]
direction = [0, 0, -1]
shortening = "100 um"
stiffness = "1e8 N/m/m"
order = 2
[[port]]
name = "tip"
on = "right"
direction = "z"
[load]
force = "20 N/m"
[analysis.cycle]
force = "20 N/m"
steps = 20
"""
    )
    shown = CliRunner().invoke(check, [str(tmp_path / "joint.toml")])
    assert shown.exit_code == 0, shown.output
    assert "bolt one" in shown.output
    assert "shortened by" in shown.output
    out = tmp_path / "out"
    done = CliRunner().invoke(command, [str(tmp_path / "joint.toml"), "--out", str(out)])
    assert done.exit_code == 0, done.output
    found = json.loads((out / "summary.json").read_text())["prestress"]
    one, two = found["bolts"]
    assert one["force_after_each_step_n_per_m"][0] == pytest.approx(12e3, rel=1e-9)
    assert one["force_n_per_m"] == one["force_after_each_step_n_per_m"][1]
    assert two["force_n_per_m"] > 0
    assert found["friction"] == "none"


def test_a_bolt_pulls_along_the_normals_of_its_surfaces(folder):
    """Middles of head and nut that are 15 mm aside do not tilt the force, and are doubted."""
    given = {"name": "skew", "force": 1e3, "on": ["head0", "nut1"]}
    found = assembled([given], folder)
    load = found.structure.loads["skew"]
    sideways = [load[found.structure.free % 3 == axis] for axis in (0, 1)]
    assert max(np.abs(each).max() for each in sideways) < 1e-12 * np.abs(load).max()
    assert any("off their normals" in str(caution) for caution in found.doubts)


def test_a_joint_on_a_rigid_flat_is_described_by_its_normal(folder):
    """The upper plate alone pressed on a flat at z = 0: the sum of the pressure is the force."""
    given = document({"name": "press", "on": "head1", "pressure": "10 MPa"})
    given["interface"] = [
        {"name": "flat", "first": "upper_contact", "flat": "z", "friction": 0.2},
        {"name": "plates", "first": "lower_contact", "flat": [0, 0, -1], "friction": 0.2},
    ]
    found = assemble(parse_joint(given, "flat", folder))
    upper = np.abs(found.imported.pairs.friction - 0.2) < 1e-12
    assert upper.all()
    carried = found.prestress.pressure @ found.model.area
    assert carried == pytest.approx(10e6 * 1e-4, rel=1e-3)  # what the weak springs carry is missing
    for wrong, said in (
        ({"second": "lower_contact"}, "give the second surface, or flat"),
        ({"flat": None, "second": "lower_contact", "offset": 1.0}, "is of a rigid flat"),
        ({"offset": "1 m"}, "never meets the rigid flat"),
    ):
        with pytest.raises(InputError, match=said):
            assemble(
                parse_joint(given | {"interface": given["interface"][0] | wrong}, "flat", folder)
            )
