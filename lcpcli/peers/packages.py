"""Solvers in Python packages: QuantEcon.py, three solvers of convex quadratic programs,
and Gambit in a separate process.

The program is to minimize z'Mz / 2 + q'z over z >= 0, or over l <= z <= u; a problem
made from a program gives that program, with its rows. If M is symmetric, the optimality
conditions are the problem; if M is also positive semidefinite, they are sufficient: R.
W. Cottle, J.-S. Pang, R. E. Stone, The linear complementarity problem (1992) 1.2.

Gambit finds one equilibrium of a game of two players, by Lemke's method in floating
point: R. Savani, T. L. Turocy, Gambit: the package for computation in game theory,
https://www.gambit-project.org; B. C. Eaves, The linear complementarity problem,
Management Science 17 (1971) 612-634. It has no tolerance, and its time limit kills the
process.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib import import_module, metadata
from typing import Any

import numpy as np

from lcpcli import clock
from lcpcli.clock import imports
from lcpcli.errors import ParameterError, missing
from lcpcli.linalg import krylov
from lcpcli.linalg.matrices import is_sparse, is_symmetric
from lcpcli.linalg.programs import ConvexProgram, convex_minimum, highs_of_program
from lcpcli.model.block_form import Blocks
from lcpcli.model.problem import Problem, conditions_of
from lcpcli.peers.registry import Claim
from lcpcli.typing import Matrix

# Seconds that pygambit takes to load in a separate process, in addition to its time
# limit.
SECONDS_TO_LOAD = 5.0
# Unknowns up to which a matrix is converted; beyond that, the benchmark would misuse
# the peer.
MAX_CONVERTED = 2000


def not_convex(problem: Problem) -> str:
    if problem.block_form is not None:
        return "" if is_monotone(problem) else "needs a convex program"
    return (
        ""
        if (is_symmetric(problem.M) and is_monotone(problem))
        else "needs a symmetric positive semidefinite M"
    )


def is_monotone(problem: Problem) -> bool:
    return krylov.is_semidefinite(
        problem.M if problem.block_form is None else program_of(problem).Q
    )


def program_of(problem: Problem, infinite: float = np.inf) -> Blocks:
    """Return the program, to be minimized, with the infinity of a solver; without rows
    if the problem has no program."""
    conditions, block_form = conditions_of(problem), problem.block_form
    data = None if block_form is None else block_form.blocks(conditions)
    if data is None:
        none = np.zeros(0)
        data = Blocks(
            problem.M,
            problem.q,
            problem.M[:0],
            none,
            none,
            conditions.lower,
            conditions.upper,
        )
    bounds = {
        name: getattr(data, name)
        for name in ("row_lower", "row_upper", "lower", "upper")
    }
    return data._replace(
        **{name: np.clip(bound, -infinite, infinite) for name, bound in bounds.items()}
    )


def _not_stored(kind: str, problem: Problem) -> str:
    fits = problem.n <= MAX_CONVERTED or is_sparse(problem.M) is (kind == "sparse")
    return (
        ""
        if fits
        else f"takes {kind} matrices only; others are converted up to n = "
        f"{MAX_CONVERTED}"
    )


not_dense, not_sparse = partial(_not_stored, "dense"), partial(_not_stored, "sparse")


def dense(M: Matrix) -> Any:
    """Return a copy of M as a dense row-major array, which the peer may overwrite."""
    return M.toarray() if is_sparse(M) else np.array(M, order="C")


def columns(M: Matrix) -> Any:
    """Return M in compressed sparse columns, as a csc_matrix, which all peers
    accept."""
    with imports:
        from scipy.sparse import csc_matrix
    return csc_matrix(M)


PeerOutcome = tuple[Any, Any, bool, str] | tuple[Any, Any, bool, str, float]
"""x and y, whether the program is solved, and the statement of a `Claim`, perhaps its
seconds. x is the minimizer of the program, None if there is none; y are the multipliers
of its rows, the derivatives of the minimum with respect to their bounds; if y is None,
x is z."""


@dataclass
class PackageSolver:
    """Another solver, in a Python package; only those of `registry.NONLINEAR` are asked
    about nonlinear problems.

    module : the module to import, from the distribution with its first name. call : a
    function of the module, the problem, what `prepare` makes of it, by default its
    program, and, if the solver has them, its tolerance and its time limit. refusals :
    functions that say why a problem is excluded, as a clause, or "". compile : is
    called with the module before the clock starts.
    """

    module: str
    call: Callable[[Any, Any, Any, float, float], PeerOutcome]
    refusals: tuple[Callable[[Any], str], ...]
    prepare: Callable[[Any], Any] = program_of
    compile: Callable[[Any], object] = id

    def version(self) -> str | None:
        """Return the installed version; None if there is none."""
        try:
            return metadata.version(self.module.partition(".")[0])
        except metadata.PackageNotFoundError:
            return None

    def excludes(self, problem: Any) -> str:
        return next(filter(None, (refusal(problem) for refusal in self.refusals)), "")

    def solve(self, problem: Any, tol: float, time_limit: float) -> Claim:
        try:
            module = import_module(self.module)
        except ModuleNotFoundError as error:
            if error.name != self.module.partition(".")[0]:
                raise
            raise ParameterError("peer", *missing(str(error.name))) from None
        prepared = self.prepare(problem)
        self.compile(module)
        began = clock.seconds()
        x, y, solved, statement, *own_seconds = self.call(
            module, problem, prepared, tol, time_limit
        )
        seconds = own_seconds[0] if own_seconds else clock.seconds() - began
        z = None if x is None else np.array(x)
        # only a peer that solved the problem as a program returns y
        if z is not None and y is not None and problem.block_form is not None:
            z = problem.block_form.z_of(z, np.array(y), program_of(problem))
        return Claim(z, solved, seconds, statement)


# a first call compiles the method for writable arrays in row-major order, as M and q
# are
@partial(
    PackageSolver,
    "quantecon.optimize",
    refusals=(
        lambda problem: "takes no bounds but z >= 0" if problem.is_mixed else "",
        not_dense,
    ),
    compile=lambda optimize: optimize.lcp_lemke(np.eye(2), -np.ones(2), max_iter=10**6),
)
def quantecon(optimize: Any, problem: Problem, *_: Any) -> PeerOutcome:
    """Run QuantEcon.py's compiled Lemke method with lexicographic ratio test, without a
    tolerance and a time limit."""
    result = optimize.lcp_lemke(dense(problem.M), problem.q.copy(), max_iter=10**6)
    statuses = {0: "solved", 1: "iteration limit", 2: "ray"}
    return (
        result.z,
        None,
        bool(result.success),
        statuses.get(result.status, f"status {result.status}"),
    )


INFINITE_TO_DAQP = 1e30  # DAQP takes bounds of at least this size to be infinite
ENDINGS_OF_DAQP = (
    "soft optimal, optimal, , infeasible, cycling, unbounded, iteration limit, not "
    "convex, "
)
# The exit flags 2, 1, ..., -7.
ENDINGS_OF_DAQP += "initial working set overdetermined, time limit"


@partial(
    PackageSolver,
    "daqp",
    refusals=(
        not_dense,
        lambda problem: "" if is_monotone(problem) else "needs v'Mv >= 0 for all v",
    ),
    prepare=partial(program_of, infinite=INFINITE_TO_DAQP),
)
def daqp(
    daqp: Any, _: Problem, program: Blocks, tol: float, time_limit: float
) -> PeerOutcome:
    """Run DAQP: D. Arnström, A. Bemporad and D. Axehill, A dual active-set solver for
    embedded quadratic programming using recursive LDL' updates, IEEE Trans. Automat.
    Control 67 (2022) 4362-4369.

    A nonsymmetric M is treated as an affine variational inequality, provided that v'Mv
    >= 0 for all v. The tolerance is DAQP's primal tolerance; its dual tolerance remains
    1e-12.
    """
    limit, k = min(time_limit, INFINITE_TO_DAQP), program.c.size
    settings = {
        "is_avi": not is_symmetric(program.Q),
        "primal_tol": tol,
        "time_limit": limit,
    }
    Q = dense(program.Q)
    c = program.c.copy()
    A = dense(program.A)
    lower = np.concatenate((program.lower, program.row_lower))
    upper = np.concatenate((program.upper, program.row_upper))
    sense = np.where(lower == upper, 5, 0).astype(np.int32)  # 5: always active
    x, _, flag, more = daqp.solve(Q, c, A, upper, lower, sense, **settings)
    status = (
        dict(zip(range(2, -8, -1), ENDINGS_OF_DAQP.split(", "), strict=True)).get(flag)
        or f"exit flag {flag}"
    )
    return x, -np.array(more["lam"])[k:], flag == 1, status


@partial(PackageSolver, "highspy", refusals=(not_sparse, not_convex))
def highs(
    highspy: Any, _: Problem, program: Blocks, tol: float, time_limit: float
) -> PeerOutcome:
    """Run HiGHS, the simplex method for linear and an active-set method for convex
    quadratic programs: Q. Huangfu and J. A. J. Hall, Parallelizing the dual revised
    simplex method, Math. Program. Comput. 10 (2018) 119-142; https://highs.dev.

    The tolerance applies to all optimality conditions; HiGHS accepts none below 1e-10.
    Its regularization, which adds 1e-7 to the diagonal of M, is switched off, as no
    smaller tolerance could be met with it. A program without rows gets the bounds of
    x_1 as a row, as HiGHS 1.15.1 may otherwise stop at a point that is not optimal and
    call it optimal, even for a small positive definite Q.
    """
    with imports:
        from scipy.sparse import tril
    k, m = program.c.size, program.row_lower.size
    rows = columns(program.A if m else np.eye(1, k))
    bounds = program.lower, program.upper
    row_bounds = (
        (program.row_lower, program.row_upper)
        if m
        else (program.lower[:1], program.upper[:1])
    )
    options = {
        "time_limit": time_limit,
        "kkt_tolerance": max(tol, 1e-10),
        "qp_regularization_value": 0.0,
    }
    triangle = tril(columns(program.Q)) if (program.Q != 0).sum() else None
    loaded = highs_of_program(program.c, rows, row_bounds, bounds, options, triangle)
    if loaded is None:
        return None, None, False, "refused the model"
    loaded.run()
    status, solution = loaded.getModelStatus(), loaded.getSolution()
    x = solution.col_value if solution.value_valid else None
    return (
        x,
        solution.row_dual[:m],
        status == highspy.HighsModelStatus.kOptimal,
        loaded.modelStatusToString(status),
    )


@partial(PackageSolver, "piqp", refusals=(not_convex,))
def piqp(
    _: Any, problem: Problem, program: Blocks, tol: float, __: float
) -> PeerOutcome:
    """Run PIQP as `minimized` does, which has no time limit, but stops after 250
    iterations."""
    stored = columns if is_sparse(problem.M) else dense
    y = np.zeros(program.row_lower.size)
    low = program.row_lower
    high = program.row_upper
    equal = program.row_lower == program.row_upper
    equations = (stored(program.A[equal]), low[equal])
    rows = (stored(program.A[~equal]), low[~equal], high[~equal])
    bounds = program.lower, program.upper
    convex_program = ConvexProgram(
        stored(program.Q), program.c.copy(), equations, rows, bounds
    )
    ended = convex_minimum(convex_program, tol)
    y[equal], y[~equal] = ended.of_equations, ended.of_rows
    return ended.x, y, ended.status == "PIQP_SOLVED", ended.status


SOLVE = """
import json, os, sys, time
import numpy as np
import pygambit
output = os.dup(1)
os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
began = time.perf_counter()
game = pygambit.Game.from_arrays(*map(np.array, json.load(sys.stdin)))
equilibria = pygambit.nash.lcp_solve(game, rational=False, stop_after=1).equilibria
x, y = [], []
if equilibria:
    x, y = ([float(equilibria[0][s]) for s in p.strategies] for p in game.players)
