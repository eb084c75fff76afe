"""A run stored and read again: every analysis, bit for bit but for what is stored in single precision."""

from __future__ import annotations

from dataclasses import dataclass, fields, is_dataclass, replace

import h5py
import numpy as np
import pytest
from conftest import description

from microslip.describe.reading import parse_joint
from microslip.errors import Failure, InputError
from microslip.pipeline.outcome import Outcome
from microslip.pipeline.run import run
from microslip.results.objects import LARGE, read_object, write_object
from microslip.results.store import STORE, RunStore, finished, load_run
from microslip.results.summary import summary
from microslip.show.figures import draw_figures, figures_of

LOAD = {"moment_over_clamp_force_length": [4e-4]}
ANALYSES = {
    "cycle": {"count": 3, "steps": 40},
    "response": {"from": 165, "to": 190, "count": 31},
    "reduced": {"amplitudes": 6, "steps": 60, "variant": ["consistent", "refined"]},
    "backbone": {"count": 2, "methods": ["quasi_static", "harmonic"], "harmonics": 3},
    "harmonic": {"from": 170, "to": 180, "count": 3, "harmonics": 3},
    "time": {"frequencies": [170], "max_cycles": 3},
    "history": {"signal": "sine", "frequency": 175, "cycles": 2, **LOAD, "steps": 40},
}


@pytest.fixture(scope="module")
def joint():
    document = description(21, 20, load=LOAD, analysis=ANALYSES)
    document["analysis"]["history"]["moment_over_clamp_force_length"] = 4e-4
    return parse_joint(document)


@pytest.fixture(scope="module")
def whole(joint, tmp_path_factory):
    """A run of every analysis, and the folder that it was stored in as it went."""
    folder = tmp_path_factory.mktemp("stored")
    store = RunStore(folder / STORE)
    store.begin(joint)
    result = run(joint, keep=store.keep)
    store.finish(result)
    return result, folder


def same(one, other, where="", rounding=0.0):
    """Assert that two trees of objects hold the same; large fields to single precision."""
    assert type(one) is type(other), where
    if is_dataclass(one):
        for field in fields(one):
            same(
                getattr(one, field.name),
                getattr(other, field.name),
                f"{where}.{field.name}",
                rounding,
            )
    elif isinstance(one, dict):
        assert list(one) == list(other), where
        for key in one:
            same(one[key], other[key], f"{where}[{key}]", rounding)
    elif isinstance(one, list | tuple):
        assert len(one) == len(other), where
        for i, (a, b) in enumerate(zip(one, other, strict=True)):
            same(a, b, f"{where}[{i}]", rounding)
    elif isinstance(one, np.ndarray):
        assert (one.dtype, one.shape) == (other.dtype, other.shape), where
        tolerance = 1e-7 * np.abs(one).max(initial=0.0) if one.size > LARGE else 0.0
        assert np.allclose(one, other, rtol=0.0, atol=tolerance, equal_nan=True), where
    elif isinstance(one, float):
        assert one == pytest.approx(other, rel=rounding, abs=0.0, nan_ok=True), where
    else:
        assert one == other, where


def test_every_outcome_comes_back(whole):
    result, folder = whole
    again = load_run(folder)
    assert list(again.outcomes) == list(result.outcomes) == list(ANALYSES_IN_ORDER)
    same(dict(result.outcomes), dict(again.outcomes))
    assert again.timings == result.timings
    assert not again.interrupted


ANALYSES_IN_ORDER = ("backbone", "cycle", "reduced", "response", "harmonic", "time", "history")


def test_description_comes_back(whole):
    result, folder = whole
    assert load_run(folder).joint.model_dump() == result.joint.model_dump()


def test_summary_of_a_stored_run_is_that_of_the_run(whole):
    result, folder = whole
    same(summary(result), summary(load_run(folder)), rounding=1e-14)  # another layout in memory


def test_figures_of_a_stored_run_are_those_of_the_run(whole):
    result, folder = whole
    again = load_run(folder)
    assert list(figures_of(again)) == list(figures_of(result))
    for name, draw in figures_of(again).items():
        assert list(draw_figures(name, draw, again)) == list(draw_figures(name, draw, result))


def test_an_interrupted_run_goes_on(joint, whole, tmp_path):
    """What was finished is taken, what was interrupted is run again, and the result is the same."""
    result, _ = whole
    store = RunStore(tmp_path / STORE)
    store.begin(joint)
    for name in ("backbone", "cycle", "harmonic"):
        store.keep(name, result.outcomes[name])
    store.keep("reduced", replace(result.outcomes["reduced"], interrupted=True))
    done = finished(tmp_path, joint)
    assert list(done) == ["backbone", "cycle", "harmonic"]
    ran = []
    again = run(joint, done=done, keep=lambda name, outcome: ran.append(name))
    assert ran == ["reduced", "response", "time", "history"]
    same(result.value("response").curves, again.value("response").curves)
    same(result.failures, again.failures)


def test_another_description_is_refused(joint, whole):
    _, folder = whole
    other = joint.model_copy(update={"contact": joint.contact.model_copy(update={"friction": 0.4})})
    with pytest.raises(
        InputError, match=r"another joint file, which says: contact.friction = 0.25"
    ):
        finished(folder, other)


def test_no_store_and_no_file_of_ours_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"run.h5 is missing"):
        load_run(tmp_path)
    (tmp_path / STORE).write_bytes(b"not HDF5")
    with pytest.raises(InputError, match="cannot be read"):
        load_run(tmp_path)


def test_another_version_is_refused(whole, tmp_path):
    _, folder = whole
    (tmp_path / STORE).write_bytes((folder / STORE).read_bytes())
    with h5py.File(tmp_path / STORE, "a") as file:
        file.attrs["version"] = "0.0.0"
    with pytest.raises(InputError, match=r"version 0\.0\.0.*run again"):
        load_run(tmp_path)


def test_a_file_cannot_make_what_is_no_record(tmp_path):
    """Neither functions nor classes of modules that are not loaded."""
    with h5py.File(tmp_path / "bad.h5", "w") as file:
        for name, kind in (("a", "os:system"), ("b", "antigravity:x"), ("c", "microslip.none:X")):
            file.create_group(name).attrs["@kind"] = kind
        for name in "abc":
            with pytest.raises(InputError, match="does not know"):
                read_object(file, name)


@dataclass(frozen=True)
class Toy:
    order: int
    parts: dict


def test_objects_of_every_kind(tmp_path):
    toy = Toy(
        3,
        {
            "z": None,
            "a": (1.0, 2.0),
            "mixed": (1, 2.5, "text", True, 3 + 4j),
            "empty": (),
            "list": [np.arange(3), np.zeros((0, 2))],
            "nested": {"outcome": Outcome((Toy(1, {}),), (Failure("a", "b", "c"),))},
        },
    )
    with h5py.File(tmp_path / "toy.h5", "w") as file:
        write_object(file, "toy", toy)
        same(toy, read_object(file, "toy"))
        with pytest.raises(TypeError, match="set cannot be stored"):
            write_object(file, "set", {1})
