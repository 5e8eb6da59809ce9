"""The digits that are said to be determined by the data are those that the solution of
the rounded data has right. A known solution that is wrong is reported and not believed;
one that is only rounded is.
"""

from dataclasses import replace
from fractions import Fraction
from functools import cache

import numpy as np
import pytest
from numpy.random import default_rng
from scipy.sparse import csr_array

import lcpcli
from lcpcli import Problem, from_qp, read, run
from lcpcli.files import contents
from lcpcli.gallery import families
from lcpcli.verify.digits import DOUBLE_DIGITS, fewest_digits
from lcpcli.verify.point import without_wrong_solutions

from ..conftest import save_json
from ..dependent_rows import dependent_program, of_states, strict_states
from ..exact import solution
from ..seeds import parts


def rational_problem(seed, condition):
    """A problem with M symmetric positive definite but for rounding, in thirds, and its
    solution; both exact, and rounded to doubles only in the end."""
    random = default_rng(seed)
    n = int(random.integers(2, 12))
    Q = np.linalg.qr(random.standard_normal((n, n)))[0]
    A = Q * np.geomspace(1, 1 / condition, n) @ Q.T
    M = [[Fraction(value) / 3 for value in row] for row in ((A + A.T) / 2).tolist()]
    z = [Fraction(int(random.integers(1, 100)), 7) for _ in range(n)]
    q = [-sum((a * b for a, b in zip(row, z, strict=True)), Fraction(0)) for row in M]
    return Problem(
        [[float(a) for a in row] for row in M], [float(value) for value in q]
    ), z


def right_digits(z, solution):
    pairs = zip(z.tolist(), solution, strict=True)
    largest = max(abs(Fraction(a) - b) / b for a, b in pairs)
    return np.clip(-np.log10(max(float(largest), 1e-17)), 0, DOUBLE_DIGITS)


def counted(result):
    """The digits, none where another value is as good to working precision."""
    digits = np.array(result.digits, dtype=float)
    digits[result.not_unique] = 0
    return digits


def test_digits_of_many_problems_with_conditions_up_to_1e16():
    """Within one for nearly all, and never more than two too many."""
    excess = []
    for seed in range(40):
        problem, solution = rational_problem(seed, 10 ** (16 * seed / 39))
        result = run(problem, "newton")
        if not (result.solved and (result.z > 0).all()):
            continue  # rounding the data has changed the basis
        excess.append(
            fewest_digits(problem, result.z, counted(result))[0]
            - round(right_digits(result.z, solution))
        )
    assert len(excess) >= 30
    assert max(excess) <= 2
    assert np.mean(np.abs(excess) <= 1) >= 0.9
    assert min(excess) >= -3


def test_digits_do_not_depend_on_the_units_nor_on_how_M_is_stored():
    problem, _ = rational_problem(5, 1e6)
    R, C = np.exp2(default_rng(0).integers(-300, 301, (2, problem.n)).astype(float))
    other = Problem(R[:, None] * problem.M * C, R * problem.q)
    own, *others = (
        run(each, "newton").digits
        for each in (problem, other, Problem(csr_array(problem.M), problem.q))
    )
    for digits in others:
        assert max(abs(a - b) for a, b in zip(digits, own, strict=True)) <= 1


@pytest.mark.parametrize(("n", "said"), [(6, False), (14, True)])
def test_few_digits_are_said(n, said, lcp, tmp_path):
    problem = families.make("hilbert", n)
    file = tmp_path / "hilbert.json"
    save_json(file, {"M": problem.M.tolist(), "q": problem.q.tolist()})
    outcome = lcp(f"solve {file} --method newton")
    assert ("the data determine" in outcome.out) is said


def kinky_problem(seed):
    """A problem with a P-matrix, ill-conditioned or triangular with small pivots, some
    of whose w_i at z_i = 0, and of whose z_i, are 0 or nearly so."""
    random = default_rng(seed)
    n = int(random.integers(2, 5))
    if seed % 2:
        order = random.permutation(n)
        M = np.tril(random.standard_normal((n, n)), -1) + np.diag(
            10.0 ** -(20 * random.random(n) * random.integers(0, 2, n))
        )
        M = M[np.ix_(order, order)]
    else:
        Q = np.linalg.qr(random.standard_normal((n, n)))[0]
        M = Q * np.geomspace(1, 10.0 ** -random.uniform(0, 8), n) @ Q.T
    z = np.where(random.random(n) < 0.5, random.uniform(0.5, 2, n), 0.0)
    z = np.where(random.random(n) < 0.1, 10.0 ** -random.uniform(12, 18, n), z)
    small = np.where(
        random.random(n) < 0.3, 0.0, 10.0 ** -random.uniform(12, 18, n)
    ) * (np.abs(M) @ z)
    w = np.where(z > 0, 0.0, np.where(random.random(n) < 0.3, 1.0, small))
    return Problem(M, w - M @ z)


def rounded_differently(problem, random):
    """The problem with each number but 0 moved to a neighbour, or left as it is."""
    M, q = (
        np.where(a != 0, np.nextafter(a, a + random.integers(-1, 2, a.shape)), 0.0)
        for a in (problem.M, problem.q)
    )
    return Problem(M, q)


