"""All solutions of random small problems, many of them with whole faces of solutions,
and what a list of solutions says that was cut by number or by time, against an exact
oracle; of larger problems; and all equilibria of games.

LCP_ORACLE=3000 in the environment sets the number of problems with up to 5 unknowns;
here it is fewer, with up to 4.
"""

import gc
import json
import os
import re
from fractions import Fraction
from itertools import count

import numpy as np
import pytest
from numpy.random import default_rng

import lcpcli
from lcpcli import Problem, from_game
from lcpcli.enumeration import bimatrix, pieces
from lcpcli.enumeration.search import (
    ENOUGH,
    TIME_LIMIT,
    SolutionSet,
)
from lcpcli.files import contents
from lcpcli.files.contents import Source
from lcpcli.rational import double_description
from lcpcli.rational.dictionary import Vertex
from lcpcli.rational.exact_problem import ExactProblem, decimal_parts_of
from lcpcli.report import solutions

from . import solution_sets as oracle

# Of the rows of a matrix with positive principal minors.
SCALED = np.array([[3.0], [1.0], [7.0], [2.0]] * 5)


@pytest.mark.parametrize("kind", ["definite", "scaled", "dominant", "triangular"])
def test_the_only_solution_is_proved_to_be_the_only_one(kind):
    n, generator = 20, default_rng(1)
    A, S = generator.integers(-5, 6, (2, n, n)).astype(float)
    definite = A @ A.T + S - S.T + np.eye(n)
    M = {
        "definite": definite,
        "scaled": SCALED * definite,
        "dominant": A + 6 * n * np.eye(n),
        "triangular": np.tril(2 * np.ones((n, n)), -1) + np.eye(n),
    }[kind]
    problem = Problem(M, -generator.integers(1, 100, n).astype(float))
    found = lcpcli.solutions(problem)
    (piece,) = found
    assert piece.is_point
    assert found.complete
    assert ExactProblem.of_floats(problem).is_solution(piece.vertices[0])


def test_degenerate_points_take_no_time():
    """All 2^30 complementary sets have the solution 0."""
    generator = default_rng(0)
    coupling = generator.integers(0, 3, (30, 30)) * (1 - np.eye(30))
    for M in (np.eye(30), np.eye(30) + coupling):
        (piece,) = lcpcli.solutions(Problem(M, np.zeros(30)))
        assert piece.vertices == ((0,) * 30,)
        assert piece.states == (("lower", "basic"),) * 30


def test_a_limit_ends_the_list_which_is_then_not_complete():
    problem = Problem(-np.eye(12) + 0.01, np.ones(12))
    found = lcpcli.solutions(problem, max_solutions=3)
    assert len(list(found)) == 3
    assert len(found.points) == 3
    assert not found.complete
    assert list(found) == found.pieces
    stopped = lcpcli.solutions(problem)
    next(stopped)
    stopped.stop()
    assert list(stopped) == stopped.pieces
    assert len(stopped.pieces) == 1
    assert not stopped.complete
    unbegun = lcpcli.solutions(problem)
    unbegun.stop()
    assert list(unbegun) == []
    assert not unbegun.complete
    late = lcpcli.solutions(problem, time_limit=1e-9)
    assert list(late) == []
    assert not late.complete
    assert next(late, None) is None
    assert not late.complete


def test_blocks_are_searched_no_further_than_it_takes():
    """Two blocks of 2^30 solutions each, and one block without any beside one of
    those."""
    block = -np.eye(30) + np.ones((30, 30)) / 64
    found = lcpcli.solutions(
        Problem(np.kron(np.eye(2), block), np.ones(60)), max_solutions=5
    )
    assert (len({piece.vertices for piece in found}), found.others) == (5, True)
    M = np.zeros((32, 32))
    M[:30, :30], M[30:, 30:] = block, [[0, 1], [1, 0]]
    none = lcpcli.solutions(Problem(M, [*np.ones(30), -1, 1]))
    assert list(none) == []
    assert none.complete


