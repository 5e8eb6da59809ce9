"""Documents that are kept in a folder: what a test prints has to be the same text.

A change that is meant to change them writes them again: LCP_WRITE_DOCUMENTS=1 pytest FILE.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

from lcpcli.version import VERSION

FOLDER = Path(__file__).with_name("documents")


def assert_as_before(name: str, text: str) -> None:
    """Compare a text with the document of this name, but for the version and the last digits of numbers."""
    text = re.sub(r"-?\d+\.\d{10,}(e-\d+)?", lambda number: f"{round(float(number[0]), 9) + 0.0:g}", text)
    text = re.sub(r"\d\.\de\+1[6-9]", "HUGE", text)  # condition numbers of matrices that are singular up to rounding
    text = text.replace(VERSION, "VERSION")
    document = FOLDER / f"{name}.txt"
    if os.environ.get("LCP_WRITE_DOCUMENTS"):
        document.write_text(text, encoding="utf-8")
    assert text == document.read_text(encoding="utf-8")
