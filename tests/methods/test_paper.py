"""The tables of El foutayeni and Khaladi (2012): what comes out to the last printed
digit, and what does not; their smoothed modulus and equation, which are what the
formulas say wherever doubles reach; and the merit function of Fischer and Burmeister
with its smoothed form. The method `shi` is the printed algorithm: every step of it is
reached, and does what the paper says; its endings. The method `fixed-point` is
Schäfer's iteration, contracts as theory says, and refuses where it is undefined.
"""

import math
from decimal import Decimal, localcontext
from itertools import islice

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.random import default_rng
from scipy.sparse import csr_array

from lcpcli import Problem, Status, read, run
from lcpcli.files import contents
from lcpcli.gallery import families
from lcpcli.linalg import factors
from lcpcli.methods.fixed_point import (
    RESTART_GROWTH,
    Anderson,
    best_omega,
)
from lcpcli.methods.josephy_newton import phi, slopes
from lcpcli.methods.shi import (
    PLANE,
    SELECTED,
    STEEPEST_AT_MULTIPLE,
    Smoothed,
    direction,
    excess,
    shi,
    slope,
)
from lcpcli.model.box import Box

TABLE_1 = {
    1: "0.0000000 0.0000000 0.0000000 0.0000000",
    5: "0.7883251 0.0000000 1.3448593 0.0000000",
    10: "1.0197946 0.0000000 0.9884737 0.0000000",
    15: "0.9985643 0.0000000 1.0012907 0.0000000",
    20: "1.0001030 0.0000000 0.9999377 0.0000000",
    25: "0.9999918 0.0000000 1.0000058 0.0000000",
    30: "1.0000005 0.0000000 0.9999997 0.0000000",
    33: "0.9999999 0.0000000 1.0000001 0.0000000",
    34: "1.0000001 0.0000000 1.0000000 0.0000000",
    35: "1.0000000 0.0000000 1.0000000 0.0000000",
}
TABLE_2 = {
    1: "0.0000000 0.0000000 0.0000000 0.0000000",
    5: "0.1115059 0.6300237 0.3146258 0.0000000",
    10: "0.0000000 0.4906849 0.6581657 0.0000000",
    15: "0.0000000 0.5309163 0.5863067 0.0000000",
    20: "0.0000000 0.5192743 0.5936312 0.0000000",
    25: "0.0000000 0.5188339 0.5869623 0.0000000",
    30: "0.0000000 0.5173795 0.5862876 0.0000000",
    35: "0.0000000 0.5171712 0.5859293 0.0000000",
    40: "0.0000000 0.5171411 0.5860432 0.0000000",
    45: "0.0000000 0.5171911 0.5861363 0.0000000",
    50: "0.0000000 0.5172239 0.5861902 0.0000000",
    55: "0.0000000 0.5172388 0.5862079 0.0000000",
    60: "0.0000000 0.5172428 0.5862107 0.0000000",
    # Printed 0,5860930: digits transposed.
    65: "0.0000000 0.5172428 0.5862093 0.0000000",
    70: "0.0000000 0.5172421 0.5862079 0.0000000",
    75: "0.0000000 0.5172416 0.5862071 0.0000000",
    79: "0.0000000 0.5172414 0.5862069 0.0000000",  # printed 0,5172424
}


EXAMPLE_1, EXAMPLE_2 = (
    read(contents.shipped_path(f"paper-example-{number}.json")) for number in (1, 2)
)


@pytest.mark.parametrize(
    ("problem", "printed"), [(EXAMPLE_1, TABLE_1), (EXAMPLE_2, TABLE_2)]
)
def test_fixed_point_rows_are_the_printed_ones(problem, printed):
    """With as many digits as are printed."""
    trace = run(problem, "fixed-point", trace=True).trace
    rows = {row.k: " ".join(f"{z:.7f}" for z in row.z) for row in trace.rows}
    assert {k: rows[k] for k in printed} == printed


def exact_modulus(p, x):
    """phi and phi' to 400 digits, so that phi + x and phi - x have 60 and more."""
    with localcontext() as context:
        context.prec, context.Emax, context.Emin = 400, 10**9, -(10**9)
        up, down = (Decimal(p) * Decimal(x)).exp(), (-Decimal(p) * Decimal(x)).exp()
        return (1 + up + down).ln() / Decimal(p), (up - down) / (1 + up + down)


