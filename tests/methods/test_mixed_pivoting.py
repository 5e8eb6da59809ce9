"""Lemke's method on problems with bounds and free variables: whatever the equations look like, its path ends at a
solution, and its rays are proofs in the variables of the problem."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.sparse import csr_array

from lcpcli import Problem, Status, run
from lcpcli.gallery import families
from lcpcli.methods.free_variables import Reduction
from lcpcli.typing import Vector

INF = np.inf


def planted(seed: int, n: int, program: bool) -> Problem:
    """A monotone problem or a convex program with variables of all kinds and a solution, whose equations are permuted,
    turned and scaled."""
    generator = np.random.default_rng(seed)
    kinds = generator.choice(["free", "lower", "upper", "box", "fixed"], n, p=[0.3, 0.4, 0.1, 0.15, 0.05])
    lower = np.where(np.isin(kinds, ["free", "upper"]), -INF, generator.integers(-3, 1, n).astype(float))
    upper = np.where(np.isin(kinds, ["free", "lower"]), INF, np.maximum(np.nan_to_num(lower, neginf=0), 0) + 1.0)
    upper = np.where(kinds == "fixed", lower, upper)
    M = saddle(generator, n) if program else monotone(generator, n)
    ends = np.where(np.isfinite(lower), lower, -2.0), np.where(np.isfinite(upper), upper, 2.0)
    inside = ends[0] + (ends[1] - ends[0]) * generator.random(n)
    state = generator.integers(0, 3, n)
    z = np.where((state == 0) & np.isfinite(lower), lower, np.where((state == 2) & np.isfinite(upper), upper, inside))
    w = np.where(z == lower, generator.random(n), np.where(z == upper, -generator.random(n), 0.0))
    q, free = w - M @ z, np.flatnonzero(kinds == "free")
    order = generator.permutation(free)
    factors = (10.0 ** generator.uniform(-2, 2, free.size)) * generator.choice([-1.0, 1.0], free.size)
    M[free], q[free] = factors[:, np.newaxis] * M[order], factors * q[order]
    return Problem(M, q, lower=lower, upper=upper)


def monotone(generator: np.random.Generator, n: int) -> NDArray[np.float64]:
    B, S = generator.normal(size=(n, max(n // 2, 1))), generator.normal(size=(n, n))
    return B @ B.T + S - S.T


def saddle(generator: np.random.Generator, n: int) -> NDArray[np.float64]:
    """[H -A'; A 0], with a positive semidefinite H."""
    k = max(2 * n // 3, 1)
    B, A = generator.normal(size=(k, k // 2 + 1)), generator.normal(size=(n - k, k))
    return np.block([[B @ B.T, -A.T], [A, np.zeros((n - k, n - k))]])


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6), n=st.integers(2, 40), program=st.booleans())
def test_planted_problems_are_solved_however_their_equations_are_written(seed: int, n: int, program: bool) -> None:
    assert run(planted(seed, n, program), "lemke").solved


@pytest.mark.parametrize("as_matrix", [np.asarray, csr_array])
@pytest.mark.parametrize("n", [48, 100, 200])
def test_contact_with_friction_is_solved_by_one_path(n: int, as_matrix: type) -> None:
    for seed in range(5):
        problem = families.make("contact", n, seed)
        for method in ("lemke", "auto"):
            result = run(Problem(as_matrix(problem.M), problem.q), method)
            assert (result.solved, result.route[-1]) == (True, "lemke")


def tower(boxes: int, seed: int) -> Problem:
    """A time step of boxes at rest on one another (D. E. Stewart and J. C. Trinkle 1996), with their velocities as
    free variables: forces of about 0.1, and horizontal momenta, and tilts of the contacts, that are rounding."""
    generator = np.random.default_rng(seed)
    m, friction = 3 * boxes, generator.uniform(0.1, 1.0)
    mass = np.repeat(generator.uniform(0.5, 2.0, boxes), 3) * np.tile([1.0, 1.0, 0.1], boxes)
    normals, tangents = np.zeros((2, m, 2 * boxes))
    for i in range(boxes):
        tilt, offset = 1e-18 * generator.normal(), 0.02 * generator.normal()
        for k, corner in ((2 * i, -0.5), (2 * i + 1, 0.5)):
            normals[3 * i : 3 * i + 3, k], tangents[3 * i : 3 * i + 3, k] = [tilt, 1, corner], [1, -tilt, 0.25]
            if i:
                normals[3 * i - 3 : 3 * i, k] = [-tilt, -1, -(corner + offset)]
                tangents[3 * i - 3 : 3 * i, k] = [-1, tilt, 0.25]
    c = 2 * boxes
    J = np.hstack([normals, np.kron(tangents, [[1.0, -1.0]])])
    E, zero = np.kron(np.eye(c), [[1.0], [1.0]]), np.zeros
    M = np.block(
        [
            [np.diag(mass), -J, zero((m, c))],
            [J.T, zero((3 * c, 3 * c)), np.vstack([zero((c, c)), E])],
            [zero((c, m)), friction * np.eye(c), -E.T, zero((c, c))],
        ]
    )
    momenta = np.column_stack([1e-17 * generator.normal(size=boxes), 0.1 * mass[::3], 1e-18 * np.ones(boxes)])
    q = np.append(momenta.ravel(), zero(4 * c))
    return Problem(M, q, lower=np.where(np.arange(q.size) < m, -INF, 0.0))


@pytest.mark.parametrize("boxes", [1, 3, 8])
def test_boxes_at_rest_are_solved_with_their_velocities_as_free_variables(boxes: int) -> None:
    """Rows of velocities have nothing but rounding in them, which has to be 0."""
    for seed in range(5):
        assert run(tower(boxes, seed), "lemke").solved


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6), n=st.integers(1, 12), program=st.booleans())
def test_rows_of_the_reduction_are_those_of_the_problem_where_its_equations_hold(
    seed: int, n: int, program: bool
) -> None:
    """For any y of the bounded variables that satisfies G y + g = 0, the rows of w are those of z but for terms in the
    range of H, which u takes up."""
    problem, generator = planted(seed, n, program), np.random.default_rng(seed)
    reduction = Reduction(problem.M, problem.box)
    k, m = reduction.constants(problem.q), reduction.bounded.size
    y: Vector = generator.normal(size=k.size)
    s = (k.size - m) // 2
    if s:
        G, g = reduction.K[m : m + s, :m], k[m : m + s]
        y[:m] -= np.linalg.pinv(G, rcond=1e-9) @ (G @ y[:m] + g)
    nothing = np.zeros(k.size, dtype=bool)
    z, _ = reduction.given(y, nothing, nothing)
    w, own = problem.w(z), reduction.given_w(reduction.K @ y + k)
    bounded = ~problem.box.free & ~problem.box.fixed
    scale = np.abs(problem.M) @ np.abs(z) + np.abs(problem.q)
    assert np.allclose(own[bounded], w[bounded], rtol=0, atol=1e-7 * scale.max())