def test_what_has_been_found_is_printed_and_given_again_by_one_search():
    found = lcpcli.solutions(Problem([[-1, 0], [0, -1]], [1, 1]))
    assert repr(found) == "<Solutions: 0 pieces, as far as the search has come>"
    first = next(iter(found))
    assert repr(found).startswith(
        "<Solutions: 1 piece, as far as the search has come: ("
    )
    pieces = list(found)
    assert pieces[0] is first
    assert len(pieces) == 4
    assert repr(found).startswith("<Solutions: 4 pieces, all of them: (")
    assert next(found, None) is None
    faces = lcpcli.solutions(Problem([[1, 1], [1, 1]], [-1, -1]))
    list(faces)
    assert "hull of (" in repr(faces)


def test_pieces_with_many_bases_come_last_but_all_come(monkeypatch):
    problems = [Problem(-np.ones((n, n)), np.ones(n), lower=0, upper=2) for n in (2, 3)]
    expected = [
        {str(piece) for piece in lcpcli.solutions(problem)} for problem in problems
    ]
    assert min(map(len, expected)) > 1
    monkeypatch.setattr(pieces, "MAX_BASES_AT_FIRST", 1)
    for problem, own in zip(problems, expected, strict=True):
        found = [*lcpcli.solutions(problem)]
        assert len(found) == len(own)
        assert {str(piece) for piece in found} == own


COUNT = int(os.environ.get("LCP_ORACLE", "40"))
LISTS = COUNT // 5  # lists that are cut, of each kind
MOST = 5 if "LCP_ORACLE" in os.environ else 4


def hulls_of(pieces):
    """The pieces, each once, of which those of one point count as isolated."""
    hulls = [
        oracle.canonical(piece.vertices, piece.rays, piece.lines) for piece in pieces
    ]
    assert len(set(hulls)) == len(hulls)
    assert [piece.is_point for piece in pieces] == list(map(is_isolated, hulls))
    return hulls


def is_isolated(hull):
    return len(hull.vertices) == 1 and not hull.rays and not hull.lines


def agrees(M, q, lower, upper):
    """The pieces of a problem, each once, which are those of the oracle."""
    found = lcpcli.solutions(lcpcli.Problem(M, q, lower=lower, upper=upper))
    pieces = hulls_of(found)
    assert found.complete
    assert set(pieces) == oracle.maximal(oracle.in_fractions(M, q, lower, upper)), M
    return pieces


def test_the_pieces_are_the_maximal_polyhedra_of_all_choices_of_states():
    generator = default_rng(17)
    sets = [agrees(*oracle.random_problem(generator, MOST)) for _ in range(COUNT)]
    assert sum(not pieces for pieces in sets) > 0.05 * COUNT
    assert sum(len(pieces) > 1 for pieces in sets) > 0.1 * COUNT
    for least, part in (0.2, "rays"), (0.02, "lines"):
        found = sum(any(getattr(hull, part) for hull in pieces) for pieces in sets)
        assert found > least * COUNT


def random_game(generator):
    """A game of up to 3 x 3 strategies with few different payoffs, so that most have
    ties."""
    shape = tuple(generator.integers(1, 4, 2).tolist())
    return from_game(*generator.integers(0, generator.integers(2, 4), (2, *shape)))


def connected(hulls):
    """The number of components: parts that share no vertex."""
    parts = []
    for hull in hulls:
        apart = [part for part in parts if not part & hull.vertices]
        joined = set(hull.vertices).union(
            *(part for part in parts if part & hull.vertices)
        )
        parts = [*apart, joined]
    return len(parts)


