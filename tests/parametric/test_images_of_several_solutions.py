"""The derivative of J z is refused where J z differs between solutions, as the list of
all solutions in fractions shows."""

from fractions import Fraction

import numpy as np
import pytest

import lcpcli
from lcpcli.errors import DerivativeError

REFUSED = "one of several solutions, which differ in J z"


def raises(function, **arguments):
    try:
        function(**arguments)
    except DerivativeError as error:
        return str(error)
    return ""


@pytest.mark.parametrize(
    ("M", "q", "J", "differs"),
    [
        # z_1 = 0, z_2 >= 2: z is at the end of a ray, and (0, 2) has w = 0.
        ([[0, 1], [-1, 0]], [-2, 0], [[0, 1]], True),
        ([[0, 1], [-1, 0]], [-2, 0], [[1, 0]], False),
        # z_1 + z_2 = 1, and z at one of its ends
        ([[1, 1], [1, 1]], [-1, -1], [[1, -1]], True),
        ([[1, 1], [1, 1]], [-1, -1], [[1, 1]], False),
    ],
)
def test_a_ray_or_a_segment_of_solutions_has_no_derivative_along_it(M, q, J, differs):
    result = lcpcli.solve(M, q)
    for call in (
        lambda: result.derivative(dq=np.zeros(2), J=J),
        lambda: result.derivative(dq=np.zeros(2), J=J, one_sided=True),
        lambda: result.gradient([1.0], J=J),
    ):
        assert (REFUSED in raises(call)) is differs


def semidefinite(seed):
    """A monotone problem with small integers, of which a solution is planted, and a row
    J."""
    random = np.random.default_rng([142, 9, seed])
    n = int(random.integers(1, 5))
    B = random.integers(-2, 3, (n, int(random.integers(1, n + 1))))
    S = random.integers(-2, 3, (n, n))
    M = B @ B.T + (S - S.T) * int(random.integers(0, 2))
    z = random.integers(0, 3, n) * (random.random(n) < 0.6)
    w = np.where(z > 0, 0, random.integers(0, 3, n) * (random.random(n) < 0.5))
    return M, w - M @ z, random.integers(-2, 3, (1, n))


def differs_exactly(problem, row):
    """Whether J z differs between two points of the solution set."""
    J = [Fraction(int(value)) for value in row]

    def image(point):
        return sum(a * b for a, b in zip(J, point, strict=True))

    pieces = list(lcpcli.solutions(problem))
    images = {image(vertex) for piece in pieces for vertex in piece.vertices}
    directions = [ray for piece in pieces for ray in (*piece.rays, *piece.lines)]
    return len(images) > 1 or any(map(image, directions))


@pytest.mark.parametrize(
    "seeds",
    [range(150), pytest.param(range(150, 1200), marks=pytest.mark.slow("a minute"))],
)
def test_every_image_that_differs_is_refused_and_some_others_are_not(seeds):
    values = 0
    for seed in seeds:
        M, q, J = semidefinite(seed)
        result = lcpcli.solve(M, q)
        assert result.solved, seed
        if not J.any():
            continue
        told = raises(result.derivative, dq=np.zeros(len(q)), J=J)
        assert bool(told) == bool(raises(result.gradient, g=[1.0], J=J)), seed
        if differs_exactly(result.problem, J[0]):
            assert told, seed
        values += not told
    assert values > len(seeds) / 2
