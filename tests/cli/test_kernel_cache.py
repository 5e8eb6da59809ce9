"""Compiled kernels on disk that were cut off or overwritten, a disk that is full or
can only be read, processes that compile at the same time or are killed: a run says one
line, goes on, and leaves nothing that stays broken."""

import ast
import os
import random
import re
import shutil
import signal
import subprocess
import sys
import time

import pytest

from lcpcli.options import KERNELS

from .. import kernels_together  # noqa: F401
from ..conftest import Outcome
from .conftest import GOOD, MAIN, assert_refused, python

numba = pytest.importorskip("numba")
stored = pytest.importorskip("lcpcli.kernels.cache")
loading = pytest.importorskip("lcpcli.kernels.loading")
pty = pytest.importorskip("pty")
resource = pytest.importorskip("resource")

LONGEST = 600.0  # seconds until something that must happen has not
PLACES = [0.0, 0.25, 0.5, 0.75, 0.99]  # of a file, from which on it is damaged
OVERWRITTEN = 200  # bytes
NAME = f"kernels.one-1{stored.TAG}"


def cut(content, place):
    return content[: int(place * len(content))]


def overwritten(content, place):
    begin = int(place * len(content))
    end = min(begin + OVERWRITTEN, len(content))
    other = random.Random(0).randbytes(end - begin)
    return content[:begin] + other + content[end:]


@pytest.fixture
def cache(tmp_path, monkeypatch):
    """A cache in a folder of its own."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    return stored.Cache()


@pytest.fixture
def files(cache):
    """Files as numba would write them, which are recorded."""
    cache.repair()
    paths = {end: cache.folder / f"{NAME}{end}" for end in ("nbi", "1.nbc")}
    for path in paths.values():
        path.write_bytes(random.Random(1).randbytes(1000))
    cache.note("kernels")
    assert cache.has_loaded("kernels")
    return paths


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("damage", [cut, overwritten])
@pytest.mark.parametrize("end", ["nbi", "1.nbc"])
def test_a_damaged_file_is_removed_and_its_module_loaded_as_if_it_were_new(
    cache, files, end, damage, place
):
    assert not cache.repair()
    files[end].write_bytes(damage(files[end].read_bytes(), place))
    assert (cache.repair(), cache.has_loaded("kernels")) == (True, False)
    assert [path for path in files.values() if path.exists()] == [
        path for other, path in files.items() if other != end
    ]
    assert not cache.repair()


def test_a_missing_file_is_no_damage(cache, files):
    files["nbi"].unlink()
    assert (cache.repair(), cache.has_loaded("kernels")) == (False, False)


@pytest.mark.parametrize("place", PLACES)
def test_a_damaged_record_makes_all_files_suspect(cache, files, place):
    record = cache.folder / stored.RECORD
    record.write_bytes(cut(record.read_bytes(), place))
    assert cache.repair()
    assert not any(path.exists() for path in files.values())
    assert not cache.repair()


def test_files_of_other_sources_are_forgotten_without_a_word(
    files, tmp_path, monkeypatch
):
    monkeypatch.setattr(stored, "PACKAGE", tmp_path / "elsewhere")
    other = stored.Cache()
    assert (other.repair(), other.has_loaded("kernels")) == (False, False)
    assert not any(path.exists() for path in files.values())


def test_what_a_killed_process_has_compiled_is_kept(cache, files):
    late = cache.folder / f"kernels.two-2{stored.TAG}nbi"
    late.write_bytes(b"whole")
    assert (cache.repair(), late.exists()) == (False, True)
    cache.note()
    late.write_bytes(b"cut")
    assert cache.repair()
    assert [path.exists() for path in (late, *files.values())] == [False, True, True]
    old, new = (cache.folder / f"{NAME}nbi.tmp.{k}" for k in (1, 2))
    for path in (old, new):
        path.touch()
    os.utime(old, (0, 0))
    with cache.compiling("kernels", None):
        assert not old.exists()
        assert new.exists()


def test_one_process_at_a_time_compiles_a_module(cache, monkeypatch):
    waits = []
    with cache.compiling("kernels", None) as first:
        with cache.compiling("kernels", None) as second:
            assert (first, second) == (True, False)
        with cache.compiling("measure_kernels", None) as third:
            assert third
        monkeypatch.setattr(stored, "LONGEST_WAIT", 0.1)
        waiting = cache.compiling("kernels", lambda: waits.append(True))
        with pytest.raises(TimeoutError):
            waiting.__enter__()
    assert waits


def used_by(path):
    """The modules of the package that a file imports, as SOURCES names them."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("lcp"):
            name = (node.module or "").removeprefix("lcpcli.").replace(".", "/")
            if (stored.PACKAGE / f"{name}.py").exists():
                yield name
            else:
                yield from (f"{name}/{alias.name}" for alias in node.names)


