"""A response that folds: two branches of steady states that are numbers, beside a real refined model."""

import threading
from types import SimpleNamespace

import numpy as np

import microslip
from microslip.analyses.reduced.refined import load_offset, refined_table
from microslip.analyses.reduced.response import forced_response
from microslip.analyses.reduced.two_mode import two_mode_model
from microslip.analyses.statics.held import hold_mode
from microslip.pipeline import auto, smaller
from microslip.pipeline.targets import Lost

FOLD = np.linspace(160.0, 195.0, 141)
ENDS, BEGINS = 40, 90
"""The larger branch ends at one frequency, by index, and the smaller begins at another."""


def folding():
    """Refined model of the reference joint, its table, and its response."""
    joint = microslip.prepare(microslip.reference_joint(pairs=21))
    held = hold_mode(joint, 2 * np.pi * 179.0, upper=2)
    largest = 0.9 * microslip.opening_load(joint, joint.principal().port)
    largest /= joint.principal().sliding_omega ** 2
    table, _ = refined_table(held, 1e-4 * largest, largest, 24, steps=80)
    model = two_mode_model(joint, "refined", load_offset(held, 1e-4 * largest))
    return model, table, forced_response(model, table, FOLD, 40.0)


def branch(name):
    """Two smooth branches, of which the smaller is a fifth as large."""
    k = np.arange(len(FOLD))
    size = {"larger": 1.0, "smaller": 0.2}[name] * 2e-3 * np.exp(-((k - 60) ** 2) / 4000)
    return size * np.exp(-0.02j * k)


def ends_nowhere(joint, targets):
    """Of motions that cannot be marched."""
    return [Lost("contact not solved", 10) for _ in targets]


AS_GOOD_AS_THE_AMPLITUDE = SimpleNamespace(
    response=lambda curve, *known: curve,
    error_of_first=lambda curve, *known: np.zeros(len(curve.frequency)),
)
"""Outputs of motions that are numbers alone."""


def held_to(
    sought,
    refined,
    monkeypatch,
    points,
    marched=ends_nowhere,
    more=None,
    known=None,
    raised=ends_nowhere,
    ends=False,
):
    """The response of a joint that has such steady states, and motions that end there.

    `more` gives the states with more steps; left out, they are not sought on. From rest there are those that
    `raised` gives, where larger ones do not repeat. With `ends` the last ones of a branch are marched, which
    asks `more` for them once more.
    """
    model, table, base = refined
    monkeypatch.setattr(auto, "sought", sought)
    monkeypatch.setattr(auto, "raised_and_marched", marched)
    for name in ("raised_and_marched", "sought"):
        monkeypatch.setattr(smaller, name, raised)
    monkeypatch.setattr(auto, "OutputsHeld", lambda *of_case: AS_GOOD_AS_THE_AMPLITUDE)
    if not ends:
        monkeypatch.setattr(auto.choosing, "ends_to_march", lambda *known: [])
    if more is None:
        monkeypatch.setattr(auto.Search, "seek_on", lambda search, joint: None)
        monkeypatch.setattr(auto.choosing, "to_watch", lambda *known: [])
    else:
        monkeypatch.setattr("microslip.pipeline.stepping.more_steps", more)
    return auto.anchored_response(
        SimpleNamespace(prepared=None),
        SimpleNamespace(points=points, error=0.01),
        SimpleNamespace(model=model, table=table),
        base,
        threading.Event(),
        lambda count: None,
        known,
    )
