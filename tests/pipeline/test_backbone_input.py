"""Backbones from a joint file: what is refused, what is reported, and the figure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from conftest import description, with_value

from microslip.describe.reading import parse_joint
from microslip.errors import Failure, InputError
from microslip.pipeline.backbone import split_end
from microslip.pipeline.run import run as run_joint
from microslip.results.dataset import dataset
from microslip.results.summary import summary
from microslip.show.plots.backbones import backbones_figure


def described(**backbone):
    analysis = {"backbone": {"count": 4, **backbone}}
    return parse_joint(description(31, 20, analysis=analysis))


@pytest.fixture(scope="module")
def run():
    return run_joint(described(modes=[1, 2], methods=["quasi_static", "prescribed"]))


def test_a_run_reports_backbones(run):
    rows = summary(run)["backbone"]
    assert {(row["mode"], row["method"]) for row in rows} == {
        (mode, method) for mode in (1, 2) for method in ("quasi_static", "prescribed")
    }
    first = next(row for row in rows if row["method"] == "prescribed")
    assert first["frequency_hz"] == pytest.approx(first["stuck_frequency_hz"], rel=1e-7)
    assert first["damping_ratio"] == pytest.approx(first["material_damping_ratio"], rel=1e-5)
    assert all(row["residual_max"] <= 1e-8 for row in rows)
    ended = any("ends at" in caution.reason for caution in run.cautions)
    assert ended or len(rows) + len(run.failures) == 16
    group = dataset(run)["backbone"]
    assert group["frequency"].attrs["units"] == "Hz"
    assert group.sizes["curve"] == 4
    assert float(group["frequency"][1, 0]) == first["frequency_hz"]


def test_the_figure_has_a_column_per_mode(run):
    figure = backbones_figure(run)
    assert len(figure.axes) == 4
    assert [ax.get_ylabel() for ax in figure.axes[::2]] == [
        "natural frequency (Hz)",
        "damping ratio (%)",
    ]
    assert all(ax.get_xlabel() for ax in figure.axes[2:])
    lines = [line.get_label() for line in figure.axes[0].lines]
    assert len(lines) == 4
    assert backbones_figure(with_value(run, "backbone", ())) is None


def test_a_mode_beyond_the_model_ends_the_run():
    with pytest.raises(InputError, match=r"analysis.backbone.modes = \[1, 90\].*has \d+ modes"):
        run_joint(described(modes=[1, 90]))


def test_a_curve_whose_end_nobody_gave_ends_with_a_word(run):
    """Amplitudes missed beyond its last point are one caution; those between its points are failures."""
    curve = next(b for b in run.backbones if b.method == "prescribed")
    last = curve.points[-1]
    points = tuple(replace(last, amplitude=a) for a in (1.0, 10.0, 100.0))
    curve = replace(curve, points=points, scale=1e5)
    sizes = 10.0 ** np.arange(5)
    missed = [Failure("backbone", f"{a:g}", f"reason {a:g}") for a in (1e3, 1e4)]
    failures, cautions = split_end(curve, sizes, missed)
    assert failures == []
    assert len(cautions) == 1
    assert "ends at 0.001 of the amplitude that opens the joint" in cautions[0].reason
    assert "reason 1000" in cautions[0].reason
    holed = replace(curve, points=points[::2])
    failures, cautions = split_end(holed, sizes, [Failure("backbone", "10", "lost"), *missed])
    assert [failure.where for failure in failures] == ["10"]
    assert len(cautions) == 1
    assert split_end(replace(curve, method="harmonic"), sizes, missed) == (missed, [])


@pytest.mark.parametrize(
    ("change", "part"),
    [
        ({"modes": [0]}, "backbone.modes"),
        ({"modes": [1, 1]}, "names one thing twice"),
        ({"methods": ["exact"]}, "quasi_static"),
        ({"largest": 1.0}, "less than 1"),
        ({"smallest": 0.5, "largest": 0.1}, "must be above"),
        ({"steps": 90}, "multiple of 4"),
    ],
)
def test_a_wrong_section_is_named(change, part):
    with pytest.raises(InputError, match=part):
        described(**change)
