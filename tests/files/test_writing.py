"""What is written appears whole or not at all, with the permissions and the links that were there."""

from __future__ import annotations

import errno
import gzip
import json
import os
import resource
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

from lcpcli import Problem, read, write
from lcpcli.errors import LCPError, ProblemError
from lcpcli.files.atomic_write import write_whole

from ..conftest import Outcome
from ..small_problem import JSON, M, Q, numbers

EXAMPLE = Problem(M, Q, name="example")


@pytest.mark.parametrize("name", ["problem.txt", "problem", "problem.json.gz", "problem.mtx.gz", "json", ".csv"])
def test_no_file_is_written_in_an_unknown_format(tmp_path: Path, name: str) -> None:
    with pytest.raises(ProblemError, match=rf"{name}.*\.json.*\.csv"):
        write(EXAMPLE, str(tmp_path / name))
    assert list(tmp_path.iterdir()) == []


def test_a_new_file_has_the_usual_permissions_and_an_old_one_keeps_its_own(tmp_path: Path) -> None:
    path = tmp_path / "problem.json"
    before = os.umask(0o027)
    try:
        write(EXAMPLE, str(path))
        assert os.umask(0o027) == 0o027
    finally:
        os.umask(before)
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    for mode in (0o600, 0o664, 0o755):
        path.write_text("old")
        path.chmod(mode)
        write(EXAMPLE, str(path))
        assert numbers(read(str(path))) == (M, Q)
        assert stat.S_IMODE(path.stat().st_mode) == mode


def test_a_link_stays_a_link_to_what_is_written(tmp_path: Path) -> None:
    (tmp_path / "link.json").symlink_to("problem.json")
    write(EXAMPLE, str(tmp_path / "link.json"))
    assert (tmp_path / "link.json").readlink() == Path("problem.json")
    assert numbers(read(str(tmp_path / "problem.json"))) == (M, Q)


def test_a_file_of_the_longest_possible_name_is_written(tmp_path: Path) -> None:
    path = tmp_path / f"{'a' * 250}.json"
    write(EXAMPLE, str(path))
    assert [entry.name for entry in tmp_path.iterdir()] == [path.name]


@contextmanager
def full_disk() -> Iterator[None]:
    """No file can grow beyond a few bytes."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (8, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


@contextmanager
def refused_rename(error: BaseException) -> Iterator[None]:
    """No file can be put in the place of another."""

    def refuse(*_: object) -> None:
        raise error

    with pytest.MonkeyPatch.context() as patch:
        for owner, name in ((os, "replace"), (os, "rename"), (Path, "replace"), (Path, "rename")):
            patch.setattr(owner, name, refuse)
        yield


@pytest.mark.parametrize(
    ("failure", "error"),
    [
        (full_disk, LCPError),
        (lambda: refused_rename(OSError(errno.EIO, "Input/output error")), LCPError),
        (lambda: refused_rename(KeyboardInterrupt()), KeyboardInterrupt),
    ],
    ids=["full-disk", "refused-rename", "interrupt"],
)
def test_a_file_that_cannot_be_written_stays_as_it_was_and_a_new_one_is_not_left_behind(
    tmp_path: Path, failure: Callable[[], Any], error: type[BaseException]
) -> None:
    (tmp_path / "old.json").write_text("old")
    for name in ("old.json", "new.json", "problem.mtx", "problem.npz"):
        with pytest.raises(error), failure():
            write(EXAMPLE, str(tmp_path / name))
    assert {entry.name: entry.read_text() for entry in tmp_path.iterdir()} == {"old.json": "old"}


def test_of_a_pair_none_is_replaced_if_one_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "problem.mtx").write_text("old")
    (tmp_path / "problem.q.mtx").mkdir()
    with pytest.raises(LCPError, match=r"problem\.q\.mtx: is a directory"):
        write(EXAMPLE, str(tmp_path / "problem.mtx"))
    assert (tmp_path / "problem.mtx").read_text() == "old"


@pytest.fixture
def file(tmp_path: Path) -> str:
    (tmp_path / "problem.json").write_text(JSON[:-1] + ', "name": "half \\ud83d"}')
    return str(tmp_path / "problem.json")


def test_a_result_that_cannot_be_written_is_reported_in_one_line(
    lcp: Callable[..., Outcome], file: str, tmp_path: Path
) -> None:
    with refused_rename(OSError(errno.EIO, "Input/output error")):
        for output in (str(tmp_path / "result.json"), "/dev/full"):
            outcome = lcp("solve", file, "-o", output)
            assert outcome.err.startswith(f"lcp: {output}: cannot be written")
            assert (outcome.code, outcome.out, outcome.err.count("\n")) == (2, "", 1)
    assert [entry.name for entry in tmp_path.iterdir()] == ["problem.json"]


def test_a_device_is_written_to_and_not_replaced(lcp: Callable[..., Outcome], file: str) -> None:
    with refused_rename(AssertionError("the device would have been replaced")):
        outcome = lcp("solve", file, "-q", "-o", "/dev/null")
        write_whole("/dev/null", "text")
    assert outcome == Outcome(0, "", "")
    assert stat.S_ISCHR(Path("/dev/null").stat().st_mode)


def test_a_pipe_is_written_to_and_not_replaced_and_read_from(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe.json"
    os.mkfifo(pipe)
    reader = os.open(pipe, os.O_RDONLY | os.O_NONBLOCK)
    try:
        write(EXAMPLE, str(pipe))
        text = os.read(reader, 1 << 16)
    finally:
        os.close(reader)
    assert json.loads(text)["q"] == Q
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    reader, writer = os.pipe()
    try:
        os.write(writer, JSON.encode())
        os.close(writer)
        assert numbers(read(f"/dev/fd/{reader}")) == (M, Q)
    finally:
        os.close(reader)


@pytest.mark.parametrize("ending", ["md", "tex", "csv", "json", "txt"])
def test_a_name_that_is_no_unicode_does_not_lose_the_result(
    lcp: Callable[..., Outcome], file: str, tmp_path: Path, ending: str
) -> None:
    assert lcp("solve", file, "-q", "-o", str(tmp_path / f"result.{ending}")) == Outcome(0, "", "")
    assert "half" in (tmp_path / f"result.{ending}").read_text(encoding="utf-8")


@pytest.mark.parametrize("suffix", [".json", ".csv"])
def test_a_file_with_a_compressed_problem_is_read(suffix: str, tmp_path: Path) -> None:
    write(Problem([[2, 1], [1, 2]], [-5, -6]), tmp_path / f"p{suffix.upper()}")
    packed = tmp_path / f"p{suffix}.gz"
    packed.write_bytes(gzip.compress((tmp_path / f"p{suffix.upper()}").read_bytes()))
    assert read(packed).q.tolist() == [-5, -6]