def computed_split(p, x):
    """z~ and w~ at one x."""
    z, w, _ = Smoothed(Problem([[1.0]], [0.0]), p).split(np.array([x]))
    return float(z[0]), float(w[0])


# So that p x is exact.
@pytest.mark.parametrize("p", [2.0**-10, 1.0, 8.0, 2.0**40, 2.0**996])
def test_phi_and_its_slope_agree_with_60_digits_and_neither_smoothed_z_nor_w_cancels(p):
    for x in (
        np.array([0.0, 1e-9, 1e-3, 0.5, -0.5, 3.0, -30.0, 300.0, -700.0, 700.0]) / p
    ):
        phi, steepness = exact_modulus(p, float(x))
        assert abs(x) + excess(p, np.array([abs(x)]))[0] == pytest.approx(
            float(phi), rel=1e-15
        )
        assert slope(p, np.array([x]))[0] == pytest.approx(
            float(steepness), rel=4e-16, abs=0
        )
        with localcontext() as context:
            context.prec = 400
            split = float(phi + Decimal(float(x))), float(phi - Decimal(float(x)))
        assert computed_split(p, float(x)) == pytest.approx(split, rel=1e-14, abs=0)


BOX = Box(
    np.array([0.0, -np.inf, 1.0, -np.inf, 2.0]),
    np.array([np.inf, 3.0, 4.0, np.inf, 2.0]),
)


@pytest.mark.parametrize("mu", [0.0, 1e-3, 1.0])
def test_slopes_are_the_derivatives(mu):
    random = default_rng(0)
    J = random.normal(size=(5, 5))
    z = np.array([0.3, 2.5, 1.7, -1.0, 2.0])
    F = random.normal(size=5)
    step = 1e-6
    G = slopes(BOX, z, F, J, mu)
    for j in range(4):  # the last variable is fixed
        ends = [
            phi(BOX, z + t * np.eye(5)[j], F + t * J[:, j], mu) for t in (step, -step)
        ]
        assert np.abs((ends[0] - ends[1]) / (2 * step) - G[:, j]).max() <= 1e-6


def iterates(problem, x0, count, **options):
    """The first iterates, fewer if the method ends."""
    return list(islice(shi(problem, x0, **options), count))


def vectors_of_step_3(F, v, y):
    """u and v of step 2.3, as printed."""
    xi_1, xi_2 = -(v @ v) / (v @ y), -(y @ F) / (y @ y)
    return xi_1 * F, xi_2 * v


def cosine(a, b):
    return float(a @ b / np.linalg.norm(a) / np.linalg.norm(b))


def chosen(F, v, y, d):
    return direction(F, v.copy(), y.copy(), -d)[:2]


def test_steps_are_labelled_with_their_numbers():
    found = iterates(EXAMPLE_1, EXAMPLE_1.x0, 20, k_star=4)
    assert found[0].step == SELECTED
    multiples = [k for k, it in enumerate(found) if it.step == STEEPEST_AT_MULTIPLE]
    assert multiples == [4, 8, 12, 16]
    assert {it.step for it in found[1:4]} == {PLANE}


def test_alpha_maximises_the_cosine_among_all_alphas_that_descend():
    """The printed bound on alpha is the descent condition only for <u - v, d> > 0; for
    < 0 it turns round."""
    generator, sides = default_rng(0), set()
    steps = np.concatenate([np.logspace(-8, 8, 200), [1e12]])
    for n in np.repeat([2, 3, 5], 15).tolist():
        F, v, y, d = generator.standard_normal((4, n))
        u, w = vectors_of_step_3(F, v, y)
        step, s = chosen(F, v, y, d)
        assert step == PLANE
        assert s @ d > 0
        bound, side = -(w @ d) / ((u - w) @ d), math.copysign(1, (u - w) @ d)
        candidates = (bound + side * t * max(1.0, abs(bound)) for t in steps)
        best = max(cosine(alpha * u + (1 - alpha) * w, d) for alpha in candidates)
        assert cosine(s, d) >= best - 1e-7
        a, b = np.linalg.lstsq(np.column_stack((u, w)), s, rcond=None)[0]
        assert np.allclose(a * u + b * w, s)
        alpha = a / (a + b) if abs(a + b) > 1e-9 * (abs(a) + abs(b)) else math.inf
        # Otherwise s would be a negative multiple of a candidate.
        assert alpha == math.inf or a + b > 0
        sides.add(side)
    assert sides == {-1, 1}


