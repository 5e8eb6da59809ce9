"""Texts that can be read safely are read to the right numbers, as other programs write
them, in one file or in two; what is not read is refused by its name."""

import io
import json
import sys
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from scipy import sparse

from lcpcli import Problem, read, run, write
from lcpcli.files import beside, contents
from lcpcli.files.beside import read_start

from .. import exact
from ..conftest import JSON, M, Q, numbers, save_json
from ..wordings import ADD_Q, NO_Q
from .binary import mat, npy

MARK = b"\xef\xbb\xbf"


def feed(monkeypatch, content):
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(content)))


SPELLINGS = {
    "blanks": b"  2 -1   -1\n-0.5  2 0.25  \n",
    "blanks-around-commas": b"2 , -1 , -1\n -0.5,\t2, 0.25\n",
    "byte-order-mark-and-header": MARK + b"a,b,q\n2,-1,-1\n-0.5,2,0.25\n",
    "cr": b"2,-1,-1\r-0.5,2,0.25\r",
    "blank-lines": b"\n \n2,-1,-1\n\t\n\n-0.5,2,0.25\n\n",
    "header": b"z1,z2,q\n2,-1,-1\n-0.5,2,0.25\n",
    "header-with-inches": b'5";z2;q\n2;-1;-1\n-0.5;2;0.25\n',
    "header-below-a-comment": b"# a, b\nz1,z2,q\n2,-1,-1\n-0.5,2,0.25\n",
    "comments": b"# M; q Sch\xc3\xa4fer\n2,-1,-1\n  # the second row\n-0.5,2,0.25\n#\n",
    "quoted-numbers-after-blanks": b'"2", "-1", "-1"\n"-0.5", "2", "0.25"\n',
    "quoted-numbers-parted-by-blanks": b'"2" "-1"  "-1"\n"-0.5" "2" "0.25"\n',
    "signs-and-exponents": b"+2,-1E0,-10e-1\n-.5,2.,+2.5e-01\n",
    "decimal-commas": b"2;-1;-1\n-0,5;2;0,25\n",
    "decimal-commas-between-tabs": b"2\t-1\t-1\n-0,5\t2\t0,25\n",
    "named-index-of-pandas": b",z1,z2,q\na,2,-1,-1\nb,-0.5,2,0.25\n",
    "names-below-a-named-corner": b"asset,z1,z2,q\na,2,-1,-1\nb,-0.5,2,0.25\n",
    "named-numbers-over-numbers": b"id,0,1,q\n0,2,-1,-1\n1,-0.5,2,0.25\n",
    "named-numbers-over-all-numbers": b"id,0,1,2\n0,2,-1,-1\n1,-0.5,2,0.25\n",
    "names-as-R-writes-them": b'"","z1","z2","q"\n"a",2,-1,-1\n"b",-0.5,2,0.25\n',
    "numbers-from-0-beside-bounds": b"id,z1,z2,q,lower\n0,2,-1,-1,0\n1,-0.5,2,0.25,0\n",
    "index-and-decimal-commas": b";0;1;q\n0;2;-1;-1\n1;-0,5;2;0,25\n",
    "utf-16-of-excel": "z1\tz2\tq\r\n2\t-1\t-1\r\n-0,5\t2\t0,25\r\n".encode("utf-16"),
    "utf-16-big-endian": b"\xfe\xff" + "2,-1,-1\n-0.5,2,0.25\n".encode("utf-16-be"),
    "json-crlf-and-blank-lines": f"\n\n {JSON}\n\n".replace(" ", "\r\n").encode(),
    "json-exponents": b'{"M": [[2e0, -1E+0], [-5e-1, 20e-1]], "q": [-1.0, 25e-2]}',
    "json-other-order": b'{"q": [-1, 0.25], "M": [[2, -1], [-0.5, 2]]}',
    "json-coordinates": b"""{"M": {"format": "coo", "shape": [2, 2],
                              "rows": [0, 0, 1, 1], "cols": [0, 1, 0, 1],
                              "values": [2, -1, -0.5, 2]}, "q": [-1, 0.25]}""",
    "json-coordinates-unordered": b"""{"q": [-1, 0.25],
                                      "M": {"values": [2, -0.5, -1, 2],
                                            "cols": [1, 0, 1.0, 0e0],
                                            "rows": [1, 1, 0, 0],
                                            "shape": [2.0, 2e0], "format": "coo"}}""",
}


