"""Files: what can be read safely is read to the right numbers, and what is written is read back to the same ones."""

from __future__ import annotations

import errno
import io
import json
import math
import os
import resource
import stat
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy import sparse

from lcpcli import Problem, read, run, write
from lcpcli.errors import LCPError, ProblemError
from lcpcli.files import read_vector, write_whole
from lcpcli.problem import VERDICTS, is_sparse

from .conftest import Outcome

M = [[2.0, -1.0], [-0.5, 2.0]]
Q = [-1.0, 0.25]
JSON = '{"M": [[2, -1], [-0.5, 2]], "q": [-1, 0.25]}'
MARK = b"\xef\xbb\xbf"
LARGEST, SMALLEST = sys.float_info.max, math.ulp(0.0)


def feed(monkeypatch: pytest.MonkeyPatch, content: bytes) -> None:
    """Put content on standard input."""
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(content)))


def numbers(problem: Problem) -> tuple[list[list[float]], list[float]]:
    """M and q as lists."""
    return (problem.M.toarray() if is_sparse(problem.M) else problem.M).tolist(), problem.q.tolist()


SPELLINGS = {
    "commas": b"2,-1,-1\n-0.5,2,0.25\n",
    "semicolons": b"2;-1;-1\n-0.5;2;0.25\n",
    "tabs": b"2\t-1\t-1\n-0.5\t2\t0.25\n",
    "blanks": b"  2 -1   -1\n-0.5  2 0.25  \n",
    "blanks-around-commas": b"2 , -1 , -1\n -0.5,\t2, 0.25\n",
    "blank-and-tab-after-semicolon": b"2; -1;\t-1\n-0.5;2;0.25\n",
    "byte-order-mark": MARK + b"2,-1,-1\n-0.5,2,0.25\n",
    "byte-order-mark-and-header": MARK + b"a,b,q\n2,-1,-1\n-0.5,2,0.25\n",
    "crlf": b"2,-1,-1\r\n-0.5,2,0.25\r\n",
    "cr": b"2,-1,-1\r-0.5,2,0.25\r",
    "no-newline-at-the-end": b"2,-1,-1\n-0.5,2,0.25",
    "blank-lines": b"\n \n2,-1,-1\n\t\n\n-0.5,2,0.25\n\n",
    "header": b"z1,z2,q\n2,-1,-1\n-0.5,2,0.25\n",
    "quoted-header": b'"z,1";"z,2";"q"\n2;-1;-1\n-0.5;2;0.25\n',
    "header-of-blanks": b"z1 z2 q\n2 -1 -1\n-0.5 2 0.25\n",
    "header-below-a-comment": b"# a, b\nz1,z2,q\n2,-1,-1\n-0.5,2,0.25\n",
    "comments": b"# M; q\n2,-1,-1\n  # the second row\n-0.5,2,0.25\n#\n",
    "comment-not-in-english": "# Schäfer 2004\n2,-1,-1\n-0.5,2,0.25\n".encode(),
    "quoted-numbers": b'"2","-1","-1"\n"-0.5","2","0.25"\n',
    "quoted-numbers-after-blanks": b'"2", "-1", "-1"\n"-0.5", "2", "0.25"\n',
    "quoted-numbers-parted-by-blanks": b'"2" "-1"  "-1"\n"-0.5" "2" "0.25"\n',
    "signs-and-exponents": b"+2,-1E0,-10e-1\n-.5,2.,+2.5e-01\n",
    "json": JSON.encode(),
    "json-byte-order-mark": MARK + JSON.encode(),
    "json-crlf": JSON.replace(" ", "\r\n").encode(),
    "json-blank-lines": f"\n\n {JSON}\n\n".encode(),
    "json-exponents": b'{"M": [[2e0, -1E+0], [-5e-1, 20e-1]], "q": [-1.0, 25e-2]}',
    "json-other-order": b'{"q": [-1, 0.25], "M": [[2, -1], [-0.5, 2]]}',
    "json-coordinates": b"""{"M": {"format": "coo", "shape": [2, 2], "rows": [0, 0, 1, 1], "cols": [0, 1, 0, 1],
                            "values": [2, -1, -0.5, 2]}, "q": [-1, 0.25]}""",
    "json-coordinates-unordered": b"""{"q": [-1, 0.25], "M": {"values": [2, -0.5, -1, 2], "cols": [1, 0, 1.0, 0e0],
                                      "rows": [1, 1, 0, 0], "shape": [2.0, 2e0], "format": "coo"}}""",
}