def test_small_p_ends_at_the_smoothing_error_and_says_so():
    result = run(EXAMPLE_1, "shi", p=3.0, max_iterations=2000)
    assert result.status is Status.STALLED
    bound = math.log(3) / 3 * np.abs(EXAMPLE_1.M - np.eye(4)).sum(axis=1).max()
    assert 1e-3 < result.residual <= bound
    told = f"smoothing error, in F at most (ln 3 / p) |M - I| = {bound:.2g} for p = 3 "
    assert f"the remaining residual is the {told}" in result.message


@pytest.mark.parametrize(
    ("family", "n", "p"), [("hilbert", 6, None), ("gaussian", 2, 10.0)]
)
def test_an_end_far_from_a_zero_or_by_rounding_is_no_smoothing_error(family, n, p):
    result = run(families.make(family, n), "shi", p=p, tol=1e-15)
    assert result.status is Status.STALLED
    assert "no step decreases |F~| any further" in result.message


@pytest.mark.parametrize(
    ("k_star", "status"), [(10, Status.ITERATION_LIMIT), (100, Status.SOLVED)]
)
def test_direction_that_cannot_descend_gives_way_to_steepest_descent(k_star, status):
    """A positive definite problem on which the plane of F~ and the last step becomes
    orthogonal to d."""
    generator = default_rng([12, 3])
    factor = generator.standard_normal((12, 12))
    problem = Problem(
        factor @ factor.T + 12 * np.eye(12), generator.standard_normal(12)
    )
    assert run(problem, "shi", k_star=k_star, max_iterations=1000).status is status


def test_evaluations_of_a_search_in_vain_are_counted(monkeypatch):
    done, real = [], Smoothed.at
    monkeypatch.setattr(Smoothed, "at", lambda self, x: done.append(x) or real(self, x))
    result = run(
        Problem([[2.0, -5.0], [5.0, 2.0]], [-1.0, 1.0]), "shi", max_iterations=200
    )
    assert result.evaluations == len(done)


@pytest.mark.parametrize(
    ("problem", "word"),
    [
        (Problem([[2.0]], [-1e-200]), "underflows"),
        (Problem(EXAMPLE_1.M, EXAMPLE_1.q * 1e200, x0=np.zeros(4)), "overflow"),
        # Where phi' = 0 makes J = M + 1 = 0: no zero of F~
        (Problem([[-1.0]], [-1.0], x0=[0.0]), "stationary"),
    ],
)
def test_what_it_cannot_go_on_from_is_a_breakdown_that_says_so(problem, word):
    result = run(problem, "shi")
    assert result.status is Status.BREAKDOWN
    assert word in result.message


LARGE = np.diag(np.append(1.0, -np.ones(factors.MAX_NUMPY_ROWS)))


@pytest.mark.parametrize(
    "M",
    [
        [[0, 1], [1, 0]],
        np.outer([1, 2, 3], [3, 1, 2]) / 11 - np.eye(3),
        LARGE,
        csr_array(LARGE),
    ],
    ids=["exactly", "up to rounding", "large", "sparse"],
)
def test_singular_matrix_is_refused_by_name(M):
    result = run(Problem(M, -np.ones(np.shape(M)[0])), "fixed-point")
    assert result.status is Status.BREAKDOWN
    assert "I + M is singular" in result.message
    assert "another omega" in result.message


@pytest.mark.parametrize(
    "M", [np.diag([1e-20, 1.0, 1e20]).tolist(), [[0.0, 1e20], [1.0, 2e20]]]
)
def test_badly_scaled_matrix_is_not_mistaken_for_a_singular_one(M):
    problem = Problem(M, [-1.0] * len(M))
    assert (
        run(problem, "fixed-point", max_iterations=3).status is Status.ITERATION_LIMIT
    )


