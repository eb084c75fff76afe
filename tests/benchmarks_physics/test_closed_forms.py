"""Jenkins element and bar on a Coulomb foundation: cycles with a closed form."""

from __future__ import annotations

import numpy as np
import pytest

from microslip.analyses.prepared.joint import PreparedJoint, prepare_joint
from microslip.analyses.prepared.prestress import Prestress
from microslip.analyses.statics.cycle import Cycle, quasi_static_cycle
from microslip.contact.law import contact_law
from microslip.contact.pairs import (
    BACKWARD,
    FORWARD,
    normal,
    normal_rows,
    tangential,
    tangential_rows,
)
from microslip.contact.solver import ContactSolver, Solution
from microslip.model.flexibility import Flexibility, static_flexibility
from microslip.model.joint import JointModel


def hand_made(position, area, W, loads, R=None, loads_q=None, port_port=None):
    """Joint model without modes from a flexibility matrix; R are motions free of stiffness.

    `loads` (2 m, 2) holds the relative displacement without contact of ports clamp and drive.
    """
    rows = W.shape[0]
    R = np.zeros((rows, 0)) if R is None else R
    return JointModel(
        position=position,
        area=area,
        dimension=2,
        omega=np.zeros(R.shape[1]),
        equilibrium_modes=R.shape[1],
        mode_v=R,
        residual=W,
        ports=("clamp", "drive"),
        port_modes=np.zeros((R.shape[1], 2)) if loads_q is None else loads_q,
        port_v=loads,
        port_port=np.zeros((2, 2)) if port_port is None else port_port,
        rayleigh=(0.0, 0.0),
    )


STIFFNESS, NORMAL, MU = 2e7, 400.0, 0.3
SLIP_FORCE = MU * NORMAL


def jenkins(amplitude, steps=200) -> Cycle:
    """Rigid slider of slip force F_s behind a spring k, its end moved by X sin(theta)."""
    rigid = hand_made(
        np.zeros(1), np.ones(1), np.diag([1.0, 0.0]), np.array([[1.0, 0.0], [0.0, 1.0]])
    )
    law = contact_law(1, MU, np.array([0.0, 1 / STIFFNESS]))
    joint = prepare_joint(rigid, law, {"clamp": NORMAL}, "drive")
    return quasi_static_cycle(joint, "drive", amplitude, steps=steps)


@pytest.mark.parametrize("ratio", [1.5, 2.0, 5.0, 40.0])
def test_jenkins_dissipation(ratio):
    """D = 4 F_s (X - F_s/k).

    The two steps in which slip begins cut the corners of the parallelogram; each costs at most
    an eighth of (largest step)² k, for the trapezoidal rule on a kinked line.
    """
    limit = SLIP_FORCE / STIFFNESS
    steps = 200
    cycle = jenkins(ratio * limit, steps)
    expected = 4 * SLIP_FORCE * (ratio - 1) * limit
    step = ratio * limit * 2 * np.pi / steps
    assert abs(cycle.dissipated - expected) <= 2 * STIFFNESS * step**2 / 8 + 1e-12 * expected


def test_jenkins_dissipation_converges_with_steps_at_second_order():
    """Steps that carry the corner at the same fraction: the error falls with steps², at most."""
    limit = SLIP_FORCE / STIFFNESS
    expected = 4 * SLIP_FORCE * limit
    errors = [abs(jenkins(2 * limit, n).dissipated - expected) / expected for n in (50, 200, 800)]
    steps = np.array([50, 200, 800])
    assert np.all(errors <= 1.1 * (np.pi**2 / steps**2) * 2)


def test_jenkins_force_is_bounded_by_the_slip_force():
    limit = SLIP_FORCE / STIFFNESS
    cycle = jenkins(3 * limit)
    assert tangential(cycle.r).max() == pytest.approx(SLIP_FORCE, rel=1e-12)
    assert tangential(cycle.r).min() == pytest.approx(-SLIP_FORCE, rel=1e-12)


@pytest.mark.parametrize("ratio", [0.1, 0.99])
def test_jenkins_below_the_slip_force_is_a_spring(ratio):
    limit = SLIP_FORCE / STIFFNESS
    cycle = jenkins(ratio * limit)
    assert abs(cycle.dissipated) < 1e-14 * SLIP_FORCE * limit
    top = np.argmax(cycle.load)
    assert tangential(cycle.r[top]) == pytest.approx(ratio * SLIP_FORCE, rel=1e-12)


AXIAL, LENGTH, SHEAR = 3e6, 2.0, 700.0  # E A in N, m, f in N/m


