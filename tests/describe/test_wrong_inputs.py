"""Every wrong file of the table is refused with one message that names what is wrong."""

from __future__ import annotations

import re

import pytest
from wrong_inputs import MEASURED, RIGHT, WRONG, WRONG_SIGNALS, history

from microslip.describe.reading import load_joint
from microslip.errors import InputError
from microslip.pipeline.excitation import prepare_histories

FOREIGN = re.compile(
    r"should|\bInput\b|Tuple|[Vv]alidat|pydantic|Extra inputs|Field required|codec|Expected|Invalid|"
    r"Unclosed|Unterminated|Unescaped|Cannot|recursion|Exceeds|Errno|Traceback|None\b|Error\b|<class|"
    r"pint|tomllib|pyuff|NoneType|literal|_error"
)
"""Words of the libraries, none of which is ours."""


def test_the_right_file_is_right(tmp_path):
    (tmp_path / "load.csv").write_text("time [s], moment [N*m/m]\n0, 0\n0.001, 1\n0.002, 0\n")
    file = tmp_path / "joint.toml"
    for text in (RIGHT, history(MEASURED)(RIGHT)):
        file.write_text(text)
        load_joint(file)


def test_there_are_two_hundred_and_none_twice():
    texts = [wrong.text() for wrong in WRONG]
    assert len(texts) + len(WRONG_SIGNALS) >= 200
    assert len(set(texts)) == len(texts)
    assert RIGHT not in texts


def assert_says(message: str, says: tuple[str, ...], most: int = 7) -> None:
    for words in says:
        assert words in message, message
    assert len(message.splitlines()) <= most
    assert not FOREIGN.search(message), message


@pytest.mark.parametrize("wrong", WRONG, ids=lambda wrong: wrong.name)
def test_wrong_file(wrong, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("load.csv", "load.uff"):
        (tmp_path / name).write_text("")
    (tmp_path / "my.toml").write_text(wrong.text(), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        load_joint("my.toml")
    message = str(caught.value)
    assert message.startswith("my.toml: ")
    assert_says(message, wrong.says)


@pytest.mark.parametrize("wrong", WRONG_SIGNALS, ids=lambda wrong: f"{wrong.file} {wrong.name}")
def test_wrong_signal(wrong, tmp_path):
    (tmp_path / wrong.file).write_bytes(wrong.content)
    text = history(MEASURED, file=f'"{wrong.file}"')(RIGHT) + wrong.keys
    (tmp_path / "my.toml").write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        prepare_histories(load_joint(tmp_path / "my.toml").analysis.history, 175.0)
    message = str(caught.value).replace(str(tmp_path), "")
    assert_says(message, ("analysis.history 'measured'", *wrong.says), 1)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (RIGHT.encode("utf-16"), ("not UTF-8 text", "UTF-16", "save it as UTF-8")),
        (RIGHT.replace("Right", "für").encode("latin-1"), ("not UTF-8 text (line 1)", "encoding")),
        (b"\x89PNG\r\n\x1a\n\x00\x00", ("not UTF-8 text (line 1)",)),
        (b"PK\x03\x04", ("not valid TOML: line 1",)),
    ],
)
def test_other_kinds_of_file(content, says, tmp_path):
    (tmp_path / "my.toml").write_bytes(content)
    with pytest.raises(InputError) as caught:
        load_joint(tmp_path / "my.toml")
    assert_says(str(caught.value), says, 1)


def test_a_mark_of_the_editor_at_the_start_is_no_mistake(tmp_path):
    (tmp_path / "my.toml").write_bytes(b"\xef\xbb\xbf" + RIGHT.encode().replace(b"\n", b"\r\n"))
    assert load_joint(tmp_path / "my.toml").beams.length == 0.2515
