"""Programs in MPS and in the LP format: what is read of each of their features, and
that nothing is lost on the way."""

import sys

import numpy as np
import pytest

from lcpcli import from_qp, read, run, write
from lcpcli.errors import ProblemError
from lcpcli.formulations.quadratic_program.program import Program
from lcpcli.linalg.matrices import is_sparse
from lcpcli.model.problem import conditions_of

INF = np.inf
TRIANGLE = " bread bread 2\n bread milk -1\n milk milk 4\n"
FEATURES = """* every kind of row and bound
NAME          features
OBJSENSE
    MAX
ROWS
 N  profit
 N  other
 L  low
 G  high
 E  equal
 E  equal2
COLUMNS
    x  profit  1.5  low  1
    x  high  -2e0
    y  profit  -.25   equal  4
    y  other  3
    z  equal2  1  low  1
    z  profit  0
RHS
    rhs  low  4  high  -1
    rhs  equal  2  equal2  3
    rhs  profit  -7
RANGES
    rng  low  2.5  high  3
    rng  equal  2  equal2  -2
BOUNDS
 MI bnd x
 UP bnd x -1
 FR bnd y
 LO bnd z 1
 UP bnd z 1e1
ENDATA
"""


def program(problem):
    assert isinstance(problem.origin, Program)
    data = problem.origin.blocks(conditions_of(problem))
    assert data is not None
    return problem.origin, data


def written(folder, text, name="p.mps"):
    (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    return folder / name


def test_rows_ranges_bounds_names_constant_and_sense_are_read(tmp_path):
    problem = read(written(tmp_path, FEATURES))
    origin, data = program(problem)
    assert problem.name == "features"
    assert origin.sense == "max"
    assert origin.constant == 7
    assert origin.columns == ("x", "y", "z")
    assert origin.rows == ("low", "high", "equal", "equal2")
    assert (-data.c).tolist() == [1.5, -0.25, 0]
    assert np.array(data.A).tolist() == [[1, 0, 1], [-2, 0, 0], [0, 4, 0], [0, 0, 1]]
    assert data.row_lower.tolist() == [1.5, -1, 2, 1]
    assert data.row_upper.tolist() == [4, 2, 4, 3]
    assert data.lower.tolist() == [-INF, -INF, 1]
    assert data.upper.tolist() == [-1, INF, 10]
    in_small_letters = FEATURES.replace("OBJSENSE\n    MAX", "objsense\n    max")
    assert read(written(tmp_path, in_small_letters)).origin == origin


def test_fixed_format_with_spaces_in_names(tmp_path):
    lines = ["NAME          fixed", "ROWS", " N  COST", " G  ROW ONE", "COLUMNS"]
    lines += ["    COL ONE   COST               1.0   ROW ONE            2.0", "RHS"]
    lines += ["    RHS       ROW ONE            6.0", "ENDATA", ""]
    origin, data = program(read(written(tmp_path, "\n".join(lines))))
    assert origin.columns == ("COL ONE",)
    assert origin.rows == ("ROW ONE",)
    assert data.A[0, 0] == 2
    assert data.row_lower[0] == 6


def test_the_lp_format_is_read(tmp_path):
    pytest.importorskip("highspy")
    lines = [
        "max",
        " obj: 3 x - y + [ -2 x^2 + 2 x * y - 4 y^2 ] / 2 + 5",
        "st",
        " r: x + y >= 1",
        " s: x + y <= 4",
    ]
    lines += [
        " t: x + y >= -1e30",
        "bounds",
        " -1e20 <= x <= 1e25",
        " y <= 9e19",
        " z free",
        "end",
        "",
    ]
    origin, data = program(
        read(written(tmp_path, "\n".join(lines).replace("5\n", "5 + 0 z\n", 1), "p.lp"))
    )
    assert origin.sense == "max"
    assert origin.constant == 5
    assert (-np.array(data.Q)).tolist() == [[-2, 1, 0], [1, -4, 0], [0, 0, 0]]
    assert data.row_lower.tolist() == [1, -INF, -INF]
    assert data.row_upper.tolist() == [INF, 4, INF]
    assert data.lower.tolist() == [-INF, 0, -INF]
    assert data.upper.tolist() == [INF, 9e19, INF]


def test_exact_answers_are_of_the_decimals_in_the_file(tmp_path, lcp):
    pytest.importorskip("flint")
    text = "NAME e\nROWS\n N c\n G r\nCOLUMNS\n x c 0.1 r 0.3\nRHS\n b r 0.7\nENDATA\n"
    outcome = lcp(f"solve {written(tmp_path, text)} --exact --format json")
    assert outcome.record["answer"]["exact"] == {"x": ["7/3"], "y": ["1/3"]}


def test_without_its_reader_the_extra_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "highspy", None)
    with pytest.raises(
        ProblemError, match="the LP format, which needs highspy; pip install highspy"
    ):
        read(written(tmp_path, "min\n obj: x\nst\n r: x >= 1\nend\n", "p.lp"))
    assert read(written(tmp_path, FEATURES)).name == "features"


