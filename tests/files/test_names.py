"""The unknowns of a problem may have names, which files keep and tables show. Rows and
columns of CSV that are labelled by these in another order are refused; a model may have
its q elsewhere."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from lcpcli import Problem, from_qp, read, write
from lcpcli.errors import ProblemError

from ..conftest import save_json
from ..wordings import NO_SUCH_FILE

NAMES = ["a", "b", "c"]
M = {"M": [[4, -1, 0], [-1, 4, -1], [0, -1, 4]], "names": NAMES}
NAMED = {
    "name": "market",
    "M": [[2, 1], [1, 2]],
    "q": [-5, -6],
    "names": ["north sea", "süd"],
}


@pytest.fixture(autouse=True)
def folder(in_folder):
    save_json(in_folder / "p.json", M | {"q": [-1, 2, -3]})
    return in_folder


@pytest.mark.parametrize("ending", ["json", "npz", "mat"])
def test_several_q_belong_to_a_file_of_M_with_bounds_and_names(ending, lcp, folder):
    save_json(
        folder / "m.json",
        M | {"lower": [None, 0, 0], "upper": [9, 9, 0.5], "q": [0, 0, 0]},
    )
    assert lcp("convert", "m.json", "-o", f"whole.{ending}").code == 0
    whole = read(f"whole.{ending}")
    given = {
        "M": whole.M,
        "names": list(whole.names),
        "lower": whole.lower,
        "upper": whole.upper,
    }
    if ending == "json":
        save_json(
            folder / "alone.json", M | {"lower": [None, 0, 0], "upper": [9, 9, 0.5]}
        )
    elif ending == "npz":
        np.savez(folder / "alone.npz", **given)
    else:
        savemat(
            folder / "alone.mat",
            given | {"names": np.array(given["names"], dtype=object)},
        )
    (folder / "qs.csv").write_text(",base,tax\na,-1,1\nb,2,2\nc,-3,-3\n")
    lines = lcp(
        "solve", f"alone.{ending}", "qs.csv", "--format", "json"
    ).out.splitlines()
    records = [json.loads(line) for line in lines]
    assert [record["z"] for record in records] == [
        pytest.approx([0.25, 0, 0.5]),
        pytest.approx([-0.25, 0, 0.5]),
    ]
    assert [(record["problem"], record["names"]) for record in records] == [
        ("base", NAMES),
        ("tax", NAMES),
    ]
    alone = lcp(
        "solve", f"alone.{ending}", "qs.csv", "--exact", "--format", "json"
    ).out.splitlines()
    assert [json.loads(line)["exact"]["z"] for line in alone] == [
        ["1/4", "0", "1/2"],
        ["-1/4", "0", "1/2"],
    ]


def test_a_link_to_nothing_is_a_file_that_is_missing(lcp, folder):
    (folder / "nightly").mkdir()
    (folder / "nightly" / "a.json").symlink_to(folder / "gone.json")
    (folder / "nightly" / "p.json").write_text((folder / "p.json").read_text())
    assert f"nightly/a.json: {NO_SUCH_FILE}; " in lcp("solve", "nightly").err


def test_columns_of_one_name_leave_the_rows_where_they_are(folder):
    (folder / "p.csv").write_text(",a,b,a,q\na,2,0,1,-1\na,0,3,0,-2\nb,1,0,4,-3\n")
    assert read("p.csv").M.tolist() == [[2, 0, 1], [0, 3, 0], [1, 0, 4]]


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("A title\n2,1,-5\n1,2,-6\n", ["", ""]),
        ("prices,of,a market,in,May\n2,1,-5\n1,2,-6\n", ["", ""]),
        ("A title;;\na;b;q\n2;1;-5\n1;2;-6\n", ["a", "b"]),
        ("a;b;q\n2;1;-5\n1;2;-6\n;;\n", ["a", "b"]),
        ("a;b;q;;\n2;1;-5;;\n1;2;-6;;\n", ["a", "b"]),
        ("2;1;-5;\n1;2;-6;\n", ["", ""]),
        ("2020,2021,q\n2,1,-5\n1,2,-6\n", ["2020", "2021"]),
        ("1,2,q\n2,1,-5\n1,2,-6\n", ["", ""]),
        (",wheat,corn,q\na,2,1,-5\nb,1,2,-6\n", ["wheat", "corn"]),
        ("no,wheat,corn,q\n1,2,1,-5\n2,1,2,-6\n", ["wheat", "corn"]),
        ("wheat,corn,q,lower\n2,1,-5,0\n1,2,-6,\n", ["wheat", "corn"]),
        ("M1,M2,q\n2,1,-5\n1,2,-6\n", ["", ""]),
        ("a,a,q\n2,1,-5\n1,2,-6\n", ["", ""]),
        ("a,,q\n2,1,-5\n1,2,-6\n", ["", ""]),
    ],
)
def test_a_header_names_the_unknowns_unless_it_is_a_title_or_numbers(
    text, names, folder
):
    (folder / "p.csv").write_text(text)
    problem = read("p.csv")
    assert list(problem.names) == names
    assert problem.M.tolist() == [[2, 1], [1, 2]]
    assert problem.q.tolist() == [-5, -6]


def test_a_workspace_may_have_other_names_and_a_program_has_its_own():
    savemat("w.mat", {"M": NAMED["M"], "q": NAMED["q"], "names": [1.0, 2.0, 3.0]})
    assert list(read("w.mat").names) == ["", ""]
    program = from_qp(None, [1], columns=["x"])
    with pytest.raises(ProblemError, match="names: cannot be combined with origin"):
        Problem(program.M, program.q, origin=program.origin, names=["z"])


HEADINGS = [
    ["wheat", "price n0"],
    ["wheat", "q"],
    ["wheat", "Lower"],
    ["wheat", "1st"],
    ["a,b", "c"],
    ["wheat", ""],
]


@pytest.mark.parametrize("names", HEADINGS)
def test_a_table_is_headed_by_names_that_a_header_can_hold(names, lcp):
    header = "wheat,price n0,q" if names == HEADINGS[0] else None
    save_json(Path("p.json"), {"M": [[2, 1], [1, 2]], "q": [-5, 3], "names": names})
    converted = lcp("convert", "p.json", "-o", "p.csv")
    assert ("left out: names" in converted.err) == (header is None)
    first = Path("p.csv").read_text().splitlines()[0]
    assert first == (header or "2.0,1.0,-5.0")
    assert read("p.csv").q.tolist() == [-5, 3]
    assert list(read("p.csv").names) == (names if header else ["", ""])
    write(Problem([[2, 1], [1, 2]], [-5, 3], lower=[0, -1], names=names), "b.csv")
    first = Path("b.csv").read_text().splitlines()[0]
    assert first == (f"{header},lower,upper" if header else "M1,M2,q,lower,upper")
    assert read("b.csv").box.lower.tolist() == [0, -1]


def test_a_table_is_headed_by_the_names_of_a_formulation(lcp):
    inequality = {"H": [[2, 1], [0, 2]], "h": [-1, -1], "A": [[1, 1]]}
    names = {"row_lower": [1], "rows": ["flour"], "columns": ["bread", "milk"]}
    save_json(Path("p.json"), inequality | names)
    converted = lcp("convert", "p.json", "-o", "p.csv")
    form = "written as the conditions of the variational inequality, M, q and bounds"
    assert converted.err == f"lcp: wrote p.csv\nlcp: p.csv: {form}\n"
    assert list(read("p.csv").names) == ["bread", "milk", "flour"]
    contact = {"W": np.eye(3).tolist(), "q": [-1, 0, 0], "mu": [0.5], "dimension": 3}
    save_json(Path("c.json"), contact)
    names = list(read("c.json").names)
    converted = lcp("convert", "c.json", "-o", "c.csv")
    assert any(names)
    is_headed = list(read("c.csv").names) == names
    assert ("names" in converted.err) == (not is_headed)


def test_a_program_in_mps_is_no_list_of_its_conditions(lcp):
    program = {"c": [1, 1], "A": [[1, 1]], "row_lower": [1], "name": "my prog"}
    save_json(Path("p.json"), program | {"source": "a book"})
    converted = lcp("convert", "p.json", "-o", "p.mps")
    needed = "as MPS needs unique names without spaces or control characters"
    changed = f"1 name had to be changed, {needed}: 'my prog' is 'my_prog'"
    assert converted.err.splitlines() == [
        "lcp: wrote p.mps",
        "lcp: p.mps: the format keeps only the program; left out: source",
        f"lcp: p.mps: {changed}",
    ]
