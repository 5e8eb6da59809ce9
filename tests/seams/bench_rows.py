"""What `bench.py` measures: functions that prepare calls, by the names of their rows;
public functions only."""

import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.random import default_rng
from populations import make

import lcpcli

Call = Callable[[], Any]
FOLDER = []  # where the problems are kept that the gallery has made
PROGRAMS = [
    (name, n)
    for name in ("lp", "qp", "portfolio", "lasso", "control", "transport")
    for n in (20, 60, 200)
]
PROGRAMS += [("frontier", n) for n in (20, 60)]


def made(family, n, *parameters):
    """Read a problem of the gallery, which the first process that needs it has
    written."""
    path = FOLDER[0] / f"{'-'.join((family, str(n), *parameters))}.npz"
    if not path.exists():
        settings = [part for parameter in parameters for part in ("--set", parameter)]
        make(path, family, n, *settings)
    return lcpcli.read(path)


def calls(call, make, *given, **options):
    """Prepare calls of a function with what another one has made of some arguments."""

    def prepare():
        made_before = make(*given)
        return lambda: call(made_before, **options)

    return prepare


def of_family(family, n, *parameters, **options):
    return calls(lcpcli.run, made, family, n, *parameters, **options)


def of_arrays(given, **options):
    return lcpcli.solve(*given, **options)


def of_many(given, **options):
    return list(lcpcli.solve_many(*given, **options))


def columns(number):
    return random_lcp(10)[0], default_rng(1).normal(size=(10, number))


def batch():
    return [
        np.array(part)
        for part in zip(*(random_lcp(10, seed) for seed in range(200)), strict=True)
    ]


def sequence(family, n, *parameters):
    problem = made(family, n, *parameters)
    return problem.M, problem.q[:, None] * (
        1 + 0.01 * default_rng(2).normal(size=(problem.n, 20))
    )


def in_turn(given):
    M, steps = given
    own = lcpcli.Solver(M)
    for q in steps.T:
        own.solve(q)


def game(n):
    return default_rng(n).integers(-50, 51, (2, n, n)).astype(float)


def plain(family, n):
    problem = made(family, n)
    return lcpcli.Problem(problem.M, problem.q)


def command(*words):
    whole = [sys.executable, "-m", "lcpcli", *words]
    return lambda: lambda: subprocess.run(whole, check=True, stdout=subprocess.DEVNULL)


def rows(folder, data):
    """Functions that prepare what is measured, by name."""
    FOLDER[:] = [folder]
    table = {}
    for n in (4, 10, 50, 300):
        table[f"lcp {n}"] = calls(of_arrays, random_lcp, n)
        table[f"lcp {n} compiled"] = calls(of_arrays, random_lcp, n, compiled=True)
        table[f"lcp {n} loop"] = calls(of_arrays, random_lcp, n, trace=True)
    table["boxes 10"], table["boxes 10 compiled"] = (
        of_family("boxes", 10),
        of_family("boxes", 10, compiled=True),
    )
    for n in (20, 100):
        table[f"contact {n} at rest"] = of_family("rigid-boxes", n, "kind=tower")
        table[f"contact {n} at rest compiled"] = of_family(
            "rigid-boxes", n, "kind=tower", compiled=True
        )
        table[f"contact {n} moving"] = of_family("contact", n)
        table[f"contact {n} moving compiled"] = of_family("contact", n, compiled=True)
    for name, n in PROGRAMS:
        table[f"program {name} {n}"] = of_family(name, n)
    for name in ("lp", "qp", "portfolio", "control", "lasso", "transport"):
        table[f"program {name} 200 compiled"] = of_family(name, 200, compiled=True)
    for path in data:
        table[f"program {path.stem}"] = calls(
            lcpcli.run, lcpcli.read, path, compiled=True
        )
    table["obstacle 100 x 100"] = of_family("obstacle", 10_000)
    for method in ("shi", "fixed-point"):
        for n in (4, 100, 1000):
            table[f"{method} {n}"] = of_family("tridiagonal", n, method=method)
            table[f"{method} {n} trace"] = of_family(
                "tridiagonal", n, method=method, trace=True
            )
    table["solve_many 200 columns"] = calls(of_many, columns, 200, compiled=False)
    table["solve_many 2000 columns"] = calls(of_many, columns, 2000)
    table["solve_many batch of 200"] = calls(
        lambda given: lcpcli.solve_many(*given).z, batch
    )
    table["Solver 50"] = calls(in_turn, sequence, "harker-pang", 50)
    table["Solver contact"] = calls(in_turn, sequence, "rigid-boxes", 30, "kind=tower")
    table["Solver obstacle"] = calls(in_turn, sequence, "obstacle", 400)
    table["start-up"] = command("solve", "paper-example-1", "--format", "json")
    table["start-up of help"] = command("solve", "--help")
    for n in (5, 20):
        table[f"games {n} x {n}"] = calls(
            lambda given: lcpcli.run(lcpcli.from_game(*given)), game, n
        )
    table["games 6 x 6 all equilibria"] = calls(
        lambda given: list(lcpcli.solutions(lcpcli.from_game(*given))), game, 6
    )
    table["games poker"] = of_family("poker", 30)
    for n in (12, 16, 20):
        table[f"exact {n}"] = calls(lcpcli.exact, plain, "harker-pang", n)
    table["on request: obstacle 1000 x 1000"] = of_family("obstacle", 1_000_000)
    return table


def random_lcp(n, seed=0):
    """M positive definite, not symmetric, and q."""
    random = default_rng(seed)
    A, B = random.normal(size=(2, n, n))
    return A @ A.T + B - B.T + np.eye(n), 3 * random.normal(size=n)
