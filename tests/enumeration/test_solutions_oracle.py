"""All solutions of random small problems, many of them with whole faces of solutions, and what a list of solutions says
that was cut by number or by time, against an exact oracle.

LCP_ORACLE=3000 in the environment sets the number of problems with up to 5 unknowns; here it is fewer, with up to 4.
"""

from __future__ import annotations

import json
import os
import re
from fractions import Fraction
from itertools import count
from typing import Any

import numpy as np
import pytest

import lcpcli
from lcpcli.enumeration.search import ENOUGH, TIME_LIMIT, Solutions, SolutionSet
from lcpcli.files.contents import Source
from lcpcli.report import solutions

from . import solution_sets as oracle

COUNT = int(os.environ.get("LCP_ORACLE", "100"))
SIX, LISTS = COUNT // 25, COUNT // 10  # problems with 6 unknowns; lists that are cut, of each kind
MOST = 5 if "LCP_ORACLE" in os.environ else 4


def agrees(M: np.ndarray, q: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> list[oracle.Hull]:
    """The pieces of a problem, each once, which are those of the oracle."""
    found = lcpcli.solutions(lcpcli.Problem(M, q, lower=lower, upper=upper))
    pieces = [oracle.canonical(piece.vertices, piece.rays, piece.lines) for piece in found]
    assert found.complete
    assert len(set(pieces)) == len(pieces)
    assert set(pieces) == oracle.maximal(oracle.in_fractions(M, q, lower, upper)), (M, q, lower, upper)
    return pieces


def test_the_pieces_are_the_maximal_polyhedra_of_all_choices_of_states() -> None:
    generator = np.random.default_rng(17)
    sets = [agrees(*oracle.random_problem(generator, MOST)) for _ in range(COUNT)]
    assert sum(not pieces for pieces in sets) > 0.05 * COUNT
    assert sum(len(pieces) > 1 for pieces in sets) > 0.1 * COUNT
    assert sum(any(len(hull.vertices) > 1 for hull in pieces) for pieces in sets) > 0.05 * COUNT
    assert sum(any(hull.rays for hull in pieces) for pieces in sets) > 0.2 * COUNT
    assert sum(any(hull.lines for hull in pieces) for pieces in sets) > 0.02 * COUNT


def test_six_unknowns() -> None:
    generator = np.random.default_rng(23)
    sets = [agrees(*oracle.random_problem(generator, 6, 6)) for _ in range(SIX)]
    assert sum(len(pieces) > 1 for pieces in sets) > 0.1 * SIX


def test_unknowns_between_two_bounds() -> None:
    """Of each w_i one sign is asked for at one bound and the other one at the other: nothing that is chosen for one
    branch of the tree holds in another one."""
    generator, count = np.random.default_rng(5), COUNT // 5
    sets = []
    for _ in range(count):
        n = int(generator.integers(2, 5))
        M, q = generator.integers(-2, 3, (n, n)).astype(float), generator.integers(-2, 3, n).astype(float)
        lower = generator.integers(-1, 1, n).astype(float)
        sets.append(agrees(M, q, lower, lower + generator.integers(1, 3, n)))
    assert min(map(len, sets)) > 0
    assert sum(len(pieces) > 1 for pieces in sets) > 0.2 * count


Whole = set[oracle.Hull]


def random_game(generator: np.random.Generator) -> lcpcli.Problem:
    """A game of up to 3 x 3 strategies with few different payoffs, so that most have ties."""
    shape = tuple(generator.integers(1, 4, 2).tolist())
    return lcpcli.from_game(*generator.integers(0, generator.integers(2, 4), (2, *shape)))


def whole_of(found: Solutions) -> Whole:
    """All pieces, by the oracle."""
    data = found.problem
    rows = [
        tuple(Fraction(row.get(j, 0), d) for j in range(data.n)) for row, d in zip(data.rows, data.scales, strict=True)
    ]
    q = tuple(Fraction(value, d) for value, d in zip(data.constants, data.scales, strict=True))
    return oracle.maximal(oracle.Data(rows, q, list(data.lower), list(data.upper)))


def connected(hulls: Whole) -> int:
    """The number of components: parts that share no vertex."""
    parts: list[set[Any]] = []
    for hull in hulls:
        apart = [part for part in parts if not part & hull.vertices]
        joined = set(hull.vertices).union(*(part for part in parts if part & hull.vertices))
        parts = [*apart, joined]
    return len(parts)


def check(found: Solutions, whole: Whole, ended: str) -> tuple[bool, bool | None]:
    """Compare all that a list says with the whole; whether it is complete, and whether there are others."""
    pieces = [oracle.canonical(piece.vertices, piece.rays, piece.lines) for piece in found.pieces]
    assert len(set(pieces)) == len(pieces)
    assert set(pieces) <= whole, "a piece is a maximal one"
    assert found.others in ((False,) if len(pieces) == len(whole) and found.complete else (True, None))
    assert found.others is not True or len(pieces) < len(whole)
    assert not found.complete or set(pieces) == whole
    shown = SolutionSet(found, ended, 0.0)
    held = json.loads(solutions.report(shown, Source("file", None), exact=True).render("json"))
    assert (held["complete"], held["others"], len(held["pieces"])) == (found.complete, found.others, len(pieces))
    assert (held["status"] == ended) == (not found.complete)
    vertices = {vertex for piece in found.pieces for vertex in piece.vertices}
    assert {tuple(map(Fraction, each["z"])) for each in held["solutions"]} == vertices
    isolated = [hull for hull in pieces if len(hull.vertices) == 1 and not hull.rays and not hull.lines]
    check_words(shown.message, found, len(isolated), whole)
    (section,) = solutions.build(shown, exact=True, form="table").sections
    assert section.settled == found.complete
    if found.equilibria is None:
        assert held["components"] is None
    else:
        check_game(found, whole, held)
        assert found.complete or not any("sum to" in remark for remark in section.remarks)
    return found.complete, found.others


def check_words(message: str, found: Solutions, isolated: int, whole: Whole) -> None:
    """The sentence says the same."""
    number = len(found.pieces)
    if not number:
        assert ("no solution: " in message) == (found.complete and not whole)
        return
    assert ("proved to be" in message) == found.complete
    assert ("only one" in message) == (found.complete and len(whole) == isolated == 1)
    assert ("there are others" in message) == (found.others is True)
    assert ("there may be others" in message) == (found.others is None)
    assert ("infinitely many" in message) == (isolated < number)
    assert ("all isolated" in message) <= (found.complete and isolated == len(whole))
    numbers = dict(zip(("faces", "subsets", "components"), (number - isolated, number, connected(whole)), strict=True))
    for word, expected in numbers.items():
        for stated in re.findall(rf"(\d+) (?:maximal Nash )?{word[:-1]}", message):
            assert int(stated) == expected
            assert found.complete or word != "components"


def check_game(found: Solutions, whole: Whole, held: dict[str, Any]) -> None:
    """Extreme equilibria, subsets, components, degeneracy and indices of a game."""
    game, equilibria = found.problem.problem.origin, found.equilibria
    assert {k for subset in equilibria.subsets for k in subset.extreme} == set(range(len(equilibria.extreme)))
    assert [len(set(piece["vertices"])) for piece in held["pieces"]] == [len(s.extreme) for s in equilibria.subsets]
    assert all(len(subset.rows) * len(subset.columns) == len(subset.extreme) for subset in equilibria.subsets)
    assert (equilibria.components is None) == (held["components"] is None) == (not found.complete)
    if found.complete:
        assert len(held["components"]) == connected(whole)
    A, B = game.payoffs()  # type: ignore[union-attr]
    for each in equilibria.extreme:
        by_row = [oracle.dot(tuple(row), each.column) for row in A]
        by_column = [oracle.dot(column, each.row) for column in zip(*B, strict=True)]
        best = [values.count(max(values)) for values in (by_row, by_column)]
        played = [sum(value > 0 for value in strategy) for strategy in (each.column, each.row)]
        assert (each.index is None) == any(a > b for a, b in zip(best, played, strict=True))
    indices = [each.index for each in equilibria.extreme]
    assert equilibria.is_degenerate == (True if None in indices else False if found.complete else None)
    assert not found.complete or None in indices or sum(map(int, filter(None, indices))) == 1


@pytest.mark.parametrize("kind", ["game", "mixed"])
@pytest.mark.parametrize("cut", ["number", "time"])
def test_cut_list_says_nothing_that_is_false(kind: str, cut: str, monkeypatch: pytest.MonkeyPatch) -> None:
    generator, said = np.random.default_rng(31), list[tuple[bool, bool | None]]()
    for _ in range(LISTS):
        if kind == "game":
            problem = random_game(generator)
        else:
            M, q, lower, upper = oracle.random_problem(generator, 4)
            problem = lcpcli.Problem(M, q, lower=lower, upper=upper)
        whole = whole_of(lcpcli.solutions(problem))
        if cut == "number":
            found = lcpcli.solutions(problem, max_solutions=int(generator.integers(1, 4)))
            list(found)
        else:
            clock = count()
            with monkeypatch.context() as patched:
                patched.setattr("time.perf_counter", lambda clock=clock: next(clock))
                found = lcpcli.solutions(problem, time_limit=int(generator.integers(1, 60)))
                list(found)
        said.append(check(found, whole, ENOUGH if cut == "number" else TIME_LIMIT))
    assert sum(complete for complete, _ in said) > 0.1 * LISTS
    assert sum(others is (True if cut == "number" else None) for _, others in said) > 0.05 * LISTS
