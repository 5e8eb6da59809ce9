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

USES = {
    "Result": "print(repr(it), it.to_dict()['status'], it.to_json()[:1], it._repr_html_()[:6], it.z.tolist())",
    "Problem": "print(repr(it), it._repr_html_()[:6], it.q.tolist())",
    "Trace": "print(repr(it))",
    "Verification": "print(repr(it).splitlines()[0], bool(it))",
    "Inspection": "print(repr(it).splitlines()[0])",
}
SAYS = {
    "Result": "<Result: solved by newton, n = 2",
    "Problem": "<Problem small: n = 2, dense> <table [-5.0, -6.0]",
    "Trace": "<Trace: ",
    "Verification": "small: n = 2 True",
    "Inspection": "small: n = 2",
}


def objects() -> dict[str, Any]:
    problem = lcpcli.Problem([[2, 1], [1, 2]], [-5, -6], name="small")
    result = lcpcli.run(problem, "newton", trace=True)
    found = [problem, result, result.trace, lcpcli.check(problem, result.z), lcpcli.inspect(problem)]
    return {type(it).__name__: it for it in found}


@pytest.mark.slow("a process for each object")
@pytest.mark.parametrize("name", SAYS)
def test_methods_are_there_in_a_fresh_process(name: str, tmp_path: Path) -> None:
    (tmp_path / "it").write_bytes(pickle.dumps(objects()[name]))
    code = f"import pickle\nit = pickle.load(open('it', 'rb'))\n{USES[name]}"
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.stderr, done.returncode) == ("", 0)
    assert done.stdout.startswith(SAYS[name])


def test_pieces_of_the_set_of_solutions_are_there_in_a_fresh_process(tmp_path: Path) -> None:
    pieces = list(lcpcli.solutions(lcpcli.Problem([[0, 0], [0, 1]], [0, -1])))
    (tmp_path / "it").write_bytes(pickle.dumps(pieces))
    code = "import pickle\nprint(*pickle.load(open('it', 'rb')))"
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.stderr, done.returncode) == ("", 0)
    assert done.stdout == " ".join(map(str, pieces)) + "\n"


@pytest.mark.parametrize("taken", [0, 1, 3])
def test_a_set_of_solutions_has_what_was_found_and_ends_with_it(taken: int, tmp_path: Path) -> None:
    game = lcpcli.from_game([[3, 0], [0, 2]], [[2, 0], [0, 3]])
    search = lcpcli.solutions(game)
    for _ in zip(range(taken + (taken == 3)), search, strict=False):
        continue
    deep = copy.deepcopy(search)
    assert list(map(str, deep)) == list(map(str, search.pieces))
    (tmp_path / "it").write_bytes(pickle.dumps(search))
    code = "import pickle\nit = pickle.load(open('it', 'rb'))\nprint(len(list(it)), len(it.equilibria.extreme), it)"
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert (done.stderr, done.returncode) == ("", 0)
    assert done.stdout == f"{taken} {taken} {search}\n"
    assert deep.others is (False if taken == 3 else None)
    assert len(list(search)) == 3