@settings(max_examples=20)
@given(seed=st.integers(0, 2**32 - 1), spread=st.floats(0, 8), sparse=st.booleans())
def test_auto_omega_is_near_the_best_for_positive_definite_matrices(
    seed, spread, sparse
):
    generator = np.random.default_rng(seed)
    Q = np.linalg.qr(generator.standard_normal((8, 8)))[0]
    eigenvalues = 10 ** generator.uniform(-spread / 2, spread / 2, 8)
    M = (Q * eigenvalues) @ Q.T
    M = (M + M.T) / 2
    best = np.sqrt(eigenvalues.min() * eigenvalues.max())
    omega = best_omega(csr_array(M) if sparse else M)
    assert best / 3 <= omega <= 3 * best


def test_auto_omega_of_other_matrices_is_the_largest_diagonal_entry():
    # Then all pivots are positive.
    rows_exchanged = [[2, 1, 2, -2], [1, 1, 2, -1], [2, 2, 1, -1], [-2, -1, -1, 2]]
    for M, omega in (
        ([[1, 2], [-1, 3]], 3),
        ([[0, -5], [1, 0]], 5),
        ([[0, 0], [0, 0]], 1),
        (rows_exchanged, 2),
    ):
        dense = np.array(M, dtype=float)
        assert best_omega(dense) == omega
        assert best_omega(csr_array(dense)) == omega


def test_auto_omega_and_anderson_each_save_iterations_on_the_obstacle_problem():
    problem = families.make("obstacle", 400)
    options = ({}, {"omega": "auto"}, {"omega": "auto", "anderson": 5})
    published, plain, fast = (run(problem, "fixed-point", **each) for each in options)
    assert fast.solved
    assert plain.iterations < published.iterations
    assert 2 * fast.iterations < plain.iterations
    assert np.allclose(fast.z, plain.z, rtol=0, atol=1e-9)


def test_anderson_restarts_with_a_plain_step_from_the_best_point():
    sequence = Anderson(3, 2)
    images = np.array([[2.0, 0.0], [1.0, 0.5], [9.0, 9.0]])
    sizes = (3.0, 1.0, 1.0 + 2 * RESTART_GROWTH)
    for image, size in zip(images, sizes, strict=True):
        following = sequence.next(image - [size, 0.0], image)
    assert following.tolist() == images[1].tolist(), "what the best point leads to"
    following = sequence.next(following, images[0])
    assert following.tolist() == images[0].tolist(), "without an earlier difference"


@settings(max_examples=8)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 30), memory=st.integers(1, 12))
def test_anderson_never_diverges_on_h_matrices(seed, n, memory):
    """Strictly diagonally dominant by rows, rows and columns in other units, omega at
    least the diagonal."""
    generator = np.random.default_rng(seed)
    M = generator.standard_normal((n, n))
    np.fill_diagonal(M, 0)
    np.fill_diagonal(M, 1.05 * np.abs(M).sum(axis=1) + 0.01)
    M = M * np.exp2(generator.integers(-2, 3, n))
    problem = Problem(M, generator.standard_normal(n))
    start = 100 * generator.standard_normal(n)
    for anderson in (0, memory):
        assert run(
            problem, "fixed-point", x0=start, omega="auto", anderson=anderson
        ).solved


@pytest.mark.parametrize("p", [0.1, 1.0, 8.0])
def test_gradient_agrees_with_differences(p):
    M = [[8, -1, 0, -5], [1, 5, -1, 0], [2, -1, 6, -1], [6, 0, -1, 7]]
    smoothed = Smoothed(Problem(M, [1, -2, -3, 4]), p)
    x, h = np.array([0.25, -1e-3, 2e-5, -0.75]), 1e-6
    differences = [
        (smoothed.at(x + step).f - smoothed.at(x - step).f) / (2 * h)
        for step in h * np.eye(4)
    ]
    assert smoothed.gradient(smoothed.at(x)) == pytest.approx(differences, rel=1e-6)
