"""An interrupted run of many problems says how far it came, and its log that it is not complete."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from lcpcli.cli.request import Request

Lcp = Callable[..., Any]


def interrupt(*_: Any, **__: Any) -> Any:
    raise KeyboardInterrupt


def test_log_of_problems_that_have_changed_is_not_complete_once_one_of_them_is_interrupted(
    lcp: Lcp, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    files = [f"p{i}.json" for i in range(4)]
    for name in files:
        Path(name).write_text('{"M": [[2]], "q": [-1]}')
    assert lcp("solve", *files, "-o", "log.jsonl").code == 0
    for name in files[1:3]:
        Path(name).write_text('{"M": [[2]], "q": [-3]}')
    with monkeypatch.context() as patch:
        patch.setattr(Request, "run", interrupt)
        outcome = lcp("solve", *files, "--resume", "log.jsonl")
    told = "lcp: 2 of 4 problems: 2 solved; interrupted; go on with --resume log.jsonl\n"
    assert (outcome.code, outcome.err) == (130, told)
    assert "complete" not in Path("log.jsonl").read_text()
    assert lcp("solve", *files, "-o", "log.jsonl").code == 2
    assert lcp("solve", *files, "--resume", "log.jsonl").err == "lcp: 4 problems: 4 solved\n"
    lines = Path("log.jsonl").read_text().splitlines()
    assert sorted((json.loads(line)["file"], json.loads(line)["z"][0]) for line in lines) == [
        (name, z) for name, z in zip(files, (0.5, 1.5, 1.5, 0.5), strict=True)
    ]
    assert [line.endswith('"complete": true}') for line in lines] == [False, False, False, True]


@pytest.mark.parametrize("problem", ["p.json", "-"])
def test_summary_of_an_interrupted_run_says_of_how_many_unless_it_would_have_to_wait(
    problem: str, lcp: Lcp, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("p.json").write_text('{"M": [[2]], "q": [-1]}')
    Path("M.csv").write_text("2,1\n1,2\n")
    Path("q.csv").write_text("a,b,c\n-1,-2,-3\n-1,1,2\n")
    run, left = Request.run, iter([1])
    monkeypatch.setattr(Request, "run", lambda *given, **named: run(*given, **named) if any(left) else interrupt())
    outcome = lcp("solve", "p.json", "p.json", problem, "M.csv", "q.csv")
    number = "1 problem" if problem == "-" else "1 of 6 problems"
    told = f"lcp: {number}: 1 solved; interrupted; with -o FILE.jsonl it could be resumed\n"
    assert (outcome.code, outcome.err) == (130, told)