@pytest.mark.parametrize("content", SPELLINGS.values(), ids=SPELLINGS)
@pytest.mark.parametrize("name", ["problem.csv", "problem.txt"])
def test_every_safe_spelling_is_read(tmp_path: Path, name: str, content: bytes) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    problem = read(str(path))
    assert numbers(problem) == (M, Q)
    assert problem.name == "problem"


@pytest.mark.parametrize("content", SPELLINGS.values(), ids=SPELLINGS)
def test_every_safe_spelling_is_read_from_standard_input(monkeypatch: pytest.MonkeyPatch, content: bytes) -> None:
    feed(monkeypatch, content)
    problem = read("-")
    assert numbers(problem) == (M, Q)
    assert problem.name == "standard input"


@pytest.mark.parametrize("spelling", [name for name in SPELLINGS if name.startswith("json")])
def test_json_files_are_read(tmp_path: Path, spelling: str) -> None:
    path = tmp_path / "problem.json"
    path.write_bytes(SPELLINGS[spelling])
    assert numbers(read(str(path))) == (M, Q)


VECTORS = {
    "row": b"-1,0.25\n",
    "column": b"-1\n0.25\n",
    "row-of-semicolons": b"-1;0.25",
    "row-of-blanks": b"-1 0.25",
    "row-below-a-header": b"a,b\n-1,0.25\n",
    "column-below-a-header": b"q\r\n-1\r\n0.25\r\n",
    "column-with-blank-lines": b"\n-1\n\n0.25",
    "column-with-comments": b"# q\n-1\n# and\n0.25",
    "column-in-quotes": b'"-1"\n"0.25"\n',
    "column-with-one-in-quotes": b'"-1"\n0.25\n',
    "byte-order-mark": MARK + b"-1\n0.25\n",
    "json-list": b"[-1, 0.25]",
    "json-list-in-lines": b"\n[\r\n-1,\r\n25e-2\r\n]\r\n",
    "json-list-with-mark": MARK + b"[-1, 0.25]",
}


@pytest.mark.parametrize("content", VECTORS.values(), ids=VECTORS)
def test_q_is_read_from_a_file_of_its_own(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "M.csv").write_bytes(b"2,-1\n-0.5,2\n")
    (tmp_path / "q.csv").write_bytes(content)
    problem = read(str(tmp_path / "M.csv"), str(tmp_path / "q.csv"))
    assert numbers(problem) == (M, Q)
    assert problem.name == "M"


def test_q_is_read_from_standard_input(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "M.csv").write_bytes(b"2,-1\n-0.5,2\n")
    feed(monkeypatch, b"-1\n0.25\n")
    assert numbers(read(str(tmp_path / "M.csv"), "-")) == (M, Q)


@pytest.mark.parametrize("content", VECTORS.values(), ids=VECTORS)
@pytest.mark.parametrize("option", ["--x0", "--x1"])
def test_a_start_is_read_from_a_file(lcp: Callable[..., Outcome], tmp_path: Path, option: str, content: bytes) -> None:
    (tmp_path / "problem.json").write_text(JSON)
    (tmp_path / "start").write_bytes(content)
    options = [option, str(tmp_path / "start"), "--format", "json", "--trace", "--max-iterations", "1"]
    outcome = lcp("solve", str(tmp_path / "problem.json"), "--method", "shi", *options)
    trace = json.loads(outcome.out)["trace"]
    assert trace[int(option[-1])]["z"] == [0, 0.5]


def test_a_start_of_hundreds_of_numbers_can_be_given_on_the_command_line(
    lcp: Callable[..., Outcome], tmp_path: Path
) -> None:
    n = 300
    write(Problem(2 * sparse.eye_array(n, format="csr"), np.full(n, -1.0)), str(tmp_path / "problem.json"))
    outcome = lcp("solve", str(tmp_path / "problem.json"), "--x0", ",".join(["0.25"] * n), "-q")
    assert (outcome.code, outcome.err) == (0, "")


@pytest.mark.parametrize(
    ("solution", "expected"),
    [("[1, 0]", [[1, 0]]), ("[[1, 0]]", [[1, 0]]), ("[[1, 0], [0, 2.5]]", [[1, 0], [0, 2.5]])],
)
def test_solution_is_one_list_or_a_list_of_lists(tmp_path: Path, solution: str, expected: list[list[float]]) -> None:
    path = tmp_path / "problem.json"
    path.write_text(f'{JSON[:-1]}, "solution": {solution}}}')
    assert [z.tolist() for z in read(str(path)).solutions] == expected


