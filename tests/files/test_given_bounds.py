"""Bounds on the command line take the place of those of a problem, of which nothing else holds then."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any


def test_what_is_known_of_the_problem_is_not_taken_for_known_of_other_bounds(
    lcp: Callable[..., Any], tmp_path: Path
) -> None:
    file = tmp_path / "p.json"
    file.write_text(json.dumps({"M": [[1]], "q": [-2], "solution": [2]}))
    for options, z, error in (((), 2, 0), (("--upper", "1"), 1, None), (("--lower", "3"), 3, None)):
        found = json.loads(lcp("solve", str(file), *options, "--format", "json").out)
        assert (found["z"], found["error"]) == ([z], error)
    file.write_text(json.dumps({"M": [[-1]], "q": [-1], "verdict": "infeasible"}))
    assert "infeasible" in lcp("solve", str(file)).out
    assert "infeasible" not in lcp("solve", str(file), "--upper", "1").out