def check(found, whole, ended):
    """Compare all that a list says with the whole; whether it is complete, and whether
    there are others."""
    pieces = hulls_of(found.pieces)
    assert set(pieces) <= whole, "a piece is a maximal one"
    assert found.others in (
        (False,) if len(pieces) == len(whole) and found.complete else (True, None)
    )
    assert found.others is not True or len(pieces) < len(whole)
    assert not found.complete or set(pieces) == whole
    shown = SolutionSet(found, ended, 0.0)
    held = json.loads(
        solutions.solutions_report(shown, Source("file", None), exact=True).render(
            "json"
        )
    )
    assert held["complete"] == found.complete
    assert held["others"] == found.others
    assert len(held["pieces"]) == len(pieces)
    assert (held["status"] == ended) == (not found.complete)
    vertices = {vertex for piece in found.pieces for vertex in piece.vertices}
    assert {tuple(map(Fraction, each["z"])) for each in held["solutions"]} == vertices
    check_words(shown.message, found, sum(map(is_isolated, pieces)), whole)
    (section,) = solutions.build(shown, exact=True, format_name="table").sections
    assert section.is_as_requested == found.complete
    if found.equilibria is None:
        assert held["components"] is None
    else:
        check_game(found, whole, held)
        assert found.complete or not any(
            "sum to" in remark for remark in section.remarks
        )
    return found.complete, found.others


def check_words(message, found, isolated, whole):
    number = len(found.pieces)
    if not number:
        assert ("no solution: " in message) == (found.complete and not whole)
        return
    assert ("proved to be" in message) == found.complete
    assert ("only one" in message) == (found.complete and len(whole) == isolated == 1)
    assert ("there are others" in message) == (found.others is True)
    assert ("there may be others" in message) == (found.others is None)
    assert ("infinitely many" in message) == (isolated < number)
    assert ("all isolated" in message) == (
        found.complete and isolated == len(whole) > 1
    )
    for word, expected in (
        ("faces", number - isolated),
        ("subsets", number),
        ("components", connected(whole)),
    ):
        for stated in re.findall(rf"(\d+) (?:maximal Nash )?{word[:-1]}", message):
            assert int(stated) == expected
            assert found.complete or word != "components"


def check_game(found, whole, held):
    """Extreme equilibria, subsets, components, degeneracy and indices of a game."""
    game, equilibria = found.problem.problem.origin, found.equilibria
    assert {k for subset in equilibria.subsets for k in subset.extreme} == set(
        range(len(equilibria.extreme))
    )
    assert [len(set(piece["vertices"])) for piece in held["pieces"]] == [
        len(s.extreme) for s in equilibria.subsets
    ]
    assert all(
        len(subset.rows) * len(subset.columns) == len(subset.extreme)
        for subset in equilibria.subsets
    )
    assert (
        (equilibria.components is None)
        == (held["components"] is None)
        == (not found.complete)
    )
    if found.complete:
        assert len(held["components"]) == connected(whole)
    A, B = game.payoffs()
    for each in equilibria.extreme:
        by_row = [oracle.dot(tuple(row), each.column) for row in A]
        by_column = [oracle.dot(column, each.row) for column in zip(*B, strict=True)]
        best = [values.count(max(values)) for values in (by_row, by_column)]
        played = [
            sum(value > 0 for value in strategy) for strategy in (each.column, each.row)
        ]
        assert (each.index is None) == any(
            a > b for a, b in zip(best, played, strict=True)
        )
    indices = [each.index for each in equilibria.extreme]
    assert equilibria.is_degenerate == (
        True if None in indices else False if found.complete else None
    )
    assert (
        not found.complete
        or None in indices
        or sum(map(int, filter(None, indices))) == 1
    )


