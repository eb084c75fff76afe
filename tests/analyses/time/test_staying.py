"""Whether motions stay beside a periodic one, against the motion from it marched alone."""

import tomllib
from types import SimpleNamespace

import numpy as np
import pytest
from unstable_joint import LOAD, UNSTABLE

import microslip
from microslip.analyses.time import staying
from microslip.analyses.time.scheme import time_scheme
from microslip.analyses.time.staying import LEAVES, stay_of
from microslip.analyses.time.steady import steady_state
from microslip.analyses.time.watching import watched

STEPS = 150

LARGER = {400.2: -0.01745 - 0.01907j, 424.0: -0.01699 - 0.01344j, 430.0: -0.01578 - 0.01356j}
"""First harmonics of the larger motion, m."""

TRIED = 12
"""Guesses."""


@pytest.fixture(scope="module")
def joint():
    return microslip.prepare(microslip.parse_joint(tomllib.loads(UNSTABLE)))


def larger(scheme, f):
    """From guesses a thousandth apart: which of them leads to an unstable motion hangs on rounding."""
    for k in range(TRIED):
        guess = (1 + 1e-3 * k) * LARGER[f]
        found = steady_state(scheme, f, LOAD, guess=guess, tolerance=1e-6, max_cycles=300)
        if found.converged and abs(abs(found.amplitude / LARGER[f]) - 1) < 1e-3:
            return found
    raise AssertionError(f"none of {TRIED} guesses leads to the larger motion at {f} Hz")


@pytest.fixture(scope="module", params=sorted(LARGER))
def beside(request, joint):
    """A periodic motion, what is said of motions beside it, and sizes of the motion that it is, over it."""
    f = request.param
    scheme = time_scheme(joint, 1 / (f * STEPS), frequency=f)
    steady = larger(scheme, f)
    Q, _ = watched(scheme, LOAD, steady.cycle.state, 1200, steady.phase)
    return f, steady, stay_of(scheme, steady), np.abs(Q) / abs(steady.amplitude)


def test_motions_leave_stay_or_beat_as_they_do_when_marched(beside):
    """From rounding alone, for 1200 cycles: what leaves does, and what beats does so by as much."""
    f, steady, stay, sizes = beside
    late = sizes[-400:]
    assert abs(steady.amplitude) == pytest.approx(abs(LARGER[f]), rel=1e-3)
    if f == 400.2:
        assert stay.strays == np.inf
        assert stay.varies == 0
        assert late.max() < 0.1
    elif f == 424.0:
        assert stay.strays == stay.varies == 0
        assert np.ptp(late) < 1e-4
        assert late[0] == pytest.approx(1.0, abs=1e-4)
    else:
        mean = abs(stay.amplitude) / abs(steady.amplitude)
        strays = np.abs(late / late.mean() - 1).max()
        assert late.mean() == pytest.approx(mean, abs=0.01)
        assert stay.varies == pytest.approx(strays, rel=0.2)
        assert stay.varies <= stay.strays == pytest.approx(strays, rel=0.2)
        assert 0.01 < strays < LEAVES


def test_what_has_not_converged_says_nothing(joint):
    scheme = time_scheme(joint, 1 / (430.0 * STEPS), frequency=430.0)
    steady = steady_state(scheme, 430.0, LOAD, max_cycles=3)
    with pytest.raises(microslip.MicroslipError, match="converge"):
        stay_of(scheme, steady)


def turning(monkeypatch, grows, turn, limit):
    """Beside a motion of size one, others that turn and come to a circle of known radius, or leave it."""

    def marched(scheme, load, z, cycles, phase, memory):
        states = [z]
        for _ in range(cycles):
            z = states[-1]
            states.append(z * np.exp(1j * turn) * (1 + grows * (1 - abs(z) / limit)))
        return 1 + np.array(states[1:]), states

    multiplier = (1 + grows) * np.exp(1j * turn)
    found = SimpleNamespace(
        verdict="unstable",
        values=np.array([multiplier]),
        vibration=np.array([True]),
        largest=abs(multiplier),
        cycles=3,
    )
    monkeypatch.setattr(staying, "stability_of", lambda *_, **__: found)
    monkeypatch.setattr(staying, "pushed", lambda *of: (-complex(of[-1]), complex(of[-1])))
    monkeypatch.setattr(staying, "watched", marched)
    return stay_of(SimpleNamespace(), SimpleNamespace(amplitude=1.0, load=1.0, phase=0.0))


@pytest.mark.parametrize("limit", [1e-3, 3e-3, 8e-3])
@pytest.mark.parametrize("turn", [0.03, 0.08, 1.1, np.pi])
@pytest.mark.parametrize("grows", [5e-4, 2e-3, 2e-2])
def test_what_stays_is_bounded_by_pushes_that_fall_back_to_it(monkeypatch, grows, turn, limit):
    """However slowly: a push larger than what stays would else be what is said of it."""
    stay = turning(monkeypatch, grows, turn, limit)
    shift = abs(abs(stay.amplitude) - 1)
    assert 0.99 * limit <= stay.strays + shift
    assert stay.strays <= 3.1 * limit
    assert stay.varies <= 1.05 * limit


def test_what_grows_beyond_every_push_leaves(monkeypatch):
    assert turning(monkeypatch, 2e-2, 1.1, -1e-2).strays == np.inf
