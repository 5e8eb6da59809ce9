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


@pytest.fixture
def meet(
    lcp: Callable[..., Outcome], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[[Kind], tuple[Outcome, bool]]:
    """Run a kind of bad input in a folder of its own: how it ends, and whether the folder is as it was."""

    def run(kind: Kind) -> tuple[Outcome, bool]:
        files = {"good.json": GOOD, "M.csv": "2,0\n0,2\n", "q.csv": "-1\n-1\n"} | kind.files
        for name, content in files.items():
            (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
        (tmp_path / "results").mkdir()
        (tmp_path / "loop").symlink_to("loop")
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(kind.stdin)))
        before = contents(tmp_path)
        return lcp(*kind.arguments), contents(tmp_path) == before

    return run


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
def test_one_line_says_where_what_and_how_to_fix_it(meet: Callable[[Kind], tuple[Outcome, bool]], kind: Kind) -> None:
    outcome, unchanged = meet(kind)
    assert is_one_readable_line(outcome.err), outcome.err[:LONGEST_LINE]
    assert [word for word in kind.words if word not in outcome.err] == [], outcome.err
    assert (outcome.code, outcome.out, unchanged) == (2, "", True)
    assert [word for word in FOREIGN if word in without(outcome.err, OURS)] == [], outcome.err


def without(text: str, parts: Iterable[str]) -> str:
    for part in parts:
        text = text.replace(part, "")
    return text


@pytest.mark.parametrize("kind", UNWRITABLE)
def test_nothing_is_solved_for_an_output_that_cannot_be_written(
    meet: Callable[[Kind], tuple[Outcome, bool]], kind: Kind, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(driver, "run", lambda *_, **__: pytest.fail("solved in vain"))
    outcome, _ = meet(kind)
    assert outcome.code == 2


def test_nothing_is_solved_if_an_option_of_the_last_method_is_out_of_range(
    meet: Callable[[Kind], tuple[Outcome, bool]], monkeypatch: pytest.MonkeyPatch
) -> None:
    solved: list[Result] = []
    run = driver.run
    monkeypatch.setattr(driver, "run", lambda *given, **named: solved.append(run(*given, **named)) or solved[-1])
    line = "compare good.json --method fixed-point --method shi --rho 2"
    outcome, _ = meet(Kind(tuple(line.split()), ()))
    assert (outcome.code, solved) == (2, [])


@pytest.mark.parametrize("kind", [*JSON[:3], *MATRICES[:3], *CSV[:3], *OPTIONS[:3]])
def test_a_failing_run_leaves_the_old_output_as_it_is(meet: Callable[[Kind], tuple[Outcome, bool]], kind: Kind) -> None:
    outcome, unchanged = meet(Kind((*kind.arguments, "-o", "old.csv"), (), {**kind.files, "old.csv": "old"}))
    assert (outcome.code, unchanged) == (2, True)


def test_a_closed_standard_input_is_reported_in_one_line(
    lcp: Callable[..., Outcome], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "stdin", None)
    outcome = lcp("solve", "-")
    assert is_one_readable_line(outcome.err)
    assert "standard input" in outcome.err
    assert (outcome.code, outcome.out) == (2, "")


def test_a_missing_file_in_a_folder_that_cannot_be_listed_is_reported_in_one_line(
    lcp: Callable[..., Outcome], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(folder: Path) -> Iterator[Path]:
        raise PermissionError(13, os.strerror(13), str(folder))

    monkeypatch.setattr(Path, "iterdir", refuse)
    outcome = lcp("solve", str(tmp_path / "good.json"))
    assert is_one_readable_line(outcome.err)
    assert "no such file" in outcome.err
    assert (outcome.code, outcome.out) == (2, "")
