"""Answers in files, z and w or all solutions, in CSV or JSON, which lcp reads back;
iterates have their own file."""

import csv
import json
from io import StringIO

import pytest

from lcpcli import Trace, read, run
from lcpcli.files import contents

EXAMPLE = contents.shipped_path("paper-example-2.json")

PROBLEMS = {
    "murty": '{"M": [[1, 2], [2, 1]], "q": [-1, -1]}',
    "faces": '{"M": [[0, 1], [0, 0]], "q": [-1, 0]}',
    "line": '{"M": [[0, 0], [0, 1]], "q": [0, -0.1], "lower": [null, 0]}',
    "both": (
        '{"A": [[2, 2], [2, 1]], "B": [[2, 2], [2, 1]], "rows": ["go", "stay"], '
        '"columns": ["left, or", "right"]}'
    ),
}


def table(file):
    return list(
        csv.DictReader(
            line for line in StringIO(file.read_text()) if not line.startswith("#")
        )
    )


@pytest.fixture
def folder(in_folder, monkeypatch):
    # Whose times are not looked at here.
    monkeypatch.setattr("lcpcli.solving.driver.MAX_REPETITIONS", 1)
    for name, text in PROBLEMS.items():
        (in_folder / f"{name}.json").write_text(text)
    return in_folder


def test_rows_selected_from_a_trace_are_those_of_a_trace_kept_for_them():
    whole = Trace()
    run(read(EXAMPLE), "fixed-point", trace=whole)
    for most in (None, 5, 12, 39):
        alone = Trace(5, most)
        run(read(EXAMPLE), "fixed-point", trace=alone)
        assert [row.k for row in whole.selected(5, most, None).rows] == [
            row.k for row in alone.rows
        ]


@pytest.mark.parametrize("exact", [[], ["--exact"]], ids=["rounded", "exact"])
@pytest.mark.parametrize("form", ["json", "csv"])
@pytest.mark.parametrize("name", ["faces", "line", "both", "transport"])
def test_each_solution_of_a_list_is_checked(name, form, exact, lcp, folder):
    """The lists are of an LCP, a mixed problem, a game and a program."""
    problem = f"{name}.json" if (folder / f"{name}.json").exists() else name
    assert (
        lcp(
            "solve", problem, "--all", *exact, "--format", form, "-o", f"all.{form}"
        ).code
        == 0
    )
    outcome = lcp("check", problem, f"all.{form}", *exact, "--format", "json")
    vertices = {"faces": 1 + (form == "csv"), "line": 1, "both": 3, "transport": 2}
    assert outcome.code == 0
    assert outcome.err == ""
    assert len(outcome.records) == vertices[name]


@pytest.mark.parametrize(
    ("name", "swapped", "cell", "other"),
    [("murty", (2, 3), 4, "5"), ("both", (12, 13), 3, "")],
    ids=["z1-and-z2", "probabilities-of-two-columns"],
)
def test_wrong_solution_among_others_in_csv_is_told_apart(
    name, swapped, cell, other, lcp, folder
):
    assert lcp(f"solve {name}.json --all --format csv -o all.csv").code == 0
    lines = (folder / "all.csv").read_text().splitlines()
    first, second = (next(csv.reader([lines[k]])) for k in swapped)
    first[cell], second[cell] = second[cell], other or first[cell]
    for k, row in zip(swapped, (first, second), strict=True):
        lines[k] = ",".join(f'"{text}"' for text in row)
    (folder / "all.csv").write_text("\n".join(lines))
    outcome = lcp(f"check {name}.json all.csv --format json")
    correct = [json.loads(line)["accepted"] for line in outcome.out.splitlines()]
    assert outcome.code == 1
    assert correct.count(False) == 1
