"""What wanders about a mean: series whose mean, drift and beat are known beforehand."""

from __future__ import annotations

import numpy as np
import pytest

from microslip.pipeline.wandering import FEWEST, Block, wander_of

UNTIL, CYCLES = 4000.0, 60
N = np.arange(CYCLES)


def blocks(means, beat=0.0, decay=0.0):
    """Blocks of cycles with these mean sizes, in which the size beats by so much, less in each."""
    return [
        Block(
            float(CYCLES * (i + 1)),
            m * np.exp(0.4j),
            np.asarray(m * (1 + beat * np.exp(-decay * i) * np.cos(0.9 * N))),
        )
        for i, m in enumerate(means)
    ]


def noise(memory, seed, count=30):
    """A stationary series of unit variance, each value with so much of the one before."""
    own, out = np.random.default_rng(seed).standard_normal(count + 50), [0.0]
    for one in own:
        out.append(memory * out[-1] + np.sqrt(1 - memory**2) * one)
    return np.array(out[-count:])


@pytest.mark.parametrize("memory", [-0.6, 0.0, 0.4])
@pytest.mark.parametrize("drift", [0.0, 1e-6, -3e-6])
def test_the_mean_after_many_cycles_is_within_its_doubt(memory, drift):
    """Two standard errors of a slope through twenty points leave out one in thirty (Student's t, 18 degrees),
    and some more as the best known of three counts, and where neighbours have in common what is not known:
    not one in ten.

    The doubt is what a drift would make that cannot be told from none, not more.
    """
    right, stated = 0, []
    for seed in range(400):
        i = np.arange(1, 31)
        found = wander_of(blocks(1 + drift * CYCLES * i + 1e-3 * noise(memory, seed)), UNTIL)
        if found is None:
            continue
        off = abs(abs(found.amplitude) / (1 + drift * UNTIL) - 1)
        right += off <= found.doubt
        stated.append(found.doubt)
        assert found.drift * (UNTIL - 20.5 * CYCLES) == pytest.approx(found.doubt, rel=1e-6)
    assert len(stated) > 300
    assert right / len(stated) > 0.9
    even = 1e-3 * np.sqrt((1 + max(memory, 0)) / (1 - max(memory, 0)) * 12 / 20**3) / CYCLES
    assert np.median(stated) < (abs(drift) + 3.5 * even) * (UNTIL - 20.5 * CYCLES)


@pytest.mark.parametrize("turn", [0.9, 2.0, 2.9])
def test_the_mean_of_a_beat_is_within_its_doubt(turn):
    """One that turns by so much from block to block, wherever it begins; faster, to a tenth of it."""
    for start in np.linspace(0, 2 * np.pi, 40):
        found = wander_of(blocks(1 + 0.004 * np.sin(turn * np.arange(30) + start)), UNTIL)
        assert abs(abs(found.amplitude) - 1) < found.doubt
        assert found.doubt < {0.9: 0.05, 2.0: 0.003, 2.9: 0.0004}[turn]


def test_it_is_better_known_by_more_blocks():
    """The error of a slope falls as the number of blocks to the power 3/2."""
    short, long = (
        np.median(
            [f.doubt for s in range(99) if (f := wander_of(blocks(1 + 1e-3 * noise(0, s, n)), 1e5))]
        )
        for n in (18, 72)
    )
    assert short / long == pytest.approx(4**1.5, rel=0.25)


def test_amplitude_and_drift_are_those_of_the_series():
    even = 1 + 1e-6 * CYCLES * np.arange(1, 31) + 1e-5 * (-1.0) ** np.arange(30)
    found = wander_of(blocks(even), UNTIL)
    assert found.drift == pytest.approx(1e-6, rel=0.05)
    assert np.angle(found.amplitude) == pytest.approx(0.4)
    assert abs(found.amplitude) == pytest.approx(1 + 1e-6 * CYCLES * 20.5, rel=1e-6)


