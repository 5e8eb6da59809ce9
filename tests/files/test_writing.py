"""What is written appears whole or not at all, with the permissions and the links that
were there; a log of many problems has each of them exactly once in the end, whoever
wrote it, in whatever order."""

import errno
import fcntl
import json
import os
import resource
import stat
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest

from lcpcli import Problem, read, write
from lcpcli.cli import streams
from lcpcli.errors import LCPError, OptionError
from lcpcli.files import atomic_write
from lcpcli.files.atomic_write import write_whole

from ..cli.conftest import assert_refused
from ..conftest import JSON, M, Outcome, Q, numbers
from ..wordings import DIRECTORY

EXAMPLE = Problem(M, Q, name="example")


def test_a_new_file_has_the_usual_permissions_and_an_old_one_keeps_its_own(tmp_path):
    path = tmp_path / "problem.json"
    before = os.umask(0o027)
    try:
        write(EXAMPLE, path)
        assert os.umask(0o027) == 0o027
    finally:
        os.umask(before)
    assert stat.S_IMODE(path.stat().st_mode) == 0o640
    for mode in (0o600, 0o664, 0o755):
        path.write_text("old")
        path.chmod(mode)
        write(EXAMPLE, path)
        assert numbers(read(path)) == (M, Q)
        assert stat.S_IMODE(path.stat().st_mode) == mode


def test_a_link_stays_a_link_to_what_is_written(tmp_path):
    (tmp_path / "link.json").symlink_to("problem.json")
    write(EXAMPLE, tmp_path / "link.json")
    assert (tmp_path / "link.json").readlink() == Path("problem.json")
    assert numbers(read(tmp_path / "problem.json")) == (M, Q)


@contextmanager
def full_disk():
    """No file can grow beyond a few bytes."""
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (8, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


@contextmanager
def refused_rename(error):
    """No file can be put in the place of another."""

    def refuse(*_):
        raise error

    with pytest.MonkeyPatch.context() as patch:
        for owner, name in (
            (os, "replace"),
            (os, "rename"),
            (Path, "replace"),
            (Path, "rename"),
        ):
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
    tmp_path, failure, error
):
    (tmp_path / "old.json").write_text("old")
    for name in ("old.json", "new.json", "problem.mtx", "problem.npz"):
        with pytest.raises(error), failure():
            write(EXAMPLE, tmp_path / name)
    assert {entry.name: entry.read_text() for entry in tmp_path.iterdir()} == {
        "old.json": "old"
    }


def test_of_a_pair_none_is_replaced_if_one_cannot_be_written(tmp_path):
    (tmp_path / "problem.mtx").write_text("old")
    (tmp_path / "problem.q.mtx").mkdir()
    with pytest.raises(LCPError, match=rf"problem\.q\.mtx: {DIRECTORY}"):
        write(EXAMPLE, tmp_path / "problem.mtx")
    assert (tmp_path / "problem.mtx").read_text() == "old"


@pytest.fixture
def file(tmp_path):
    (tmp_path / "problem.json").write_text(JSON[:-1] + ', "name": "half \\ud83d"}')
    return str(tmp_path / "problem.json")


def test_a_device_is_written_to_and_not_replaced(lcp, file):
    with refused_rename(AssertionError("the device would have been replaced")):
        outcome = lcp(f"solve {file} -q -o /dev/null")
        write_whole("/dev/null", "text")
    assert outcome == Outcome(0, "", "")
    assert_refused(
        lcp(f"solve {file} -o /dev/full"), "lcp: /dev/full: cannot be written"
    )
    assert stat.S_ISCHR(Path("/dev/null").stat().st_mode)


def test_a_pipe_is_written_to_and_not_replaced_and_read_from(tmp_path):
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


TOGETHER = "good.json", "three.jsonl", "M.csv", "Q.csv"


@pytest.fixture
def folder(in_folder):
    lines = [json.dumps({"M": [[2, 1], [1, 2]], "q": [-5, -k]}) for k in range(1, 5)]
    (in_folder / "good.json").write_text(lines[0])
    (in_folder / "three.jsonl").write_text("\n".join(lines[1:]))
    (in_folder / "M.csv").write_text("2,1\n1,2\n")
    (in_folder / "Q.csv").write_text("-1,-2,-3,-4\n-5,-6,-7,-8\n")
    return in_folder


def records(path):
    return [json.loads(line) for line in path.read_text().splitlines()]


def whole_log(lcp, *files):
    """The lines of the log of these problems."""
    assert lcp("solve", *(files or TOGETHER), "-o", "log.jsonl").code == 0
    return Path("log.jsonl").read_text().splitlines(keepends=True)


