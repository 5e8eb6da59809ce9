"""lcp bench: what it keeps and counts, how it ends, goes on after it was cut off, and
what it refuses before that."""

import json
import os
import sys
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from lcpcli.bench import record as records
from lcpcli.bench.report import render
from lcpcli.files.atomic_write import reserve
from lcpcli.peers.registry import Claim

from ..cli.conftest import assert_refused
from . import bench_problems


@pytest.fixture
def output(tmp_path):
    return tmp_path / "r.json"


@pytest.fixture
def bench(lcp, tmp_path, output):
    """Run lcp bench on problems of these names with `auto`, and more; what it came to,
    and its record."""

    def run(names, more=""):
        files = bench_problems.write(tmp_path, *names.split())
        line = f"bench {' '.join(files)} --budget 0 --method auto {more} -o {output}"
        outcome = lcp(line)
        return outcome, records.read(str(output))

    return run


def keys(record):
    return [row.key for row in record.measurements]


def test_record_holds_what_was_measured(bench):
    outcome, record = bench("one two three none", "--method shi")
    assert outcome.code == 0
    assert outcome.err == "lcp: 7 of 8 measurements succeeded\n"
    assert keys(record) == [
        (f"{p}.json", m)
        for p in ("one", "two", "three", "none")
        for m in ("auto", "shi")
    ]
    rows = {row.key: row for row in record.measurements}
    auto = rows["one.json", "auto"]
    none = rows["none.json", "auto"]
    unsolved = rows["none.json", "shi"]
    assert (auto.success, auto.false_success, auto.claimed) == (True, False, True)
    assert (auto.status, auto.kind, auto.curve_of) == ("solved", "method", "error")
    assert auto.curve[-1][2] == auto.error < 1e-9
    assert min(auto.seconds) > 0
    assert rows["three.json", "auto"].curve_of == "error"
    assert (none.status, none.success, none.claimed) == ("infeasible", True, True)
    assert (unsolved.curve_of, unsolved.error, unsolved.success) == (
        "residual",
        None,
        False,
    )
    assert record.versions["numpy"] == np.__version__
    assert record.machine.cores == os.cpu_count()
    assert record.options.accept == 1e-6


def test_other_solvers_may_lie_take_some_problems_or_be_missing(
    bench, output, lcp, monkeypatch
):
    """A false success sets the exit code; an excluded problem is no failure, and is
    listed with its reason."""

    def excludes(problem):
        return "takes no verdicts" if problem.verdict else ""

    def solve(problem):
        return Claim(problem.solutions[0], True, 0.002, "")

    bench_problems.install(monkeypatch, "picky", solve, excludes)
    bench_problems.install(monkeypatch, "absent", bench_problems.silent, version=None)
    outcome, record = bench("one none", "--peer picky --peer absent")
    assert outcome.code == 0
    assert (
        outcome.err.splitlines()[0]
        == "lcp: not installed, left out: absent; pip install absent"
    )
    assert record.peers == ["picky"]
    assert record.missing == ["absent"]
    row = record.measurements[-1]
    assert (row.status, row.seconds, row.claimed) == ("excluded", [], False)
    bench_problems.install(monkeypatch, "liar", bench_problems.liar)
    outcome, record = bench("one two none", "--peer liar --peer picky")
    assert outcome.code == 1
    assert "; 3 false claims" in outcome.err
    lied = [row for row in record.measurements if row.solver == "liar"]
    assert [
        (row.claimed, row.success, row.false_success, row.kind) for row in lied
    ] == 3 * [(True, False, True, "peer")]
    shown = lcp(f"bench --resume {output}")
    assert shown.code == 1
    assert shown.out.count("wrong: fine") == 3
    assert "takes no verdicts" in shown.out


def test_acceptance_level_decides(bench, monkeypatch):
    def rough(problem):
        return Claim(problem.solutions[0] * (1 + 1e-5), True, 0.001, "rough")

    bench_problems.install(monkeypatch, "rough", rough)
    assert bench("one", "--peer rough")[0].code == 1
    assert bench("one", "--peer rough --accept 1e-3")[0].code == 0


