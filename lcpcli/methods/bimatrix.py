"""Equilibria of bimatrix games: pure ones by comparing the costs, those of games of
constant sum by a linear program, others by the method of Lemke and Howson.

Optimal strategies of a game of constant sum are the minimizer and the multipliers of a
linear program: G. B. Dantzig, A proof of the equivalence of the programming problem and
the game problem, in T. C. Koopmans (ed.), Activity Analysis of Production and
Allocation (1951) 330-335.

C. E. Lemke and J. T. Howson, Equilibrium points of bimatrix games, J. SIAM 12 (1964)
413-423, on two dictionaries, one for the strategies of each player, as in L. S.
Shapley, A note on the Lemke-Howson algorithm, Mathematical Programming Study 1 (1974)
175-189.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np

from lcpcli.basis.exchanges import BasicSolutions
from lcpcli.clock import imports
from lcpcli.interrupts import raise_if_timed_out
from lcpcli.linalg.doubles import ROUNDING, SIGN_ROUNDING, generator, is_finite
from lcpcli.linalg.factors import SingularMatrix
from lcpcli.linalg.matrices import is_sparse
from lcpcli.linalg.programs import ConvexProgram, convex_minimum, minimized
from lcpcli.methods.stages import Breakdown, Finished, Iterate, Stage, Stalled
from lcpcli.model.box import of_masks
from lcpcli.model.problem import Problem
from lcpcli.typing import Indices, Vector

# Number of labels whose paths are followed in the first round: lengths of paths differ
# by orders of magnitude, and one short path is enough. After each round half of them
# continue, with twice as many pivots, as all paths of a game that is almost one of zero
# sum are long.
LABELS, MIN_LABELS = 32, 4
# Pivots of a path in the first round, and the number of rounds.
PIVOTS, ROUNDS = 16, 12
TIE = 1e-11  # relative to the smallest ratio: rows that block within it may be equal
# Relative to the largest entry of a column: entries that may be rounding of 0.
NO_PIVOT = 1e-11
# Limits of PIQP: on its residuals and on the duality gap, which large games do not
# reach, although their supports are right by then; on its steps; and on the
# multiplications of a step, during which it cannot be interrupted.
TOLERANCE = 1e-13
MAX_GAP = 1e-11
MAX_PROGRAM_STEPS = 40
MAX_DENSE_OPERATIONS = 2e9

SolveProgram: TypeAlias = Callable[[Vector], tuple[Vector, Vector] | None]


class Costs(NamedTuple):
    """The costs of both players, of shape (m, k), all positive: M = [0 R; C' 0], and q
    < 0 is scaled to -1."""

    R: Vector
    C: Vector


def costs(problem: Problem) -> Costs | None:
    """Return the costs of the game whose equilibria solve a dense LCP; None if it has
    no such form."""
    M, q = problem.M, problem.q
    if (
        is_sparse(M)
        or not problem.box.is_orthant
        or problem.n < 2
        or M[0, 0]
        or not M[0, -1] > 0.0
        or q.max() >= 0.0
    ):
        return None
    m = int((M[0] > 0.0).argmax())
    R, C = M[:m, m:], M[m:, :m].T
    if M[:m, :m].any() or M[m:, m:].any() or not (R.min() > 0.0 and C.min() > 0.0):
        return None
    return Costs(R / -q[:m, None], C / -q[m:])


def is_constant_sum(game: Costs) -> bool:
    """Return whether what one player pays, the other receives, up to rounding, a factor
    that converts the payoffs, and constants."""
    R, C = game
    factor = np.ptp(C) / (np.ptp(R) or 1.0)
    rounding = ROUNDING * float(C.max() + factor * R.max())
    return float(np.ptp(C + factor * R)) <= rounding


def takes_briefly(game: Costs) -> bool:
    """Return whether PIQP, which cannot be interrupted, takes at most two seconds."""
    rows, columns = game.R.shape
    return bool(rows * columns * min(rows, columns) <= MAX_DENSE_OPERATIONS)


def by_piqp(problem: Problem, game: Costs) -> Stage:
    """Yield the equilibrium of `_of_program` by PIQP."""
    return _of_program(problem, game, _interior)


def by_simplex(problem: Problem, game: Costs) -> Stage:
    """Yield the equilibrium of `_of_program` by the simplex method of HiGHS, at a
    vertex."""
    return _of_program(problem, game, _vertex)


def _of_program(problem: Problem, game: Costs, solve: SolveProgram) -> Stage:
    """Yield an equilibrium of a game of constant sum: y / e'y and x / e'x, where y has
    the smallest sum of those with R y >= 1, y >= 0, and x are the multipliers of its
    rows.

    Finished : it is an equilibrium up to rounding. Stalled : the support is not that of
    one. Breakdown : the program is not solved.
    """
    strategies = solve(game.R)
    if strategies is None or not (strategies[0].any() and strategies[1].any()):
        return Breakdown("the linear program is not solved")
    y, x = (np.maximum(each, 0.0) for each in strategies)
    z = np.concatenate((x / (x @ game.C).min(), y / (game.R @ y).min()))
    # Components of z that should be 0 are small relative to w, in the scaling of the
    # strategies.
    units = z.max() / np.abs(problem.q)
    z = _of_support(problem, np.where(z > units * problem.w(z), z, 0.0))
    w = problem.w(z)
    gaps = np.minimum(z, units * w) / z.max()
    is_equilibrium = bool((np.abs(gaps) <= SIGN_ROUNDING).all())
    x = problem.box.x_of(z, w)
    yield Iterate(x, None, "", 1, signs_final=is_equilibrium)
    return Finished() if is_equilibrium else Stalled("other strategies cost less")


def _interior(R: Vector) -> tuple[Vector, Vector] | None:
    """Return y and x of `_of_program`, by PIQP."""
    rows, columns = R.shape
    # PIQP factorizes a matrix whose order is the number of variables: they are x, whose
    # sum is largest with R'x <= 1, x >= 0, in the dual of a program with more columns.
    of_x = rows < columns
    A, sign = (R.T, -1.0) if of_x else (R, 1.0)
    ones, none = np.ones(A.shape[0]), np.full(A.shape[0], np.inf)
    n = A.shape[1]
    program = ConvexProgram(
        Q=np.zeros((n, n)),
        c=np.full(n, sign),
        equations=(np.zeros((0, n)), np.zeros(0)),
        rows=(A, -none, ones) if of_x else (A, ones, none),
        bounds=(np.zeros(n), np.full(n, np.inf)),
    )
    ended = convex_minimum(program, TOLERANCE, MAX_PROGRAM_STEPS, MAX_GAP)
    if not (is_finite(ended.x) and is_finite(ended.of_rows)):
        return None
    return (-ended.of_rows, ended.x) if of_x else (ended.x, ended.of_rows)


def _vertex(R: Vector) -> tuple[Vector, Vector] | None:
    """Return y and x of `_of_program`, both vertices, by the simplex method."""
    lower_upper, bounds = (
        (np.full(size, lower_bound), np.full(size, np.inf))
        for size, lower_bound in zip(R.shape, (1.0, 0.0), strict=True)
    )
    minimum = minimized(np.ones(R.shape[1]), R, lower_upper, bounds)
    return None if minimum is None else (minimum.x, minimum.y)


def _of_support(problem: Problem, z: Vector) -> Vector:
    """Return the basic solution with the support of z; z itself if others have this
    support, as where all its strategies cost the same."""
    try:
        return np.maximum(BasicSolutions(problem).at(of_masks(z > 0.0)).z, 0.0)
    except SingularMatrix:
        return z


def pure(problem: Problem, game: Costs | None) -> Vector | None:
    """Return the z of the first equilibrium in pure strategies, shape (n,); None if
    there is none, or no game."""
    if game is None:
        return None
    R, C = game
    both = (R.min(axis=0) == R) & (C.min(axis=1, keepdims=True) == C)
    position = int(both.argmax())
    i, j = divmod(position, R.shape[1])
    if not both[i, j]:
        return None
    z, m = np.zeros(problem.n), R.shape[0]
    z[i], z[m + j] = (
        -problem.q[m + j] / problem.M[m + j, i],
        -problem.q[i] / problem.M[i, m + j],
    )
    return z


def pure_equilibrium(problem: Problem, game: Costs | None) -> Stage:
    """Yield the first equilibrium in pure strategies, if there is one."""
    z = pure(problem, game)
    if z is None:
        return Stalled("there is no equilibrium in pure strategies")
    yield Iterate(problem.box.x_of(z, problem.w(z)), None, "", 1)
    return Finished()


def lemke_howson(problem: Problem, game: Costs) -> Stage:
    """Follow the paths of a game from several labels in rounds; yield the point of each
    path after its pivots of a round.

    Finished : the last iterate is an equilibrium, up to rounding. Stalled : no path has
        ended at one.
    """
    paths, evaluations = dict[int, _LemkeHowsonPath](), 0
    labels = generator(0).permutation(problem.n)[:LABELS].tolist()
    for number in range(ROUNDS):
        for label in labels[: max(LABELS >> number, MIN_LABELS)]:
            path = paths[label] = paths.get(label) or _LemkeHowsonPath(game, label)
            if path.is_over:
                continue
            before = path.pivots
            path.follow(PIVOTS * 2**number)
            evaluations += path.pivots - before
            z = path.point()
            if path.is_complete:
                z = _of_support(problem, z)
            x = problem.box.x_of(z, problem.w(z))
            yield Iterate(x, None, "label", evaluations, signs_final=path.is_complete)
            if path.is_complete:
                return Finished()
    return Stalled("no path of Lemke and Howson leads to an equilibrium")


class _LemkeHowsonPath:
    """The path of one label. is_over : whether it has terminated; is_complete : at an
    equilibrium."""

    def __init__(self, costs_of_players: Costs, label: int) -> None:
        m, k = costs_of_players.R.shape
        self.label = self.entering = label
        self.pivots = 0
        self.is_over = False
        self.is_complete = False
        # Row i gives its label to x_i and to the slack of its payoff, column j gives m
        # + j to y_j and to its slack.
        rows, columns = np.arange(m), m + np.arange(k)
        weights = generator(label).uniform(0.5, 1.0, m + k)
        self.of_y = _Dictionary(
            _payoffs(costs_of_players.R), rows, columns, weights[:m]
        )
        self.of_x = _Dictionary(
            _payoffs(costs_of_players.C).T, columns, rows, weights[m:]
        )
        self.is_x = label < m  # whether a strategy of the row player enters next

    def follow(self, max_pivots: int) -> None:
        for _ in range(max_pivots):
            leaving = (self.of_x if self.is_x else self.of_y).pivot(self.entering)
            self.pivots += 1
            if leaving is None or leaving == self.label:
                self.is_over, self.is_complete = True, leaving is not None
                break
            self.entering, self.is_x = leaving, not self.is_x
        raise_if_timed_out()

    def point(self) -> Vector:
        """Return the strategies, not scaled, at this point of the path; basic ones that
        are 0 have small values."""
        return np.concatenate((self.of_x.values(), self.of_y.values()))


def _payoffs(costs_of_player: Vector) -> Vector:
    """Return positive payoffs, between 1 and 2, that have the same best replies as the
    costs."""
    largest, smallest = costs_of_player.max(), costs_of_player.min()
    return np.array(1.0 + (largest - costs_of_player) / ((largest - smallest) or 1.0))


class _Dictionary:
    """The basic variables, as functions of the others, of A v + s = 1 with v, s >= 0;
    ties between blocking rows are broken by a second right-hand side, a symbolic
    perturbation of the first.

    Each variable has another label; the labels of v are a range.
    """

    def __init__(
        self, A: Vector, slacks: Indices, variables: Indices, weights: Vector
    ) -> None:
        with imports:
            from scipy.linalg.blas import dger
        rows, columns = A.shape
        self._subtract = dger
        self.T = np.empty((rows, columns + 2))
        self.T[:, :columns] = A
        self.T[:, columns] = 1.0
        self.T[:, columns + 1] = weights
        self.basic, self.others = slacks.copy(), variables.copy()
        self._first = variables[0]

    def pivot(self, label: int) -> int | None:
        """Let a variable that is not basic enter; return the label of the one that
        leaves, None if there is none."""
        T, width = self.T, self.others.size
        c = int((self.others == label).argmax())
        column = T[:, c].copy()
        rows = np.flatnonzero(column > NO_PIVOT * np.abs(column).max())
        if not rows.size:
            return None
        ratios = T[rows, width] / column[rows]
        blocking_rows = rows[ratios <= ratios.min() + TIE]
        r = int(
            blocking_rows[
                (T[blocking_rows, width + 1] / column[blocking_rows]).argmin()
            ]
        )
        pivot, column[r] = column[r], 0.0
        row = T[r] / pivot
        # T.T is stored in columns, as the routine needs it to overwrite T
        self._subtract(-1.0, row, column, a=T.T, overwrite_a=True)
        T[:, c] = column / -pivot
        T[r] = row
        T[r, c] = 1.0 / pivot
        np.maximum(T[:, width], 0.0, out=T[:, width])
        leaving = int(self.basic[r])
        self.basic[r], self.others[c] = label, leaving
        return leaving

    def values(self) -> Vector:
        """Return v, with a small positive value for basic variables that are 0."""
        v, width = np.zeros(self.T.shape[1] - 2), self.others.size
        positions = self.basic - self._first
        is_variable = (positions >= 0) & (positions < width)
        v[positions[is_variable]] = np.maximum(self.T[is_variable, width], TIE)
        return v
