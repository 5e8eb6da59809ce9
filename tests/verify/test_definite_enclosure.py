"""Enclosures of basic solutions of stiff bands, and proofs that these are definite,
hold in rational arithmetic, and tell what doubles cannot."""

from fractions import Fraction

import numpy as np
import pytest
from scipy.sparse import csr_array, diags_array

from lcpcli import Problem, run
from lcpcli.gallery.families import make
from lcpcli.linalg.doubles import EPS
from lcpcli.model.box import BASIC, LOWER
from lcpcli.verify import enclosure
from lcpcli.verify.definite_enclosure import enclosed, is_definite, least_eigenvalue

from ..methods.bands import basic_solution

N = 150
FIBONACCI = 2111485077978050, 3416454622906707, 5527939700884757  # from the 75th on
STIFF = {
    "beam": {"contrast": 1e8, "load": 30.0},
    "frame": {"contrast": 1e4, "load": 30.0, "support": "springs"},
    "convection": {"contrast": 1e6, "load": 30.0},
}


def stiff(kind):
    problem = make("beam" if kind == "convection" else kind, N, **STIFF[kind])
    if kind == "convection":
        ones = np.ones(problem.n - 1)
        D = diags_array([ones, -ones], offsets=[1, -1])
        problem = Problem(csr_array(problem.M + 2.0**-10 * D), problem.q)
    return problem


@pytest.mark.parametrize("kind", STIFF)
def test_enclosures_hold_the_exact_basic_solution(kind):
    problem = stiff(kind)
    z = run(problem, "interior").z
    basis = problem.box.basis_at(z)
    found = enclosed(problem, basis)
    exact_z, exact_w = basic_solution(problem, z)
    for i in range(problem.n):
        own = Fraction(float(found.z.high[i])) + Fraction(float(found.z.low[i]))
        assert abs(own - exact_z[i]) <= found.z_error[i]
        assert abs(Fraction(float(found.w[i])) - exact_w[i]) <= found.w_error[i]
    # And they are narrow.
    assert found.z_error.max() <= 1e-25 * np.abs(z).max()
    assert not enclosure.why_unproved(problem, z, 1e-10)
    # With another basis a sign is wrong.
    active = np.flatnonzero(basis == LOWER)
    assert active.size
    other = z.copy()
    other[active[0]] = np.abs(z).max()
    assert problem.box.basis_at(other)[active[0]] == BASIC
    assert enclosure.why_unproved(problem, other, 1e-10)


@pytest.mark.parametrize(
    ("spring", "whether", "whatever_rounding"),
    [(1.0, True, True), (1e-15, True, False), (0.0, False, False)],
)
def test_a_beam_is_definite_by_its_springs(spring, whether, whatever_rounding):
    """Without them it moves freely; soft ones may be a matter of rounding."""
    n = 40
    problem = on_springs(n, spring)
    assert is_definite(problem) == whether
    assert is_definite(problem, EPS) == whatever_rounding
    assert not is_definite(on_springs(n, -1e-15))


def test_a_bound_on_the_least_eigenvalue_is_one():
    """Fibonacci numbers with the determinant 1 are definite, but by less than what is
    looked for."""
    first, second, third = (np.ldexp(f, -52) for f in FIBONACCI)
    M = csr_array(np.array([[third, second], [second, first]]))
    assert least_eigenvalue(M, None) == 0
    M = csr_array(np.diag([1.0, 2.0**-60]))
    assert 0 < least_eigenvalue(M, None) <= 2.0**-60


def on_springs(n, stiffness):
    ones, springs = np.ones(n), np.zeros(n)
    springs[[0, -1]] = stiffness
    B = diags_array([ones, -2 * ones, ones], offsets=[0, 1, 2], shape=(n - 2, n))
    M = csr_array(B.T @ B + diags_array([springs], offsets=[0]))
    return Problem(M, -ones)
