"""Inputs that a mutation fuzzer has found to break the program once."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lcpcli.bench import recording as benching
from lcpcli.errors import OptionError, ProblemError
from lcpcli.files import beside, log, reading
from lcpcli.methods.registry import OMEGA
from lcpcli.options import EVERY, MAX_ITERATIONS, TOL, Option

from .conftest import Lcp, assert_refused


def array(values: Any) -> bytes:
    file = io.BytesIO()
    np.lib.format.write_array(file, np.array(values))
    return file.getvalue()


def archive(method: int = zipfile.ZIP_STORED, **members: bytes) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", method) as writing:
        for name, content in members.items():
            writing.writestr(f"{name}.npy", content)
    return file.getvalue()


def spoiled(content: bytes, found: bytes, other: bytes) -> bytes:
    assert found in content
    return content.replace(found, other, 1)


EYE = array([[1.0, 0.0], [0.0, 1.0]])
ARCHIVES = {
    "header-without-end": archive(M=spoiled(EYE, b"}", b"("), q=array([1.0, 1.0])),
    "header-with-open-text": archive(M=spoiled(EYE, b"'descr'", b"'''escr"), q=array([1.0, 1.0])),
    "header-of-zeros": archive(M=array(np.zeros(60)), q=spoiled(array(np.zeros(300)), b"{'descr'", b"\0" * 8)),
    "compression-broken": spoiled(
        archive(zipfile.ZIP_LZMA, M=array(np.arange(400.0).reshape(20, 20))), b"\x5d\0\0", b"\xff\xff\xff"
    ),
}


@pytest.mark.parametrize("content", ARCHIVES.values(), ids=ARCHIVES)
@pytest.mark.parametrize(
    "read", [reading.read, lambda path: beside.read_candidates(path, 2, log.Sought())], ids=["problem", "answer"]
)
def test_broken_archive_is_reported_in_one_short_line(
    read: Callable[[str], Any], content: bytes, tmp_path: Path
) -> None:
    file = tmp_path / "p.npz"
    file.write_bytes(content)
    with pytest.raises(ProblemError) as fault:
        read(str(file))
    message = str(fault.value).removeprefix(str(file))
    assert "numpy.savez" in message
    assert len(message) < 250
    assert "\n" not in message


def test_array_that_python_2_has_written_is_read_without_a_warning(tmp_path: Path) -> None:
    file = tmp_path / "p.npz"
    file.write_bytes(archive(M=spoiled(EYE, b"(2, 2), }  ", b"(2L, 2L), }"), q=array([1.0, 1.0])))
    assert reading.read(str(file)).M.tolist() == [[1, 0], [0, 1]]


@pytest.mark.parametrize(
    ("name", "content", "fault"),
    [
        ("p.mtx", f"%%MatrixMarket matrix array real general\n1 1\n{'9' * 10**6}x\n", "line 3: is '999"),
        ("p.json", "{" + ",".join(f'"{k}": 0' for k in range(10**5)) + ', "99999": 0}', "99999: occurs twice"),
    ],
    ids=["million-digits", "hundred-thousand-keys"],
)
def test_long_file_is_refused_in_a_time_in_proportion(name: str, content: str, fault: str, tmp_path: Path) -> None:
    """In hours if the time grew with the square of the length."""
    file = tmp_path / name
    file.write_text(content)
    with pytest.raises(ProblemError, match=fault):
        reading.read(str(file))


@pytest.mark.parametrize("option", [MAX_ITERATIONS, EVERY, TOL, OMEGA], ids=lambda option: option.name)
def test_number_beyond_all_doubles_is_out_of_range(option: Option) -> None:
    for number in (10**400, -(10**5000)):
        with pytest.raises(OptionError, match="is too large"):
            option.check(number)


@pytest.mark.usefixtures("folder")
def test_whole_number_beyond_all_doubles_is_reported_in_one_line(lcp: Lcp) -> None:
    told = "lcp: --every: is too large; it must be: whole number >= 1\n"
    assert_refused(lcp("solve", "good.json", "--every", "9" * 400), told)


def test_exact_proof_is_found_where_denominators_are_beyond_all_doubles(lcp: Lcp, tmp_path: Path) -> None:
    file = tmp_path / "p.json"
    file.write_text('{"M": [[0, 0], [0, 0]], "q": [-1e-320, 1e-320]}')
    outcome = lcp("solve", str(file), "--method", "shi", "--exact", "--format", "json")
    assert (outcome.code, outcome.err) == (3, "")
    assert json.loads(outcome.out)["exact"]["y"] is not None


@pytest.mark.usefixtures("folder")
def test_missing_problem_of_a_resumed_bench_is_reported_before_any_work(
    lcp: Lcp, monkeypatch: pytest.MonkeyPatch
) -> None:
    lcp("bench", "good.json", "none.json", "--method", "newton", "--budget", "0", "-q", "-o", "record.json")
    record = json.loads(Path("record.json").read_text())
    Path("record.json").write_text(json.dumps(record | {"measurements": []}))
    Path("none.json").unlink()
    monkeypatch.setattr(benching, "_measure", lambda *_: pytest.fail("measured in vain"))
    assert_refused(lcp("bench", "--resume", "record.json"), "lcp: none.json: no such file")


def test_zero_that_is_stored_is_a_zero_to_the_classes(lcp: Lcp, tmp_path: Path) -> None:
    M = {"format": "coo", "shape": [2, 2], "rows": [0, 0], "cols": [0, 1], "values": [1, 0]}
    file = tmp_path / "p.json"
    file.write_text(json.dumps({"M": M, "q": [-1, 0]}))
    outcome = lcp("inspect", str(file), "--format", "json")
    assert (outcome.code, outcome.err) == (0, "")
    assert json.loads(outcome.out)["classes"]["symmetric"]["verdict"] == "yes"