def least_digits(z, solutions):
    """The digits of each z_i that all solutions share, none of a z_i = 0 that moves."""
    found = []
    for i, own in enumerate(z.tolist()):
        motion = max(abs(Fraction(own) - each[i]) for each in solutions)
        found.append(
            float(-np.log10(float(motion / Fraction(own))))
            if own and motion
            else 0.0
            if motion
            else 17.0
        )
    return found


def test_no_digits_are_told_at_kinks_that_rounding_the_data_changes():
    """Neither of a z_i at a bound that it may leave, nor of those that move with it."""
    changed = told = 0
    for seed in range(20):
        problem, random = kinky_problem(seed), default_rng(seed)
        result = run(problem)
        if not result.solved:
            continue
        solutions = [solution(rounded_differently(problem, random)) for _ in range(15)]
        true = least_digits(result.z, [z for z in solutions if z is not None])
        for count, own in zip(result.digits, true, strict=True):
            changed += own < 0.5
            told += count is not None and count > 10
            assert count is None or count <= own + 2, f"seed {seed}"
    assert changed >= 6
    assert told >= 20


@pytest.mark.parametrize("seeds", parts(25, 120))
def test_digits_of_each_component_are_those_that_its_states_determine(seeds):
    """Beside equations that follow from others, free rows, and rows strictly inside
    their ranges, whose multipliers are 0: with each number moved in its last place."""
    told = undetermined = 0
    for seed in seeds:
        program, random = dependent_program(seed), default_rng(seed)
        result = run(program.problem())
        assert result.solved
        states = strict_states(result)
        if states is None:
            continue
        exact = of_states(program, *states)
        moved = [of_states(program.moved(random), *states) for _ in range(5)]
        own = [i for i, value in exact.items() if value is None]
        if any(each is None or any(each[i] is not None for i in own) for each in moved):
            continue  # the rows of the program itself are dependent
        for i, own in exact.items():
            if own is None:
                assert result.digits[i] is None, (seed, i)
                assert i in result.not_unique, (seed, i)
                undetermined += 1
                continue
            assert i not in result.not_unique
            motion = max(abs(each[i] - own) for each in moved)
            assert result.digits[i] is not None, (seed, i)
            if own:
                right = -np.log10(float(motion / abs(own))) if motion else 17
                assert right - 3 <= result.digits[i] <= min(right, 16) + 2, (seed, i)
                told += 1
    assert told > 40
    assert undetermined > 8


ALL, UNIT = DOUBLE_DIGITS, np.nextafter(-0.3333333333333333, -1.0)
EXAMPLES = {
    "bounds are exact": (Problem([[2, 0], [0, 1]], [-1, 1]), {}, [ALL, ALL]),
    "several solutions": (
        Problem(np.ones((2, 2)), [-1, -1], lower=-1, upper=3),
        {"z0": [0.4, 0.6]},
        [None, None],
    ),
    "not solved": (Problem([[0, -1], [1, 0]], [-1, -1]), {}, None),
    "large by one unit in the last place": (
        Problem([[3, 0], [1, 1e-20]], [-1, UNIT]),
        {},
        [ALL, 0],
    ),
    "without that unit": (
        Problem([[3, 0], [1, 1e-20]], [-1, -0.3333333333333333]),
        {},
        [ALL, None],
    ),
    # w_2 = 0 at z_2 = 0, by which z_1 moves, but no more than by rounding; and a row of
    # zeros
    "what rounding cannot exchange": (
        Problem([[2, 1], [1, 2]], [-2, -1]),
        {},
        [ALL, None],
    ),
    "a row of zeros": (Problem([[0, 0], [0, 2]], [0, -1]), {}, [None, ALL]),
    "a wrong sign of w within a loose tolerance": (
        Problem([[2, 1], [1, 2]], [-2, -1.0001]),
        {"method": "newton", "tol": 1e-3, "z0": [1, 0]},
        [4, None],
    ),
}


@pytest.mark.parametrize("name", EXAMPLES)
def test_digits_are_told_where_the_data_determine_them(name):
    problem, options, digits = EXAMPLES[name]
    assert run(problem, **options).digits == digits


def test_of_many_kinks_there_are_no_digits_either():
    # Of too many kinks not all exchanges can be tried.
    for n, alternate in ((100, DOUBLE_DIGITS), (400, None)):
        M = 4 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
        z = np.arange(n) % 2
        assert run(Problem(M, -M @ z)).digits == [
            alternate if own else None for own in z
        ]


@pytest.mark.parametrize("q", [[-10, -3], [-10, -1], [-1, -3], [0, -1]])
def test_digits_are_those_of_the_mirror_image(q):
    """In which -z and -w take the place of z and w."""
    M = [[2, 0.5], [0.5, 2]]
    own = run(Problem(M, q, upper=1))
    image = run(Problem(M, [-value for value in q], lower=-1, upper=0))
    assert image.z.tolist() == (0 - own.z).tolist()
    assert own.digits is not None
    assert own.digits == image.digits