def test_all_files_whose_functions_and_constants_kernels_use_are_sources():
    kernels = [f"kernels/{name}" for name in (*loading.MODULES, "overloads")]
    used = {name for file in kernels for name in used_by(stored.PACKAGE / f"{file}.py")}
    assert set(stored.SOURCES) == used | set(kernels)


# In place of folders that can only be read, as those who run the tests may write
# everywhere.
READ_ONLY = """
import errno, os, tempfile

def refuse(**_):
    raise OSError(errno.EROFS, os.strerror(errno.EROFS))

tempfile.TemporaryFile = refuse
"""
SMALL = """
import resource
resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))
"""


@pytest.mark.parametrize(
    ("first", "fault"),
    [
        (READ_ONLY, "numba: has no folder for compiled kernels; set NUMBA_CACHE_DIR"),
        (SMALL, "cannot keep compiled kernels (File too large); set NUMBA_CACHE_DIR"),
    ],
    ids=["read-only", "full"],
)
def test_where_there_is_no_room_for_kernels_a_run_goes_on_without_them(
    first, fault, tmp_path
):
    file = tmp_path / "good.json"
    file.write_text(GOOD)
    # This file runs first in each process, also in workers that are no forks.
    (tmp_path / "sitecustomize.py").write_text(first)
    own = os.environ | {
        "NUMBA_CACHE_DIR": str(tmp_path / "cache"),
        "PYTHONPATH": str(tmp_path),
        KERNELS: "1",
    }
    done = python(MAIN, f"solve {file} --format json", env=own)
    assert (done.code, done.record["solved"]) == (0, True)
    told = "lcpcli: continuing without compiled kernels: "
    assert re.fullmatch(f"{told}.*{re.escape(fault)}.*\n", done.err)
    many = tmp_path / "many.jsonl"
    many.write_text(f"{GOOD}\n" * 20)
    done = python(MAIN, f"solve {many} --jobs 2 -q", env=own)
    assert (done.code, done.err.count("\n")) == (0, 1), done.err
    done = python(MAIN, "kernels", env=own)
    assert_refused(done, fault)
    assert (done.out, done.err[:5]) == ("", "lcp: ")


@pytest.fixture
def copied(cache, monkeypatch):
    """A cache in a folder of its own with all kernels."""
    with monkeypatch.context() as patched:
        patched.setattr(numba.config, "CACHE_DIR", os.environ.get("NUMBA_CACHE_DIR"))
        there = stored.Cache()
    for room, folder in there.folders.items():
        for path in folder.glob("*"):
            if path.suffix in (".nbi", ".nbc") or path.name == stored.RECORD:
                shutil.copy(path, cache.folders[room])
    assert all(map(cache.has_loaded, loading.MODULES))
    return cache


