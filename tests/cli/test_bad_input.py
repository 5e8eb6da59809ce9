"""Bad input is reported in one line that says where, what and how to fix it; nothing is
printed or left behind."""

from __future__ import annotations

import io
import json
import os
import sys
import zipfile
from collections.abc import Callable, Iterable, Iterator
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lcpcli import Result
from lcpcli.bench import timing as benching
from lcpcli.errors import ProblemError
from lcpcli.files import beside, reading
from lcpcli.solving import driver as driver

from ..bad_input.kinds import FOREIGN_FILES, FOREIGN_WORDS, GOOD, LONG, NPZ, OURS, Kind
from ..conftest import Outcome
from ..documents import assert_as_before, typed_in
from .conftest import Lcp, assert_refused

LONGEST_LINE = 1000
Meet = Callable[[Kind], tuple[Outcome, bool]]


@pytest.fixture
def meet(
    lcp: Callable[..., Outcome], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Meet:
    """Run a kind of bad input in a folder of its own: how it ends, and whether the
    folder is as it was and nothing was solved in vain."""
    numbers = count()

    def met(kind: Kind) -> tuple[Outcome, bool]:
        folder = tmp_path / str(next(numbers))
        (folder / "results").mkdir(parents=True)
        (folder / "loop").symlink_to("loop")
        files = {
            "good.json": GOOD,
            "M.csv": "2,0\n0,2\n",
            "q.csv": "-1\n-1\n",
        } | kind.files
        for name, content in files.items():
            if name:
                (folder / name).write_bytes(
                    content if isinstance(content, bytes) else content.encode()
                )
        monkeypatch.chdir(folder)
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(kind.stdin)))
        solved: list[Result] = []
        run = driver.run
        monkeypatch.setattr(
            driver,
            "run",
            lambda *given, **named: solved.append(run(*given, **named)) or solved[-1],
        )
        before = contents(folder)
        outcome = lcp(*kind.arguments)
        return outcome, contents(folder) == before and not solved

    return met


def contents(folder: Path) -> dict[Path, bytes | None]:
    return {
        path: path.read_bytes() if path.is_file() else None
        for path in folder.rglob("*")
    }


def is_one_readable_line(text: str) -> bool:
    return text.endswith("\n") and text[:-1].isprintable() and len(text) <= LONGEST_LINE


@pytest.mark.parametrize("kind", [*LONG, *NPZ, *FOREIGN_FILES])
def test_one_line_says_where_what_and_how_to_fix_it(meet: Meet, kind: Kind) -> None:
    assert [word for word in kind.words if word not in line_about(kind, meet)] == []


@pytest.mark.parametrize(
    "name", ["files", "json", "matrix-market", "options", "programs"]
)
def test_the_line_about_bad_input_is_the_same_as_before(
    name: str, meet: Meet, tmp_path: Path
) -> None:
    """In a folder with good.json, M.csv, q.csv, results/ and loop -> loop."""
    text, files = "", dict[str, str | bytes]()
    for typed in typed_in(f"bad-{name}"):
        text += f"{typed.line}\n"
        content = typed.content or b""
        if typed.file:
            files[typed.file] = content
        else:
            text += line_about(Kind(tuple(typed.arguments), (), files, content), meet)
            files = {}
    assert_as_before(f"bad-{name}", text.replace(str(tmp_path), "FOLDER"))


def line_about(kind: Kind, meet: Meet) -> str:
    """The one readable line, in words of this program, that is all that bad input leads
    to."""
    outcome, unchanged = meet(kind)
    assert is_one_readable_line(outcome.err), outcome.err[:LONGEST_LINE]
    assert (outcome.code, outcome.out, unchanged) == (2, "", True), kind.arguments
    assert [
        word for word in FOREIGN_WORDS if word in without(outcome.err, OURS)
    ] == [], outcome.err
    return outcome.err


def without(text: str, parts: Iterable[str]) -> str:
    for part in parts:
        text = text.replace(part, "")
    return text


@pytest.mark.parametrize("broken", ["input", "folder"])
def test_what_the_system_refuses_is_reported_in_one_line(
    broken: str,
    lcp: Callable[..., Outcome],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A closed standard input, and a missing file in a folder that cannot be listed."""

    def refuse(folder: Path) -> Iterator[Path]:
        raise PermissionError(13, os.strerror(13), str(folder))

    if broken == "input":
        monkeypatch.setattr(sys, "stdin", None)
        outcome = lcp("solve", "-")
    else:
        monkeypatch.setattr(Path, "iterdir", refuse)
        outcome = lcp("solve", str(tmp_path / "good.json"))
    assert is_one_readable_line(outcome.err)
    assert ("standard input" if broken == "input" else "no such file") in outcome.err
    assert (outcome.code, outcome.out) == (2, "")


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
    "header-with-open-text": archive(
        M=spoiled(EYE, b"'descr'", b"'''escr"), q=array([1.0, 1.0])
    ),
    "header-of-zeros": archive(
        M=array(np.zeros(60)), q=spoiled(array(np.zeros(300)), b"{'descr'", b"\0" * 8)
    ),
    "compression-broken": spoiled(
        archive(zipfile.ZIP_LZMA, M=array(np.arange(400.0).reshape(20, 20))),
        b"\x5d\0\0",
        b"\xff\xff\xff",
    ),
}


@pytest.mark.parametrize("content", ARCHIVES.values(), ids=ARCHIVES)
@pytest.mark.parametrize(
    "read",
    [reading.read, lambda path: beside.read_candidates(path, 2, ("", ""))],
    ids=["problem", "answer"],
)
def test_broken_archive_is_told_in_one_short_line(
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


def test_array_that_python_2_has_written_is_read_without_a_warning(
    tmp_path: Path,
) -> None:
    file = tmp_path / "p.npz"
    file.write_bytes(
        archive(M=spoiled(EYE, b"(2, 2), }  ", b"(2L, 2L), }"), q=array([1.0, 1.0]))
    )
    assert reading.read(str(file)).M.tolist() == [[1, 0], [0, 1]]


@pytest.mark.parametrize(
    ("name", "content", "fault"),
    [
        (
            "p.mtx",
            f"%%MatrixMarket matrix array real general\n1 1\n{'9' * 10**6}x\n",
            "line 3: is '999",
        ),
        (
            "p.json",
            "{" + ",".join(f'"{k}": 0' for k in range(10**5)) + ', "99999": 0}',
            "99999: occurs twice",
        ),
    ],
    ids=["million-digits", "hundred-thousand-keys"],
)
def test_long_file_is_refused_in_a_time_in_proportion(
    name: str, content: str, fault: str, tmp_path: Path
) -> None:
    """In hours if the time grew with the square of the length."""
    file = tmp_path / name
    file.write_text(content)
    with pytest.raises(ProblemError, match=fault):
        reading.read(str(file))


@pytest.mark.usefixtures("folder")
def test_missing_problem_of_a_resumed_bench_is_reported_at_first(
    lcp: Lcp, monkeypatch: pytest.MonkeyPatch
) -> None:
    lcp(
        "bench",
        "good.json",
        "none.json",
        "--method",
        "newton",
        "--budget",
        "0",
        "-q",
        "-o",
        "record.json",
    )
    record = json.loads(Path("record.json").read_text())
    Path("record.json").write_text(json.dumps(record | {"measurements": []}))
    Path("none.json").unlink()
    monkeypatch.setattr(
        benching, "_measure", lambda *_: pytest.fail("measured in vain")
    )
    assert_refused(
        lcp("bench", "--resume", "record.json"), "lcp: none.json: no such file"
    )
