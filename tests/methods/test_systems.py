"""A kind of matrix that is none of numpy's or scipy's is one class, with which pivoting
and refinement work."""

import numpy as np

from lcpcli.basis.exchanges import BasisSolver
from lcpcli.linalg.krylov import StoppingCriterion, conjugate_gradients, identity, norm
from lcpcli.methods.newton import newton
from lcpcli.model.box import BASIC, ORTHANT

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


def test_a_solution_of_half_of_the_digits_is_refined_to_all_of_them():
    c, q = circulant(1 << 14)
    system = Circulant(c, q)
    *_, last = newton(system, np.zeros(q.size))
    found = ORTHANT.basis_of(last.x)
    rough, basic = np.zeros(q.size), (found == BASIC).nonzero()[0]
    rough[basic] = system.solver(basic)(-q[basic])
    better = system.at(found)
    assert better.is_solution
    residuals = [norm((system.product(z) + q)[basic]) for z in (rough, better.z)]
    assert residuals[1] < 1e-14 * norm(q) < residuals[0]
