"""Reduction: what it must keep exactly, and the error of what it does not."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse.linalg as spla
from conftest import RAYLEIGH, joint_structure
from scipy.linalg import eig

from microslip.contact.pairs import components, normal_components
from microslip.errors import ModelError
from microslip.model.flexibility import static_flexibility
from microslip.model.joint import JointModel, Reducer, bonded_modes
from microslip.model.modes import bonding, linear_modes

PAIRS = np.arange(8, 43)
NORMAL = normal_components(PAIRS)
BOTH = components(PAIRS)


@pytest.fixture(scope="module")
def structure():
    return joint_structure(51)


@pytest.fixture(scope="module")
def models(structure):
    found = {}
    for count in (20, 40, 80):
        found[count] = Reducer(structure, count, RAYLEIGH).model(structure.loads)
    return found


@pytest.mark.parametrize("bonded", [NORMAL, BOTH], ids=["sliding", "stuck"])
def test_bonded_frequencies_tend_to_the_full_ones(structure, models, bonded):
    """From above (Ritz), and the nearer the more modes are kept."""
    full = linear_modes(structure, bonded, 6).frequency
    found = [bonded_modes(models[k], bonded)[0][:6] / (2 * np.pi) for k in (20, 40, 80)]
    errors = np.array(found) / full - 1
    elastic = full > 100.0
    print("relative errors at 20, 40, 80 modes", errors[:, elastic].max(axis=1))
    assert np.all(np.diff(np.abs(errors[:, elastic]).max(axis=1)) < 0)
    assert np.abs(errors[-1, elastic]).max() < 1e-4


def small_model(omega, mode_v, residual):
    """Joint model of a few modes and pairs, without ports."""
    m, k = len(residual) // 2, len(omega)
    return JointModel(
        position=np.arange(float(m)),
        area=np.ones(m),
        dimension=2,
        omega=np.asarray(omega, dtype=float),
        equilibrium_modes=0,
        mode_v=mode_v,
        residual=residual,
        ports=(),
        port_modes=np.zeros((k, 0)),
        port_v=np.zeros((2 * m, 0)),
        port_port=np.zeros((0, 0)),
        rayleigh=(0.0, 0.0),
    )


@pytest.fixture(scope="module")
def random_model():
    rng = np.random.default_rng(8)
    root = rng.standard_normal((6, 6))
    return small_model(np.sort(rng.uniform(1, 9, 4)), rng.standard_normal((6, 4)), root @ root.T)


def test_bond_of_one_mode_is_a_spring():
    """``omega² + psi²/W`` where one component is bonded; its contact compliance is in series."""
    model = small_model([3.0], np.array([[2.0], [5.0]]), np.diag([0.5, 4.0]))
    for bonded, psi, W in ((0, 2.0, 0.5), (1, 5.0, 4.0)):
        omega, shapes = bonded_modes(model, np.array([bonded]))
        assert omega == pytest.approx([np.sqrt(9 + psi**2 / W)], rel=1e-14)
        assert np.abs(shapes) == pytest.approx(1.0)
        give = np.array([0.75, 0.3])
        omega, _ = bonded_modes(model, np.array([bonded]), give)
        assert omega == pytest.approx([np.sqrt(9 + psi**2 / (W + give[bonded]))], rel=1e-14)


def test_bonded_modes_solve_the_eigenproblem_with_reactions(random_model):
    """``omega_n² eta + Psi^T r = omega² eta`` and ``Psi eta - W r = 0``, the reactions kept."""
    bonded = np.array([0, 2, 3])
    give = np.linspace(0.1, 0.6, 6)
    k, b = 4, len(bonded)
    psi = random_model.mode_v[bonded]
    W = random_model.residual[np.ix_(bonded, bonded)] + np.diag(give[bonded])
    system = np.block([[np.diag(random_model.omega**2), psi.T], [psi, -W]])
    values = eig(system, np.diag([1.0] * k + [0.0] * b), right=False)
    finite = np.sort(values[np.abs(values) < 1e9].real)
    omega, shapes = bonded_modes(random_model, bonded, give)
    assert omega**2 == pytest.approx(finite, rel=1e-10)
    assert shapes.T @ shapes == pytest.approx(np.eye(k), abs=1e-12)
    r = np.linalg.solve(W, psi @ shapes)
    error = random_model.omega[:, None] ** 2 * shapes + psi.T @ r - shapes * omega**2
    assert np.abs(error).max() < 1e-10 * omega[-1] ** 2


def test_nothing_bonded_leaves_the_modes_free(random_model):
    none = np.array([], dtype=int)
    omega, shapes = bonded_modes(random_model, none)
    assert omega == pytest.approx(random_model.omega, rel=1e-12)
    assert np.abs(shapes) == pytest.approx(np.eye(4), abs=1e-12)
    soft, _ = bonded_modes(random_model, np.arange(6), np.full(6, 1e9))
    assert soft == pytest.approx(random_model.omega, rel=1e-7)


def test_no_compliance_is_exact_contact(random_model):
    bonded = np.arange(5)
    one, other = bonded_modes(random_model, bonded), bonded_modes(random_model, bonded, np.zeros(6))
    assert np.array_equal(one[0], other[0])
    assert np.array_equal(one[1], other[1])


@pytest.mark.parametrize("kept", [4, 10, 40])
def test_truncation_keeps_the_static_flexibility(models, kept):
    whole, part = static_flexibility(models[80]), static_flexibility(models[80].truncated(kept))
    for name in ("W", "R", "loads_v", "loads_q", "loads_loads"):
        a, b = getattr(whole, name), getattr(part, name)
        assert np.abs(a - b).max() <= 1e-12 * np.abs(a).max()
    assert len(models[80].truncated(kept).omega) == kept


@pytest.mark.parametrize("count", [20, 40])
def test_static_flexibility_does_not_depend_on_the_modes_kept(models, count):
    """Kept or residual, a mode has the same static response. Up to the choice of soft modes."""
    one, other = static_flexibility(models[count]), static_flexibility(models[80])
    assert one.R.shape == other.R.shape
    assert np.abs(one.W - other.W).max() <= 1e-7 * np.abs(other.W).max()


def test_residual_is_positive_semidefinite(models):
    for model in models.values():
        values = np.linalg.eigvalsh(model.residual)
        assert values[0] > -1e-9 * values[-1]


def test_flexibility_is_symmetric(models):
    W = static_flexibility(models[80]).W
    assert np.array_equal(W, W.T)


def bonded_solution(model, bonded, load):
    """Static response of the model with components of v held at zero: (outputs, r)."""
    f = static_flexibility(model)
    e, c = f.R.shape[1], len(bonded)
    system = np.zeros((e + c, e + c))
    system[:e, :e] = np.diag(f.stiffness)
    system[:e, e:] = f.R[bonded].T
    system[e:, :e] = f.R[bonded]
    system[e:, e:] = -f.W[np.ix_(bonded, bonded)]
    right = np.r_[f.loads_q @ load, -f.loads_v[bonded] @ load]
    z = np.linalg.solve(system, right)
    r = np.zeros(f.W.shape[0])
    r[bonded] = z[e:]
    return f.loads_loads @ load + z[:e] @ f.loads_q - r @ f.loads_v, r


@pytest.mark.parametrize("bonded", [NORMAL, BOTH], ids=["sliding", "stuck"])
@pytest.mark.parametrize("port", ["clamp", "moment"])
def test_static_response_is_that_of_the_full_mesh(structure, models, bonded, port):
    basis = bonding(structure.interface.relative, bonded)
    K = (basis.T @ structure.stiffness @ basis).tocsc()
    full = basis @ spla.spsolve(K, basis.T @ structure.loads[port])
    expected = np.array([load @ full for load in structure.loads.values()])
    force = structure.loads[port] - structure.stiffness @ full
    B = structure.interface.relative
    reaction = 0.5 * (B @ force)  # B B^T = 2: matching nodes, one pair each
    load = np.zeros(4)
    load[models[80].port(port)] = 1.0
    found, r = bonded_solution(models[80], bonded, load)
    # the bonded response is a difference of responses of the bodies alone: relative to those,
    # with the condition number of the elastic bodies (3e8) times machine precision to lose
    alone = np.sqrt(np.abs(np.diag(static_flexibility(models[80]).loads_loads)))
    error = np.abs(found - expected) / (alone * alone[models[80].port(port)])
    wrong = np.abs(r - reaction).max() / np.abs(reaction).max()
    print(f"error of outputs {error.max():.1e}, of reactions {wrong:.1e}")
    assert error.max() < 2e-7
    assert wrong < 1e-4


def test_ports_added_later_are_the_same(structure, models):
    """with_ports gives what model gives with all ports at once."""
    reducer = Reducer(structure, 40, RAYLEIGH)
    extra = {"push": structure.mass @ np.ones(structure.dofs), "tip": np.eye(structure.dofs)[7]}
    both = reducer.model({**structure.loads, **extra})
    added = reducer.with_ports(reducer.model(structure.loads), extra)
    assert added.ports == both.ports
    for name in ("port_modes", "port_v", "port_port"):
        a, b = getattr(added, name), getattr(both, name)
        size = np.sqrt(np.abs(np.outer(np.diag(b), np.diag(b)))) if name == "port_port" else 1.0
        top = np.abs(b).max(axis=0) if name != "port_port" else size
        assert np.all(np.abs(a - b) <= 1e-7 * top + 1e-30)


def test_ports_are_reciprocal(models):
    """Static response at port a to port b is that at b to a."""
    f = static_flexibility(models[80])
    assert np.abs(f.loads_loads - f.loads_loads.T).max() <= 1e-12 * np.abs(f.loads_loads).max()


def test_rayleigh_damping_of_each_mode(models):
    model = models[20]
    zeta = model.modal_damping() / (2 * model.omega)
    assert zeta == pytest.approx(RAYLEIGH[1] * model.omega / 2)


def test_paper_damping_ratio():
    """beta = 7.3e-7 s is zeta = 3.9e-4 at 170 Hz."""
    assert RAYLEIGH[1] * 2 * np.pi * 170 / 2 == pytest.approx(3.9e-4, rel=1e-2)


def test_errors_name_what_there_is(structure, models):
    with pytest.raises(ModelError, match="clamp, moment"):
        models[20].port("torque")
    with pytest.raises(ModelError, match="cannot keep"):
        models[20].truncated(21)
    with pytest.raises(ModelError, match="cannot keep"):
        models[20].truncated(3)
    with pytest.raises(ModelError, match="cannot keep"):
        Reducer(structure, structure.dofs, RAYLEIGH)