@pytest.mark.slow("compiles kernels again")
@pytest.mark.parametrize(
    ("place", "damage", "end"),
    [
        (0.5, cut, "1.nbc"),
        (0.75, overwritten, "nbi"),
    ],
)
def test_damaged_kernels_are_compiled_again_in_one_run_which_says_so(
    copied, place, damage, end, tmp_path
):
    (path,) = copied.folder.glob(f"measure_kernels.on_bounds-*{stored.TAG}{end}")
    path.write_bytes(damage(path.read_bytes(), place))
    (tmp_path / "good.json").write_text(GOOD)
    own = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path), KERNELS: "1"}
    command = "solve", str(tmp_path / "good.json"), "--format", "json"
    for told in (f"{loading.DAMAGED}\n", ""):
        # There, so that it imports the package that has the copied kernels.
        done = python(MAIN, *command, env=own, cwd=stored.PACKAGE.parent)
        assert (done.code, done.err) == (0, told)
        assert done.record["solved"]
    assert path.exists()


@pytest.mark.slow("compiles kernels again")
def test_missing_kernels_are_compiled_ahead_of_time_with_a_bar_on_a_terminal(
    copied, tmp_path
):
    for path in copied.folder.glob("measure_kernels.on_bounds-*"):
        path.unlink()
    own = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path), "TERM": "xterm", KERNELS: ""}
    shown, lines = [], []
    for _ in range(2):
        ours, terminal = pty.openpty()
        # The bar need not wait.
        code = f"from lcpcli.cli import terminal; terminal.PATIENCE = 0; {MAIN}"
        process = subprocess.Popen(
            [sys.executable, "-c", code, "kernels"],
            stdout=subprocess.PIPE,
            stderr=terminal,
            text=True,
            env=own,
            cwd=stored.PACKAGE.parent,
        )
        os.close(terminal)
        text = b""
        try:
            while part := os.read(ours, 4096):
                text += part
        except OSError:  # the process has ended
            pass
        os.close(ours)
        lines.append(process.communicate()[0])
        shown.append(text.decode())
    assert process.returncode == 0
    where = f"the cache is in {tmp_path}\n"
    assert lines == [
        f"1 kernel compiled, {loading.KERNELS - 1} already there; {where}",
        f"0 kernels compiled, {loading.KERNELS} already there; {where}",
    ]
    assert ["on_bounds" in text for text in shown] == [True, False]


@pytest.mark.slow("compiles kernels again")
def test_ctrl_c_while_kernels_are_compiled_ends_at_once_and_loses_none(
    copied, tmp_path
):
    for path in copied.folder.glob("measure_kernels.*"):
        path.unlink()
    before = set(tmp_path.rglob("*.nbc"))
    own = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    process = subprocess.Popen(
        [sys.executable, "-c", MAIN, "kernels"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=own,
        cwd=stored.PACKAGE.parent,
    )
    end = time.monotonic() + LONGEST
    while len(set(tmp_path.rglob("*.nbc")) - before) < 2:
        assert time.monotonic() < end
        assert process.poll() is None
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=LONGEST)
    assert (process.returncode, out, err.strip()) == (130, "", "")
    whole = {path: path.read_bytes() for path in tmp_path.rglob("*.nb[ci]")}
    program = "from lcpcli.kernels.cache import Cache; print(Cache().repair())"
    done = python(program, env=own, cwd=stored.PACKAGE.parent)
    assert done == Outcome(0, "False\n", "")
    assert {path: path.read_bytes() for path in whole} == whole


@pytest.mark.slow("compiles kernels")
def test_processes_that_compile_at_the_same_time_lose_nothing(tmp_path):
    own = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    program = """
import sys
from lcpcli.kernels import loading
loading.load("measure_kernels")
from lcpcli.kernels import measure_kernels
print(measure_kernels.on_bounds.stats.cache_misses.total())
"""
    command = [sys.executable, "-c", program]
    together = [
        subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=own)
        for _ in range(2)
    ]
    assert sorted(each.communicate()[0] for each in together) == ["0\n", "1\n"]
    assert [each.returncode for each in together] == [0, 0]
    assert python(program, env=own) == Outcome(0, "0\n", "")
