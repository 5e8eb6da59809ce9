"""What lcp bench refuses in one line, before it measures or writes: mistakes, and a file that another run writes."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lcpcli.bench import record as records
from lcpcli.bench.report import render
from lcpcli.files.atomic_write import reserve

from . import bench_problems

Lcp = Callable[..., Any]
REFUSED = {
    "quik": "did you mean quick?",
    "nothing-like-it": "choose one of quick",
    "path": "path: is neither a suite nor a file; run tests/benchmarks/paths.py of the source instead",
    "missing.json": "missing.json: no such file",
    "-": "standard input",
    "--peer quantecom": "did you mean quantecon?",
    "--method newtom": "'newtom'",
    "--time-limit 0": "--time-limit",
    "--time-limit inf": "--time-limit",
    "--accept 2": "--accept",
    "--budget -1": "--budget",
    "--tol nan": "--tol",
    "-o r.xlsx": "r.xlsx",
    "-o /nowhere/r.json": "/nowhere",
    "--plot r.gif": "--plot",
    "--resume r.json": "no such file",
    "--resume r.json quick": "SUITE: has no effect with --resume",
    "--resume r.json --method auto": "--method: has no effect with --resume",
    "--resume r.json --budget 1": "--budget: has no effect with --resume",
}


@pytest.mark.parametrize("arguments", REFUSED)
def test_bad_usage_is_reported_in_one_line(
    arguments: str, lcp: Lcp, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    outcome = lcp("bench", *arguments.split())
    assert (outcome.code, outcome.out, outcome.err.count("\n")) == (2, "", 1)
    assert REFUSED[arguments] in outcome.err
    assert not list(tmp_path.iterdir())


def test_problem_is_not_overwritten(tmp_path: Path, lcp: Lcp) -> None:
    (file,) = bench_problems.write(tmp_path, "one")
    content = Path(file).read_text()
    outcome = lcp("bench", file, "-o", file)
    assert outcome.code == 2
    assert "holds the problem" in outcome.err
    assert Path(file).read_text() == content


@pytest.mark.skipif(sys.platform == "win32", reason="no such locks")
@pytest.mark.parametrize("link", [False, True])
def test_bench_that_another_run_writes_is_left_to_it(link: bool, tmp_path: Path, lcp: Lcp) -> None:
    files = bench_problems.write(tmp_path, "one", "two")
    output = name = tmp_path / "r.json"
    if link:
        name = tmp_path / "link.json"
        name.symlink_to(output)
    bench = ("bench", *files, "--budget", "0", "--method", "auto", "-o", str(name), "-q")
    with reserve([str(output)]):
        outcome = lcp(*bench)
        assert (outcome.code, outcome.err.count("\n")) == (2, 1)
        assert f"{name}: is being written by another run" in outcome.err
    assert lcp(*bench).code == 0
    with reserve([str(output)]):
        assert lcp("bench", "--resume", str(name), "-q").code == 0  # nothing is left, so that nothing is written
    record = records.read(str(output))
    del record.measurements[1:]
    output.write_text(render(record, "json", None, False))
    with reserve([str(output)]):
        assert "is being written by another run" in lcp("bench", "--resume", str(name), "-q").err
    assert lcp("bench", "--resume", str(name), "-o", str(output), "-q").code == 0
    assert len(records.read(str(output)).measurements) == len(files)
    assert not [*tmp_path.glob(".*")]
