"""Prepared joints in files: the same bits come out, and other files are refused."""

from __future__ import annotations

from dataclasses import fields, is_dataclass

import numpy as np
import pytest
from short_lap import SHORT_LAP
from spatial_twin import spatial_joint
from typer.testing import CliRunner

import microslip
from microslip.analyses.prepared.saved import load_model, save_model, units_of
from microslip.cli.export import app
from microslip.errors import InputError


@pytest.fixture(scope="module")
def planar():
    return microslip.prepare(microslip.reference_joint(pairs=21))


@pytest.fixture(scope="module", params=["planar", "spatial", "elastic"])
def joint(request, planar):
    if request.param == "planar":
        return planar
    if request.param == "spatial":
        return spatial_joint(planar, 0.4)
    law = microslip.contact_law(21, 0.3, np.full(42, 1e-10))
    return microslip.prepare_joint(planar.model, law, {"clamp": 1e6}, "moment", planar.mode)


def same(one, other, path="joint"):
    """Every number and word, bit for bit, and types."""
    if is_dataclass(one) and not isinstance(one, type):
        assert type(one) is type(other), path
        for field in fields(one):
            same(getattr(one, field.name), getattr(other, field.name), f"{path}.{field.name}")
    elif isinstance(one, np.ndarray):
        assert one.dtype == other.dtype, path
        assert np.array_equal(one, other, equal_nan=one.dtype.kind == "f"), path
    elif isinstance(one, dict):
        assert list(one) == list(other), path
        for key in one:
            same(one[key], other[key], f"{path}.{key}")
    elif isinstance(one, tuple):
        assert len(one) == len(other), path
        for k, (a, b) in enumerate(zip(one, other, strict=True)):
            same(a, b, f"{path}[{k}]")
    else:
        assert one == other, path


def test_everything_comes_back(joint, tmp_path):
    again = load_model(save_model(joint, tmp_path / "joint.npz"))
    same(joint, again)
    assert units_of(tmp_path / "joint.npz") == "width"


def test_analyses_answer_with_the_same_bits(joint, tmp_path):
    again = load_model(save_model(joint, tmp_path / "joint.npz", per="whole"))
    assert units_of(tmp_path / "joint.npz") == "whole"
    a, b = (microslip.cycle(each, 300.0, steps=60) for each in (joint, again))
    assert a.dissipated > 0
    for name in ("r", "v", "status"):
        assert np.array_equal(getattr(a, name), getattr(b, name))
    assert a.dissipated == b.dissipated
    if not joint.law.exact:
        return
    a, b = (
        microslip.harmonic_response(each, 100.0, [175.0, 176.0], harmonics=1)
        for each in (joint, again)
    )
    assert [p.amplitude for p in a.points] == [p.amplitude for p in b.points]
    assert len(a.points) > 1


def test_a_joint_without_a_mode_comes_back(planar, tmp_path):
    plain = microslip.prepare_joint(planar.model, planar.law, {"clamp": 1e6}, "moment")
    again = load_model(save_model(plain, tmp_path / "plain.npz"))
    assert again.mode is None
    same(plain, again)


def changed(path, target, **entries):
    """The file with some of its entries changed, or gone."""
    arrays = dict(np.load(path)) | entries
    np.savez(target, **{name: value for name, value in arrays.items() if value is not None})
    return target


def test_other_files_are_refused_by_name(planar, tmp_path):
    file = save_model(planar, tmp_path / "joint.npz")
    np.savez(tmp_path / "other.npz", K=np.eye(3))
    np.save(tmp_path / "one.npy", np.eye(3))
    (tmp_path / "text.npz").write_text("nothing")
    np.savez(tmp_path / "objects.npz", format=np.array([{}], dtype=object))
    whole = file.read_bytes()
    (tmp_path / "half.npz").write_bytes(whole[: len(whole) // 2])
    cases = {
        "nowhere.npz": "cannot be read",
        "other.npz": "is no saved model, it holds K; microslip export writes one",
        "one.npy": "is no saved model",
        "text.npz": "is no saved model",
        "objects.npz": "is no saved model",
        "half.npz": "is no saved model",
        changed(file, tmp_path / "late.npz", format_version=3).name: "is of format 3, written by",
        changed(file, tmp_path / "less.npz", residual=None).name: "residual is missing",
        changed(file, tmp_path / "cut.npz", area=np.ones(3)).name: r"area is \(3,\), and must be",
        changed(file, tmp_path / "words.npz", format_version="two").name: "is of format two",
        changed(file, tmp_path / "q.npz", prestress_q=np.ones(7)).name: r"prestress_q is \(7,\)",
        changed(
            file, tmp_path / "held.npz", preload=np.ones(9)
        ).name: r"preload is \(9,\), and preload_p",
    }
    for name, said in cases.items():
        with pytest.raises(InputError, match=said) as error:
            load_model(tmp_path / name)
        assert name in str(error.value)
    with pytest.raises(InputError, match=r"joint\.npz: cannot be written: No such file"):
        save_model(planar, tmp_path / "nowhere" / "joint.npz")
    with pytest.raises(InputError, match=r"joint\.txt: a saved model is a file \.npz"):
        save_model(planar, tmp_path / "joint.txt")


def test_the_command_writes_the_joint_of_a_file(tmp_path):
    joint = tmp_path / "joint.toml"
    joint.write_text(SHORT_LAP + '[load]\nmoment = "50 N*m/m"\n')
    run = CliRunner()
    done = run.invoke(app, [str(joint)])
    assert done.exit_code == 0, done.output
    same(microslip.prepare(microslip.load_joint(joint)), load_model(tmp_path / "joint.npz"))
    refused = run.invoke(app, [str(joint)])
    assert refused.exit_code == 2
    assert "exists already; --force replaces it" in refused.output
    assert run.invoke(app, [str(joint), "--force"]).exit_code == 0
    assert run.invoke(app, [str(joint), "--out", "model.mat"]).exit_code == 2


def test_a_model_does_not_replace_what_its_joint_is_read_from(tmp_path):
    (tmp_path / "joint.npz").write_bytes(b"the only copy")
    joint = tmp_path / "joint.toml"
    joint.write_text(
        """kind = "matrices"
[matrices]
stiffness = "joint.npz:K"
mass = "joint.npz:M"
[interface]
pairs = "joint.npz:pairs"
relative = "joint.npz:B"
[contact]
friction = 0.3
[preload]
name = "clamp"
vector = "joint.npz:clamp"
force = 1e5
[port]
name = "tip"
kind = "force"
vector = "joint.npz:tip"
[load]
force = 10.0
"""
    )
    done = CliRunner().invoke(app, [str(joint), "--force"])
    assert done.exit_code == 2
    assert "reads this file; give another with --out" in done.output
    assert (tmp_path / "joint.npz").read_bytes() == b"the only copy"
