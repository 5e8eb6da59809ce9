"""What is written is read back exactly, in every format; lcp convert keeps the digits
that were written, from each text format to each other one."""

import json
import math
import sys
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy import sparse

from lcpcli import Problem, read, write
from lcpcli.cli.make import read_written
from lcpcli.cli.problems import Inputs
from lcpcli.files import writing
from lcpcli.files.formats import COMPLETE
from lcpcli.linalg.matrices import dense, is_sparse
from lcpcli.model.problem import VERDICTS
from lcpcli.rational.numbers import decimal, fraction, places

from ..conftest import M, Q, read_exact

LARGEST, SMALLEST = sys.float_info.max, math.ulp(0.0)
FLOATS = st.floats(allow_nan=False, allow_infinity=False)


@st.composite
def bounds(draw, n):
    """Any bounds of n unknowns, infinite ones among them; or none."""
    if draw(st.booleans()):
        return {}
    pairs = draw(
        st.lists(
            st.tuples(st.floats(allow_nan=False), st.floats(allow_nan=False)),
            min_size=n,
            max_size=n,
        )
    )
    lower, upper = ([choose(pair) for pair in pairs] for choose in (min, max))
    return {
        "lower": [-math.inf if value == math.inf else value for value in lower],
        "upper": [math.inf if value == -math.inf else value for value in upper],
    }


@st.composite
def problems(draw, *, in_coordinates):
    """Any problem of a few unknowns that has a name."""
    n = draw(st.integers(1, 4))
    vectors = st.lists(FLOATS, min_size=n, max_size=n)
    if in_coordinates:
        places = st.tuples(st.integers(0, n - 1), st.integers(0, n - 1))
        entries = draw(st.dictionaries(places, FLOATS))
        rows, cols = [i for i, _ in entries], [j for _, j in entries]
        matrix = sparse.coo_array(
            (list(entries.values()), (rows, cols)), shape=(n, n), dtype=float
        )
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
        names=draw(
            st.sampled_from(
                [[], ["north sea", "süd", "", "a name longer than a column"][:n]]
            )
        ),
        **draw(bounds(n)),
    )