@pytest.mark.parametrize("spelling", SPELLINGS)
def test_every_safe_spelling_is_read_from_a_file_and_from_standard_input(
    spelling, tmp_path, monkeypatch
):
    for suffix in ("csv", "txt", *(["json"] if spelling.startswith("json") else [])):
        (tmp_path / f"problem.{suffix}").write_bytes(SPELLINGS[spelling])
        problem = read(tmp_path / f"problem.{suffix}")
        assert numbers(problem) == (M, Q)
        assert problem.name == "problem"
    feed(monkeypatch, SPELLINGS[spelling])
    problem = read("-")
    assert numbers(problem) == (M, Q)
    assert problem.name == "standard input"


VECTORS = {
    "row": b"-1,0.25\n",
    "column": b"-1\n0.25\n",
    "row-of-semicolons": b"-1;0.25",
    "row-below-a-header": b"a,b\n-1,0.25\n",
    "column-below-a-header": b"q\r\n-1\r\n0.25\r\n",
    "column-with-blank-lines": b"\n-1\n\n0.25",
    "column-with-comments": b"# q\n-1\n# and\n0.25",
    "column-with-one-in-quotes": b'"-1"\n0.25\n',
    "byte-order-mark": MARK + b"-1\n0.25\n",
    "json-list-in-lines": b"\n[\r\n-1,\r\n25e-2\r\n]\r\n",
    "json-list-with-mark": MARK + b"[-1, 0.25]",
}


@pytest.mark.parametrize("content", VECTORS.values(), ids=VECTORS)
def test_q_and_a_start_are_read_from_a_file(tmp_path, content, monkeypatch):
    (tmp_path / "M.csv").write_bytes(b"2,-1\n-0.5,2\n")
    (tmp_path / "q.csv").write_bytes(content)
    feed(monkeypatch, content)
    for q in (str(tmp_path / "q.csv"), "-"):
        problem = read(tmp_path / "M.csv", q)
        assert numbers(problem) == (M, Q)
        assert problem.name == "M"
    assert read_start("--x0", str(tmp_path / "q.csv"), 2).tolist() == Q


INDICES = {
    "of-names": b"id,0,1\na,2,-1\nb,-0.5,2\n",
    "of-numbers": b"id,0,1\n0,2,-1\n1,-0.5,2\n",
    "of-the-headings": b"year,2019,2020\n2019,2,-1\n2020,-0.5,2\n",
}


@pytest.mark.parametrize("content", INDICES.values(), ids=INDICES)
def test_M_with_a_named_index_is_read_beside_a_q_of_its_own(tmp_path, content):
    (tmp_path / "M.csv").write_bytes(content)
    for q in (b"q\n-1\n0.25\n", b"id,0\n0,-1\n1,0.25\n"):
        (tmp_path / "q.csv").write_bytes(q)
        assert numbers(read(tmp_path / "M.csv", tmp_path / "q.csv")) == (M, Q)


def test_a_start_is_taken_from_a_file_or_hundreds_of_typed_numbers(lcp, tmp_path):
    file, start = str(tmp_path / "problem.json"), str(tmp_path / "start")
    Path(file).write_text(JSON)
    Path(start).write_text("-1\n0.25\n")
    for number, option in enumerate(("--x0", "--x1")):
        options = f"{option} {start} --format json --trace --max-iterations 1"
        trace = lcp(f"solve {file} --method shi {options}").record["trace"]
        assert trace[number]["z"] == [0, 0.5]
    write(Problem(2 * sparse.eye_array(300, format="csr"), np.full(300, -1.0)), file)
    outcome = lcp("solve", file, "--x0", ",".join(["0.25"] * 300), "-q")
    assert outcome.code == 0
    assert outcome.err == ""


FILES = {
    "M.npy": npy(np.array(M)),
    "q.npy": npy(np.array(Q)[:, None]),
    "M.mat": mat(M=M),
    "b.mat": mat(b=Q),
    "p.csv": b"2,-1,-1\n-0.5,2,0.25\n",
    "q.csv": b";0\n0;-1\n1;0,25\n",
}


@pytest.fixture
def folder(in_folder, monkeypatch):
    for name, content in FILES.items():
        (in_folder / name).write_bytes(content)
    # Whose times are not looked at here.
    monkeypatch.setattr("lcpcli.solving.driver.MAX_REPETITIONS", 1)
    return in_folder


def test_a_file_that_holds_M_alone_takes_exactly_the_next_one(folder, lcp):
    files = "p.csv M.npy q.npy M.mat b.mat p.csv"
    found = lcp(f"compare {files} --method newton --format json")
    assert [json.loads(line)["problem"] for line in found.out.splitlines()] == [
        "p",
        "M",
        "M",
        "p",
    ]
    assert lcp("compare p.csv M.npy").err.strip() == (
        f"lcp: M.npy: {NO_Q}; {ADD_Q}".format("2 x 2")
    )
    lcp(f"bench {files} --method newton --budget 0 -q -o b.json")
    record = json.loads((folder / "b.json").read_text())
    assert [case["name"] for case in record["cases"]] == [
        "p.csv",
        "M.npy q.npy",
        "M.mat b.mat",
    ]
    record["measurements"].clear()
    save_json(folder / "b.json", record)
    assert lcp("bench --resume b.json -q").code == 0
    assert all(
        row["success"]
        for row in json.loads((folder / "b.json").read_text())["measurements"]
    )


