"""What auto says of problems of all kinds: of the gallery, of random ones, and of files
in a folder.

python tests/seams/verdicts.py --data FOLDER -o record  # also files in and below FOLDER
"""

from functools import partial
from itertools import cycle

import numpy as np
import populations
from record import GENEROUS_SECONDS, Case, exact, main, of_result

from lcpcli import Problem, read, read_nl, run, solve_mcp

# Random problems, of ten kinds in turn, with other bounds than 0 and infinity or not.
RANDOM = 20_000
COMPILED = 4  # one random problem in so many is solved with compiled kernels
MAX_STEPS = 2000  # for problems in files, some of which are hard
SIZES = (3, 10, 40)
LARGE = {
    "obstacle": 2500,
    "torsion": 900,
    "tridiagonal": 1000,
    "circuit": 800,
    "transport": 400,
    "control": 400,
}
SUFFIXES = {
    ".json",
    ".npz",
    ".mps",
    ".qps",
    ".lp",
    ".nl",
    ".csv",
    ".mat",
    ".efg",
    ".nfg",
}


def cases(seed, data=None):
    """Return the cases of the gallery, of the folder, and the random ones."""
    found = [
        Case(f"gallery {family} {n}", partial(populations.gallery, family, n, seed))
        for family in populations.FAMILIES
        for n in (*SIZES, *([LARGE[family]] if family in LARGE else []))
    ]
    if data:
        files = sorted(
            file for file in data.rglob("*") if file.suffix.lower() in SUFFIXES
        )
        found += [
            Case(f"file {file.relative_to(data)}", partial(_read, file))
            for file in files
        ]
    return found + [
        Case(f"random {kind} {k}", partial(_random, kind, seed, k))
        for k, kind in zip(range(RANDOM), cycle(exact.CLASSES), strict=False)
    ]


def _read(file):
    return read_nl(file) if file.suffix == ".nl" else read(file)


def _random(kind, seed, k):
    random = np.random.default_rng([seed, k])
    if k // len(exact.CLASSES) % 2:
        return populations.mixed(random, int(random.integers(1, 13)), kind)
    return exact.random_problem(int(random.integers(1 << 30)), 12, kind)


def outcome(case, problem):
    """Return the status, z, the route and the proof."""
    kind, *_, number = case.key.split()
    solve = run if isinstance(problem, Problem) else solve_mcp
    own = {"max_iterations": MAX_STEPS}
    if kind == "random":
        own = {"compiled": int(number) % COMPILED == 0}
    return of_result(solve(problem, time_limit=GENEROUS_SECONDS, **own))


if __name__ == "__main__":
    main(cases, outcome)
