"""One call of `lcpcli.solve` from arrays to the verified answer, for dense M:
dense_calls.py [numpy] [n ...]

Medians of repeated calls on positive definite problems, nonsymmetric and symmetric;
where the time goes; and the distance from the work that cannot be avoided: one
factorization of the final block M_PP, one copy of it, one product with M. All are
measured in turns, by the wall, so that what disturbs one disturbs the others. The
problems are those of the gallery (Harker and Pang 1990), and planted ones: if not
symmetric, A'A + B - B' + I / 10 with normal A and B, a tenth to nine tenths of the z_i
at 0; if symmetric, eigenvalues from 1 to 10^4, half of the z_i at 0. With `numpy` the
extra `fast` is not used.
"""

import sys
from functools import partial
from itertools import product
from statistics import median

import numpy as np
from measuring import in_turns, show
from scipy.linalg import lapack

import lcpcli
from lcpcli.gallery import families

SIZES = (5, 10, 50, 300, 1000, 2000)
BUDGET, LEAST, MOST = 2.0, 5, 2000  # seconds and repetitions for the medians of a row
SEEDS, ACTIVE = 3, (0.1, 0.5, 0.9)
WIDTHS = (5, 11, 10, 5, 10, 7, 11, 13, 10, 9)
HEADER = (
    "n",
    "problem",
    "symmetric",
    "seed",
    "call",
    "set-up",
    "iterations",
    "verification",
    "limit",
    "distance",
)


def planted(n, seed, symmetric):
    random = np.random.default_rng([seed, n])
    A, B = random.standard_normal((2, n, n)) / np.sqrt(n)
    if symmetric:
        Q = np.linalg.qr(A)[0]
        M, active = (Q * np.geomspace(1, 1e4, n)) @ Q.T, 0.5
        M = (M + M.T) / 2
    else:
        M = A.T @ A + (B - B.T) / 2 + 0.1 * np.eye(n)
        active = ACTIVE[seed % len(ACTIVE)]
    sizes, zero = random.uniform(0, 1, n), random.random(n) < active
    w = np.where(zero, sizes * (100 if symmetric else 1), 0)
    return lcpcli.Problem(M, w - M @ np.where(zero, 0, sizes))


def row(n, name, symmetric, seed, compiled):
    gallery = partial(families.make, "harker-pang", n, seed, symmetric=symmetric)
    problem = planted(n, seed, symmetric) if name == "planted" else gallery()
    results = []
    M, P, v = problem.M, np.flatnonzero(lcpcli.run(problem).z), np.ones(n)
    P = P if P.size else np.zeros(1, dtype=np.intp)  # z = 0
    block = M[np.ix_(P, P)]
    factorize = (
        partial(lapack.dpotrf, lower=True, clean=False) if symmetric else lapack.dgetrf
    )
    least = (lambda: factorize(block.T), lambda: M[P][:, P], lambda: M @ v)
    ours = partial(lcpcli.solve, M, problem.q, compiled=compiled)
    times = in_turns(
        lambda: results.append(ours()), *least, most=MOST, least=LEAST, budget=BUDGET
    )
    seconds, *parts = map(median, times)
    assert all(result.solved for result in results)
    totals = [
        sum(result.parts[part] for result in results)
        for part in ("setup", "solve", "verify")
    ]
    shares = [f"{100 * total / sum(totals):.0f} %" for total in totals]
    call, limit = (f"{1e6 * t:.0f} us" for t in (seconds, sum(parts)))
    own = [str(n), name, "yes" if symmetric else "no", str(seed)]
    return [*own, call, *shares, limit, f"{seconds / sum(parts):.1f}"]


if __name__ == "__main__":
    compiled = "numpy" not in sys.argv
    sizes = [int(word) for word in sys.argv[1:] if word != "numpy"] or SIZES
    show(HEADER, WIDTHS)
    for one in product(sizes, ("harker-pang", "planted"), (False, True), range(SEEDS)):
        show(row(*one, compiled), WIDTHS)
