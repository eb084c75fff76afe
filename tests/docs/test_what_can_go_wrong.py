"""The page of messages quotes what the program says, and leaves out no kind of it."""

from __future__ import annotations

import ast
import re

import pytest
from conftest import ROOT

from microslip import errors
from microslip.cli import messages

PAGE = (ROOT / "docs" / "what-can-go-wrong.md").read_text("utf-8")
SOURCES = [ast.parse(p.read_text("utf-8")) for p in sorted((ROOT / "src").rglob("*.py"))]
OURS = re.compile(r"^(?:`\w+Error`|\*\*.*?\*\*|\|).*", re.MULTILINE)


def said(node: ast.AST) -> str:
    """Text of a string as it is written, with … where something is put in."""
    if isinstance(node, ast.JoinedStr):
        return "".join(v.value if isinstance(v, ast.Constant) else "…" for v in node.values)
    return node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else ""


TEXTS = [text for tree in SOURCES for node in ast.walk(tree) if (text := said(node))]
QUOTED = sorted(
    {
        quoted
        for line in OURS.findall(PAGE)
        for quoted in re.findall(r"`([^`]+)`", line)
        if " " in quoted
        and not re.match(r"microslip |error: |\[|Failure|closed|interface_m", quoted)
    }
)


@pytest.mark.parametrize("message", QUOTED)
def test_quoted_message_is_in_the_source(message):
    pieces = [piece.strip() for piece in message.split("…") if piece.strip()]
    assert any(all(piece in text for piece in pieces) for text in TEXTS)


def test_every_error_is_explained():
    kinds = [name for name in vars(errors) if name.endswith("Error")]
    assert [name for name in kinds if f"`{name}`" not in PAGE and f".{name}`" not in PAGE] == []


def test_every_exit_code_is_explained():
    codes = (messages.FAILED, messages.USER_ERROR, messages.UNANSWERED, messages.INTERRUPTED, 0)
    assert [code for code in codes if f"\n| {code} |" not in PAGE] == []


def test_every_stage_that_can_fail_is_explained():
    calls = (n for tree in SOURCES for n in ast.walk(tree) if isinstance(n, ast.Call))
    stages = {
        call.args[0].value
        for call in calls
        if getattr(call.func, "id", "") == "Failure" and isinstance(call.args[0], ast.Constant)
    }
    paper = {name for name in stages if name.startswith("fig")}
    assert {s for s in stages - paper if f"`{s}`" not in PAGE} == set()