os.write(output, json.dumps([x, y, time.perf_counter() - began]).encode())
"""


@partial(
    PackageSolver,
    "pygambit",
    refusals=(
        lambda problem: (
            "" if _strategies(problem) else "takes games of two players only"
        ),
    ),
)
def gambit(
    _: Any, problem: Problem, __: Blocks, ___: float, time_limit: float
) -> PeerOutcome:
    m, M = _strategies(problem), dense(problem.M)
    R, C = M[:m, m:], M[m:, :m].T
    limit = None if time_limit == np.inf else time_limit + SECONDS_TO_LOAD
    call = [sys.executable, "-c", SOLVE]
    game = json.dumps([(-R).tolist(), (-C).tolist()])
    try:
        done = subprocess.run(
            call, input=game, capture_output=True, text=True, timeout=limit
        )
    except subprocess.TimeoutExpired:
        return None, None, False, "stopped at the time limit", time_limit
    if done.returncode:
        return None, None, False, f"failed with exit code {done.returncode}", 0.0
    x, y, seconds = json.loads(done.stdout)
    if not x:
        return None, None, False, "no equilibrium", seconds
    return (
        np.concatenate((x / (C.T @ x).min(), y / (R @ y).min())),
        None,
        True,
        "an equilibrium",
        seconds,
    )


def _strategies(problem: Problem) -> int:
    """Return the number of rows of R if M = [0 R; C' 0] with R, C > 0, and q = -e, z >=
    0; 0 for other problems."""
    if problem.is_mixed or (problem.q != -1).any():
        return 0
    M = dense(problem.M)
    m, game = int(np.argmax(M[0] > 0)), np.zeros(M.shape, dtype=bool)
    game[:m, m:] = game[m:, :m] = True
    return m if np.array_equal(M > 0, game) and not M[~game].any() else 0