def test_large_programs_are_sparse_and_small_ones_dense(tmp_path):
    def text(k):
        columns = "".join(f" x{j} c 1 r 1\n" for j in range(k))
        return f"NAME n\nROWS\n N c\n G r\nCOLUMNS\n{columns}RHS\n b r 1\nENDATA\n"

    assert [is_sparse(read(written(tmp_path, text(k))).M) for k in (5, 500)] == [
        False,
        True,
    ]


DIET = """NAME diet
ROWS
 N cost
 G protein
 L fat
COLUMNS
 bread cost 2 protein 8
 milk cost 3 protein 9
 milk fat 1
RHS
 r protein 36 fat 5
BOUNDS
 UP b bread 4
ENDATA
"""


UP = " UP b bread 4"
# What is other than in DIET, and what is read of it.
READ = {
    "entries of any size": (
        {"protein 8": "protein 1e-12", "fat 1": "fat 1e17"},
        {"A": [[1e-12, 9], [0, 1e17]]},
    ),
    "a triangle of the quadratic part": (
        {"ENDATA": f"QUADOBJ\n{TRIANGLE}ENDATA"},
        {"Q": [[2, -1], [-1, 4]]},
    ),
    "the whole matrix": (
        {"ENDATA": f"QMATRIX\n{TRIANGLE} milk bread -1\nENDATA"},
        {"Q": [[2, -1], [-1, 4]]},
    ),
    "sides of 1e20": (
        {"protein 36 fat 5": "protein -1e20 fat 1e30"},
        {"row_lower": 2 * [-INF], "row_upper": 2 * [INF]},
    ),
    "a range of 1e20": (
        {"BOUNDS": "RANGES\n g protein 1e20\nBOUNDS"},
        {"row_lower": [36, -INF], "row_upper": [INF, 5]},
    ),
    "a range of an equation": (
        {"L fat": "E fat", "BOUNDS": "RANGES\n g fat -1e25\nBOUNDS"},
        {"row_lower": [36, -INF]},
    ),
    "bounds of 1e20": (
        {UP: " LO b bread -1e20\n UP b bread 1e20"},
        {"lower": [-INF, 0], "upper": [INF, INF]},
    ),
    "a bound below 1e20": (
        {UP: " MI b bread\n UP b bread 9.9e19"},
        {"lower": [-INF, 0], "upper": [9.9e19, INF]},
    ),
    "a fixed variable": ({UP: " FX b bread 2"}, {"lower": [2, 0], "upper": [2, INF]}),
    "a number behind PL": (
        {UP: " PL b bread 0"},
        {"lower": [0, 0], "upper": [INF, INF]},
    ),
    "a variable of the quadratic part alone": (
        *(
            {UP: " UP b rye 3", "ENDATA": "QUADOBJ\n rye rye 1\nENDATA"},
            {"Q": np.diag([0, 0, 1]), "upper": [INF, INF, 3]},
        ),
    ),
    "line ends, blank lines and comments": ({"\n": "\r\n* a comment\r\n\r\n"}, {}),
    "remarks after dollar signs": (
        {" milk fat 1": " milk fat 1 $ a remark", UP: f"{UP} $ another"},
        {},
    ),
    "names of sets and blanks missing": (
        {" r protein": " protein", " UP b": " UP", " milk cost": "milk cost"},
        {},
    ),
    "headings in small letters": (
        {name: name.lower() for name in ("NAME", "ROWS", "COLUMNS", "RHS", "BOUNDS")},
        {},
    ),
    "another free row with a side": (
        {" G prot": " N price\n G prot", "fat 5": "fat 5\n r price 7"},
        {},
    ),
}


