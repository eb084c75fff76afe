"""What the check of the pages would let through is planted, and must be found."""

from __future__ import annotations

import shutil
import subprocess
import sys

import pytest
from conftest import ROOT

PAGE = """<html><body><article>
<p>Some $x_1$ left</p><span class="math">\\(x\\)</span><img src="nothing.png">
<div style="width:2000px">wide</div><script src="https://elsewhere.example/mathjax.js"></script>
<script>throw new Error("boom")</script></article></body></html>"""


@pytest.mark.skipif(shutil.which("chromium") is None, reason="no Chromium")
def test_every_fault_of_a_page_is_said(tmp_path):
    pytest.importorskip("playwright")
    (tmp_path / "page.html").write_text(PAGE)
    script = ROOT / "docs" / "_scripts" / "check_pages.py"
    done = subprocess.run([sys.executable, script, tmp_path], capture_output=True, text=True)
    assert done.returncode == 1, done.stderr
    for fault in (
        "asks the network for https://elsewhere.example/mathjax.js",
        "script: boom",
        "at 1440 px: 1 equations are not drawn",
        "bare TeX: Some $x_1$ left",
        "no picture: nothing.png",
        "at 820 px: 1188 px wider than the window",
    ):
        assert fault in done.stdout
