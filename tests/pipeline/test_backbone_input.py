"""Backbones from a joint file: what is refused, what is reported, and the figure."""

from __future__ import annotations

import pytest
from conftest import description, with_value

from microslip.describe.reading import parse_joint
from microslip.errors import InputError
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
    assert len(rows) + len(run.failures) == 16
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
