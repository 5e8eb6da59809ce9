"""What is written is read back exactly, in every format."""

from __future__ import annotations

import math
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy import sparse

from lcpcli import Problem, read, write
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.problem import VERDICTS

from ..small_problem import M, Q

LARGEST, SMALLEST = sys.float_info.max, math.ulp(0.0)
FLOATS = st.floats(allow_nan=False, allow_infinity=False)


@st.composite
def bounds(draw: st.DrawFn, n: int) -> dict[str, list[float]]:
    """Any bounds of n unknowns, infinite ones among them; or none."""
    if draw(st.booleans()):
        return {}
    pairs = draw(st.lists(st.tuples(st.floats(allow_nan=False), st.floats(allow_nan=False)), min_size=n, max_size=n))
    lower, upper = ([choose(pair) for pair in pairs] for choose in (min, max))
    return {
        "lower": [-math.inf if value == math.inf else value for value in lower],
        "upper": [math.inf if value == -math.inf else value for value in upper],
    }


@st.composite
def problems(draw: st.DrawFn, *, in_coordinates: bool, with_bounds: bool = True) -> Problem:
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
        **(draw(bounds(n)) if with_bounds else {}),
    )


def everything(problem: Problem) -> list[Any]:
    """All that a problem holds, its numbers bit by bit."""
    dense = problem.M.toarray() if is_sparse(problem.M) else problem.M
    bounds = [np.asarray(bound) for bound in (problem.lower, problem.upper)]
    vectors = [dense, problem.q, problem.x0, problem.x1, *bounds, *problem.solutions]
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
BOUNDED = Problem(
    *(EXTREME, EXTREME[0]),
    name="bounded",
    lower=[-math.inf, -0.0, SMALLEST, -LARGEST],
    upper=[-SMALLEST, 0.0, math.inf, 1e308],
)


DENSE, SPARSE = problems(in_coordinates=False), problems(in_coordinates=True)
UNBOUNDED = problems(in_coordinates=False, with_bounds=False) | problems(in_coordinates=True, with_bounds=False)
WHOLE = Problem(EXTREME, EXTREME[0], name="extreme", x0=EXTREME[1], x1=EXTREME[2], solutions=EXTREME)
WHOLE_SPARSE = Problem(sparse.csr_array(EXTREME), EXTREME[0], name="extreme", solutions=EXTREME[:1])
RANDOM = settings(deadline=None, max_examples=15)


def check_written(problem: Problem, folder: Path, *names: str) -> None:
    """What is written to the first file is read back from all these exactly."""
    write(problem, str(folder / names[0]))
    assert everything(read(*(str(folder / name) for name in names))) == everything(problem)


@RANDOM
@given(problem=DENSE | SPARSE)
@example(problem=WHOLE)
@example(problem=WHOLE_SPARSE)
@example(problem=BOUNDED)
def test_json_is_read_back_exactly(folder: Path, problem: Problem) -> None:
    check_written(problem, folder, "all.json")


@RANDOM
@given(problem=DENSE | SPARSE)
@example(problem=WHOLE)
@example(problem=BOUNDED)
def test_csv_is_read_back_exactly(folder: Path, problem: Problem) -> None:
    dense = problem.M.toarray() if is_sparse(problem.M) else problem.M
    kept = Problem(dense, problem.q, name="both", lower=problem.lower, upper=problem.upper)
    check_written(kept, folder, "both.csv")


@RANDOM
@given(problem=DENSE | SPARSE)
@example(problem=BOUNDED)
def test_mat_is_read_back_with_all_bounds(folder: Path, problem: Problem) -> None:
    write(Problem(problem.M, problem.q, lower=problem.lower, upper=problem.upper), str(folder / "all.mat"))
    assert everything(read(str(folder / "all.mat")))[4:6] == everything(problem)[4:6]


def texts_end_without_nul(problem: Problem) -> bool:
    return not any(text.endswith("\0") for text in (problem.name, problem.source, problem.note))


@RANDOM
@given(problem=(DENSE | SPARSE).filter(texts_end_without_nul))
@example(problem=WHOLE)
@example(problem=WHOLE_SPARSE)
@example(problem=BOUNDED)
def test_npz_is_read_back_exactly(folder: Path, problem: Problem) -> None:
    check_written(problem, folder, "all.npz")


@RANDOM
@given(problem=UNBOUNDED)
@example(problem=WHOLE)
@example(problem=WHOLE_SPARSE)
def test_matrix_market_is_read_back_exactly(folder: Path, problem: Problem) -> None:
    check_written(Problem(problem.M, problem.q, name="pair"), folder, "pair.mtx", "pair.q.mtx")


def test_scipy_reads_the_sparse_matrix_of_an_npz(tmp_path: Path) -> None:
    write(Problem(sparse.csr_array(M), Q), str(tmp_path / "problem.npz"))
    assert sparse.load_npz(tmp_path / "problem.npz").toarray().tolist() == M
