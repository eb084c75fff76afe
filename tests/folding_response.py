"""A response that folds: two branches of steady states that are numbers, beside a real refined model."""

import numpy as np

import microslip
from microslip.analyses.reduced.refined import load_offset, refined_table
from microslip.analyses.reduced.response import forced_response
from microslip.analyses.reduced.two_mode import two_mode_model
from microslip.analyses.statics.held import hold_mode

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
