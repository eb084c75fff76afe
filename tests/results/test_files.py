"""Results on disk: what was written is read again, and what cannot be read is named."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from microslip.errors import InputError
from microslip.results.files import load_results, plain, write_dataset, write_summary


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Of a run that found one number."""
    write_summary({"title": "Two", "found": 2}, tmp_path / "summary.json")
    group = xr.Dataset({"found": xr.Variable((), 2.0), "slip": (("x", "y"), np.eye(3) / 3)})
    write_dataset(
        xr.DataTree.from_dict({"/": xr.Dataset(), "deep/down": group}), tmp_path / "results.nc"
    )
    return tmp_path


def test_what_was_written_is_read(folder: Path) -> None:
    with load_results(folder) as found:
        assert found.summary == {"title": "Two", "found": 2}
        assert float(found.data["deep/down"]["found"]) == 2.0
        np.testing.assert_allclose(found.data["deep/down/slip"], np.eye(3) / 3, rtol=1e-7)
        assert found.data["deep/down/slip"].dtype == np.float32
        assert repr(found) == f"Results in {folder}: Two\n  deep"
    # closed: the file may be replaced
    (folder / "results.nc").unlink()


@pytest.mark.parametrize("name", ["summary.json", "results.nc"])
def test_what_is_missing_is_named(folder: Path, name: str) -> None:
    (folder / name).unlink()
    with pytest.raises(InputError, match=f"holds no results of a run: {name} is missing"):
        load_results(folder)


@pytest.mark.parametrize("name", ["summary.json", "results.nc"])
def test_what_cannot_be_read_is_named(folder: Path, name: str) -> None:
    (folder / name).write_text("neither")
    with pytest.raises(InputError, match=f"{name}: cannot be read"):
        load_results(folder)


def test_plain_is_json() -> None:
    value = {
        1: np.array([1.0, np.nan]),
        "yes": np.bool_(True),
        "count": np.int64(3),
        "none": None,
        "far": np.inf,
        "nested": ({"x": np.float32(0.5)},),
    }
    expected = {
        "1": [1.0, None],
        "yes": True,
        "count": 3,
        "none": None,
        "far": None,
        "nested": [{"x": 0.5}],
    }
    assert plain(value) == expected
    assert json.loads(json.dumps(plain(value), allow_nan=False)) == expected