def test_texts_and_starts_are_read_from_json(tmp_path: Path) -> None:
    path = tmp_path / "problem.json"
    path.write_text(
        f'{JSON[:-1]}, "x0": [1, 2], "x1": [3, 4e0], "name": "n\\u00e4me", "source": "s", "note": "", '
        '"verdict": "ray"}'
    )
    problem = read(str(path))
    assert problem.x0 is not None
    assert problem.x1 is not None
    assert (problem.x0.tolist(), problem.x1.tolist()) == ([1, 2], [3, 4])
    assert (problem.name, problem.source, problem.note, problem.verdict) == ("näme", "s", "", "ray")


def test_zero_entries_in_coordinates_are_zeros(tmp_path: Path) -> None:
    path = tmp_path / "problem.json"
    coordinates = {"format": "coo", "shape": [2, 2], "rows": [1, 0], "cols": [0, 0], "values": [0, 3]}
    path.write_text(json.dumps({"M": coordinates, "q": [1, 1]}))
    assert numbers(read(str(path)))[0] == [[3, 0], [0, 0]]


def test_coordinates_without_entries_are_the_zero_matrix(tmp_path: Path) -> None:
    path = tmp_path / "problem.json"
    coordinates = {"format": "coo", "shape": [2, 2], "rows": [], "cols": [], "values": []}
    path.write_text(json.dumps({"M": coordinates, "q": [1, 1]}))
    assert numbers(read(str(path)))[0] == [[0, 0], [0, 0]]


FLOATS = st.floats(allow_nan=False, allow_infinity=False)


@st.composite
def problems(draw: st.DrawFn, *, in_coordinates: bool) -> Problem:
    """Any problem of a few unknowns that has a name."""
    n = draw(st.integers(1, 4))
    vectors = st.lists(FLOATS, min_size=n, max_size=n)
    if in_coordinates:
        places = st.tuples(st.integers(0, n - 1), st.integers(0, n - 1))
        entries = draw(st.dictionaries(places, FLOATS))
        rows, cols = [i for i, _ in entries], [j for _, j in entries]
        matrix = sparse.coo_array((list(entries.values()), (rows, cols)), shape=(n, n), dtype=float)
    else:
        matrix = draw(st.lists(vectors, min_size=n, max_size=n))
    return Problem(
        matrix,
        draw(vectors),
        name=draw(st.text(min_size=1)),
        x0=draw(st.none() | vectors),
        x1=draw(st.none() | vectors),
        solutions=draw(st.lists(vectors, max_size=3)),
        verdict=draw(st.sampled_from(["", *VERDICTS])),
        source=draw(st.text()),
        note=draw(st.text()),
    )


def everything(problem: Problem) -> list[Any]:
    """All that a problem holds, its numbers bit by bit."""
    dense = problem.M.toarray() if is_sparse(problem.M) else problem.M
    vectors = [dense, problem.q, problem.x0, problem.x1, *problem.solutions]
    bits = [None if v is None else v.tobytes() for v in vectors]
    return [*bits, is_sparse(problem.M), problem.name, problem.source, problem.note, problem.verdict]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("files")


EXTREME = [
    [SMALLEST, -SMALLEST, 2 * SMALLEST, LARGEST],
    [-LARGEST, sys.float_info.min, -0.0, 0.1],
    [1e15, 1e15 + 1, 2.0**53 - 1, 2.0**53 + 2],
    [1e22, -1e23, 1 / 3, 123456789012345.0],
]


@settings(deadline=None)
@given(problem=problems(in_coordinates=False))
@example(problem=Problem(EXTREME, EXTREME[0], name="extreme", x0=EXTREME[1], x1=EXTREME[2], solutions=EXTREME))
def test_dense_json_is_read_back_exactly(folder: Path, problem: Problem) -> None:
    write(problem, str(folder / "dense.json"))
    assert everything(read(str(folder / "dense.json"))) == everything(problem)


@settings(deadline=None)
@given(problem=problems(in_coordinates=True))
@example(problem=Problem(sparse.csr_array(EXTREME), EXTREME[0], name="extreme"))
def test_json_in_coordinates_is_read_back_exactly(folder: Path, problem: Problem) -> None:
    write(problem, str(folder / "coordinates.json"))
    assert everything(read(str(folder / "coordinates.json"))) == everything(problem)


