"""Programs in files with the suffix .lp, in the LP format unless their content shows
that it is MPS."""

from __future__ import annotations

from typing import Any

from lcpcli.files.formats import Number
from lcpcli.formulations.quadratic_program import mps_format


def fields(content: bytes, number: Number = float) -> dict[str, Any]:
    return mps_format.fields(content, number, "in the LP format")
