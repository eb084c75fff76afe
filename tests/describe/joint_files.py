"""The reference joint as a document, and the message a wrong one is refused with."""

from __future__ import annotations

import tomllib

import pytest
from conftest import ROOT

from microslip.describe.reading import parse_joint
from microslip.errors import InputError

EXAMPLE = ROOT / "examples" / "lap_joint.toml"


def example_document() -> dict:
    """Nested mappings of the reference joint, as `tomllib` makes them."""
    return tomllib.loads(EXAMPLE.read_text(encoding="utf-8"))


def refused(document: dict) -> str:
    with pytest.raises(InputError) as caught:
        parse_joint(document, "my.toml")
    message = str(caught.value)
    assert message.startswith("my.toml: ")
    assert "pydantic" not in message
    return message
