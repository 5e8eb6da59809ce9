"""Results of ill-posed problems on the command line: what is said, and what `lcp check` makes of it."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest


@pytest.mark.parametrize("n", [8, 30])
def test_of_an_ill_posed_problem_the_proof_stands_and_the_solution_does_not(
    n: int, lcp: Callable[..., Any], tmp_path: Path
) -> None:
    """Weights in a row whose rounding leaves a solution: they are chosen so that the exact pivots are positive."""
    M = 2.2 * np.eye(n) - np.diag(np.full(n - 1, 1.1), 1) - np.diag(np.full(n - 1, 1.1), -1)
    M[0, 0], M[-1, -1] = 1.1, np.nextafter(1.1, 2)
    (tmp_path / "p.json").write_text(json.dumps({"M": M.tolist(), "q": [-1.0] + [0.0] * (n - 1)}))
    solved = lcp("solve", str(tmp_path / "p.json"), "-o", str(tmp_path / "result.json"))
    result = json.loads((tmp_path / "result.json").read_text())
    assert (solved.code, result["status"], result["solved"]) == (1, "ill_posed", False)
    assert result["certificate"]["kind"] == "farkas"
    assert lcp("check", str(tmp_path / "p.json"), str(tmp_path / "result.json")).code == 0
    (tmp_path / "z.json").write_text(json.dumps(result["z"]))
    assert lcp("check", str(tmp_path / "p.json"), str(tmp_path / "z.json")).code == 1