@pytest.mark.parametrize(
    ("decay", "lasts"),
    [(0.0, True), (0.02, True), (-0.02, True), (0.03, False), (-0.03, False), (0.2, False)],
)
def test_a_beat_lasts_that_neither_decays_nor_grows(decay, lasts):
    """By a quarter from the first half of its blocks to the second, ten later, at most."""
    even = 1 + 1e-5 * (-1.0) ** np.arange(30)
    found = wander_of(blocks(even, 0.01, decay), UNTIL)
    assert found.strays == pytest.approx(
        0.01 * np.exp(-decay * (10 if decay > 0 else 29)), rel=0.01
    )
    assert found.varies == (found.strays if lasts else 0.0)


@pytest.mark.parametrize(
    "bends",
    [
        lambda i: np.exp(-i / 9),  # comes to rest
        lambda i: -np.exp(i / 5 - 6),  # leaves
        lambda i: np.sin(i / 4),  # beats slowly
    ],
)
def test_what_bends_does_not_wander(bends):
    """Also where it is not quite smooth."""
    means = 1 + 1e-3 * (bends(np.arange(30.0)) + 0.003 * noise(0.0, 3))
    assert wander_of(blocks(means), UNTIL) is None


def test_few_blocks_do_not_tell():
    """The first third is left out: seventeen leave twelve, sixteen eleven."""
    even = 1 + 1e-5 * (-1.0) ** np.arange(30)
    assert FEWEST == 12
    assert wander_of(blocks(even[:17]), UNTIL) is not None
    assert wander_of(blocks(even[:16]), UNTIL) is None


@pytest.mark.parametrize("latest", [1, 2, 3])
@pytest.mark.parametrize("off", [0.0, 8.0])
def test_what_begins_to_leave_shows_in_the_last_blocks(latest, off):
    """By eight times what means scatter by in one, two or three: seen in nineteen of twenty; else never."""
    seen = 0
    for seed in range(200):
        means = noise(0.0, seed)
        means[-latest:] += off
        crossing = wander_of(blocks(1 + 1e-4 * noise(0.0, seed)), UNTIL) is not None
        seen += crossing and wander_of(blocks(1 + 1e-4 * means), UNTIL) is None
    assert seen == 0 if not off else seen > 190


def test_what_strays_unevenly_lasts_unless_that_changes_by_more():
    """By half from block to block: seldom is that taken for a growth, and three times as much for none."""
    said = {1.0: 0, 3.0: 0}
    for times in said:
        for seed in range(200):
            by = np.exp(0.5 * noise(0.0, seed)) * np.where(np.arange(30) < 20, 1.0, times)
            rows = blocks(1 + 1e-5 * (-1.0) ** np.arange(30))
            beat = 0.004 * np.cos(0.9 * N)
            found = wander_of(
                [one._replace(sizes=1 + b * beat) for one, b in zip(rows, by, strict=True)], UNTIL
            )
            said[times] += found.varies > 0
    assert said[1.0] > 185
    assert said[3.0] < 15


@pytest.mark.parametrize("drift", [0.0, 1e-5])
def test_a_drift_is_no_part_of_a_beat(drift):
    means = 1 + drift * CYCLES * np.arange(1, 31) + 1e-5 * (-1.0) ** np.arange(30)
    found = wander_of(blocks(means, 0.002), UNTIL)
    assert found.varies == pytest.approx(0.002, rel=0.02)


def test_leaps_between_blocks_stretch_the_line():
    """Blocks as many cycles apart as a leap and one of them: the drift is that of the whole way."""
    at = np.cumsum(np.where(np.arange(30) % 4, 60.0, 360.0))
    means = 1 + 1e-6 * at + 2e-5 * np.sin(2.9 * np.arange(30))
    found = wander_of([Block(n, m, np.array([m])) for n, m in zip(at, means, strict=True)], 2e4)
    assert found.drift == pytest.approx(1e-6, rel=0.05)
    there = abs(1 + 1e-6 * 2e4 - found.amplitude)
    assert found.doubt == pytest.approx(there, rel=0.05)


def test_what_came_first_is_forgotten():
    even = 1 + 1e-5 * (-1.0) ** np.arange(30)
    began = np.concatenate([[0.3, 0.8, 0.9], even[3:]])
    assert wander_of(blocks(began), UNTIL) == wander_of(blocks(even), UNTIL)
