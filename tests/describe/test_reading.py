"""Joint files: what is read, and what every mistake is answered with."""

from __future__ import annotations

import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st
from joint_files import example_document, refused

from microslip.describe.lap import LapJoint
from microslip.describe.reading import load_joint, parse_joint
from microslip.errors import InputError


@pytest.fixture
def document() -> dict:
    return example_document()


@pytest.mark.parametrize(
    ("section", "key", "parts"),
    [
        ("contact", "fricton", ["contact.fricton", "'friction'"]),
        ("beams", "lenght", ["beams.lenght", "'length'"]),
        ("clamp", "friction", ["clamp.friction", "belongs in [contact]"]),
        ("damping", "xyzzy", ["damping.xyzzy", "alpha, beta"]),
    ],
)
def test_an_unknown_key_names_the_nearest(document, section, key, parts):
    document[section][key] = 1
    message = refused(document)
    for part in parts:
        assert part in message


def test_an_unknown_section_names_the_nearest(document):
    document["bems"] = {}
    assert "bems is not a known key; the nearest at the top of the file is 'beams'" in refused(
        document
    )


def test_an_unknown_key_of_an_analysis_names_the_nearest(document):
    document["analysis"]["response"]["form"] = 1
    assert "analysis.response.form" in (message := refused(document))
    assert "'from'" in message


def test_no_clamp_force(document):
    del document["clamp"]["force"]
    assert "clamp.force is missing: expected a force per metre of width" in refused(document)


def test_no_clamp_section(document):
    del document["clamp"]
    assert "[clamp] is missing: a section with force, half_length" in refused(document)


def test_a_section_that_is_a_number(document):
    document["clamp"] = 3
    assert "clamp = 3: must be a section, [clamp]" in refused(document)


@pytest.mark.parametrize("mark", ["\x85", "\u2028", "\x7f", "\n"])
def test_a_mark_that_cannot_be_seen_is_spelt_out(document, mark):
    document["beams"]["length"] = f"x{mark}m"
    document["clamp"][f"for{mark}ce"] = 1
    message = refused(document)
    assert len(message.splitlines()) == 3
    assert mark not in message.replace("\n  ", "")


def test_many_mistakes_are_a_few_lines():
    message = refused({"beams": {"length": -1, "xyzzy": 1}, "clamp": {"force": "1 m"}})
    assert 3 < len(message.splitlines()) <= 7


def test_missing_file(tmp_path):
    with pytest.raises(InputError, match=r"none\.toml: no such file.*microslip new lap"):
        load_joint(tmp_path / "none.toml")


def test_folder_instead_of_file(tmp_path):
    with pytest.raises(InputError, match="is a folder"):
        load_joint(tmp_path)


def test_syntax_error_names_the_line(tmp_path):
    file = tmp_path / "bad.toml"
    file.write_text("[beams]\nlength = = 3\n")
    with pytest.raises(InputError, match=r"bad\.toml: not valid TOML: .*line 2"):
        load_joint(file)


def test_binary_file(tmp_path):
    file = tmp_path / "bad.toml"
    file.write_bytes(b"title = '\xff\xfe'")
    with pytest.raises(InputError, match="not UTF-8"):
        load_joint(file)


def test_empty_file(tmp_path):
    file = tmp_path / "empty.toml"
    file.write_text("")
    with pytest.raises(InputError, match=r"\[beams\] is missing"):
        load_joint(file)


@given(
    st.recursive(
        st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5),
        lambda inner: (
            st.lists(inner, max_size=3)
            | st.dictionaries(
                st.sampled_from([*LapJoint.model_fields, "cycle", "length", "force", "x"]), inner
            )
        ),
        max_leaves=8,
    ).filter(lambda value: isinstance(value, dict))
)
def test_any_document_is_refused_with_one_message(document):
    with pytest.raises(InputError) as caught:
        parse_joint(document)
    assert len(str(caught.value).splitlines()) <= 7


def test_a_description_needs_no_numerics():
    code = (
        "import sys, pkgutil, importlib, microslip.describe as floor\n"
        "for module in pkgutil.iter_modules(floor.__path__, 'microslip.describe.'):\n"
        "    importlib.import_module(module.name)\n"
        "heavy = {'numpy', 'scipy', 'skfem', 'numba', 'xarray', 'microslip.model'}\n"
        "print(sorted(heavy & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("kind", ["mesh", "matrices", "model"])
def test_a_section_says_which_kind_was_forgotten(kind):
    with pytest.raises(
        InputError, match=rf'kind is missing: with \[{kind}\] it is kind = "{kind}"'
    ):
        parse_joint({kind: {"file": "joint.inp"}})
