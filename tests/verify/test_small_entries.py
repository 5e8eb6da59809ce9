"""Points beside a proved solution whose small entries they miss; and multipliers of
rows that are not active, which are rounding of 0."""

import numpy as np
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st

import lcpcli
from lcpcli import Problem, from_qp

SEEDS = st.integers(0, 2**32 - 1)


def diffusion(generator):
    """One source, from which the solution decays by a factor for each unknown."""
    n, k = int(generator.integers(60, 100)), 10.0 ** generator.uniform(-3, 0)
    q = np.zeros(n)
    q[generator.integers(n)] = -generator.uniform(0.1, 10)
    spread = sp.diags_array([-1.0, 2, -1], offsets=[-1, 0, 1], shape=(n, n))
    return Problem((sp.eye_array(n) + k * spread).tocsr(), q)


def without_tail(z):
    return np.where(z < 1e-13 * z.max(), 0.0, z)


@settings(max_examples=7)
@given(seed=SEEDS)
def test_a_point_without_its_tail_counts_and_a_wrong_one_does_not(seed):
    generator = np.random.default_rng(seed)
    problem = diffusion(generator)
    z = lcpcli.run(problem).z
    noise = generator.standard_normal(z.size)
    cut = without_tail(z)
    assert (cut == 0).any()
    for accepted in (cut, cut * (1 + 4e-13 * noise)):
        found = lcpcli.check(problem, accepted)
        assert found.accepted
        assert "of its largest entry" in found.message
        said = "z differs from an exact solution by no more than"
        assert said in found.message
        assert "with fewer than three correct digits" in found.message
    other = z.copy()
    other[z.argmax()] *= 1 + 1e-6
    for refused in (np.abs(z + 1e-6 * z.max() * noise), z * (1 + 1e-6 * noise), other):
        assert not lcpcli.check(problem, refused).accepted


def test_auto_answers_the_solution_and_a_named_method_keeps_its_iterate():
    """Those of interior have no correct digit in the tail."""
    n = 200
    spread = sp.diags_array([-1.0, 2, -1], offsets=[-1, 0, 1], shape=(n, n))
    M, q = (sp.eye_array(n) + 0.5 * spread).tocsr(), np.zeros(n)
    q[20] = -1.0
    exact = lcpcli.solve(M, q)
    assert exact.solved
    assert (exact.z > 0).all()
    for method in ("interior", "lemke"):
        result = lcpcli.solve(M, q, method)
        assert result.solved
        assert "of its largest entry" in result.message
        assert np.abs(result.z - exact.z).max() < 1e-10
        assert not np.allclose(result.z, exact.z, rtol=1e-3, atol=0)
    assert not lcpcli.solve(M, q, "shi", max_iterations=3).solved


@settings(max_examples=10)
@given(seed=SEEDS, rounding=st.sampled_from([1e-17, 5e-17, 2e-16]))
def test_multipliers_of_rows_that_are_not_active_may_be_rounding(seed, rounding):
    generator = np.random.default_rng(seed)
    n, m = int(generator.integers(3, 12)), int(generator.integers(2, 8))
    A, B = generator.standard_normal((m, n)), generator.standard_normal((n, n))
    x, width = generator.standard_normal(n), generator.uniform(0.1, 2, m)
    sides = {"row_lower": A @ x - width, "row_upper": A @ x + width}
    c = generator.standard_normal(n)
    problem = from_qp(B @ B.T + np.eye(n), c, A, lower=-np.inf, **sides)
    z = lcpcli.run(problem).z
    y, s = slice(n, n + m), z[n + m :]
    is_inside = (sides["row_lower"] < s) & (s < sides["row_upper"])
    size = max(np.abs(z[y]).max(), np.abs(c).max())
    noise = np.where(is_inside, generator.standard_normal(m), 0.0) * size
    for factor, is_right in ((rounding, True), (1e-6, not is_inside.any())):
        moved = z.copy()
        moved[y] += factor * noise
        assert lcpcli.check(problem, moved).accepted == is_right