def foundation(elements: int) -> PreparedJoint:
    """Free bar of linear elements on an even Coulomb foundation, pulled at x = 0.

    Tangential flexibility of the free bar: any symmetric inverse, here that of the bar with its
    far end on a spring E A/L, plus the rigid motion as a coordinate of equilibrium. Normal
    directions are decoupled, with unit flexibility, and carry f dx/mu per node.
    """
    x = np.linspace(0, LENGTH, elements + 1)
    area = np.full(elements + 1, LENGTH / elements)
    area[[0, -1]] /= 2
    along = (2 * LENGTH - np.maximum(x[:, None], x[None, :])) / AXIAL
    n, t, m = normal_rows(), tangential_rows(), len(x)
    W = np.zeros((2 * m, 2 * m))
    W[n, n] = np.eye(m)
    W[t, t] = along
    loads = np.zeros((2 * m, 2))
    loads[n, 0] = SHEAR * area / MU  # unit clamp: the normal forces themselves
    loads[t, 1] = along[0]
    R = np.zeros((2 * m, 1))
    R[t] = 1.0
    port_port = np.diag([0.0, along[0, 0]])
    model = hand_made(x, area, W, loads, R, np.array([[0.0, 1.0]]), port_port)
    flexibility = static_flexibility(model)
    start = prestressed(model, flexibility)
    return PreparedJoint(model, flexibility, start, contact_law(m, MU), "drive")


def prestressed(model, flexibility) -> Prestress:
    """Normal forces alone. Written down: without friction the free bar has no equilibrium."""
    m = model.pairs
    v = np.zeros(2 * m)
    r = flexibility.loads_v[:, 0].copy()
    status = np.ones(m, dtype=np.int8)
    solution = Solution(r, v, np.zeros(1), status, 0.0, 0)
    return Prestress({"clamp": 1.0}, solution, normal(r) / model.area, np.ones(m, dtype=bool))


def pull(elements, fraction, steps=400) -> Cycle:
    force = fraction * SHEAR * LENGTH
    return quasi_static_cycle(foundation(elements), "drive", force, steps=steps, max_cycles=4)


@pytest.mark.parametrize("fraction", [0.3, 0.55, 0.8])
def test_bar_on_coulomb_foundation(fraction):
    """D = (2/3) F³/(E A f), end displacement F²/(2 E A f), within 0.1 %."""
    force = fraction * SHEAR * LENGTH
    cycle = pull(128, fraction, 200)
    assert cycle.dissipated == pytest.approx(2 / 3 * force**3 / (AXIAL * SHEAR), rel=1e-3)
    end = cycle.output[np.argmax(cycle.load), 1]
    assert end == pytest.approx(force**2 / (2 * AXIAL * SHEAR), rel=1e-3)
    assert cycle.external_work == pytest.approx(cycle.dissipated, rel=1e-9)


def orders(errors):
    """Observed order between neighbours of a sequence of meshes, each twice as fine."""
    errors = np.abs(errors)
    return np.log2(errors[:-1] / errors[1:])


def test_dissipation_of_the_bar_converges_at_second_order():
    """The end of slip lies a quarter of the bar in, on a node of each mesh."""
    force = 0.25 * SHEAR * LENGTH
    exact = 2 / 3 * force**3 / (AXIAL * SHEAR)
    found = [pull(n, 0.25, 400).dissipated / exact - 1 for n in (8, 16, 32, 64)]
    print("orders", orders(found))
    assert orders(found) == pytest.approx(2.0, abs=0.05)


def test_end_displacement_of_the_bar_converges_at_second_order():
    """The end of slip lies a third of the bar in, a third of an element from a node.

    Where it falls on a node the displacement is exact: linear elements are exact at their nodes.
    """
    errors = {}
    for fraction in (1 / 3, 0.25):
        force = fraction * SHEAR * LENGTH
        exact = force**2 / (2 * AXIAL * SHEAR)
        cycles = [pull(n, fraction, 80) for n in (8, 16, 32, 64)]
        errors[fraction] = np.array([c.output[np.argmax(c.load), 1] / exact - 1 for c in cycles])
    print("orders", orders(errors[1 / 3]))
    assert orders(errors[1 / 3]) == pytest.approx(2.0, abs=0.05)
    assert np.abs(errors[0.25]).max() < 1e-7


def test_bar_slips_as_far_as_the_force_reaches():
    """After the first pull the slipping length is F/f: equilibrium alone."""
    joint = foundation(200)
    model, flexibility = joint.model, joint.flexibility
    fraction = 0.55
    force = fraction * SHEAR * LENGTH
    solver = ContactSolver(
        flexibility, MU, np.full(model.pairs, SHEAR * LENGTH / 200), np.ones(model.pairs, np.int8)
    )
    amplitude = np.array([1.0, force])
    solution = solver.solve(
        flexibility.loads_v @ amplitude, flexibility.loads_q @ amplitude, np.zeros(model.pairs)
    )
    slip = model.position[np.isin(solution.status, (FORWARD, BACKWARD))]
    assert slip.max() == pytest.approx(force / SHEAR, abs=1.01 * LENGTH / 200)
    assert tangential(solution.r).sum() == pytest.approx(force, rel=1e-10)


def test_flexibility_by_hand_is_that_of_the_bar():
    """The flexibility used above inverts the stiffness matrix of the bar on its end spring."""
    elements = 8
    W = foundation(elements).flexibility.W[tangential_rows(), tangential_rows()]
    k = AXIAL * elements / LENGTH
    K = np.diag(np.r_[k, np.full(elements - 1, 2 * k), k]) - k * (
        np.eye(elements + 1, k=1) + np.eye(elements + 1, k=-1)
    )
    K[-1, -1] += AXIAL / LENGTH
    assert pytest.approx(np.eye(elements + 1), abs=1e-12) == K @ W
    assert isinstance(foundation(8).flexibility, Flexibility)
