"""Methods on problems with bounds and free variables: published iterations keep their
rates, others find the solution, and Lemke's path ends at one, or on a ray that is a
proof, whatever the equations look like."""

from itertools import islice, pairwise, permutations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import default_rng
from scipy.sparse import csr_array

import lcpcli
from lcpcli import Problem, Status, run
from lcpcli.basis.free_variables import Reduction, WithoutFree
from lcpcli.basis.tableau import follow
from lcpcli.gallery import families
from lcpcli.methods.fixed_point import fixed_point
from lcpcli.methods.lemke import RAY, path_to_end, reduced
from lcpcli.methods.shi import shi
from lcpcli.model.box import Box
from lcpcli.model.changes import shifted
from lcpcli.verify.point import Criterion, Point

from ..mixed_problems import definite, with_all_bounds
from .planted import solvable


def iterates(problem, method, count):
    stage = {"fixed-point": fixed_point, "shi": shi}[method](
        problem, np.zeros(problem.n)
    )
    return [iterate.x for iterate in islice(stage, count)]


def test_fixed_point_converges_on_boxes_at_the_rate_of_the_theory():
    """By max |1 - lambda| / |1 + lambda| in each step, for M positive definite."""
    for seed in range(3):
        generator = default_rng(seed)
        M, q = definite(int(generator.integers(2, 30)), generator)
        lower = -generator.uniform(0, 1, q.size)
        problem = Problem(
            M, q, lower=lower, upper=lower + generator.uniform(0, 2, q.size)
        )
        exact = lcpcli.run(problem)
        x = problem.box.x_of(exact.z, problem.w(exact.z))
        eigenvalues = np.linalg.eigvalsh(M)
        rate = float(np.max(np.abs(1 - eigenvalues) / (1 + eigenvalues)))
        errors = [
            float(np.linalg.norm(each - x))
            for each in (np.zeros(q.size), *iterates(problem, "fixed-point", 60))
        ]
        floor = 1e-12 * (1 + float(np.linalg.norm(x)))
        assert all(
            after <= rate * before * (1 + 1e-6) + floor
            for before, after in pairwise(errors)
        )


def with_bounds(seed):
    """The data of a positive definite problem with all kinds of bounds."""
    generator = default_rng(seed)
    M, q = definite(10, generator)
    lower, upper = with_all_bounds(10, generator)
    return {"M": M, "q": q, "lower": lower, "upper": upper}


GUARANTEED = [
    name
    for name, own in lcpcli.inspect(Problem(**with_bounds(0))).guarantees.items()
    if own.word == "yes"
]


def test_all_own_methods_are_guaranteed_for_definite_problems_with_bounds():
    assert {"auto", "shi", "fixed-point", "newton", "interior", "lemke", "milp"} <= {
        *GUARANTEED
    }


@pytest.mark.parametrize("method", GUARANTEED)
def test_every_guaranteed_method_solves_problems_with_all_kinds_of_bounds(method):
    for seed in range(3):
        data = with_bounds(seed)
        result, reference = (
            lcpcli.solve(**data, method=name) for name in (method, "newton")
        )
        assert result.solved
        assert reference.solved
        assert np.abs(result.z - reference.z).max() <= 1e-6 * (
            1 + np.abs(reference.z).max()
        )
        assert ((data["lower"] <= result.z) & (result.z <= data["upper"])).all()


def test_point_at_a_bound_is_there_exactly_once_the_reference_point_is_moved_back():
    """u - l + l is not always u in doubles: here for some of the unknowns."""
    generator = default_rng(0)
    lower, upper = generator.random(500), 1 + 9 * generator.random(500)
    assert ((upper - lower) + lower < upper).any()
    problem = Problem(
        np.eye(500), generator.standard_normal(500), lower=lower, upper=upper
    )
    change = shifted(problem)
    for moved, bound in ((change.problem.lower, lower), (change.problem.upper, upper)):
        assert np.array_equal(problem.box.z_of(change.back(moved / 2)), bound)


INF = np.inf


def planted(seed, n, program):
    """A monotone problem or a convex program with variables of all kinds and a
    solution, whose equations are permuted, turned and scaled."""
    random = default_rng(seed)
    problem = solvable("program" if program else "half", n, random)
    M, q, free = problem.M.copy(), problem.q.copy(), np.flatnonzero(problem.box.free)
    order = random.permutation(free)
    factors = (10.0 ** random.uniform(-2, 2, free.size)) * random.choice(
        [-1.0, 1.0], free.size
    )
    M[free], q[free] = factors[:, np.newaxis] * M[order], factors * q[order]
    return Problem(M, q, lower=problem.lower, upper=problem.upper)


@settings(max_examples=20)
@given(seed=st.integers(0, 10**6), n=st.integers(2, 40), program=st.booleans())
def test_planted_problems_are_solved_however_their_equations_are_written(
    seed, n, program
):
    assert run(planted(seed, n, program), "lemke").solved


@pytest.mark.parametrize("form", [np.asarray, csr_array])
def test_contact_with_friction_is_solved_by_one_path(form):
    for seed, n in ((0, 48), (3, 200)):
        problem = families.make("contact", n, seed)
        for method in ("lemke", "auto"):
            result = run(Problem(form(problem.M), problem.q), method)
            assert result.solved
            assert result.route[-1] == "lemke"


