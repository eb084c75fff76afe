"""From histories in a file to loads at every step."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import ROOT

from microslip.describe.excitation import (
    Excitation,
    FreeDecay,
    Sine,
    SteppedSine,
    SweptSine,
)
from microslip.describe.reading import load_joint
from microslip.errors import InputError
from microslip.pipeline.excitation import prepare_histories, sampled_load

EXAMPLE = ROOT / "examples" / "lap_joint.toml"


@pytest.mark.parametrize("file", sorted(EXAMPLE.parent.glob("*.toml")), ids=lambda p: p.stem)
def test_every_example_is_valid_down_to_its_signals(file):
    joint = load_joint(file)
    for item in prepare_histories(joint.analysis.history, 174.9):
        assert len(item.load) > 1000


def test_a_measured_signal_lies_beside_the_joint_file(tmp_path):
    (tmp_path / "load.csv").write_text("time [s], moment [kN*m/m]\n0, 0\n0.5, 1\n1, 0\n")
    text = EXAMPLE.read_text() + '[[analysis.history]]\nsignal = "measured"\nfile = "load.csv"\n'
    (tmp_path / "joint.toml").write_text(text)
    (history,) = load_joint(tmp_path / "joint.toml").analysis.history
    load = sampled_load(history, 0.0, history.resolution(1.0))
    assert (load[0], load[-1], load.max()) == (0.0, 0.0, 1000.0)
    assert len(load) == 151
    (tmp_path / "joint.toml").write_text(text + "dataset = 2\n")
    with pytest.raises(InputError, match="dataset = 2: is for universal files"):
        load_joint(tmp_path / "joint.toml")


def test_example_signals_agree():
    """The same blow as CSV in ms and kN m/m, and as a universal file in s and N m/m, half."""
    joint = load_joint(EXAMPLE.parent / "lap_joint_measured.toml")
    csv, universal = prepare_histories(joint.analysis.history, 174.9)
    assert csv.load.max() == pytest.approx(1500, rel=0.01)
    assert universal.load == pytest.approx(0.5 * csv.load, abs=0.05)


def test_every_signal_is_sampled_at_its_step():
    """At 1 Hz in steps of 1/8 s: quarter cycles are the peaks, and a dwell keeps the phase."""
    dt = 1 / 8
    sine = Sine(signal="sine", frequency=1, cycles=1.5, moment=1)
    assert sampled_load(sine, 2.0, dt)[::2] == pytest.approx([0, 2, 0, -2, 0, 2, 0])
    dwells = SteppedSine(signal="stepped_sine", frequencies=[1, 2], cycles=1, moment=1)
    time = np.arange(13) * dt
    expected = np.sin(2 * np.pi * np.where(time < 1, 1, 2) * time)
    assert sampled_load(dwells, 1.0, dt) == pytest.approx(expected, abs=1e-12)
    sweep = SweptSine(signal="swept_sine", to=1, duration=2, moment=1, **{"from": 1})
    assert sampled_load(sweep, 3.0, dt)[:13] == pytest.approx(sampled_load(sine, 3.0, dt))


def test_a_free_decay_is_loaded_before_its_first_step_only():
    held = FreeDecay(signal="free_decay", start="static", duration=1, moment=1)
    assert sampled_load(held, 5.0, 0.25).tolist() == [5, 0, 0, 0, 0]
    moving = FreeDecay(signal="free_decay", start="mode", modal_amplitude=1, duration=1)
    assert sampled_load(moving, 5.0, 0.25).tolist() == [0, 0, 0, 0, 0]


def test_a_prepared_history_counts_its_steps_and_blocks():
    """Ten cycles at 100 Hz in 20 steps each; the joint at 50 Hz asks for nothing finer."""
    sine = Sine(signal="sine", frequency=100, cycles=10, steps=20, moment=7)
    (item,) = prepare_histories([sine], 50.0)
    assert (item.dt, item.cycle_steps, item.blocks) == (1 / 2000, 20, 10)
    assert len(item.load) == 201
    assert item.load.max() == pytest.approx(1.0)


def test_a_history_that_cannot_be_sampled_is_named():
    long = Sine(signal="sine", name="long", frequency=100, cycles=1e6, moment=7)
    with pytest.raises(InputError, match=r"^analysis\.history 'long': .* at most 5,000,000 are"):
        prepare_histories([long], 50.0)
    coarse = FreeDecay(
        signal="free_decay", start="mode", modal_amplitude=1, duration=1, time_step=1e-2
    )
    with pytest.raises(InputError, match=r"^analysis\.history 'free_decay'\.time_step: gives 1 "):
        prepare_histories([coarse], 100.0)


def test_an_excitation_from_outside_says_what_it_lacks():
    class Noise(Excitation):
        signal: str = "noise"

    with pytest.raises(NotImplementedError, match="Noise"):
        sampled_load(Noise(), 1.0, 0.1)