@pytest.mark.parametrize("name", READ)
def test_what_is_written_in_another_way_is_read(name, tmp_path):
    text, (changes, told) = DIET, READ[name]
    for old, new in changes.items():
        assert old in text
        text = text.replace(old, new)
    plain, other = read(written(tmp_path, DIET)), read(written(tmp_path, text))
    _, data = program(other)
    assert {field: np.array(getattr(data, field)).tolist() for field in told} == {
        field: np.array(value).tolist() for field, value in told.items()
    }
    if not told:
        assert np.array_equal(plain.M, other.M)
        assert np.array_equal(plain.q, other.q)
        assert other.origin == plain.origin


def test_sides_are_read_back_as_the_doubles_that_they_were(tmp_path):
    """In doubles 0.3 - 0.1 is not 0.2. A row without sides has none."""
    sides = {"row_lower": [0.1, -INF, -INF, 0.5], "row_upper": [0.3, INF, 0.7, INF]}
    write(
        from_qp(None, [1.0, 1.0], np.ones((4, 2)) + np.eye(4, 2), **sides),
        tmp_path / "p.mps",
    )
    assert " 0.2\n" in (tmp_path / "p.mps").read_text()  # the range in decimals
    _, found = program(read(tmp_path / "p.mps"))
    rows = sorted(zip(found.row_lower.tolist(), found.row_upper.tolist(), strict=True))
    assert [row for row in rows if row != (-INF, INF)] == [
        (-INF, 0.7),
        (0.1, 0.3),
        (0.5, INF),
    ]


def test_sides_beyond_the_range_of_doubles_are_no_bounds(tmp_path):
    """With and without a range that is infinite, too."""
    text = (
        "NAME n\nROWS\n N c\n L low\n G high\nCOLUMNS\n x c 1 low 1\n x high "
        "1\nRHS\n b low 1e400 high -1e400\n"
    )
    for ranges in ("", "RANGES\n r low 1e400 high 1e20\n"):
        _, found = program(read(written(tmp_path, f"{text}{ranges}ENDATA\n")))
        assert [found.row_lower.tolist(), found.row_upper.tolist()] == [
            [-INF, -INF],
            [INF, INF],
        ]


def test_a_variable_of_the_quadratic_part_alone_in_lp(tmp_path):
    pytest.importorskip("highspy")
    lp = (
        "Minimize\n obj: y + [ x^2 ] / 2\nSubject To\n c: y >= 1\nBounds\n 2 <= x "
        "<= 40\nEnd\n"
    )
    assert run(read(written(tmp_path, lp, "p.lp"))).answer.objective == pytest.approx(3)


def test_names_in_lp_may_have_bytes_that_are_not_utf_8(tmp_path):
    pytest.importorskip("highspy")
    file = tmp_path / "p.lp"
    file.write_bytes(b"min\n obj: a\xe9\nst\n c\xe9: a\xe9 >= 1\nend\n")
    problem = read(file)
    assert [*problem.names] == ["a\ufffd", "c\ufffd"]
    assert run(problem).answer.objective == pytest.approx(1)
