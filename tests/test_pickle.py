"""What has been pickled has all its methods in a process that has imported nothing but pickle."""

from __future__ import annotations

import copy
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import lcpcli

USES = {  # what is done with an object of each class, and the beginning of what that says
    "Result": (
        "repr(it), it.to_dict()['status'], it.to_json()[:1], it._repr_html_()[:6], it.z.tolist()",
        "<Result: solved by newton, n = 2",
    ),
    "Problem": ("repr(it), it._repr_html_()[:6], it.q.tolist()", "<Problem small: n = 2, dense> <table [-5.0, -6.0]"),
    "Trace": ("repr(it)", "<Trace: "),
    "Verification": ("repr(it).splitlines()[0], bool(it)", "small: n = 2 True"),
    "Inspection": ("repr(it).splitlines()[0]", "small: n = 2"),
}


def told(it: object, folder: Path, code: str) -> str:
    """What a fresh process says of an object that is pickled."""
    (folder / "it").write_bytes(pickle.dumps(it))
    command = [sys.executable, "-c", f"import pickle\nit = pickle.load(open('it', 'rb'))\nprint({code})"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert (done.stderr, done.returncode) == ("", 0)
    return done.stdout


def objects() -> dict[str, Any]:
    problem = lcpcli.Problem([[2, 1], [1, 2]], [-5, -6], name="small")
    result = lcpcli.run(problem, "newton", trace=True)
    found = [problem, result, result.trace, lcpcli.check(problem, result.z), lcpcli.inspect(problem)]
    return {type(it).__name__: it for it in found}


@pytest.mark.slow("a process for each object")
@pytest.mark.parametrize("name", USES)
def test_methods_are_there_in_a_fresh_process(name: str, tmp_path: Path) -> None:
    code, says = USES[name]
    assert told(objects()[name], tmp_path, code).startswith(says)


def test_pieces_of_the_set_of_solutions_are_there_in_a_fresh_process(tmp_path: Path) -> None:
    pieces = list(lcpcli.solutions(lcpcli.Problem([[0, 0], [0, 1]], [0, -1])))
    assert told(pieces, tmp_path, "*it") == " ".join(map(str, pieces)) + "\n"


@pytest.mark.parametrize("taken", [0, 1, 3])
def test_a_set_of_solutions_has_what_was_found_and_ends_with_it(taken: int, tmp_path: Path) -> None:
    search = lcpcli.solutions(lcpcli.from_game([[3, 0], [0, 2]], [[2, 0], [0, 3]]))
    for _ in zip(range(taken + (taken == 3)), search, strict=False):
        continue
    deep = copy.deepcopy(search)
    assert list(map(str, deep)) == list(map(str, search.pieces))
    said = told(search, tmp_path, "len(list(it)), len(it.equilibria.extreme), it")
    assert said == f"{taken} {taken} {search}\n"
    assert deep.others is (False if taken == 3 else None)
    assert len(list(search)) == 3