def everything(problem):
    """All that a problem holds, its numbers bit by bit."""
    bounds = [np.asarray(bound) for bound in (problem.lower, problem.upper)]
    vectors = [
        dense(problem.M),
        problem.q,
        problem.x0,
        problem.x1,
        *bounds,
        *problem.solutions,
    ]
    bits = [None if v is None else v.tobytes() for v in vectors]
    texts = [problem.name, problem.source, problem.note, problem.verdict]
    return [*bits, is_sparse(problem.M), *texts, list(problem.names)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
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


WHOLE = Problem(
    EXTREME, EXTREME[0], name="extreme", x0=EXTREME[1], x1=EXTREME[2], solutions=EXTREME
)
WHOLE_SPARSE = Problem(
    sparse.csr_array(EXTREME), EXTREME[0], name="extreme", solutions=EXTREME[:1]
)
KEPT = {  # what a file keeps, by its name
    "all.json": lambda whole: whole,
    "all.npz": lambda whole: whole,
    "all.mat": lambda whole: Problem(
        whole.M, whole.q, name="all", lower=whole.lower, upper=whole.upper
    ),
    "all.csv": lambda whole: Problem(
        dense(whole.M), whole.q, name="all", lower=whole.lower, upper=whole.upper
    ),
    "all.mtx": lambda whole: Problem(whole.M, whole.q, name="all"),
}


@pytest.mark.parametrize("name", KEPT)
@settings(max_examples=8)
@given(problem=problems(in_coordinates=False) | problems(in_coordinates=True))
@example(problem=WHOLE)
@example(problem=WHOLE_SPARSE)
@example(problem=BOUNDED)
def test_what_a_file_keeps_is_read_back_exactly(folder, name, problem):
    if name == "all.npz" and any(
        text.endswith("\0") for text in (problem.name, problem.source, problem.note)
    ):
        return  # which numpy leaves out
    kept = KEPT[name](problem)
    write(kept, folder / name)
    assert everything(read(*map(str, files_of(folder / name)))) == everything(kept)


def test_scipy_reads_the_sparse_matrix_of_an_npz(tmp_path):
    write(Problem(sparse.csr_array(M), Q), str(tmp_path / "problem.npz"))
    assert sparse.load_npz(tmp_path / "problem.npz").toarray().tolist() == M


DIGITS = "0.1000000000000000055511151231257827"
INTEGER = "123456789012345678901234567891"
NUMBERS = st.one_of(
    st.integers(-9, 9).map(str),
    st.floats(-1e9, 1e9).map(repr),
    st.integers(-(10**30), 10**30).map(str),
    st.tuples(st.integers(0, 10**25), st.integers(-60, 5)).map(
        lambda pair: f"{pair[0]}e{pair[1]}"
    ),
    st.sampled_from(
        [
            "0.1",
            DIGITS,
            "0.10000000000000001",
            "0.1" + 30 * "0" + "1",
            "-0.09999999999999999999",
            "1e-400",
        ]
    ),
    st.sampled_from(["3.00000000000000000001", "2.99999999999999999999", INTEGER]),
)
MODERATE = NUMBERS.filter(
    lambda text: not fraction(text) or 1e-6 < abs(fraction(text)) < 1e14
)  # as HiGHS takes them


def convert(*arguments):
    *files, output = map(str, arguments)
    written = read_written(Inputs(files))
    writing.write_as(written, output, as_program=True)


def files_of(path):
    """The file of a problem, with that of q beside it."""
    return [
        path,
        *([path.with_suffix(f".q{path.suffix}")] if path.suffix == ".mtx" else []),
    ]


def exact(path):
    """All numbers of a problem as they are written."""
    held = read_exact(*map(str, files_of(path)))
    rows = [
        {j: Fraction(a, scale) for j, a in row.items() if a}
        for row, scale in zip(held.rows, held.scales, strict=True)
    ]
    q = [
        Fraction(a, scale) for a, scale in zip(held.constants, held.scales, strict=True)
    ]
    return [rows, q, held.lower, held.upper]


@st.composite
def texts(draw):
    n = draw(st.integers(1, 3))
    numbers = st.lists(NUMBERS, min_size=n, max_size=n)
    upper = st.none() | NUMBERS.map(lambda text: text.lstrip("-"))
    bounds = st.just([None] * n) | st.lists(upper, min_size=n, max_size=n)
    return draw(st.lists(numbers, min_size=n, max_size=n)), draw(numbers), draw(bounds)


@settings(max_examples=5)
@given(problem=texts(), in_coordinates=st.booleans())
@example(
    problem=([[DIGITS, "0.1"], ["0", INTEGER]], ["-" + DIGITS, "1e-400"], [None, None]),
    in_coordinates=True,
)
@example(
    problem=([["1", "0"], [INTEGER, DIGITS]], ["0", "-" + DIGITS], [DIGITS, None]),
    in_coordinates=False,
)
def test_every_text_format_passes_the_digits_on(folder, problem, in_coordinates):
    M, q, upper = problem
    n, listed = len(q), plain(M)
    if in_coordinates:
        places_of = [(i, j) for i in range(n) for j in range(n)]
        rows_of, columns_of = (
            plain([str(place[k]) for place in places_of]) for k in (0, 1)
        )
        values = plain([M[i][j] for i, j in places_of])
        listed = (
            f'{{"format": "coo", "shape": [{n}, {n}], "rows": {rows_of}, "cols": '
            f'{columns_of}, "values": {values}}}'
        )
    (folder / "a.json").write_text(
        f'{{"M": {listed}, "q": {plain(q)}, "upper": {plain(upper)}}}'
    )
    rows = [
        {j: fraction(text) for j, text in enumerate(row) if fraction(text)} for row in M
    ]
    expected = [
        rows,
        list(map(fraction, q)),
        [0] * n,
        [None if text is None else fraction(text) for text in upper],
    ]
    formats = ["json", "csv", *["mtx"] * (upper == [None] * n)]
    for first in formats:
        convert(folder / "a.json", folder / f"b.{first}")
        assert exact(folder / f"b.{first}") == expected
        for second in formats:
            convert(*files_of(folder / f"b.{first}"), folder / f"c.{second}")
            assert exact(folder / f"c.{second}") == expected


def plain(value):
    if isinstance(value, list):
        return f"[{', '.join(map(plain, value))}]"
    return (
        "null"
        if value is None
        else json.dumps(value)
        if value in ("min", "max")
        else value
    )


def numbers_of(data):
    """The numbers of a program, and null; as by default where it has none."""
    k = len(data["c"])
    default = {
        "Q": [[0] * k] * k,
        "lower": [0] * k,
        "upper": [None] * k,
        "constant": 0,
        "sense": "min",
    }
    return default | {
        key: _fractions(value)
        for key, value in data.items()
        if key not in ("rows", "columns", "name")
    }


def _fractions(value):
    if isinstance(value, list):
        return list(map(_fractions, value))
    return (
        fraction(value)
        if isinstance(value, str) and value not in ("min", "max")
        else value
    )


@settings(max_examples=5)
@given(
    numbers=st.lists(MODERATE, min_size=15, max_size=15),
    sense=st.sampled_from(["min", "max"]),
)
def test_programs_keep_their_digits_in_json_and_mps(folder, numbers, sense):
    a, b, c, constant, *others = numbers
    low, high = sorted(others[:2], key=fraction)
    program = {
        "Q": [[a, b], [b, c]],
        "c": others[2:4],
        "A": [others[k : k + 2] for k in (4, 5, 7, 9)],
    }
    program |= {
        "row_lower": [low, low, None, high],
        "row_upper": [high, None, high, high],
    }
    program |= {
        "lower": [low, None],
        "upper": [high, high],
        "sense": sense,
        "constant": constant,
    }
    (folder / "p.json").write_text(
        "{"
        + ", ".join(f'"{key}": {plain(value)}' for key, value in program.items())
        + "}"
    )
    for step in (["q.json"], ["q.mps", "r.mps", "q.json"]):
        files = [folder / name for name in ["p.json", *step]]
        for source, target in pairwise(files):
            convert(source, target)
        held = json.loads(files[-1].read_text(), parse_int=str, parse_float=str)
        assert numbers_of(held) == numbers_of(program)


def test_games_keep_their_payoffs(folder, lcp):
    (folder / "g.json").write_text(
        f'{{"A": [[{DIGITS}, "1/3"], [{INTEGER}, 2]], "B": [[1, 2], [3, 0.25]]}}'
    )
    convert(folder / "g.json", folder / "h.json")
    held = json.loads((folder / "h.json").read_text(), parse_int=str, parse_float=str)
    assert held == {
        "name": "g",
        "A": [[DIGITS, "1/3"], [INTEGER, "2"]],
        "B": [["1", "2"], ["3", "0.25"]],
    }
    (folder / "g.nfg").write_text(
        'NFG 1 R "a" {"1" "2"} {2 1} 1/3 2 0.10000000000000000555 1\n'
    )
    convert(folder / "g.nfg", folder / "h.json")
    held = json.loads((folder / "h.json").read_text(), parse_int=str, parse_float=str)
    assert held["A"] == [["1/3"], ["0.10000000000000000555"]]
    outcome = lcp(f"convert {folder / 'g.nfg'} -o {folder / 'h.csv'}")
    assert outcome.err.splitlines()[2:] == [
        f"lcp: {folder}/h.csv: some numbers have more digits than doubles and "
        "were rounded; .json would keep them all"
    ]


@pytest.mark.parametrize("ending", ["npz", "mat", "npy"])
def test_doubles_are_rounded_with_one_remark(folder, lcp, ending):
    (folder / "a.json").write_text(
        f'{{"M": [[{DIGITS}, 0], [0, {INTEGER}]], "q": [0, -1]}}'
    )
    output = folder / f"a.{ending}"
    outcome = lcp(f"convert {folder / 'a.json'} -o {output}")
    assert outcome.code == 0
    assert outcome.err.count("\n") == 2
    assert "were rounded" in outcome.err
    again = read(*([output, folder / "a.q.npy"] if ending == "npy" else [output]))
    assert again.M.tolist() == [[0.1, 0.0], [0.0, float(INTEGER)]]
    (folder / "b.json").write_text('{"M": [[0.1]], "q": [-0.3333333333333333]}')
    assert lcp(f"convert {folder / 'b.json'} -o {folder / f'b.{ending}'} -q").err == ""


@settings(max_examples=30)
@given(value=st.fractions(max_denominator=10**6), power=st.integers(0, 400))
def test_decimals_are_exact(value, power):
    number = value.numerator / Fraction(10) ** power
    assert fraction(decimal(number)) == number
    assert (places(Fraction(1, value.denominator)) is None) == (
        10**40 % value.denominator != 0
    )


# A problem of each formulation, with all that its file may have.
FORMULATIONS = {
    "program": """{"Q": [[-2, 0.1], [0.1, -3]], "c": [-1, 1e5],
        "A": [[1, 1], [1e-6, 2]], "row_lower": [0.25, null], "row_upper": [0.75, 9],
        "lower": [null, 2], "upper": [null, 2], "sense": "max", "constant": 0.1,
        "name": "odd", "note": "a note", "rows": ["R 1,", ""],
        "columns": ["-ä;", ""]}""",
    "game": """{"A": [[3, 0], [0, 2]], "B": [[2, 0], [0, 3]], "rows": ["go", "stay"],
        "columns": ["left", "far right"], "players": ["Ann", "Bo"]}""",
    "inequality": """{"H": [[2, 1], [0, 2]], "h": [-1, -1], "A": [[1, 1], [1, -1]],
        "row_lower": [-1, 0], "row_upper": [2, null], "lower": -1,
        "rows": ["flour", "salt"], "columns": ["bread", "süß"]}""",
    "fit": """{"lsq": true, "A": [[1, 1], [1, 2], [1, 3]], "b": [1, 2, 2], "lower": 0,
        "upper": [1, null], "E": [[1, 1]], "d": [1], "columns": ["level", "slope"]}""",
    "players": """{"sizes": [1, 1], "H": [[2, 1], [1, 2]], "c": [-1, -2],
        "A": [[1, 1], [1, 0]], "row_lower": [null, 0], "row_upper": [1, 3],
        "owner": [null, "Ann"], "shared": "each", "players": ["Ann", "Bo"],
        "rows": ["limit", "line"], "columns": ["x", "yield"]}""",
    "polymatrix": """{"players": ["Ann", "Bo", "Cid"],
        "actions": [["go", "stay"], ["left", "far right"], ["up", "down"]],
        "payoffs": {"Ann": {"Bo": [[3, "-1/3"], [0, 2]]}, "Bo": {"Cid":
        [[2, 0], [0, 3]]}, "Cid": {"Ann": [[1, 0], [0, 1]]}}}""",
    "contact": """{"W": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]],
        "q": [-1, 0, 1, 0], "mu": [0.5, 0.25], "restitution": [0.5, 0],
        "before": [-2, 0, -1, 0]}""",
    "contact in space": """{"W": {"format": "coo", "shape": [3, 3], "rows": [0, 1, 2],
        "cols": [0, 1, 2], "values": [1, 1, 1]}, "q": [-1, 0, 1], "mu": 0.5,
        "dimension": 3, "facets": 6}""",
    "friction indices": """{"A": [[1, 0.2], [0.2, 2]], "b": [-1, -3],
        "lo": [0, -0.5], "hi": [null, 0.5], "findex": [-1, 0]}""",
    "problem": """{"M": [[2, 0], [0, 2]], "q": [-1, -1], "names": ["a", "süß"]}""",
}


@pytest.mark.parametrize("as_program", [False, True])
@pytest.mark.parametrize("ending", COMPLETE)
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_what_a_problem_was_made_from_is_read_back(
    formulation, ending, as_program, tmp_path
):
    """In its own keys, or beside M, q and bounds, with all names."""
    given, direct, back = (tmp_path / f"{name}.json" for name in ("a", "direct", "b"))
    given.write_text(FORMULATIONS[formulation])
    held = tmp_path / f"held{ending}"
    problem = read(given)
    write(problem, held, as_program=as_program)
    again = read(held)
    assert everything(again) == everything(problem)
    for each, path in ((problem, direct), (again, back)):
        write(each, path, as_program=True)
    written = json.loads(back.read_text())
    assert written == json.loads(direct.read_text())
    assert written.keys() >= json.loads(given.read_text()).keys()