def test_interrupted_bench_keeps_its_rows(bench, output, lcp, monkeypatch):
    kept = []  # in the file, while the bench goes on

    def impatient(problem):
        kept.append(len(records.read(str(output)).measurements))
        if len(kept) == 2:
            raise KeyboardInterrupt
        return bench_problems.silent(problem)

    bench_problems.install(monkeypatch, "impatient", impatient)
    outcome, done = bench("one two three", "--peer impatient")
    assert outcome.code == 130
    assert kept == [1, 3]
    assert "interrupted after 3 of 6 measurements" in outcome.err
    assert keys(done) == [
        ("one.json", "auto"),
        ("one.json", "impatient"),
        ("two.json", "auto"),
    ]
    assert lcp(f"bench --resume {output} -q").code == 0
    whole = records.read(str(output))
    assert whole.measurements[:3] == done.measurements
    assert keys(whole) == [
        (f"{p}.json", s) for p in ("one", "two", "three") for s in ("auto", "impatient")
    ]


def test_bench_that_was_killed_goes_on_behind_the_last_whole_line(
    bench, output, lcp, monkeypatch
):
    """Each measurement is added to the end of the file; nothing that is there is
    written again before all are known."""
    texts = []

    def watching(problem):
        texts.append(output.read_bytes())
        return bench_problems.silent(problem)

    bench_problems.install(monkeypatch, "watching", watching)
    _, done = bench("one two three", "--peer watching")
    assert [text.count(b"\n") for text in texts] == [2, 4, 6]
    assert all(later.startswith(text) for text, later in pairwise(texts))
    whole = output.read_bytes()
    assert whole.count(b"\n") == 1
    output.write_bytes(texts[-1][:-20])
    assert len(records.read(str(output)).measurements) == 4
    assert lcp(f"bench --resume {output} -q").code == 0
    assert keys(records.read(str(output))) == keys(done)


def test_what_was_measured_elsewhere_is_shown_as_it_is_but_not_resumed(
    bench, output, lcp
):
    _, record = bench("one")
    object.__setattr__(record.machine, "cores", 1000)
    text = render(record, "json", None, False)
    output.write_text(text)
    assert (
        lcp(f"bench --resume {output} --format json").out == text == output.read_text()
    )
    output.write_text(json.dumps({**json.loads(text), "measurements": []}))
    assert_refused(lcp(f"bench --resume {output}"), "--resume: was measured with cores")


def test_progress_is_shown_on_a_terminal_alone(tmp_path, lcp, monkeypatch):
    files = bench_problems.write(tmp_path, "one")
    line = f"bench {' '.join(files)} --budget 0 --method auto --method lemke"
    assert lcp(line).err == ""
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr("lcpcli.cli.terminal.PATIENCE", 0.0)
    monkeypatch.setattr("sys.stderr.isatty", lambda: True, raising=False)
    shown = lcp(line).err
    assert not [
        word
        for word in ("one.json: auto", "one.json: lemke", "1/2")
        if word not in shown
    ]
    quiet = lcp(f"{line} -q")
    assert quiet.code == 0
    assert quiet.out == ""
    assert quiet.err == ""


def test_a_lock_that_cannot_be_removed_stays(tmp_path, monkeypatch):
    """Some systems remove no file that is open."""

    def unlink(*_, **__):
        raise PermissionError

    monkeypatch.setattr(Path, "unlink", unlink)
    with reserve([str(tmp_path / "r.json")]):
        pass
    assert [file.name for file in tmp_path.iterdir()] == [".r.json.lock"]


@pytest.mark.skipif(sys.platform == "win32", reason="no such locks")
def test_bench_that_another_run_writes_is_left_to_it_behind_a_link_too(tmp_path, lcp):
    files = bench_problems.write(tmp_path, "one", "two")
    output, name = tmp_path / "r.json", tmp_path / "link.json"
    name.symlink_to(output)
    bench = f"bench {' '.join(files)} --budget 0 --method auto -o {name} -q"
    with reserve([str(output)]):
        assert_refused(lcp(bench), f"{name}: is being written by another run")
    assert lcp(bench).code == 0
    with reserve([str(output)]):
        # Nothing is left, so that nothing is written.
        assert lcp(f"bench --resume {name} -q").code == 0
    record = records.read(str(output))
    del record.measurements[1:]
    output.write_text(render(record, "json", None, False))
    with reserve([str(output)]):
        assert "is being written by another run" in lcp(f"bench --resume {name} -q").err
    assert not [*tmp_path.glob(".*")]


def test_a_missing_problem_is_refused_before_a_bench_goes_on(
    bench, lcp, output, tmp_path
):
    bench("one none")
    record = json.loads(output.read_text())
    output.write_text(begun := json.dumps(record | {"measurements": []}))
    (tmp_path / "none.json").unlink()
    outcome = lcp(f"bench --resume {output}")
    assert_refused(outcome, "none.json: ")
    assert output.read_text() == begun
