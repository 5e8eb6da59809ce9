"""Standard output that is full, closed or not wanted any more: one line or none, never a traceback, nothing lost."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lcpcli.files import contents

EXAMPLE = contents.shipped_path("paper-example-1.json")


def shell(script: str) -> subprocess.CompletedProcess[str]:
    """Run a shell script in which $LCP is the command."""
    environment = {"LCP": f"{sys.executable} -m lcpcli", "PATH": "/usr/bin:/bin"}
    return subprocess.run(["bash", "-c", script], capture_output=True, text=True, env=environment, check=False)


@pytest.mark.slow("each in a process of its own")
@pytest.mark.parametrize("command", [f"solve {EXAMPLE}", "compare --format json", "--help"])
def test_full_device_is_reported_in_one_line(command: str) -> None:
    done = shell(f"$LCP {command} > /dev/full")
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert "standard output cannot be written (No space left on device)" in done.stderr


@pytest.mark.slow("each in a process of its own")
def test_closed_standard_output_leaves_the_exit_code() -> None:
    done = shell(f"$LCP solve {EXAMPLE} >&-")
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.slow("each in a process of its own")
def test_reader_that_has_enough_is_no_failure_to_solve() -> None:
    done = shell("$LCP compare --every 1 | true; echo ${PIPESTATUS[0]}")
    assert done.stdout in ("141\n", "0\n")  # 0 if the reader was still there
    assert done.stderr == ""


@pytest.mark.slow("each in a process of its own")
def test_first_line_can_be_had_alone() -> None:
    done = shell("$LCP compare --every 1 | head -1")
    assert done.stdout.startswith("paper-example-1")
    assert done.stderr == ""


def test_problem_is_not_overwritten_by_its_result(lcp: Callable[..., Any], tmp_path: Path) -> None:
    file = tmp_path / "own.json"
    file.write_text('{"M": [[2]], "q": [-1]}')
    outcome = lcp("solve", str(file), "-o", str(tmp_path / ".." / tmp_path.name / "own.json"))
    assert outcome.code == 2
    assert "holds the problem" in outcome.err
    assert file.read_text() == '{"M": [[2]], "q": [-1]}'


@pytest.mark.parametrize("method", ["shi", "fixed-point"])
@pytest.mark.parametrize(
    "text",
    [
        '{"M": [[1]], "q": [-1], "x0": [1e308]}',
        '{"M": [[1e308, 1e308], [-1e308, 1e308]], "q": [-1, -1]}',
        '{"M": [[1e-320, 0], [0, 1e-320]], "q": [1e308, -1]}',
        '{"M": [[0]], "q": [0]}',
        '{"M": [[0, 0], [0, 0]], "q": [-1, 1e300]}',
        '{"M": [[1e-300]], "q": [-1e300]}',
    ],
)
def test_numbers_at_the_ends_of_double_range_end_in_a_status(
    text: str, method: str, lcp: Callable[..., Any], tmp_path: Path
) -> None:
    file = tmp_path / "own.json"
    file.write_text(text)
    for form in ("table", "json"):
        outcome = lcp("solve", str(file), "--method", method, "--format", form, "--max-iterations", "300")
        assert outcome.code in (0, 1)
        assert outcome.err == ""
