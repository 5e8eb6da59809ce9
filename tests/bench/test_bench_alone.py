"""Two runs of lcp bench with one file: the second one refuses, so that the measurements of neither vanish."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lcpcli.bench import record as records
from lcpcli.files.atomic_write import reserve

from . import bench_problems

Lcp = Callable[..., Any]
FAST = ("--budget", "0")


@pytest.mark.skipif(sys.platform == "win32", reason="no such locks")
@pytest.mark.parametrize("link", [False, True])
def test_bench_that_another_run_writes_is_left_to_it(link: bool, tmp_path: Path, lcp: Lcp) -> None:
    files = bench_problems.write(tmp_path, "one", "two", "three", "none")
    output = name = tmp_path / "r.json"
    if link:
        name = tmp_path / "link.json"
        name.symlink_to(output)
    with reserve([str(output)]):
        outcome = lcp("bench", *files, *FAST, "--method", "auto", "-o", str(name))
        assert (outcome.code, len(outcome.err.splitlines())) == (2, 1)
        assert f"{name}: is being written by another run" in outcome.err
    assert lcp("bench", *files, *FAST, "--method", "auto", "-o", str(name), "-q").code == 0
    with reserve([str(output)]):
        assert lcp("bench", "--resume", str(name), "-q").code == 0  # nothing is left, so that nothing is written
    record = records.read(str(output))
    del record.measurements[1:]
    output.write_text(records.to_json(record))
    with reserve([str(output)]):
        assert "is being written by another run" in lcp("bench", "--resume", str(name), "-q").err
    assert lcp("bench", "--resume", str(name), "-o", str(output), "-q").code == 0
    assert len(records.read(str(output)).measurements) == len(files)
    assert not [*tmp_path.glob(".*")]


def test_a_negative_budget_of_sequences_is_refused(lcp: Lcp) -> None:
    outcome = lcp("bench", "sequences", "--budget", "-1")
    assert (outcome.code, outcome.out) == (2, "")
    assert outcome.err == "lcp: --budget: -1.0 is out of range; it must be: seconds >= 0\n"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--method", "shi"), "--method: has no effect on lcp bench sequences"),
        (("--peer", "piqp"), "--peer: has no effect"),
        (("--plot", "a.svg"), "--plot: has no effect"),
        (("quick",), "sequences: is measured alone"),
    ],
)
def test_what_has_no_effect_on_sequences_is_refused(arguments: tuple[str, ...], words: str, lcp: Lcp) -> None:
    outcome = lcp("bench", "sequences", *arguments)
    assert outcome.code == 2
    assert words in outcome.err


def test_the_suite_that_is_gone_says_what_to_run_instead(lcp: Lcp) -> None:
    outcome = lcp("bench", "path")
    assert (outcome.code, outcome.err) == (
        2,
        "lcp: path: is neither a suite nor a file; run tests/benchmarks/paths.py of the source instead\n",
    )
