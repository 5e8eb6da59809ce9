"""Block principal pivoting with the safeguard that makes it finite on P-matrices,
projected gradients that lead to states for it, and its finish of other methods from a
nearly right active set."""

import numpy as np
import pytest
from numpy.random import default_rng
from scipy.sparse import csr_array

from lcpcli import Problem, Status, Trace, read
from lcpcli.files import contents
from lcpcli.gallery import families
from lcpcli.linalg import factors, matrices
from lcpcli.methods import newton
from lcpcli.methods.newton import FINISH, finish
from lcpcli.methods.stages import Breakdown, Finished, Iterate, Stalled
from lcpcli.model.box import ORTHANT
from lcpcli.solving.driver import run

from .grids import line
from .planted import matrix
from .stages import scripted, through


def test_rows_of_the_papers_first_table_are_its_own():
    """From any start with all components negative: 0; 4, 0, 4, 0; 1, 0, 1, 0, the
    vector-division rows."""
    trace = Trace()
    example = read(contents.shipped_path("paper-example-1.json"))
    run(example, "newton", -np.ones(4), trace=trace)
    assert [row.z.tolist() for row in trace.rows[1:]] == [[4, 0, 4, 0], [1, 0, 1, 0]]


@pytest.mark.parametrize("n", [3, 5, 21])
def test_cycle_of_plain_newton_is_broken(n):
    """M = I + 2 C with the cyclic shift C, n odd, q = e, from x = -e_1: plain steps
    never end."""
    M = np.eye(n) + 2 * np.roll(np.eye(n), 1, axis=0)
    trace = Trace()
    result = run(Problem(M, np.ones(n)), "newton", 1.0 - 2 * np.eye(n)[0], trace=trace)
    assert result.solved
    assert {"block", "least index"} <= {row.step for row in trace.rows}


def test_singular_principal_submatrix_is_a_breakdown():
    result = run(Problem([[0.0, 1.0], [1.0, 0.0]], [-1.0, 1.0]), "newton")
    assert result.status is Status.BREAKDOWN
    assert "singular" in result.message


@pytest.fixture
def sizes(monkeypatch):
    """The sizes of the dense blocks that are factorized from now on, without the Schur
    complements of updates, which have a row for each of a few changes."""
    found = []

    def counting(real):
        return lambda self, A, *how: (
            (A.shape[0] > 50 and found.append(A.shape[0])) or real(self, A, *how)
        )

    kind = type(factors.dense_factors())
    for name in ("cholesky", "lu"):
        monkeypatch.setattr(kind, name, counting(getattr(kind, name)))
    return found


@pytest.mark.parametrize("symmetric", [True, False])
def test_auto_factorizes_once_from_an_active_set_that_is_nearly_right(symmetric, sizes):
    problem = families.make("harker-pang", 250, 3, symmetric=symmetric)
    result = run(problem, "auto")
    assert result.solved
    assert result.route == ("gradient", "newton")
    assert len(sizes) == 1
    plain = run(problem, "newton")
    assert np.allclose(result.z, plain.z, rtol=0, atol=1e-12 * np.abs(plain.z).max())


@pytest.fixture
def precisions(monkeypatch):
    """The types of the matrices of which products are taken."""
    seen = set()
    monkeypatch.setattr(
        newton, "product", lambda M, v: seen.add(M.dtype) or matrices.product(M, v)
    )
    return seen


@pytest.mark.parametrize("family", ["harker-pang", "boxes", "degenerate"])
def test_steps_in_single_precision_lead_to_the_solution_in_doubles(family, precisions):
    result = run(families.make(family, 250, 1), "auto")
    assert result.solved
    assert result.relative_residual <= 1e-12
    assert result.route[0] == "gradient"
    assert precisions == {np.dtype(np.float32)}


def test_numbers_beyond_the_range_of_single_precision_are_left_to_doubles(precisions):
    of_M = 2.0**-60
    problem = families.make("harker-pang", 250, 1)
    plain = run(problem, "auto")
    precisions.clear()
    result = run(Problem(of_M * problem.M, problem.q), "auto")
    assert result.solved
    assert not precisions
    assert np.allclose(result.z * of_M, plain.z, rtol=1e-12, atol=0)


def test_steps_end_where_states_do_not_settle():
    """M = 0.1 I + A'A + B - B' with B as large as A: the iteration has no reason to
    converge."""
    A, B = default_rng(0).standard_normal((2, 300, 300)) / np.sqrt(300)
    M = 0.1 * np.eye(300) + A.T @ A + (B - B.T)
    q = default_rng(1).standard_normal(300)
    stage = newton.projected_gradient(Problem(M, q), np.zeros(300))
    evaluations = [iterate.evaluations for iterate in stage]
    assert len(evaluations) == 1
    assert evaluations[0] < newton.MAX_GRADIENT_STEPS
    assert run(Problem(M, q), "auto").solved


def constant(x, ending=None, times=5):
    """A method that has found its active set and goes nowhere."""
    return scripted((Iterate(x.copy(), None, "", k) for k in range(times)), ending)


def with_solution(M, seed):
    """A problem whose solution is known, nondegenerate, and the x that has its
    signs."""
    generator = default_rng(seed)
    x = generator.standard_normal(M.shape[0])
    z, w = 2 * np.maximum(x, 0), 2 * np.maximum(-x, 0)
    return Problem(M, w - M @ z, solutions=[z]), x


@pytest.mark.parametrize("n", [5, factors.MAX_NUMPY_ROWS + 20])
@pytest.mark.parametrize("kind", ["dense", "sparse", "nonsymmetric"])
def test_right_signs_give_the_solution_to_rounding(n, kind):
    own = "monotone" if kind == "nonsymmetric" else "definite"
    M = matrix(own, n, default_rng(1))
    problem, x = with_solution(csr_array(M) if kind == "sparse" else M, 2)
    signed = np.sign(x) * default_rng(3).uniform(0.1, 1, n)
    *_, last = finish(problem, None, constant(signed))
    assert last.step == FINISH
    z = ORTHANT.z_of(last.x)
    rounding = 1e-13 * (np.abs(M) @ z + np.abs(problem.q)).max()
    assert np.abs(np.minimum(z, problem.w(z))).max() <= rounding


@pytest.mark.parametrize("seed", range(3))
def test_a_few_wrong_signs_are_corrected(seed):
    """Nearly always: for 14 of the first 3000 seeds the number of wrong signs does not
    fall; there it gives up."""
    problem, x = with_solution(line(40, 4.0).toarray(), seed)
    x[default_rng(seed).choice(40, 3, replace=False)] *= -1
    *_, last = finish(problem, None, constant(x))
    assert last.step == FINISH
    assert np.allclose(ORTHANT.z_of(last.x), problem.solutions[0], rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    "M", [np.ones((3, 3)), csr_array(np.ones((3, 3)))], ids=["dense", "sparse"]
)
def test_singular_block_leaves_the_method_its_iterates_and_its_ending(M):
    problem = Problem(M, np.array([-1.0, -2.0, -3.0]))
    for ending in (Finished(), Stalled("rounding"), Breakdown("no more")):
        given, _ = through(constant(np.ones(3)))
        iterates, found = through(finish(problem, None, scripted(given, ending)))
        assert iterates == given
        assert found == ending


def test_a_method_that_ends_is_finished_at_its_last_iterate():
    problem, x = with_solution(np.diag([1.0, 2.0, 3.0]), 7)
    steps = [
        iterate.step
        for iterate in finish(problem, None, constant(x, Stalled("here"), times=1))
    ]
    assert steps == ["", FINISH]
