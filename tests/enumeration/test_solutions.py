"""All solutions of problems whose solution sets are known: none, one, some, 2^n, segments, rays and lines."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from scipy.sparse import csr_array, diags_array

import lcpcli
from lcpcli import Problem, errors
from lcpcli.enumeration import pieces
from lcpcli.rational.exact_problem import ExactProblem

FREE = (-np.inf, np.inf)
SECONDS = 120.0  # for milliseconds of work: a search that never ends fails


def shown(points: tuple[tuple[Fraction, ...], ...]) -> set[str]:
    return {" ".join(map(str, point)) for point in points}


# M, q, bounds, and the vertices, rays and lines of each piece
KNOWN = {
    # K. G. Murty, Linear Complementarity, Linear and Nonlinear Programming, Heldermann 1988, chapter 1
    "one of a P-matrix": ([[2, 1], [1, 2]], [-5, -6], (0, np.inf), [({"4/3 7/3"}, set(), set())]),
    # R. W. Cottle, J.-S. Pang and R. E. Stone, The Linear Complementarity Problem, SIAM 2009: section 1.3, where q lies
    # in no complementary cone; 3.1, semidefinite M, where the solutions are a polyhedron
    "none although feasible": ([[0, 1], [1, 0]], [-1, 1], (0, np.inf), []),
    "none and infeasible": ([[0, -1], [1, 0]], [-1, -1], (0, np.inf), []),
    "a segment": ([[1, 1], [1, 1]], [-1, -1], (0, np.inf), [({"1 0", "0 1"}, set(), set())]),
    "a triangle": (np.ones((3, 3)), -np.ones(3), (0, np.inf), [({"1 0 0", "0 1 0", "0 0 1"}, set(), set())]),
    "a ray": ([[0, 0], [0, 1]], [0, -1], (0, np.inf), [({"0 1"}, {"1 0"}, set())]),
    "the orthant": (np.zeros((2, 2)), [0, 0], (0, np.inf), [({"0 0"}, {"1 0", "0 1"}, set())]),
    # Lemke's method ends on a ray although there are two whole rays of solutions
    "two rays with one end": (
        *([[0, 1], [0, 0]], [-1, 0], (0, np.inf)),
        [({"0 1"}, {"0 1"}, set()), ({"0 1"}, {"1 0"}, set())],
    ),
    "two": ([[-1]], [1], (0, np.inf), [({"0"}, set(), set()), ({"1"}, set(), set())]),
    "three in a box": ([[-1]], [0], (-1, 1), [({value}, set(), set()) for value in ("-1", "0", "1")]),
    # where w_2 = z_1 = 0, z_1 is at its lower bound, but w_1 = -z_2 has the sign for that only where z_2 = 0
    "an edge of a box": ([[0, -1], [1, 0]], [0, 0], (0, 1), [({"0 0", "1 0"}, set(), set())]),
    "a line": ([[1, -1], [-1, 1]], [0, 0], FREE, [({"0 0"}, set(), {"1 1"})]),
    "a plane": (np.zeros((2, 2)), [0, 0], FREE, [({"0 0"}, set(), {"1 0", "0 1"})]),
    "equations without solution": ([[1, -1], [-1, 1]], [0, 1], FREE, []),
    "fixed unknowns": ([[0, 1], [1, 0]], [-1, 1], (1, 1), [({"1 1"}, set(), set())]),
}


@pytest.mark.parametrize("name", KNOWN)
def test_known_sets_are_found_and_proved_complete(name: str) -> None:
    M, q, (lower, upper), expected = KNOWN[name]
    found = lcpcli.solutions(Problem(M, q, lower=lower, upper=upper), time_limit=SECONDS)
    pieces = [(shown(piece.vertices), shown(piece.rays), shown(piece.lines)) for piece in found]
    assert sorted(map(str, map(sorted_sets, pieces))) == sorted(map(str, map(sorted_sets, expected)))
    assert found.complete


def sorted_sets(piece: tuple[set[str], set[str], set[str]]) -> list[list[str]]:
    return [sorted(part) for part in piece]


@pytest.mark.parametrize("coupled", [False, True])
def test_minus_a_dominant_matrix_has_a_solution_for_each_of_2_to_the_n_sets(coupled: bool) -> None:
    """K. G. Murty, On the number of solutions to the complementarity problem, Linear Algebra and its Applications 5
    (1972) 65-108: q > 0 lies in all complementary cones."""
    n = 8
    M = -np.eye(n) + coupled * (np.ones((n, n)) - np.eye(n)) / 64
    found = lcpcli.solutions(Problem(M, np.ones(n)))
    supports = {tuple(value > 0 for value in piece.vertices[0]) for piece in found if piece.is_point}
    assert (len(found.pieces), len(supports), found.complete) == (2**n, 2**n, True)


def test_the_number_of_solutions_of_a_nondegenerate_matrix_has_one_parity_for_all_q() -> None:
    """The theorem of Murty (1972), for q in the interior of its cones."""
    generator = np.random.default_rng(4)
    for _ in range(6):
        M, vectors = generator.integers(-99, 100, (5, 5)), generator.integers(-9999, 10000, (6, 5))
        assert len({len(list(lcpcli.solutions(Problem(M, q)))) % 2 for q in vectors}) == 1


def test_a_positive_diagonal_is_not_taken_for_positive_minors() -> None:
    """Three solutions of each of six pairs, which are hardly coupled."""
    M = np.kron(np.eye(6), [[1, 2], [2, 1]]) + 1 / 1024
    found = lcpcli.solutions(Problem(M, -np.ones(12)))
    assert (len(list(found)), found.complete) == (3**6, True)
    assert all(piece.is_point for piece in found.pieces)


SCALED = np.array([[3.0], [1.0], [7.0], [2.0]] * 5)  # of the rows of a matrix with positive principal minors


@pytest.mark.parametrize("kind", ["definite", "scaled", "dominant", "triangular"])
def test_the_only_solution_is_proved_to_be_the_only_one(kind: str) -> None:
    n, generator = 20, np.random.default_rng(1)
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
    assert (piece.is_point, found.complete) == (True, True)
    assert ExactProblem.of_floats(problem).is_solution(piece.vertices[0])


def test_multipliers_beyond_the_range_of_doubles_prove_the_only_solution() -> None:
    found = lcpcli.solutions(Problem([[1e200, -1e-250], [-1e-250, 1e-200]], [-1, -1]))
    assert ([piece.is_point for piece in found], found.complete) == ([True], True)


def test_semidefinite_problems_have_one_piece_which_is_found_whole() -> None:
    """A linear program with an edge of minima: min -x1 - x2, x1 + x2 <= 2, x1 <= 1, x >= 0."""
    M = np.array([[0, 0, 1, 1], [0, 0, 1, 0], [-1, -1, 0, 0], [-1, 0, 0, 0]], dtype=float)
    (piece,) = lcpcli.solutions(Problem(np.kron(np.eye(3), M), np.tile([-1, -1, 2, 1], 3)))
    assert len(piece.vertices) == 2**3
    assert {vertex[:4] for vertex in piece.vertices} == {(0, 2, 1, 0), (1, 1, 1, 0)}


def test_degenerate_points_take_no_time() -> None:
    """All 2^30 complementary sets have the solution 0."""
    generator = np.random.default_rng(0)
    coupling = generator.integers(0, 3, (30, 30)) * (1 - np.eye(30))
    for M in (np.eye(30), np.eye(30) + coupling):
        (piece,) = lcpcli.solutions(Problem(M, np.zeros(30)))
        assert piece.vertices == ((0,) * 30,)
        assert piece.states == (("lower", "basic"),) * 30


def test_decimals_count_as_written_if_they_are_given_exactly() -> None:
    third, tenth = Fraction(1, 3), Fraction(1, 10)
    problem = Problem([[1 / 3, 0.1], [0.1, 0.03]], [-1, -0.3])
    exact = ExactProblem(problem, [{0: third, 1: tenth}, {0: tenth, 1: tenth * 3 / 10}], [Fraction(-1), -3 * tenth])
    (piece,) = lcpcli.solutions(exact)  # the rows are multiples of each other, and in doubles they are not
    assert set(piece.vertices) == {(3, 0), (0, 10)}
    assert all(each.is_point for each in lcpcli.solutions(problem))


def test_a_limit_ends_the_list_which_is_then_not_complete() -> None:
    problem = Problem(-np.eye(12) + 0.01, np.ones(12))
    found = lcpcli.solutions(problem, max_solutions=3)
    assert (len(list(found)), len(found.points), found.complete) == (3, 3, False)
    assert list(found) == found.pieces
    stopped = lcpcli.solutions(problem)
    next(stopped)
    stopped.stop()
    assert (list(stopped), len(stopped.pieces), stopped.complete) == (stopped.pieces, 1, False)
    segments = lcpcli.solutions(Problem(np.kron(np.eye(40), np.ones((2, 2))), -np.ones(80)), time_limit=0.2)
    assert (list(segments), segments.complete) == ([], False)  # one piece with 2^40 vertices
    late = lcpcli.solutions(problem, time_limit=1e-9)
    assert (list(late), late.complete) == ([], False)
    assert (next(late, None), late.complete) == (None, False)


def test_as_many_as_were_asked_for_are_all_if_a_search_as_long_finds_no_other() -> None:
    problem = Problem([[1, 2], [2, 1]], [-1, -1])
    for most, others in ((2, True), (3, False), (4, False)):
        found = lcpcli.solutions(problem, max_solutions=most)
        assert (len(list(found)), found.others, found.complete) == (min(most, 3), others, not others)
        assert ("not all" in repr(found)) == others
    ended = lcpcli.solutions(problem, max_solutions=2)
    assert [next(ended), next(ended)] == ended.pieces
    assert ended.others is None
    ended.stop()
    assert (next(ended, None), next(ended, None), ended.others) == (None, None, None)


def test_blocks_are_searched_no_further_than_it_takes() -> None:
    """Two blocks of 2^30 solutions each, and one block without any beside one of those."""
    block = -np.eye(30) + np.ones((30, 30)) / 64
    found = lcpcli.solutions(Problem(np.kron(np.eye(2), block), np.ones(60)), max_solutions=5)
    assert (len({piece.vertices for piece in found}), found.others) == (5, True)
    M = np.zeros((32, 32))
    M[:30, :30], M[30:, 30:] = block, [[0, 1], [1, 0]]
    none = lcpcli.solutions(Problem(M, [*np.ones(30), -1, 1]))
    assert (list(none), none.complete) == ([], True)


@pytest.mark.parametrize("as_matrix", [np.asarray, csr_array])
def test_too_many_unknowns_that_depend_on_each_other_are_refused(as_matrix: type) -> None:
    M = np.eye(700) + np.eye(700, k=1) * (np.arange(700) < 600)
    with pytest.raises(errors.ProblemError, match="has 600 unknowns that depend on each other"):
        lcpcli.solutions(Problem(as_matrix(M), -np.ones(700)))


def test_blocks_may_be_many() -> None:
    """More than the unknowns that may depend on each other."""
    found = lcpcli.solutions(Problem(diags_array(np.ones(700), format="csr"), -np.ones(700)), time_limit=SECONDS)
    assert [len(piece.vertices) for piece in found] == [1]
    assert found.complete


def test_limits_out_of_range_are_refused() -> None:
    for options in ({"max_solutions": 0}, {"max_solutions": 1.5}, {"time_limit": 0}):
        with pytest.raises(errors.OptionError, match="out of range"):
            lcpcli.solutions(Problem([[1]], [1]), **options)


def test_what_has_been_found_is_printed_and_given_again_by_one_search() -> None:
    found = lcpcli.solutions(Problem([[-1, 0], [0, -1]], [1, 1]))
    assert repr(found) == "<Solutions: 0 pieces, as far as the search has come>"
    first = next(iter(found))
    assert repr(found).startswith("<Solutions: 1 piece, as far as the search has come: (")
    pieces = list(found)
    assert (pieces[0] is first, len(pieces)) == (True, 4)
    assert repr(found).startswith("<Solutions: 4 pieces, all of them: (")
    assert all(one is other for one, other in zip(found, found, strict=True)), "loops that take turns"
    assert next(found, None) is None
    faces = lcpcli.solutions(Problem([[1, 1], [1, 1]], [-1, -1]))
    list(faces)
    assert "hull of (" in repr(faces)


def test_pieces_with_many_bases_come_last_but_all_come(monkeypatch: pytest.MonkeyPatch) -> None:
    problems = [Problem(-np.ones((n, n)), np.ones(n), lower=0, upper=2) for n in (2, 3)]
    expected = [{str(piece) for piece in lcpcli.solutions(problem)} for problem in problems]
    assert min(map(len, expected)) > 1
    monkeypatch.setattr(pieces, "MOST_BASES_AT_FIRST", 1)
    for problem, own in zip(problems, expected, strict=True):
        found = [*lcpcli.solutions(problem)]
        assert len(found) == len(own)
        assert {str(piece) for piece in found} == own


def test_point_beyond_its_bounds_is_no_piece_though_w_vanishes() -> None:
    for z in ((-1, 2), (3, 0), (4, -1)):
        data = ExactProblem.of_floats(Problem([[1, 1], [1, 1]], [-sum(z)] * 2, lower=0, upper=[2, np.inf]))
        point = tuple(map(Fraction, z))
        with pytest.raises(ArithmeticError):
            pieces.Piece.of([pieces.states_of(data, point)], (point,))


@pytest.mark.parametrize("n", [4, 12])
def test_a_singular_semidefinite_matrix_with_a_positive_diagonal_has_a_face_of_solutions(n: int) -> None:
    """In a cycle of n places, z may rise by the same everywhere."""
    M = 2 * np.eye(n) - np.roll(np.eye(n), 1, axis=1) - np.roll(np.eye(n), -1, axis=1)
    found = lcpcli.solutions(Problem(M, [-1.0, 1.0, *[0.0] * (n - 2)]))
    (piece,) = found
    assert found.others is False
    assert [list(ray) for ray in piece.rays] == [[1] * n]