@pytest.mark.parametrize(
    ("M", "q", "lower", "y"),
    [
        # z_1 + z_2 = -1, the other sign.
        ([[0, 0, 1], [0, 0, 1], [-1, -1, 0]], [1, 1, -1], [0, 0, -INF], [0, 0, 1]),
        # w_3 = z_2 + 1 = 0.
        ([[0, 0, 0], [0, 0, -1], [0, 1, 0]], [0, 0, 1], [0, 0, -INF], [0, 0, -1]),
        # y has the sign that leaves out the free variable
        ([[1, 1], [1, -1]], [0, -1], [-INF, 0], [-1, 1]),
    ],
)
def test_ray_of_a_problem_with_equations_proves_that_it_is_infeasible(M, q, lower, y):
    result = run(Problem(M, q, lower=lower), "lemke")
    assert result.status is Status.INFEASIBLE
    assert result.certificate.vector == pytest.approx(y)


def test_a_ray_stays_within_the_bounds():
    """Also where the last variable to enter falls, as w does at an upper bound."""
    ways = set()
    for seed in range(60):
        random = default_rng(seed)
        M, q = random.integers(-3, 4, (4, 4)), random.integers(-5, 3, 4)
        upper = np.where(random.random(4) < 0.5, 1.0, INF)
        problem = Problem(M, q, upper=upper)
        path = path_to_end(problem, follow, reduced(problem))
        if path.end == RAY:
            z, _ = path.ray()
            assert (z >= 0).all()
            assert not z[upper < INF].any()
            ways |= {path.way} if z.any() else set()
    assert ways == {-1, 1}


@pytest.mark.parametrize("small", [1e-8, 1e-17, 1e-40])
def test_numbers_far_smaller_than_others_are_settled_by_their_own_rows(small):
    """Where the path ends, z_0 is within rounding of the large numbers, but not of the
    small ones."""
    block, q = np.array([[2.0, 1.0], [1.0, 2.0]]), np.array([-5.0, -6.0])
    M = np.kron(np.eye(2), block)
    result = run(Problem(M, np.concatenate([q, small * q])), "lemke")
    assert result.solved
    assert np.allclose(
        result.z, np.array([4, 7, 4 * small, 7 * small]) / 3, rtol=1e-12, atol=0
    )


KINDS = {
    "free": (-INF, INF),
    "lower": (1, INF),
    "upper": (-INF, 1),
    "boxed": (0, 1),
    "fixed": (1, 1),
}


def box_of(kinds, shift, width):
    low, high = np.array([KINDS[kind] for kind in kinds]).T
    return Box(shift + low * width, shift + high * width)


@settings(max_examples=30)
@given(
    st.lists(st.sampled_from(list(KINDS)), min_size=1, max_size=6),
    st.integers(0, 20),
    st.booleans(),
)
def test_a_reduction_holds_for_all_bounds_of_the_same_kinds(kinds, seed, is_singular):
    random = np.random.default_rng(seed)
    M = random.integers(-3, 4, (len(kinds), len(kinds))) * 10.0 ** random.integers(
        -2, 3, len(kinds)
    )
    if is_singular:
        M[:, 0] = M[0] = 0.0
    q, (box, other) = (
        random.normal(size=len(kinds)),
        (box_of(kinds, 0.0, 1.0), box_of(kinds, -3.0, 2.5)),
    )
    anew, again = Reduction(M, other), Reduction(M, box).within(other)
    y, inside = random.uniform(size=anew.d.size), random.random(anew.d.size) < 0.5
    ours, theirs = (
        (each.d, each.constants(q), *each.recover(y, inside, ~inside))
        for each in (again, anew)
    )
    assert all(map(np.array_equal, ours, theirs))


def test_a_reduction_does_not_hold_for_bounds_of_other_kinds():
    for kinds in permutations(KINDS, 2):
        one, other = (box_of([kind, "boxed"], 0.0, 1.0) for kind in kinds)
        assert Reduction(np.eye(2), one).within(other) is None


def problem_with_free(n, seed):
    """Return a monotone problem with n unknowns, every other of which is free."""
    rng = default_rng(seed)
    A = rng.uniform(-1, 1, (n, n)) * (rng.random((n, n)) < 3 / n)
    M = csr_array(A - A.T + np.diag(rng.uniform(0.5, 1, n)))
    return Problem(
        M, rng.uniform(-1, 1, n), lower=np.where(np.arange(n) % 2, 0.0, -np.inf)
    )


def test_a_path_ends_at_the_solution_also_in_free_variables():
    random = default_rng(0)
    B, A = random.normal(size=(6, 6)), random.normal(size=(3, 6))
    sides = {"row_lower": A @ np.ones(6), "row_upper": A @ np.ones(6)}
    problem = lcpcli.from_qp(B @ B.T, random.normal(size=6), A, **sides)
    path = path_to_end(problem, follow, reduced(problem))
    assert Point(Criterion(problem), path.point()[0]).relative_residual < 1e-8


@pytest.mark.parametrize("n", [6, 40, 101])
def test_solutions_of_the_bounded_variables_are_those_of_the_problem(n):
    problem = problem_with_free(n, n)
    own = WithoutFree(problem)
    inner = run(own.reduced)
    assert inner.solved
    assert own.reduced.n == n // 2
    z, states = own.recover(inner.z, own.reduced.box.basis_at(inner.z))
    assert np.abs(problem.box.gaps(z, problem.w(z))).max() <= 1e-12
    assert np.array_equal(states, problem.box.basis_at(z))