@settings(deadline=None)
@given(problem=problems(in_coordinates=False) | problems(in_coordinates=True))
@example(problem=Problem(EXTREME, EXTREME[0]))
def test_csv_is_read_back_exactly(folder: Path, problem: Problem) -> None:
    write(problem, str(folder / "both.csv"))
    dense = problem.M.toarray() if is_sparse(problem.M) else problem.M
    assert everything(read(str(folder / "both.csv"))) == everything(Problem(dense, problem.q, name="both"))


EXAMPLE = Problem(M, Q, name="example")


@pytest.mark.parametrize("name", ["problem.txt", "problem", "problem.json.gz", "json", ".csv"])
def test_no_file_is_written_in_an_unknown_format(tmp_path: Path, name: str) -> None:
    with pytest.raises(ProblemError, match=rf"{name}.*\.json.*\.csv"):
        write(EXAMPLE, str(tmp_path / name))
    assert list(tmp_path.iterdir()) == []


def test_a_new_file_has_the_permissions_that_are_usual(tmp_path: Path) -> None:
    before = os.umask(0o027)
    try:
        write(EXAMPLE, str(tmp_path / "problem.json"))
        assert os.umask(0o027) == 0o027
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "problem.json").stat().st_mode) == 0o640


@pytest.mark.parametrize("mode", [0o600, 0o664, 0o755])
def test_an_old_file_keeps_its_permissions(tmp_path: Path, mode: int) -> None:
    path = tmp_path / "problem.json"
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


@pytest.mark.parametrize("old", [None, "old"])
@pytest.mark.parametrize(
    ("failure", "error"),
    [
        (full_disk, LCPError),
        (lambda: refused_rename(OSError(errno.EIO, "Input/output error")), LCPError),
        (lambda: refused_rename(KeyboardInterrupt()), KeyboardInterrupt),
    ],
    ids=["full-disk", "refused-rename", "interrupt"],
)
def test_a_file_that_cannot_be_written_stays_as_it_was(
    tmp_path: Path, failure: Callable[[], Any], error: type[BaseException], old: str | None
) -> None:
    path = tmp_path / "problem.json"
    if old is not None:
        path.write_text(old)
    with pytest.raises(error), failure():
        write(EXAMPLE, str(path))
    assert {entry.name: entry.read_text() for entry in tmp_path.iterdir()} == ({"problem.json": old} if old else {})


def test_a_result_that_cannot_be_written_is_told_in_one_line(lcp: Callable[..., Outcome], tmp_path: Path) -> None:
    (tmp_path / "problem.json").write_text(JSON)
    with refused_rename(OSError(errno.EIO, "Input/output error")):
        outcome = lcp("solve", str(tmp_path / "problem.json"), "-o", str(tmp_path / "result.json"))
    assert outcome.err.count("\n") == 1
    assert "result.json: cannot be written" in outcome.err
    assert (outcome.code, outcome.out) == (2, "")
    assert [entry.name for entry in tmp_path.iterdir()] == ["problem.json"]


def test_a_device_is_written_to_and_not_replaced(lcp: Callable[..., Outcome], tmp_path: Path) -> None:
    (tmp_path / "problem.json").write_text(JSON)
    with refused_rename(AssertionError("the device would have been replaced")):
        outcome = lcp("solve", str(tmp_path / "problem.json"), "-o", "/dev/null")
        write_whole("/dev/null", "text")
    assert outcome == Outcome(0, "", "")
    assert stat.S_ISCHR(Path("/dev/null").stat().st_mode)


def test_a_full_device_is_told_in_one_line(lcp: Callable[..., Outcome], tmp_path: Path) -> None:
    (tmp_path / "problem.json").write_text(JSON)
    outcome = lcp("solve", str(tmp_path / "problem.json"), "-o", "/dev/full")
    assert outcome.err.count("\n") == 1
    assert "/dev/full: cannot be written" in outcome.err
    assert (outcome.code, outcome.out) == (2, "")


def test_a_pipe_is_written_to_and_not_replaced(tmp_path: Path) -> None:
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


def test_a_problem_is_read_from_a_pipe() -> None:
    reader, writer = os.pipe()
    try:
        os.write(writer, JSON.encode())
        os.close(writer)
        assert numbers(read(f"/dev/fd/{reader}")) == (M, Q)
    finally:
        os.close(reader)


