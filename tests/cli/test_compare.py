"""`microslip compare`: what two runs differ in, over each other and side by side."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import assert_refused
from conftest import description, with_value
from typer.testing import CliRunner

from microslip.cli.main import app
from microslip.describe.reading import parse_joint
from microslip.pipeline.run import Run
from microslip.pipeline.run import run as run_joint
from microslip.results.comparison import Named, Quantity, curves, quantities
from microslip.results.differences import differing_keys
from microslip.show.plots.comparison import MOST_RUNS, comparison_figures
from microslip.show.write import write_results

ANALYSES = {
    "cycle": {"moment_over_clamp_force_length": [1e-3, 4e-3, 1.2e-2], "steps": 40},
    "response": {"from": "165 Hz", "to": "195 Hz", "count": 61},
    "backbone": {"modes": [1], "methods": ["prescribed"], "count": 4, "steps": 40},
}
RATIOS = [2e-4, 4e-4]
HARDER = 1.5


def joint(factor: float = 1.0, title: str = "one", **load: list[float]) -> dict:
    """Description of a small joint whose clamp presses harder by a factor."""
    loads = load or {"moment_over_clamp_force_length": RATIOS}
    small = description(21, 20, load=loads, analysis=dict(ANALYSES), title=title)
    small["clamp"]["force"] = f"{factor} MN/m"
    return small


@pytest.fixture(scope="module")
def runs() -> tuple[Run, Run]:
    return run_joint(parse_joint(joint())), run_joint(parse_joint(joint(HARDER, "two")))


@pytest.fixture(scope="module")
def folders(runs, tmp_path_factory) -> list[Path]:
    home = tmp_path_factory.mktemp("compare")
    for name, run in zip(("soft", "hard"), runs, strict=True):
        write_results(run, home / name, formats=())
    return [home / "soft", home / "hard"]


def compare(*words):
    return CliRunner().invoke(app, ["compare", *map(str, words)])


def line(text: str, start: str) -> list[str]:
    """Words of the one line that begins so, after that."""
    (found,) = [row for row in text.splitlines() if row.strip().startswith(start)]
    return found.strip()[len(start) :].split()


def test_a_harder_clamp_scales_what_friction_does(folders):
    """With no other length or force in contact, all that friction limits grows with the clamp
    force, and at the same M/(PL) the response is the same but for its size."""
    result = compare(*folders)
    assert result.exit_code == 0, result.output
    said = result.stdout
    assert line(said, "clamp.force") == ["1", "MN/m", "1.5", "MN/m"]
    assert line(said, "opening moment, N m/m")[2:] == ["+50.0", "%"]
    assert line(said, "peak pressure, clamp alone, MPa")[2:] == ["+50.0", "%"]
    for same in ("sliding frequency, Hz", "stuck frequency, Hz", "opening M/(PL)"):
        assert line(said, same)[2:] == ["0", "%"]
    assert line(said, "peak, M/(PL) = 0.0002, Hz")[2:] == ["0", "%"]
    deflections = [row for row in said.splitlines() if row.strip().startswith("deflection there")]
    assert len(deflections) == len(RATIOS)
    assert all(row.split()[-2:] == ["+50.0", "%"] for row in deflections)
    assert line(said, "mode 1, prescribed: greatest damping, %")[2:] == ["0", "%"]
    assert "contact.friction" not in said
    assert "soft: one" in said


def test_numbers_are_those_of_the_runs(runs):
    found = {q.name: q for q in quantities([Named("a", runs[0]), Named("b", runs[1])])}
    peaks = [run.responses[0].peak_frequency for run in runs]
    assert found["peak, M/(PL) = 0.0002"].values == pytest.approx(peaks)


def test_figures_lie_over_each_other(folders, tmp_path):
    result = compare(*folders, "--out", tmp_path / "both", "--format", "svg")
    assert result.exit_code == 0, result.output
    names = {path.name for path in (tmp_path / "both").iterdir()}
    assert names == {"response.svg", "equivalent.svg", "backbones.svg"}
    assert_refused(compare(*folders, "--out", tmp_path / "both"), "holds files already", "--force")
    assert compare(*folders, "--out", tmp_path / "both", "--force").exit_code == 0


def test_matched_curves_share_a_colour_and_runs_a_line_style(runs):
    both = [Named("a", runs[0]), Named("b", runs[1])]
    ax = comparison_figures(both)["response"].axes[0]
    drawn = [line for line in ax.lines if len(line.get_xdata()) > 10]
    looks = {(line.get_color(), line.get_linestyle()) for line in drawn}
    assert len(looks) == 2 * len(RATIOS)
    assert len({color for color, _ in looks}) == len(RATIOS)
    assert {style for _, style in looks} == {"-", "--"}
    legend = [text.get_text() for text in ax.figure.legends[0].get_texts()]
    assert "a: one" in legend
    assert "b: two" in legend


def test_loads_given_by_different_keys_match_by_their_moment(runs):
    moments = [response.load for response in runs[0].responses]
    other = parse_joint(joint(moment=[*moments, 3 * moments[0]]))
    said = replace(runs[0], assembly=replace(runs[0].assembly, joint=other))
    one, two = curves([Named("a", runs[0]), Named("b", said)])
    assert list(one) == list(two)
    assert [curve.load for curve in one] == pytest.approx(moments)


def test_a_run_beside_itself_differs_in_nothing(folders, runs, tmp_path):
    write_results(runs[0], tmp_path / "again" / "soft", formats=())
    result = compare(folders[0], tmp_path / "again" / "soft")
    assert "The joint files say the same." in result.stdout
    assert not re.search(r"[+-]\d+\.\d %", result.stdout)
    assert "again/soft" in result.stdout


def test_a_run_without_an_analysis_has_gaps(runs):
    bare = replace(runs[1], outcomes={})
    found = quantities([Named("a", runs[0]), Named("b", bare)])
    assert {q.name for q in found if None in q.values} == set()
    assert comparison_figures([Named("a", runs[0]), Named("b", bare)]) == {}


def test_change_of_what_is_no_number():
    row = Quantity("peak", "Hz", (200.0, "no peak in the band", None, 190.0))
    assert np.isnan(row.changes()[1:3]).all()
    assert row.changes()[3] == pytest.approx(-0.05)


def test_a_section_that_one_file_does_without_is_one_row():
    without = joint()
    del without["analysis"]["backbone"]
    keys = dict(differing_keys([parse_joint(joint()), parse_joint(without)]))
    assert keys == {"analysis.backbone": ("given", "–")}


def test_keys_of_a_section_that_a_third_file_does_without_are_still_compared():
    one, other, without = joint(), joint(), joint()
    other["analysis"]["backbone"] = {**ANALYSES["backbone"], "count": 5}
    del without["analysis"]["backbone"]
    keys = dict(differing_keys([parse_joint(each) for each in (one, other, without)]))
    assert keys == {
        "analysis.backbone": ("given", "given", "–"),
        "analysis.backbone.count": ("4", "5", "–"),
    }


def test_outputs_are_compared_by_their_name():
    one, other = joint(), joint()
    one["output"] = [{"name": "tip", "x": "right end"}]
    other["output"] = [{"name": "other", "x": "left end"}]
    keys = dict(differing_keys([parse_joint(one), parse_joint(other)]))
    assert keys["output[tip].x"] == ("right end", "–")
    assert keys["output[other].x"] == ("–", "left end")
    assert all(key.startswith("output[") for key in keys)


# -- loads of other kinds ----------------------------------------------------------------------


def ported(kind: str, key: str, factor: float = 1.0) -> dict:
    """A small cantilever of a joint, driven through a port at its free end or by its base."""
    at = {} if kind == "base" else {"at": "right"}
    small = joint(factor)
    return small | {
        "support": {"left": "clamped", "right": "free"},
        "port": [{"name": "drive", "kind": kind, **at}],
        "load": {"port": "drive", key: [20.0 * factor]},
        "analysis": {
            "cycle": {"smallest": 0.02, "largest": 0.5, "count": 3, "steps": 40},
            "response": {"count": 61},
            "reduced": {"amplitudes": 8, "steps": 60, "upper_modes": 0},
        },
        "output": [{"name": "tip", "x": "right end"}],
    }


@pytest.fixture(scope="module")
def pushed() -> tuple[Run, Run]:
    """A force at the tip; of the second, clamp and force are larger by one factor."""
    first, second = (run_joint(parse_joint(ported("force", "force", f))) for f in (1.0, HARDER))
    return first, second


def under(run: Run, kind: str, key: str) -> Named:
    """What a run found, as if its file had said another load."""
    said = parse_joint(ported(kind, key))
    return Named(kind, replace(run, assembly=replace(run.assembly, joint=said)))


def test_forces_are_compared_as_forces(pushed):
    """Contact knows no force of its own: with clamp and load larger by one factor all forces are, and
    frequencies and damping are the same."""
    found = {q.name: q for q in quantities([Named("a", pushed[0]), Named("b", pushed[1])])}
    assert found["opening force"].unit == "N/m"
    assert found["opening force"].changes()[1] == pytest.approx(HARDER - 1, rel=1e-6)
    assert found["greatest gamma_eq, force-driven"].changes()[1] == pytest.approx(0, abs=1e-6)
    assert not [name for name in found if "moment" in name or "PL" in name]
    assert found["peak, F = 20 N/m"].values[1] is None
    assert found["peak, F = 30 N/m"].values[0] is None
    first, second = (run.responses[0].peak_frequency for run in pushed)
    assert found["peak, F = 20 N/m"].values[0] == pytest.approx(first)
    assert second == pytest.approx(first, rel=1e-6)


def test_equal_numbers_of_other_kinds_of_load_are_no_equal_loads(pushed):
    runs = [Named("force", pushed[0]), under(pushed[0], "base", "acceleration")]
    runs += [under(pushed[0], "moment", "moment")]
    labels = [{curve.load_label for curve in found} for found in curves(runs)]
    assert labels == [{"F = 20 N/m"}, {"a = 20 m/s^2"}, {"M = 20 N m/m"}]
    names = [q.name for q in quantities(runs)]
    assert not [name for name in names if "opening" in name or "gamma_eq" in name]
    shown = [t.get_text() for t in comparison_figures(runs)["response"].legends[0].get_texts()]
    assert {"F = 20 N/m", "a = 20 m/s^2", "M = 20 N m/m"} < set(shown)


def test_amplitudes_per_load_of_two_kinds_are_said_to_be_so(pushed):
    idle = replace(pushed[0].responses[0], rho=0.0)
    found = pushed[0].value("response")
    zero = with_value(pushed[0], "response", replace(found, curves=(idle,)))
    one, other = under(zero, "moment", "moment"), Named("force", pushed[0])
    per_moment = comparison_figures([one, replace(one, name="again")])["response"]
    assert per_moment.axes[0].get_ylabel() == "tip per end moment\n(mm per N m/m)"
    mixed = comparison_figures([one, other])["response"]
    assert mixed.axes[0].get_ylabel() == "tip per load\n(mm per unit of the load)"


def test_a_load_that_opens_nothing_is_said_in_words(runs):
    endless = replace(runs[1], assembly=replace(runs[1].assembly, opening_moment=np.inf))
    found = {q.name: q for q in quantities([Named("a", runs[0]), Named("b", endless)])}
    assert found["opening moment"].values[1] == found["opening M/(PL)"].values[1] == "none"


# -- what cannot be compared -------------------------------------------------------------------


def test_one_folder_is_not_enough(folders):
    assert_refused(compare(folders[0]), f"2 to {MOST_RUNS} folders", "found 1")


def test_a_folder_twice(folders):
    assert_refused(compare(folders[0], folders[0]), str(folders[0]), "given twice")


def test_a_folder_that_is_no_run(folders, tmp_path):
    assert_refused(compare(folders[0], tmp_path), str(tmp_path), "run.h5 is missing")
    assert_refused(compare(folders[0], tmp_path / "none"), "none", "run.h5 is missing")


def test_nothing_in_common(folders, runs, tmp_path):
    write_results(replace(runs[1], outcomes={}), tmp_path / "bare", formats=())
    out = tmp_path / "both"
    result = compare(folders[0], tmp_path / "bare", "--out", out)
    assert result.exit_code == 2
    assert "nothing to draw" in result.stderr
    assert "sliding frequency" in result.stdout
    assert not out.exists()