@pytest.mark.parametrize("kind", ["game", "mixed"])
@pytest.mark.parametrize("cut", ["number", "time"])
def test_cut_list_says_nothing_that_is_false(kind, cut, monkeypatch):
    generator, said = default_rng(31), []
    for _ in range(LISTS):
        if kind == "game":
            problem = random_game(generator)
        else:
            M, q, lower, upper = oracle.random_problem(generator, 4)
            problem = lcpcli.Problem(M, q, lower=lower, upper=upper)
        bounds = problem.box.vectors(problem.n)
        whole = oracle.maximal(oracle.in_fractions(problem.M, problem.q, *bounds))
        if cut == "number":
            found = lcpcli.solutions(
                problem, max_solutions=int(generator.integers(1, 4))
            )
            list(found)
        else:
            clock = count()
            with monkeypatch.context() as patched:
                patched.setattr("time.perf_counter", lambda clock=clock: next(clock))
                found = lcpcli.solutions(
                    problem, time_limit=int(generator.integers(1, 60))
                )
                list(found)
        said.append(check(found, whole, ENOUGH if cut == "number" else TIME_LIMIT))
    assert sum(complete for complete, _ in said) > 0.1 * LISTS
    assert (
        sum(others is (True if cut == "number" else None) for _, others in said)
        > 0.05 * LISTS
    )


def checked(problem):
    """The equilibria of a game, all of which are pairs of best replies."""
    found = lcpcli.solutions(problem)
    pieces = list(found)
    assert found.complete
    assert len(pieces) == len(found.equilibria.subsets)
    A, B = problem.origin.payoffs()
    for each in found.equilibria.extreme:
        x, y = each.row, each.column
        assert sum(x) == sum(y) == 1
        assert min(*x, *y) >= 0
        by_row = [oracle.dot(tuple(row), y) for row in A]
        by_column = [oracle.dot(column, x) for column in zip(*B, strict=True)]
        assert each.payoffs == (max(by_row), max(by_column))
        assert {value for value, p in zip(by_row, x, strict=True) if p} == {max(by_row)}
        assert {value for value, p in zip(by_column, y, strict=True) if p} == {
            max(by_column)
        }
    return found.equilibria


@pytest.mark.parametrize(
    ("name", "extreme", "components"),
    [("coordination-4", 15, 15), ("winkels", 12, 1), ("von-stengel-75", 75, 75)],
)
def test_shipped_games_have_the_known_number_of_equilibria(name, extreme, components):
    found = checked(lcpcli.read(contents.shipped_path(f"games/{name}.nfg")))
    assert len(found.extreme) == extreme
    assert len(found.components) == components


def test_a_game_whose_payoffs_sum_to_a_constant_has_one_subset():
    """The one piece of its LCP, given without its origin."""
    generator, faces = default_rng(9), 0
    for _ in range(8):
        A = generator.integers(0, 3, tuple(generator.integers(2, 8, 2)))
        game = from_game(A, 5 - A)
        M, q, *_ = decimal_parts_of(game)
        alone = ExactProblem(Problem(game.M, game.q), M, q or [])
        (of_game,), (of_lcp,) = (
            list(lcpcli.solutions(given)) for given in (game, alone)
        )
        assert set(of_game.vertices) == set(of_lcp.vertices)
        faces += len(of_game.vertices) > 1
    assert faces > 0


@pytest.mark.parametrize("entries", [10**9, 1000, 0])
def test_branch_and_bound_finds_the_same_equilibria_as_vertices(entries, monkeypatch):
    """Also if it is stopped after some of them, or after the first node, and the others
    come from vertices."""
    generator, faces = default_rng(12), 0
    for _ in range(LISTS):
        shape = (2, *generator.integers(1, 7, 2))
        largest = generator.choice([2, 3, 100])
        problem = from_game(*generator.integers(0, largest, shape))
        by_vertices, by_branches = (lcpcli.solutions(problem) for _ in range(2))
        is_isolated = [piece.is_point for piece in by_vertices]
        with monkeypatch.context() as patched:
            patched.setattr(pieces, "MAX_VERTICES_AT_FIRST", 0)
            patched.setattr(pieces, "ENTRIES_AT_FIRST", entries)
            assert len(list(by_branches)) == len(is_isolated)
        assert by_branches.complete
        assert by_vertices.arranged().pieces == by_branches.arranged().pieces
        assert by_vertices.equilibria == by_branches.equilibria
        faces += not all(is_isolated)
    assert 0 < faces < LISTS