@pytest.mark.parametrize("ending", ["md", "tex", "csv", "json", "txt"])
def test_a_name_that_is_no_unicode_does_not_lose_the_result(
    lcp: Callable[..., Outcome], tmp_path: Path, ending: str
) -> None:
    (tmp_path / "problem.json").write_text(JSON[:-1] + ', "name": "half \\ud83d"}')
    outcome = lcp("solve", str(tmp_path / "problem.json"), "-o", str(tmp_path / f"result.{ending}"))
    assert outcome == Outcome(0, "", "")
    assert "half" in (tmp_path / f"result.{ending}").read_text(encoding="utf-8")


ARRAYS = {
    "lists": M,
    "tuples": tuple(tuple(row) for row in M),
    "lists-of-numpy-numbers": [[np.float64(2), np.int64(-1)], [np.float32(-0.5), np.uint8(2)]],
    "float64": np.array(M),
    "float32": np.array(M, dtype=np.float32),
    "float16": np.array(M, dtype=np.float16),
    "longdouble": np.array(M, dtype=np.longdouble),
    "big-endian": np.array(M, dtype=">f8"),
    "columns-first": np.array(M, order="F"),
    "slice": np.kron(M, np.ones((2, 3)))[::2, ::3],
    "matrix-of-numpy": np.asmatrix(M),
    "csr-matrix": sparse.csr_matrix(M),
    **{kind: sparse.coo_array(M).asformat(kind) for kind in ("csr", "csc", "coo", "lil", "dok", "dia", "bsr")},
    "coo-with-duplicates": sparse.coo_array(
        ([1.0, 1.0, -1.0, -0.5, 5.0, -3.0], ([0, 0, 0, 1, 1, 1], [0, 0, 1, 0, 1, 1])), shape=(2, 2)
    ),
    "csr-with-duplicates": sparse.csr_array(([1.0, -1.0, 1.0, 2.0, -0.5], [0, 1, 0, 1, 0], [0, 3, 5]), shape=(2, 2)),
    "csc-with-duplicates": sparse.csc_array(([-0.5, 1.0, 1.0, 2.0, -1.0], [1, 0, 0, 1, 0], [0, 3, 5]), shape=(2, 2)),
    "csr-not-in-order": sparse.csr_array(([-1.0, 2.0, 2.0, -0.5], [1, 0, 1, 0], [0, 2, 4]), shape=(2, 2)),
}


def parts(matrix: Any) -> list[Any]:
    """The memory of a matrix, copied, and what kind of matrix it is."""
    if not is_sparse(matrix):
        return [type(matrix), np.array(matrix).tolist()]
    arrays = [getattr(matrix, name, None) for name in ("data", "row", "col", "indices", "indptr", "rows", "offsets")]
    held = deepcopy([array.tolist() for array in arrays if isinstance(array, np.ndarray)])
    return [type(matrix), matrix.nnz, matrix.toarray().tolist(), *held]


@pytest.mark.parametrize("matrix", ARRAYS.values(), ids=ARRAYS)
def test_a_matrix_of_any_kind_is_taken_with_the_right_values_and_left_alone(matrix: Any) -> None:
    before = parts(matrix)
    problem = Problem(matrix, Q)
    assert numbers(problem) == (M, Q)
    assert problem.M.dtype == np.float64
    assert is_sparse(problem.M) == is_sparse(matrix)
    assert not is_sparse(matrix) or problem.M.has_canonical_format
    for method in ("shi", "fixed-point"):
        assert run(problem, method).status.exit_code == 0
    assert parts(matrix) == before


def test_integers_become_floats() -> None:
    problem = Problem(np.array([[2, 1], [-3, 2]]), np.array([-1, 1], dtype=np.int8), x0=np.array([7, 8], np.uint8))
    assert numbers(problem) == ([[2, 1], [-3, 2]], [-1, 1])
    assert {v.dtype for v in (problem.M, problem.q, problem.x0) if v is not None} == {np.dtype(float)}


def test_single_precision_is_taken_as_it_is() -> None:
    tenth = np.float32(0.1)
    assert numbers(Problem(np.array([[tenth]]), np.array([tenth]))) == ([[float(tenth)]], [float(tenth)])