ALL_WRONG = (
    '{"M": [[2, 1], [1, 2]], "q": [-5, -6], "solution": [1, 1], "verdict": '
    '"infeasible"}'
)
LINE = (
    "lcp: {}: solution{}: is not a solution: its residual is 3, with z2 = 1 and w2 "
    "= -3; it is ignored\n"
)


SHIPPED = "paper-example-1", "paper-example-2", "bimatrix", "tridiagonal-100"


@cache
def problems():
    """Those that are shipped, and one of each family, with known solutions."""
    made = [read(contents.shipped_path(f"{name}.json")) for name in SHIPPED]
    made += map(families.make, families.FAMILIES)
    return [problem for problem in made if problem.solutions]


@pytest.mark.parametrize("digits", ["17g", "4f"])
def test_solutions_as_computed_and_as_printed_are_accepted(digits):
    for problem in problems():
        printed = tuple(
            np.array([float(f"{v:.{digits}}") for v in z]) for z in problem.solutions
        )
        assert without_wrong_solutions(replace(problem, solutions=printed))[1] == [], (
            problem.name
        )


def test_solutions_with_an_error_in_the_first_digit_are_wrong():
    for problem in problems():
        z = problem.solutions[0]
        # Its largest component hides the others.
        if z.any() and "growth" not in problem.name:
            other = z + 0.3 * np.abs(z).max() * (z > 0)
            kept, faults = without_wrong_solutions(replace(problem, solutions=(other,)))
            assert (kept.solutions, len(faults)) == ((), 1), problem.name


@pytest.mark.parametrize(
    ("q", "z", "is_right"),
    [
        ([-1, -1.7e-5], [1, 1.2345e-5], False),  # its last digit is worth 1e-9
        ([-1, -1.23454e-5], [1, 1.2345e-5], True),
        ([-1.5e16, -3.4], [1.5e16, 3], True),  # the last digit of 3 is worth 1
    ],
)
def test_last_digit_of_a_solution_is_where_the_exponent_puts_it(q, z, is_right):
    problem = Problem(np.eye(2), q, solutions=[np.array(z, dtype=float)])
    assert (without_wrong_solutions(problem)[1] == []) == is_right


def test_a_verdict_is_not_believed_by_a_bench_if_there_is_a_solution(tmp_path, lcp):
    file = tmp_path / "p.json"
    file.write_text(ALL_WRONG)
    outcome = lcp(f"bench {file} --method newton --budget 0 --format json")
    row = outcome.record["measurements"][0]
    assert (outcome.code, row["success"], row["false_success"]) == (0, True, False)
    assert outcome.err.startswith(LINE.format(file, "")), (
        "and the progress of the bench"
    )


def degenerate(random):
    """A problem of small integers with a known solution, at which many numbers are at
    both of their bounds, or 0."""
    n = int(random.integers(1, 5))
    M = random.integers(-1, 2, (n, n))
    if random.random() < 0.5:
        M = M.T @ M
    z = np.where(random.random(n) < 0.5, random.integers(0, 3, n), 0)
    is_large = (z == 0) & (random.random(n) < 0.5)
    w = np.where(is_large, random.integers(0, 3, n), 0)
    upper = np.where(random.random(n) < 0.4, np.maximum(z, 1), np.inf)
    return Problem(M, w - M @ z, upper=upper)


def differs(problem, i):
    """Return whether z_i has several values among all solutions, in fractions."""
    pieces = list(lcpcli.solutions(problem))
    values = {vertex[i] for piece in pieces for vertex in piece.vertices}
    moves = [*(piece.rays for piece in pieces), *(piece.lines for piece in pieces)]
    return len(values) > 1 or any(move[i] for each in moves for move in each)


def test_x_of_a_program_whose_multiplier_alone_has_other_values_is_unique():
    problem = from_qp(None, [2, 3], [[1, 1]], row_lower=[9], lower=[0, 0], upper=[4, 5])
    result = run(problem)
    assert result.z[:2].tolist() == [4, 5]
    assert not {0, 1} & set(result.not_unique)


@pytest.mark.parametrize("seeds", parts(80, 2000))
def test_a_component_that_is_said_not_to_be_unique_has_several_values(seeds):
    claims = 0
    for seed in seeds:
        problem = degenerate(default_rng(seed))
        result = run(problem)
        if result.solved:
            for i in result.not_unique or []:
                assert differs(problem, i), seed
                claims += 1
    assert claims > 6


def test_several_kinks_in_turn_leave_the_components_that_are_not_unique():
    """z1, z2 and z3 move along the solutions, two of them against each other; z6 is a
    kink only once z5, at its bound, is exchanged."""
    M = np.zeros((6, 6))
    M[:3, :3] = [[1, 0, 1], [0, 1, -1], [1, 0, 1]]
    M[3, 3:5], M[4, 4:], M[5, 5] = [1, -1], [1e-6, 1], 1
    result = run(Problem(M, [-2, -2, -2, -1e-9, -1, -1]))
    assert result.solved
    assert result.not_unique == [0, 1, 2]
