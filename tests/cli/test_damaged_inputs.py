"""Damaged files, unusual numbers, closed outputs and signals: one line, and what is known is kept."""

from __future__ import annotations

import io
import json
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lcpcli import Problem, Status, run
from lcpcli.methods.registry import METHODS

from ..files.nl_writing import model
from .conftest import MAIN, Lcp, assert_refused, python

EYE: dict[str, Any] = {
    "csr": {"data": [1.0, 1.0], "indices": [0, 1], "indptr": [0, 1, 2]},
    "csc": {"data": [1.0, 1.0], "indices": [0, 1], "indptr": [0, 1, 2]},
    "bsr": {"data": [[[1.0]], [[1.0]]], "indices": [0, 1], "indptr": [0, 1, 2]},
    "coo": {"data": [1.0, 1.0], "row": [0, 1], "col": [0, 1]},
    "dia": {"data": [[1.0, 1.0]], "offsets": [0]},
}
LINEAR = model(1, [((4, 1), {0: 1}, 0)], [(3,)])
DAMAGED = [
    ("csr", {"indptr": [0, 10**7, 0]}),
    ("csr", {"indptr": [0, 3, 2]}),
    ("csr", {"indptr": [1, 1, 2]}),
    ("csc", {"indptr": [0, 1, -1]}),
    ("csc", {"indices": [0, 2]}),
    ("bsr", {"indices": [0, -1]}),
    ("bsr", {"indptr": [0, 1, 2**40]}),
    ("coo", {"row": [0, 2**33]}),
    ("coo", {"col": [0]}),
    ("dia", {"offsets": [-5]}),
    ("csr", {"shape": [np.inf, 2.0]}),
]


def archive(form: str, **changes: Any) -> bytes:
    file = io.BytesIO()
    parts = {"shape": [2, 2], **EYE[form], "q": [-1.0, -1.0], "format": form.encode(), **changes}
    np.savez(file, **{key: np.array(value) for key, value in parts.items()})
    return file.getvalue()


@pytest.mark.parametrize(("form", "changes"), DAMAGED)
def test_index_arrays_that_do_not_fit_are_refused_before_scipy_reads_them(
    form: str, changes: dict[str, Any], lcp: Lcp, folder: Path
) -> None:
    (folder / "whole.npz").write_bytes(archive(form))
    assert lcp("solve", "whole.npz").code == 0
    (folder / "damaged.npz").write_bytes(archive(form, **changes))
    for command in ("solve", "inspect"):
        assert_refused(lcp(command, "damaged.npz"), "damaged.npz", "inconsistent parts")


@pytest.mark.parametrize("line", [1, 7])
def test_a_count_of_thousands_of_digits_in_a_model_is_refused(line: int, lcp: Lcp, folder: Path) -> None:
    lines = LINEAR.split(b"\n")
    lines[line] = b" " + 4400 * b"1" + lines[line].lstrip().lstrip(b"0123456789")
    (folder / "long.nl").write_bytes(b"\n".join(lines))
    assert_refused(lcp("solve", "long.nl"), f"long.nl: line {line + 1}")


def test_a_number_longer_than_cells_of_csv_may_be_is_read(lcp: Lcp, folder: Path) -> None:
    (folder / "M.csv").write_text("2,1\n1,2\n")
    (folder / "q.csv").write_text(f"-1.{140_000 * '0'}\n-1\n")
    assert lcp("solve", "M.csv", "q.csv", "-q").code == 0


@pytest.mark.parametrize("name", ["threads", "walkers"])
def test_numbers_that_no_library_takes_are_out_of_range(name: str, lcp: Lcp) -> None:
    method = ["--method", "reflections"] if name == "walkers" else []
    assert_refused(lcp("solve", "bimatrix", *method, f"--{name}", str(10**29)), f"--{name}", "out of range")


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("least", [5e-324, 1e-310])
def test_subnormal_numbers_end_no_method_by_an_exception(method: str, least: float) -> None:
    M, q = [[0.0, 2 * least], [least, 0.0]], [-least, least]
    result = run(Problem(M, q), method=method, max_iterations=50, time_limit=5.0)
    assert isinstance(result.status, Status)


def test_closed_standard_output_is_an_error_only_where_it_is_written(tmp_path: Path) -> None:
    def closed(*arguments: str) -> subprocess.CompletedProcess[str]:
        return python(MAIN, *arguments, preexec_fn=lambda: os.close(1))

    refused = closed("solve", "paper-example-1")
    assert (refused.returncode, refused.stderr.count("\n")) == (2, 1)
    assert "standard output cannot be written" in refused.stderr
    assert closed("solve", "paper-example-1", "-o", str(tmp_path / "result.json")).returncode == 0
    assert closed("solve", "paper-example-1", "-q").returncode == 0


def test_a_refused_run_for_ampl_leaves_no_answer_of_an_earlier_one(lcp: Lcp, folder: Path) -> None:
    (folder / "stub.nl").write_bytes(LINEAR)
    assert lcp("stub", "-AMPL").code == 0
    assert (folder / "stub.sol").is_file()
    assert lcp("stub", "-AMPL", "speed=1").code == 2
    assert not (folder / "stub.sol").exists()


@pytest.mark.skipif(sys.platform == "win32", reason="has no such signals")
@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_a_signal_leaves_the_best_solution_so_far_and_a_bound(number: int, code: int, folder: Path) -> None:
    rng = np.random.default_rng(1)
    A, B = (np.round(rng.random((16, 16)) * 99).tolist() for _ in "AB")
    (folder / "game.json").write_text(json.dumps({"A": A, "B": B}))
    after = f"""
import os
from lcpcli.enumeration import optimum
own = optimum._Search.children
def children(search, *given):
    if search.value is not None and search.bound("time_limit") is not None:
        os.kill(os.getpid(), {int(number)})
    return own(search, *given)
optimum._Search.children = children
{MAIN}
"""
    done = python(after, "solve", "game.json", "--maximize", '"payoff of row"', "--format", "json", cwd=folder)
    assert (done.returncode, done.stderr) == (code, "")
    found = json.loads(done.stdout)
    assert found["status"] == "interrupted"
    assert found["value"] is not None
    assert found["bound"] >= found["value"]


@pytest.mark.skipif(sys.platform == "win32", reason="has no such signals")
def test_sigterm_reports_the_best_iterate(folder: Path) -> None:
    after = f"""
import os, signal
from lcpcli.solving import loop
own = loop.Loop._take
def take(run, iterate):
    if run.k == 3:
        os.kill(os.getpid(), signal.SIGTERM)
    return own(run, iterate)
loop.Loop._take = take
{MAIN}
"""
    done = python(after, "solve", "paper-example-2", "--method", "shi", "--format", "json", cwd=folder)
    assert (done.returncode, done.stderr, json.loads(done.stdout)["status"]) == (143, "", "interrupted")