def test_vectors_are_taken_from_lists_tuples_and_arrays_and_left_alone() -> None:
    arrays = [np.array(Q), np.array([0.5, 1.0]), np.array([1.0, 0.5]), np.array([0.5, 0.0])]
    for array in arrays:
        array.setflags(write=False)
    q, x0, x1, z = arrays
    problem = Problem(M, q, x0=x0, x1=x1, solutions=(z, [0.5, 0.0], (0.5, 0)))
    assert [solution.tolist() for solution in problem.solutions] == [[0.5, 0.0]] * 3
    for method in ("shi", "fixed-point"):
        assert run(problem, method).status.exit_code == 0


OTHER_THAN_REAL = {
    "object": np.array([[2, 0], [0, 2]], dtype=object),
    "complex": np.array([[2, 0], [0, 2]], dtype=complex),
    "bool": np.array([[True, False], [False, True]]),
    "str": np.array([["2", "0"], ["0", "2"]]),
    "bytes": np.array([[b"2", b"0"], [b"0", b"2"]]),
    "datetime64": np.array([["2004-07-01", "2012-02-01"]] * 2, dtype="datetime64[D]"),
}


@pytest.mark.parametrize("kind", OTHER_THAN_REAL)
def test_a_matrix_of_other_than_real_numbers_is_refused_by_name(kind: str) -> None:
    with pytest.raises(ProblemError, match=rf"^M: .*{kind}.*; give real numbers"):
        Problem(OTHER_THAN_REAL[kind], Q)


@pytest.mark.parametrize("kind", OTHER_THAN_REAL)
@pytest.mark.parametrize("field", ["q", "x0", "x1", "solution"])
def test_a_vector_of_other_than_real_numbers_is_refused_by_name(kind: str, field: str) -> None:
    vector = OTHER_THAN_REAL[kind][0]
    fields = {"q": Q} | ({"solutions": [vector]} if field == "solution" else {field: vector})
    with pytest.raises(ProblemError, match=rf"^{field}: .*{kind}.*; give real numbers"):
        Problem(M, **fields)


@pytest.mark.parametrize("kind", ["complex", "bool"])
def test_a_sparse_matrix_of_other_than_real_numbers_is_refused_by_name(kind: str) -> None:
    with pytest.raises(ProblemError, match=rf"^M: .*{kind}.*; give real numbers"):
        Problem(sparse.csr_array(OTHER_THAN_REAL[kind]), Q)


@pytest.mark.parametrize(
    ("matrix", "place"),
    [
        (np.array([[2, 0], [0, np.nan]]), "M[1][1]: "),
        (sparse.csr_array([[2, 0], [0, np.nan]]), "M[1][1]: "),
        (sparse.coo_array(([LARGEST, LARGEST], ([1, 1], [0, 0])), shape=(2, 2)), "M[1][0]: "),
        (np.ones((2, 3)), "M: is 2 x 3"),
        (sparse.csc_array(np.ones((3, 3))), "M: is 3 x 3"),
        (np.ones(2), "M: has 1 dimension; "),
        (np.ones((2, 2, 2)), "M: has 3 dimensions; "),
        ([[10**400, 0], [0, 1]], "M: holds an integer beyond"),
        ([[True, 0], [0, 1]], "M[0][0]: is true"),
        ([[1, 0], [np.False_, 1]], "M[1][0]: is false"),
        ({"a": 1}, "M: is an object"),
    ],
)
def test_a_matrix_that_does_not_fit_is_refused_at_its_place(matrix: Any, place: str) -> None:
    with pytest.raises(ProblemError) as refusal:
        Problem(matrix, Q)
    assert str(refusal.value).startswith(place)


@pytest.mark.parametrize("q", [np.ones((2, 1)), np.float64(1), range(2), iter(Q), "12", None, sparse.csr_array([Q])])
def test_q_that_is_no_flat_list_is_refused_by_name(q: Any) -> None:
    with pytest.raises(ProblemError, match=r"^q: .*; give a .*list of numbers"):
        Problem(M, q)


def test_a_vector_is_read_by_the_name_that_it_is_asked_for(tmp_path: Path) -> None:
    (tmp_path / "start.csv").write_text("1\n2\n")
    assert read_vector("x0", str(tmp_path / "start.csv")).tolist() == [1, 2]
    (tmp_path / "start.csv").write_text("1,2\n3,4\n")
    with pytest.raises(ProblemError, match=r"start\.csv: x0: "):
        read_vector("x0", str(tmp_path / "start.csv"))