@pytest.mark.usefixtures("in_folder")
def test_numbers_are_typed_in_any_usual_way_unless_a_file_has_their_name(lcp):
    Path("p.csv").write_text("1,0,0,-1\n0,1,0,2.5\n0,0,1,-1\n")
    for text in ("1 -2.5 1/3", "[1, -2.5, 1/3]", " 1; -2.5;1/3", "[1,-2.5 1/3]"):
        assert beside.typed_numbers("--x0", text) == ["1", "-2.5", "1/3"]
        assert lcp("solve p.csv -q --x0", text).code == 0
        solution = text.replace("-2.5", "0").replace("1/3", "3/3")
        assert lcp("check", "p.csv", solution).code == 0
    assert beside.typed_vector("--x0", ["1", "-2.5", "1/3"], 3).tolist() == [
        1,
        -2.5,
        1 / 3,
    ]
    Path("1").write_text("5")
    assert beside.typed_numbers("--x0", "1") is None
    assert beside.typed_numbers("--x0", "2") == ["2"]
    assert beside.typed_numbers("--x0", "p.csv") is None


FOLDER = Path(contents.shipped_path("paper-example-1.json")).parent
NAMES = sorted(path.name for path in FOLDER.glob("*.json"))


@pytest.fixture(params=NAMES)
def problem(request):
    return read(contents.shipped_path(request.param))


def test_these_problems_ship():
    others = [
        "paper-example-1.json",
        "paper-example-2.json",
        "tridiagonal-100.json",
        "two-unknowns.json",
    ]
    assert ["bimatrix.json", "diode-bridge.json", *others] == NAMES


def test_each_has_a_name_a_source_and_a_solution_and_stands_in_the_folders_readme(
    problem,
):
    assert f"{problem.name}.json" in NAMES
    assert problem.source
    assert problem.solutions
    assert (
        f"| {problem.name}.json | {problem.n} |" in (FOLDER / "README.md").read_text()
    )


def test_known_solutions_are_exact_solutions(problem):
    """Each component is taken as the nearest fraction of small denominator, and the
    problem is checked in fractions."""
    for solution in problem.solutions:
        given = [Fraction(t) for t in solution.tolist()]
        z = [value.limit_denominator(1000) for value in given]
        assert max(
            abs(near - value) for near, value in zip(z, given, strict=True)
        ) <= Fraction(1, 10**15)
        assert exact.solves(problem, z)


def test_each_is_read_by_its_name_from_any_folder(in_folder):
    for name, file in contents.shipped_problems().items():
        for given in (name, file.name):
            assert np.array_equal(read(given).q, read(file).q)
    assert not list(in_folder.iterdir())


def test_every_command_that_reads_a_problem_takes_the_names(in_folder, lcp):
    assert lcp("solve bimatrix -o result.json").code == 0
    for line in (
        "solve winkels --all",
        "compare two-unknowns --method newton",
        "check bimatrix result.json",
        "inspect hs21",
        "convert portfolio -o portfolio.mat -q",
        "bench two-unknowns --method newton --budget 0 -q",
    ):
        outcome = lcp(line)
        assert (outcome.code, outcome.err) == (0, ""), line
    assert (in_folder / "portfolio.mat").exists()


@pytest.mark.parametrize(
    "content",
    [
        5000 * b"\n" + b'{"M": [[2, 1], [1, 2]], "q": [-5, -6]}',
        b'{"M": [[2, 1], [1, 2]], "q": [-5, -6]}' + 50_000 * b"\n",
        50_000 * b"\n" + b"2,1,-5\n1,2,-6\n" + 50_000 * b"\n",
        b"2,1,-5" + 50_000 * b"," + b"\n1,2,-6" + 50_000 * b"," + b"\n",
    ],
    ids=["before an object", "after an object", "around a table", "empty columns"],
)
def test_blanks_around_a_problem_take_no_time(content, lcp, in_folder):
    """Time that grew with the square of their number would be a minute."""
    (in_folder / "problem").write_bytes(content)
    outcome = lcp("solve problem -f json")
    assert outcome.record["z"] == pytest.approx([4 / 3, 7 / 3])


@pytest.mark.parametrize("method", ["shi", "fixed-point"])
def test_all_but_the_game_are_solved_by_both_methods(problem, method):
    result = run(problem, method, max_iterations=300)
    assert result.solved is (problem.name != "bimatrix")