@settings(max_examples=40, deadline=None)
@given(seed=st.integers(0, 10**6), n=st.integers(2, 30))
def test_a_program_is_monotone_after_the_reduction_however_its_equations_are_written(seed: int, n: int) -> None:
    problem = planted(seed, n, program=True)
    reduction = Reduction(problem.M, problem.box)
    K, B = reduction.K, reduction.bounded
    factors = np.ones(len(K))
    factors[: B.size] = np.sqrt(reduction.columns[B] / reduction.rows[B])
    K = factors[:, np.newaxis] * K / factors  # in units that are the same for rows and columns
    eigenvalues = np.linalg.eigvalsh(K + K.T)
    assert eigenvalues.min(initial=0.0) >= -1e-8 * eigenvalues.max(initial=1.0)


def test_ray_of_a_problem_with_equations_proves_that_it_is_infeasible() -> None:
    """z_1 + z_2 = -1 with z_1, z_2 >= 0 and a multiplier, written with the other sign."""
    M, q = [[0, 0, 1], [0, 0, 1], [-1, -1, 0]], [1, 1, -1]
    result = run(Problem(M, q, lower=[0, 0, -INF]), "lemke")
    assert result.status is Status.INFEASIBLE


def test_variables_go_from_bound_to_bound() -> None:
    """M = 0: each z_i goes to the bound that the sign of q_i asks for, without any exchange of rows."""
    result = run(Problem(np.zeros((3, 3)), [-1, 2, -3], lower=-1, upper=[5, 6, 7]), "lemke")
    assert result.solved
    assert result.z.tolist() == [5, -1, 7]


@pytest.mark.parametrize("small", [1e-8, 1e-17, 1e-40])
def test_numbers_far_smaller_than_others_are_settled_by_their_own_rows(small: float) -> None:
    """Where the path ends, z_0 is within rounding of the large numbers, but not of the small ones."""
    block, q = np.array([[2.0, 1.0], [1.0, 2.0]]), np.array([-5.0, -6.0])
    M = np.kron(np.eye(2), block)
    result = run(Problem(M, np.concatenate([q, small * q])), "lemke")
    assert result.solved
    assert np.allclose(result.z, np.array([4, 7, 4 * small, 7 * small]) / 3, rtol=1e-12, atol=0)