@pytest.mark.parametrize("limit", ["MAX_STRATEGIES", "MAX_VERTICES"])
def test_branch_and_bound_goes_on_where_there_are_too_many_vertices(limit, monkeypatch):
    problem = from_game(np.eye(5), np.eye(5))
    monkeypatch.setattr(pieces, "MAX_VERTICES_AT_FIRST", 0)
    monkeypatch.setattr(pieces, "ENTRIES_AT_FIRST", 0)
    monkeypatch.setattr(bimatrix if limit == "MAX_STRATEGIES" else pieces, limit, 0)
    listed = lcpcli.solutions(problem)
    assert len(set(map(str, listed))) == 31
    assert len(listed.pieces) == 31
    assert listed.complete


def test_pairs_of_vertices_are_computed_in_parts(monkeypatch):
    """Between them the search may stop; one row at a time has the same result."""
    data = ExactProblem.of_problem(from_game(np.eye(5), np.eye(5)))
    steps = []
    listed = []
    for max_entries in (4_000_000, 1):
        monkeypatch.setattr(double_description, "MAX_ENTRIES", max_entries)
        calls = count()
        subsets = bimatrix.nash_subsets(data, 5, 1000, lambda calls=calls: next(calls))
        assert subsets is not None
        enumerated = next(calls)
        listed.append([list(subset) for subset in subsets])
        steps.append(next(calls) - enumerated)
    assert listed[0] == listed[1]
    assert len(listed[0]) == 31
    # One step less than there are vertices of the first polyhedron.
    assert steps[1] - steps[0] == 30


@pytest.mark.parametrize(
    "payoffs",
    [
        1 - np.eye(24),
        np.eye(24),
        default_rng(1).integers(0, 2, (24, 24)),
        np.zeros((12, 12)),
    ],
    ids=["crown", "identity", "zeros and ones", "zero"],
)
def test_some_equilibria_are_found_where_there_are_too_many_to_be_listed(payoffs):
    """The first two have 2^24 - 1 maximal Nash subsets each; of the third some have
    more vertices than can be listed, and come last."""
    found = lcpcli.solutions(from_game(payoffs, payoffs), max_solutions=2)
    pieces = list(found)
    held = found.equilibria
    assert (len(pieces), found.complete, found.others) == (
        (2, False, True) if payoffs.any() else (1, True, False)
    )
    assert {k for subset in held.subsets for k in subset.extreme} == set(
        range(len(held.extreme))
    )
    assert (held.components is None) == payoffs.any()


def test_a_limit_holds_where_there_are_more_subsets_than_can_be_listed(monkeypatch):
    """By a clock that goes on by 0.1 ms each time it is read, which is before each
    step, on any machine."""
    seconds = count(0.0, 1e-4)
    monkeypatch.setattr("time.perf_counter", lambda: next(seconds))
    # More than 2^20.
    found = lcpcli.solutions(from_game(*2 * [1 - np.eye(20)]), time_limit=0.5)
    pieces = list(found)
    assert len(pieces) > 1
    assert not found.complete
    assert next(seconds) < 0.75


def test_few_equilibria_of_a_large_nash_subset_are_kept_in_memory(monkeypatch):
    monkeypatch.setattr(bimatrix, "MAX_REMEMBERED", 10)
    data = ExactProblem.of_floats(from_game(np.zeros((3, 20)), np.zeros((3, 20))))
    (subset,) = bimatrix.nash_subsets(data, 3, 1000, lambda: None)
    gc.freeze()  # what was there before is not searched again and again
    kept = [sum(isinstance(item, Vertex) for item in gc.get_objects()) for _ in subset]
    assert len(kept) == 60
    assert max(kept) - min(kept) <= 12
