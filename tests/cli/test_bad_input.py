"""Bad input is reported in one line that says where, what and how to fix it; nothing is printed or left behind."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import pytest

from lcpcli import Result
from lcpcli.solving import driver as driver

from ..bad_input.bound_kinds import BOUNDS
from ..bad_input.file_kinds import CSV, FILES, STANDARD_INPUT
from ..bad_input.foreign_kinds import FOREIGN, FOREIGN_FILES, OURS
from ..bad_input.json_kinds import COORDINATES, JSON, MATRICES
from ..bad_input.kinds import GOOD, Kind
from ..bad_input.matrix_kinds import MATRIX_MARKET, NPZ
from ..bad_input.option_kinds import FROM_RESULTS, OPTIONS, STARTS, UNWRITABLE
from ..bad_input.program_kinds import PROGRAMS
from ..conftest import Outcome

LONGEST_LINE = 1000
Meet = Callable[[Kind], tuple[Outcome, bool]]


@pytest.fixture
def meet(lcp: Callable[..., Outcome], tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Meet:
    """Run a kind of bad input in a folder of its own: how it ends, and whether the folder is as it was and nothing was
    solved in vain."""

    def met(kind: Kind) -> tuple[Outcome, bool]:
        files = {"good.json": GOOD, "M.csv": "2,0\n0,2\n", "q.csv": "-1\n-1\n"} | kind.files
        for name, content in files.items():
            (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
        (tmp_path / "results").mkdir()
        (tmp_path / "loop").symlink_to("loop")
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(kind.stdin)))
        solved: list[Result] = []
        run = driver.run
        monkeypatch.setattr(driver, "run", lambda *given, **named: solved.append(run(*given, **named)) or solved[-1])
        before = contents(tmp_path)
        outcome = lcp(*kind.arguments)
        return outcome, contents(tmp_path) == before and not solved

    return met


def contents(folder: Path) -> dict[Path, bytes | None]:
    return {path: path.read_bytes() if path.is_file() else None for path in folder.rglob("*")}


def is_one_readable_line(text: str) -> bool:
    return text.endswith("\n") and text[:-1].isprintable() and len(text) <= LONGEST_LINE


@pytest.mark.parametrize(
    "kind",
    [
        *(*FILES, *JSON, *MATRICES, *COORDINATES, *CSV, *MATRIX_MARKET, *NPZ),
        *(*FROM_RESULTS, *STANDARD_INPUT, *OPTIONS, *STARTS, *UNWRITABLE, *BOUNDS, *PROGRAMS, *FOREIGN_FILES),
    ],
)
def test_one_line_says_where_what_and_how_to_fix_it(meet: Meet, kind: Kind) -> None:
    outcome, unchanged = meet(kind)
    assert is_one_readable_line(outcome.err), outcome.err[:LONGEST_LINE]
    assert [word for word in kind.words if word not in outcome.err] == [], outcome.err
    assert (outcome.code, outcome.out, unchanged) == (2, "", True)
    assert [word for word in FOREIGN if word in without(outcome.err, OURS)] == [], outcome.err


def without(text: str, parts: Iterable[str]) -> str:
    for part in parts:
        text = text.replace(part, "")
    return text


@pytest.mark.parametrize("kind", [JSON[0], MATRICES[0], CSV[0], OPTIONS[0]])
def test_a_failing_run_leaves_the_old_output_as_it_is(meet: Meet, kind: Kind) -> None:
    outcome, unchanged = meet(Kind((*kind.arguments, "-o", "old.csv"), (), {**kind.files, "old.csv": "old"}))
    assert (outcome.code, unchanged) == (2, True)


@pytest.mark.parametrize("broken", ["input", "folder"])
def test_what_the_system_refuses_is_reported_in_one_line(
    broken: str, lcp: Callable[..., Outcome], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
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
