"""lcp make and lcp convert write problems, programs as programs, that are read again,
and refuse the rest in a line."""

import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import lcpcli
from lcpcli import Problem, from_qp, read, write
from lcpcli.errors import Exit
from lcpcli.files import contents
from lcpcli.files.formats import COMPLETE, GENERAL_SUFFIXES
from lcpcli.gallery import families as gallery

from ..conftest import numbers
from .conftest import assert_refused


@pytest.mark.parametrize(
    ("line", "family", "arguments"),
    [
        (
            "harker-pang -n 4 --seed 3 --set symmetric=true",
            "harker-pang",
            {"n": 4, "seed": 3, "symmetric": True},
        ),
        ("harker-pang --set symmetric=No", "harker-pang", {"symmetric": False}),
        (
            "contact --set friction=1e-1 --set compliance=2",
            "contact",
            {"friction": 0.1, "compliance": 2.0},
        ),
        ("murty -o -", "murty", {}),
        ("harker-pang", "harker-pang", {}),
    ],
)
def test_options_reach_the_family(line, family, arguments, lcp, tmp_path):
    made = lcp(f"make {line}")
    assert (made.code, made.err) == (0, "")
    file = tmp_path / "made.json"
    file.write_text(made.out)
    problem, expected = read(file), gallery.make(family, **arguments)
    assert abs(problem.M - expected.M).max() == 0
    assert np.array_equal(problem.q, expected.q)


def test_the_list_shows_every_family_on_narrow_and_wide_screens(lcp, monkeypatch):
    lines = lcp("make --list").out.splitlines()
    assert max(map(len, lines)) <= 80
    assert [line.split()[0] for line in lines[3:] if not line.startswith(" ")] == list(
        gallery.FAMILIES
    )
    words = " ".join(lines).split()
    assert {"eccentricity=0.8", "symmetric=false", "epsilon=1e-08"} <= set(words)
    for family, description in gallery.FAMILIES.items():
        assert set(description.split()) <= set(words)
        assert set(gallery.entry(family).matrices.split()) <= set(words)
    monkeypatch.setenv("COLUMNS", "200")
    assert lcp("make --list").out.count("\n") == 3 + len(gallery.FAMILIES)


def test_one_line_of_some_length_refuses_long_names_and_numbers(lcp):
    for line in (["x" * 100_000], ["diagonal", "--set", f"decades={10**400}"]):
        outcome = lcp("make", *line)
        assert_refused(outcome)
        assert len(outcome.err) < 1000


PORTFOLIO = contents.shipped_path("programs/portfolio.json")


@pytest.mark.parametrize(("low", "high"), [(0.1, 1e17), (-1e17, 0.1), (-3.0, 7.0)])
def test_range_in_mps_starts_at_the_side_that_leads_to_the_other(low, high, tmp_path):
    """As other readers add a range to the right-hand side of a row G, and take it from
    that of a row L."""
    write(from_qp([[1]], [1], [[1]], row_lower=low, row_upper=high), tmp_path / "p.mps")
    words = [line.split() for line in (tmp_path / "p.mps").read_text().splitlines()]
    (kind,) = (word[0] for word in words if word[-1:] == ["r1"])
    side, size = (
        float(word[-1]) for word in words if word[0] in ("RHS", "RNG") and "r1" in word
    )
    ends = (side, side + size) if kind == "G" else (side - size, side)
    assert ends == pytest.approx((low, high), rel=1e-15, abs=0)


def test_starting_points_and_solutions_keep_the_conditions(lcp, tmp_path):
    problem = read(PORTFOLIO)
    known = replace(problem, solutions=[lcpcli.run(problem).z])
    write(known, tmp_path / "known.json")
    kept = lcp(f"convert {tmp_path / 'known.json'}").record
    assert {"M", "q", "solution"} <= {*kept}
    outcome = lcp(f"convert {tmp_path / 'known.json'} -o {tmp_path / 'known.mps'}")
    assert outcome.code == 0
    assert "left out: source, note, solution" in outcome.err


RICH = Problem(
    *([[1, 1], [1, 1]], [-1, -1], "rich", [1, 2], [3, 4], [[1, 0], [0.25, 0.75]]),
    source="a book",
    note="a note",
)


def files_of(path):
    """The file of a problem, with that of q beside it."""
    q = path.with_suffix(f".q{path.suffix}")
    return [str(path), *([str(q)] if q.exists() else [])]


@pytest.mark.parametrize(
    ("first", "second"), [*pairwise([*GENERAL_SUFFIXES, GENERAL_SUFFIXES[0]])]
)
def test_numbers_are_the_same_in_all_formats(tmp_path, lcp, first, second):
    problem = Problem([[0.1, 1e-300], [-1 / 3, 5e20]], [0.7, -2])
    write(problem, tmp_path / f"a{first}")
    outcome = lcp(
        "convert", *files_of(tmp_path / f"a{first}"), "-o", str(tmp_path / f"b{second}")
    )
    assert (outcome.code, outcome.out) == (0, "")
    assert re.fullmatch(f"lcp: wrote {tmp_path / 'b'}.*\n", outcome.err)
    assert numbers(read(*files_of(tmp_path / f"b{second}"))) == numbers(problem)


@pytest.mark.parametrize("ending", COMPLETE)
def test_complete_formats_keep_everything(tmp_path, lcp, ending):
    write(RICH, tmp_path / "a.json")
    assert lcp(f"convert {tmp_path / 'a.json'} -o {tmp_path / f'b{ending}'}").code == 0
    outcome = lcp(f"convert {tmp_path / f'b{ending}'}")
    assert outcome.out.encode() == (tmp_path / "a.json").read_bytes()


@pytest.mark.parametrize("output", ["big.json", "big.npz"])
@pytest.mark.parametrize("family", ["obstacle", "harker-pang"])
def test_a_problem_that_has_no_room_in_memory_is_refused_before_it_is_made(
    family, output, lcp, in_folder, monkeypatch
):
    monkeypatch.setattr(contents, "memory", lambda: 10**8)
    told = lcp(f"make {family} -n 2000000 -o {output}")
    assert told.err == "lcp: -n: not enough memory for this problem; give less\n"
    assert told.code == Exit.NOT_SOLVED
    assert not (in_folder / output).exists()
