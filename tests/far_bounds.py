"""Random programs with minima, and the same with far bounds in place of infinite
ones."""

import numpy as np

# A program with bounds of 1e20 and more, six of them none by the convention of MPS
# files.
FAR = {
    "Q": [[2, 0], [0, 2]],
    "c": [-3, 1],
    "A": [[1, 1], [1, -1], [0, 1], [1, 2]],
    "row_lower": [1, -1e20, -1e30, -1e25],
    "row_upper": [1e20, 1e30, 4, None],
    "upper": [1e20, None],
}
ENDS = ("row_lower", "row_upper", "lower", "upper")


def random_program(seed, variables):
    """A program with rows and bounds of all kinds and a minimum: linear for even seeds,
    else quadratic and convex."""
    random = np.random.default_rng(seed)
    rows = variables // 2
    A = np.where(
        random.random((rows, variables)) < 0.4,
        random.integers(-3, 4, (rows, variables)),
        0,
    ).astype(float)
    inside = random.integers(0, 3, variables).astype(float)
    # From below, from above, a range, an equation.
    at, kinds = A @ inside, random.integers(0, 4, rows)
    below, above = (
        np.where(kinds == 3, 0, random.integers(0, 3, rows)) for _ in range(2)
    )
    # The multipliers of a minimum.
    y = random.integers(0, 3, rows) * np.select([kinds == 1, kinds == 2], [-1, 0], 1)
    lower = np.where(random.random(variables) < 0.15, -np.inf, 0.0)
    slope = np.where(np.isinf(lower), 0, random.integers(0, 3, variables))
    F = random.integers(-2, 3, (variables, random.integers(1, variables + 1))) / 2
    Q = F @ F.T if seed % 2 else None
    return {
        "Q": Q,
        "c": A.T @ y + slope - (0.0 if Q is None else Q @ inside / 2),
        "A": A,
        "row_lower": np.where(kinds == 1, -np.inf, at - below),
        "row_upper": np.where(kinds == 0, np.inf, at + above),
        "lower": lower,
        "upper": np.where(
            random.random(variables) < 0.3,
            inside + random.integers(0, 4, variables),
            np.inf,
        ),
    }


def with_far_bounds(program, size):
    """The program with bounds of that size in place of infinite ones."""
    ends = {name: np.clip(program[name], -size, size) for name in ENDS}
    return program | ends


def lists(program):
    """For JSON: null in place of infinite numbers, and nothing in place of None."""
    plain = {
        name: np.asarray(part).tolist()
        for name, part in program.items()
        if part is not None
    }
    return plain | {
        name: [x if np.isfinite(x) else None for x in plain[name]]
        for name in ENDS
        if name in plain
    }