def test_a_log_in_any_order_goes_on_with_what_it_lacks(lcp, folder):
    path = folder / "log.jsonl"
    whole = whole_log(lcp)
    path.write_text("".join(whole[at] for at in (7, 2, 5, 0, 3)) + whole[1][:40])
    assert lcp("check good.json log.jsonl -q").code == 0, (
        "the first problem is that of number 1"
    )
    assert lcp("solve good.json --z0 log.jsonl -q").code == 0
    outcome = lcp("solve", *TOGETHER, "--resume", "log.jsonl")
    assert outcome.code == 0
    assert outcome.err == "lcp: 8 problems: 8 solved\n"
    held = [record["number"] for record in records(path)]
    assert held == [8, 3, 6, 1, 4, 2, 5, 7]


def test_a_log_with_results_is_not_replaced(lcp, folder):
    path = folder / "log.jsonl"
    whole = whole_log(lcp)
    for kept in ("".join(whole[:3]), "".join(whole)[:-5], "".join(whole)):
        path.write_text(kept)
        assert_refused(
            lcp("solve", *TOGETHER, "-o", "log.jsonl"),
            "use --resume log.jsonl to continue, or delete it",
        )
        assert path.read_text() == kept


@pytest.mark.parametrize(
    ("then", "now", "words"),
    [
        ([], ["--upper", "1"], "upper none, but here it is 1"),
        (["--upper", "u.json"], ["--upper", "u.json"], "upper u.json (digest"),
        (["--z0", "1,1"], ["--z0", "1,2"], "z0 1,1, but here it is 1,2"),
    ],
)
def test_other_options_are_refused(then, now, words, lcp, folder):
    (folder / "u.json").write_text("[1, 2]")
    lcp("solve", "three.jsonl", "-o", "log.jsonl", *then)
    before = (folder / "log.jsonl").read_text()
    (folder / "u.json").write_text("[1, 3]")
    assert_refused(lcp("solve", "three.jsonl", "--resume", "log.jsonl", *now), words)
    assert (folder / "log.jsonl").read_text() == before


@pytest.mark.parametrize(
    "tail", ["\0" * 4096, '{"ver' + "\0" * 100, '{"version": "0.1.0", "fi\0\0']
)
def test_zeros_at_the_end_are_what_was_not_written(tail, lcp, folder):
    path = folder / "log.jsonl"
    path.write_text("".join(whole_log(lcp, "three.jsonl")[:2]) + tail)
    assert (
        lcp("solve three.jsonl --resume log.jsonl").err == "lcp: 3 problems: 3 solved\n"
    )
    assert [record["number"] for record in records(path)] == [1, 2, 3]


@pytest.mark.skipif(sys.platform == "win32", reason="no such locks")
def test_a_log_is_left_to_a_run_that_has_read_it_and_waits(lcp, folder, monkeypatch):
    usual = streams.all_records
    refused = []

    def late(*arguments, **others):
        with (
            pytest.raises(OptionError, match="is being written by another run"),
            atomic_write.open_log("log.jsonl", anew=False),
        ):
            pass
        refused.append(True)
        yield from usual(*arguments, **others)

    monkeypatch.setattr(streams, "all_records", late)
    (folder / "log.jsonl").write_text(whole_log(lcp, "three.jsonl")[1])
    assert lcp("solve three.jsonl --resume log.jsonl").code == 0
    assert refused == [True, True]
    assert len(records(folder / "log.jsonl")) == 3


@pytest.mark.skipif(sys.platform == "win32", reason="no such locks")
def test_a_lock_is_that_of_the_file_which_has_the_name(folder):
    first = atomic_write.open_alone("log.jsonl", "log.jsonl")
    write_whole("log.jsonl", "replaced")
    second = atomic_write.open_alone("log.jsonl", "log.jsonl")
    assert second.read() == b"replaced"
    first.close()
    with pytest.raises(OptionError, match="is being written by another run"):
        atomic_write.open_alone("log.jsonl", "log.jsonl")
    second.close()
    assert folder.is_dir()


@pytest.mark.skipif(sys.platform == "win32", reason="no such locks")
def test_a_file_that_is_replaced_just_before_it_is_locked_is_opened_again(
    folder, monkeypatch
):
    usual, contents = fcntl.flock, ["replaced"]

    def late(*arguments):
        if contents:
            write_whole("log.jsonl", contents.pop())
        usual(*arguments)

    monkeypatch.setattr("fcntl.flock", late)
    with atomic_write.open_alone("log.jsonl", "log.jsonl") as file:
        assert file.read() == b"replaced"
    assert folder.is_dir()


def test_a_log_that_was_never_begun_leaves_no_file(lcp, folder):
    outcome = lcp("solve three.jsonl -o log.jsonl --jobs 0")
    assert outcome.code == 2
    with (
        pytest.raises(OSError, match="nothing"),
        atomic_write.open_log("log.jsonl", anew=True),
    ):
        raise OSError("nothing")
    assert not (folder / "log.jsonl").exists()
