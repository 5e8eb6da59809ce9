"""A kind of matrix that is none of numpy's or scipy's is one class, with which pivoting
and refinement work."""

import numpy as np
import pytest

from lcpcli import Problem
from lcpcli.basis.exchanges import BasisSolver, CorrectedSolutions
from lcpcli.linalg.krylov import StoppingCriterion, conjugate_gradients, identity, norm
from lcpcli.methods.newton import newton
from lcpcli.methods.stages import Finished, Iterate, advance
from lcpcli.model.box import BASIC, LOWER, ORTHANT
from lcpcli.verify.point import Criterion, Point

HALF_OF_THE_DIGITS = 1e-8


class Circulant(BasisSolver):
    """M_ij = c_(i - j modulo n), symmetric and positive definite, by fast Fourier
    transforms."""

    def __init__(self, c, q):
        self.q, self.box, self._spectrum, self._sizes = (
            q,
            ORTHANT,
            np.fft.rfft(c),
            np.fft.rfft(np.abs(c)),
        )
        self.largest = float(np.abs(c).max())
        self.row_maxima = np.full(c.size, self.largest)

    def product(self, z):
        return np.fft.irfft(self._spectrum * np.fft.rfft(z), z.size)

    def terms(self, z, rows=None):
        terms = np.fft.irfft(self._sizes * np.fft.rfft(np.abs(z)), z.size) + np.abs(
            self.q
        )
        return terms if rows is None else terms[rows]

    def solver(self, indices):
        def part(v):
            z = np.zeros(self.q.size)
            z[indices] = v
            return self.product(z)[indices]

        def solve(b):
            stopping = StoppingCriterion(HALF_OF_THE_DIGITS * norm(b), 100)
            return conjugate_gradients(part, b, np.zeros(b.size), stopping, identity)[0]

        return solve


def circulant(n):
    distances = np.minimum(np.arange(n), n - np.arange(n))
    return np.exp(-1.0 * distances) + (distances == 0), np.random.default_rng(
        n
    ).standard_normal(n)


@pytest.mark.parametrize("n", [1, 2, 60, 400])
def test_newton_solves_a_problem_with_a_circulant_matrix(n):
    c, q = circulant(n)
    stage, x = newton(Circulant(c, q), np.zeros(n)), np.zeros(n)
    while isinstance(step := advance(stage), Iterate):
        x = step.x
    assert isinstance(step, Finished)
    problem = Problem(c[np.subtract.outer(np.arange(n), np.arange(n)) % n], q)
    assert Point(Criterion(problem, 1e-13), problem.box.z_of(x)).solves()


def test_a_solution_of_half_of_the_digits_is_refined_to_all_of_them():
    c, q = circulant(1 << 14)
    system = Circulant(c, q)
    *_, found = iterate_to_the_end(system)
    rough, basic = np.zeros(q.size), (found == BASIC).nonzero()[0]
    rough[basic] = system.solver(basic)(-q[basic])
    better = system.at(found)
    assert better.is_solution
    residuals = [norm((system.product(z) + q)[basic]) for z in (rough, better.z)]
    assert residuals[1] < 1e-14 * norm(q) < residuals[0]


def iterate_to_the_end(system):
    """The states of block pivoting from z = 0."""
    states = []
    for found in system.block_principal_pivoting(
        np.full(system.q.size, LOWER, np.int8)
    ):
        states.append(found.basis)
        if found.is_solution:
            break
    return states


@pytest.mark.parametrize("near", [None, np.array([5.0, 5.0])])
def test_basic_solutions_beside_bounds_are_those_of_the_problem(near):
    problem = Problem([[2, 1], [1, 2]], [-9, -12], lower=[1, 2])
    solutions = CorrectedSolutions(problem, problem.M, near)
    for basis, z in (([BASIC, BASIC], [2, 5]), ([LOWER, BASIC], [1, 5.5])):
        found = solutions.at(np.array(basis, np.int8))
        assert found.z == pytest.approx(z)
