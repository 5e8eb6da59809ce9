"""Diagnosis of a problem: the classes of M with evidence, its difficulty, which methods
are guaranteed, and the plan of `auto`, its attempts until one solves the problem or
proves that there is no solution.

For a nonlinear problem, its rows and operators, F and its Jacobian J at the start, and
the structural rank of J. The pattern of J is that of J at the start and at SAMPLES
random points nearby, with fixed seeds: an entry that is 0 at all of them is considered
0 everywhere, and a row that is the same at all of them is considered linear.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain, islice
from typing import NamedTuple, overload

import numpy as np

from lcpcli import clock
from lcpcli.auto.attempts import Structure, phases
from lcpcli.clock import imports
from lcpcli.errors import count
from lcpcli.inspection import theory
from lcpcli.inspection.verdict import NO, YES, Verdict, classify, weak_row
from lcpcli.interrupts import TimeIsUp, deadline_after, raise_if_timed_out
from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import generator, size
from lcpcli.linalg.patterns import affordable
from lcpcli.linalg.units import equilibrate
from lcpcli.methods.definite import MADE_FOR_IT, MAX_TOLD, in_words, stiffness
from lcpcli.model import views
from lcpcli.model.changes import relaxed, shifted
from lcpcli.model.evaluations import Evaluations
from lcpcli.model.nonlinear import NonlinearProblem
from lcpcli.model.problem import Problem, as_problem
from lcpcli.model.usual_units import in_usual_units, remark
from lcpcli.options import INSPECTION_SECONDS
from lcpcli.presolve.presolve import Presolved, presolved
from lcpcli.typing import Matrix, Vector
from lcpcli.verify.digits import DOUBLE_DIGITS
from lcpcli.verify.error_theorems import semidefinite_by_rounding


class Attempt(NamedTuple):
    """An attempt of `auto`.

    method, part : the method, as in the route of a result, and the part of it that is
        used; "" for the whole method.
    iterations : the number of iterations in the first round. After these, the later
        attempts run before this one continues with twice as many; None if it is never
        suspended. reason : why the attempt is made.
    """

    method: str
    part: str
    iterations: int | None
    reason: str


@np.errstate(all="ignore")
def plan(problem: Problem) -> list[Attempt]:
    """Return the attempts of `auto` on a problem, in the order in which they begin;
    most problems need only the first.

    The plan depends only on facts that cost at most one factorization of M: the same
    problem has the same plan everywhere.

    >>> import lcpcli
    >>> problem = lcpcli.Problem([[2, 1], [1, 2]], [-5, -6])
    >>> [attempt.method for attempt in lcpcli.plan(problem)][:3]
    ['newton', 'newton', 'lemke']
    """
    # The changes with which auto starts.
    given = relaxed(in_usual_units(as_problem(problem)).problem).problem
    problem = shifted(given).problem
    structure = Structure(problem, problem.q, None, given)
    in_order = chain.from_iterable(
        sorted(phase, key=lambda row: row.first_round) for phase in phases(structure)
    )
    # An attempt that occurs in several phases begins in the first of them.
    rows = dict.fromkeys(row for row in in_order if row.applies(structure))
    shares = [(row, row.first_round_iterations(structure)) for row in rows]
    return [
        Attempt(row.method, row.part, None if n == math.inf else int(n), row.reason)
        for row, n in shares
    ]


# A difference of M and M' below this, relative to the largest entry, is attributed to
# rounding.
ASYMMETRY = 1e-12


@dataclass(eq=False)
class Inspection:
    """The diagnosis of one problem. Quantities that are too expensive to compute are
    None.

    condition, equilibrated_condition : the condition numbers in the 1-norm of M and of
        R M C; infinite if singular, estimated for large n.
    spread, equilibrated_spread : the spreads of M and of R M C. spectrum : the extreme
        eigenvalues of a symmetric M.
    p, smoothing_error : as returned by `theory.smoothing`. published, best : the rates
        of `fixed-point` with omega = 1 and with `omega=auto`.
    presolve : the result of presolve for a mixed problem; None if presolve changes
        nothing or time ran out.
    plan : the attempts of `auto`, in order; None if time ran out.
    obvious : the answer, if it is obvious from M and q; otherwise "".
    stiffness : the condition number of a stiff M + M' scaled to diagonal 1, estimated;
        infinite if rounding of the entries of M makes it indefinite; None if M is not
        stiff.
    """

    problem: Problem
    nonzeros: int
    classes: dict[str, Verdict]
    spread: theory.Spread
    equilibrated_spread: theory.Spread
    cost: theory.Cost
    p: float
    smoothing_error: float
    guarantees: dict[str, theory.Guarantee]
    obvious: str
    hints: list[str]
    condition: float | None = None
    equilibrated_condition: float | None = None
    spectrum: theory.Spectrum | None = None
    published: theory.Rate | None = None
    best: theory.Rate | None = None
    presolve: Presolved | None = None
    plan: list[Attempt] | None = None
    stiffness: float | None = None

    def __repr__(self) -> str:
        return str(views.inspection_text.inspection_report(self).render()).rstrip()


@overload
def inspect(problem: Problem, time_limit: float = INSPECTION_SECONDS) -> Inspection: ...


@overload
def inspect(
    problem: NonlinearProblem, time_limit: float = INSPECTION_SECONDS
) -> NonlinearInspection: ...


@np.errstate(all="ignore")
def inspect(
    problem: Problem | NonlinearProblem, time_limit: float = INSPECTION_SECONDS
) -> Inspection | NonlinearInspection:
    """Diagnose a problem, as `lcp inspect` does: the classes of M, its scaling, and
    which methods are guaranteed.

    Parameters
    ----------
    problem : a Problem, whose sparse M is made dense only if it is small, or a
        NonlinearProblem.
    time_limit : seconds after which expensive computations stop; the questions that
        they would have decided remain undecided.

    Returns an Inspection, or a NonlinearInspection, which the interpreter shows as the
    command prints it. The verdict on a class is "yes" or "no" only where rounding
    errors cannot affect it.

    >>> import lcpcli
    >>> diagnosis = lcpcli.inspect(lcpcli.Problem([[2, 1], [1, 2]], [-5, -6]))
    >>> diagnosis.classes["p_matrix"].word, diagnosis.guarantees["lemke"].word
    ('yes', 'yes')
    """
    if isinstance(problem, NonlinearProblem):
        return inspect_nonlinear(problem, time_limit)
    as_problem(problem)
    M, deadline = problem.M, clock.seconds() + time_limit
    with deadline_after(time_limit):
        classes = classify(M)
    definite = classes["symmetric"].word == classes["positive_definite"].word == YES
    p, smoothing_error = theory.smoothing(problem)
    scaled = matrices.scaled(M, *equilibrate(M, problem.q))
    diagnosis = Inspection(
        problem=problem,
        nonzeros=int(np.count_nonzero(M.data if matrices.is_sparse(M) else M)),
        classes=classes,
        spread=theory.spread(M),
        equilibrated_spread=theory.spread(scaled),
        cost=theory.cost(M, definite),
        p=p,
        smoothing_error=smoothing_error,
        guarantees=theory.guarantees(classes, problem),
        obvious=_obvious(problem, classes),
        hints=list(filter(None, [remark(problem)])),
    )
    with suppress(TimeIsUp), deadline_after(deadline - clock.seconds()):
        raise_if_timed_out()
        if problem.n and affordable(M):
            diagnosis.condition = theory.condition(M)
            raise_if_timed_out()
            diagnosis.equilibrated_condition = theory.condition(scaled)
            raise_if_timed_out()
            diagnosis.stiffness = stiffness(M)
        raise_if_timed_out()
        if problem.n and classes["symmetric"].word == YES:
            diagnosis.spectrum = theory.eigenvalues(M, definite)
        raise_if_timed_out()
        if problem.n:
            diagnosis.published, diagnosis.best = theory.rates(
                M, diagnosis.spectrum if definite else None
            )
    with suppress(TimeIsUp), deadline_after(deadline - clock.seconds()):
        raise_if_timed_out()
        diagnosis.presolve = presolved(problem) if problem.is_mixed else None
        raise_if_timed_out()
        diagnosis.plan = plan(problem)
    with suppress(TimeIsUp), deadline_after(deadline - clock.seconds()):
        diagnosis.hints.extend(_hints(diagnosis))
    return diagnosis


def _obvious(problem: Problem, classes: dict[str, Verdict]) -> str:
    """Return what M, its classes and q obviously imply about the solutions; "" if
    nothing.

    M is a P-matrix if and only if there is exactly one solution for every q: H.
    Samelson, R. M. Thrall, O. Wesler, A partition theorem for Euclidean n-space, Proc.
    Amer. Math. Soc. 9 (1958) 805-807.
    """
    box = problem.box
    kinds = problem.box.kinds
    unique = classes["p_matrix"].word == YES
    if not box.gaps(box.project(np.zeros(problem.n)), problem.q_ref).any():
        nearest = "the z within the bounds nearest to 0" if kinds else "q >= 0: z = 0"
        remark = ", the unique one, as M is a P-matrix" if unique else ""
        return f"{nearest} is a solution{remark}"
    if unique:
        every = (
            "these and all other bounds and every q"
            if kinds
            else "this and every other q"
        )
        return f"there is exactly one solution, for {every}, as M is a P-matrix"
    if kinds:
        finite = not {"free", "lower bound", "upper bound"} & kinds.keys()
        return "there is a solution, as all bounds are finite" if finite else ""
    rows = np.flatnonzero((problem.q < 0) & ~((problem.M > 0).sum(axis=1) > 0))
    if not rows.size:
        return ""
    i = int(rows[0]) + 1
    return (
        f"q{i} < 0 and no entry of row {i} of M is positive: there is no solution, "
        f"as w{i} < 0 for every z >= 0"
    )


def _hints(diagnosis: Inspection) -> list[str]:
    """Return hints at likely mistakes in the data, each with evidence and advice."""
    hints, condition = [], diagnosis.equilibrated_condition
    before, after = map(max, (diagnosis.spread, diagnosis.equilibrated_spread))
    if before > theory.BAD_SPREAD and after < before - 1:
        hints.append(
            "badly scaled: the largest entries of rows or columns vary by "
            f"{before:.1f} decades, "
            f"by {after:.1f} after equilibration; use auto, or shi:scale "
            "and fixed-point"
        )
    if diagnosis.stiffness is not None:
        hints.append(_on_stiffness(diagnosis.stiffness))
    elif condition is not None and theory.BAD_CONDITION < condition < math.inf:
        digits = f"{min(math.log10(condition), 16.0):.0f}"
        hints.append(
            f"ill-conditioned, even after equilibration: about {digits} digits "
            "of z may be lost"
        )
    if semidefinite_by_rounding(diagnosis.problem.M) is not None:
        hints.append(
            "M is positive semidefinite up to the rounding of its entries: if it is "
            "that of a program, minimizers are said to be so up to rounding"
        )
    M = diagnosis.problem.M
    if diagnosis.classes["symmetric"].word != NO:
        return hints
    if abs(M - M.T).max() <= ASYMMETRY * abs(M).max():
        return [
            *hints,
            "M is symmetric up to rounding: if it should be, symmetrize it, "
            "which halves the work",
        ]
    transpose = M.T.tocsr() if matrices.is_sparse(M) else np.ascontiguousarray(M.T)
    if (
        diagnosis.classes["strictly_diagonally_dominant"].word == NO
        and weak_row(transpose, raise_if_timed_out) is None
    ):
        hints.append(
            "strictly diagonally dominant by columns, not by rows: if rows were "
            "intended, M is transposed"
        )
    return hints


def _on_stiffness(condition: float) -> str:
    """Return a clause on the consequences of the condition number of M scaled to
    diagonal 1.
    """
    digits = math.floor(DOUBLE_DIGITS - math.log10(min(condition, MAX_TOLD)))
    consequence = (
        f"rounding of M and q leaves at least about {count(digits, 'digit')} of z"
        if digits > 0
        else "rounding of M and q may leave z no digit"
    )
    return (
        f"stiff: the condition number is {in_words(condition)} relative to the "
        f"diagonal, and positive entries off it are not small; {consequence}; "
        f"{MADE_FOR_IT}, which auto uses, is made for such M"
    )


SAMPLES = 2  # points in addition to the start
# The factor by which the distance of a sample from the start is reduced if J is not
# finite there, at most MAX_MOVES times.
NEARER = 0.5**3
MAX_MOVES = 10
LAST_CLASS = "positive_semidefinite"  # the last class that is cheap to decide
MAX_NAMED = 5  # rows or unknowns named in a hint
NO_TEXT = (None, None, None)  # replaces the `Composition` of an F without text


@dataclass(frozen=True, eq=False)
class NonlinearInspection:
    """The diagnosis of a nonlinear problem. Facts that are unknown, or too expensive to
    compute, are None.

    operators, common_expressions, fixed_variables : as in the `Composition` of F; None
        if F has no text.
    equations : the number of unknowns without bounds, whose rows are equations.
    nonlinear_rows : the number of rows of J that vary. nonzeros : the number of entries
        of J that are not 0 everywhere.
    structural_rank : the largest rank that a matrix with the pattern of J can have;
        _of_equations : that of the rows of the equations; _of_free : that of the
        columns of the unknowns without bounds.
    undefined_rows : the rows in which F is not finite at the start. residual : the
        natural residual there.
    condition, spread, classes : of J at the start; classes is empty if J is not finite.
    """

    problem: NonlinearProblem
    operators: Mapping[str, int] | None
    common_expressions: int | None
    fixed_variables: int | None
    equations: int
    nonlinear_rows: int
    nonzeros: int
    structural_rank: int
    structural_rank_of_equations: int
    structural_rank_of_free: int
    undefined_rows: Sequence[int]
    residual: float | None
    condition: float | None
    spread: theory.Spread | None
    classes: Mapping[str, Verdict]
    hints: list[str]

    def __repr__(self) -> str:
        return str(views.inspection_text.inspection_report(self).render()).rstrip()


@np.errstate(all="ignore")
def inspect_nonlinear(
    problem: NonlinearProblem, time_limit: float = INSPECTION_SECONDS
) -> NonlinearInspection:
    """Diagnose a nonlinear problem.

    time_limit : seconds after which expensive computations stop; their results are then
        unknown.
    """
    evaluations, F = Evaluations(problem), problem.values(problem.x0)
    samples = list(_samples(evaluations))
    pattern, varying = _pattern(problem.n, samples)
    free = np.isneginf(problem.lower) & np.isposinf(problem.upper)
    J = evaluations.finite_jacobian(problem.x0)
    undefined = (~np.isfinite(F)).nonzero()[0].tolist()
    operators, common, fixed = problem.composition() if problem.composition else NO_TEXT
    condition, classes = None, dict[str, Verdict]()
    with suppress(TimeIsUp), deadline_after(time_limit):
        if J is not None and problem.n and affordable(J):
            condition = theory.condition(J)
        if J is not None:
            classes = classify(J, LAST_CLASS)
    diagnosis = NonlinearInspection(
        problem=problem,
        operators=operators,
        common_expressions=common,
        fixed_variables=fixed,
        equations=int(free.sum()),
        nonlinear_rows=int(varying.sum()),
        nonzeros=int(pattern.nnz),
        structural_rank=_rank(pattern),
        structural_rank_of_equations=_rank(pattern[free]),
        structural_rank_of_free=_rank(pattern[:, free]),
        undefined_rows=undefined,
        residual=None if undefined else size(problem.box.gaps(problem.x0, F)),
        condition=condition,
        spread=None if J is None else theory.spread(J),
        classes=classes,
        hints=[],
    )
    diagnosis.hints.extend(_nonlinear_hints(diagnosis, J is None))
    return diagnosis


def _samples(evaluations: Evaluations) -> Iterator[Matrix]:
    """Yield J at the start, and at points nearby where it is finite."""
    problem = evaluations.problem
    yield evaluations.jacobian(problem.x0)
    for seed in range(SAMPLES):
        move = generator(seed).uniform(-1.0, 1.0, problem.n) * np.maximum(
            1.0, np.abs(problem.x0)
        )
        points = (
            problem.box.project(problem.x0 + NEARER**k * move) for k in range(MAX_MOVES)
        )
        yield from islice(
            filter(lambda J: J is not None, map(evaluations.finite_jacobian, points)), 1
        )


def _pattern(n: int, samples: Sequence[Matrix]) -> tuple[Matrix, Vector]:
    """Return the entries that are not 0 in one of the samples as a csr array, and which
    rows differ between samples.
    """
    with imports:
        from scipy.sparse import csr_array
    whole = list(map(csr_array, samples))
    pattern, varying = csr_array((n, n)), np.zeros(n, dtype=bool)
    for J in whole if n else ():
        pattern = pattern + (J != 0).astype(float)  # also where it is not finite
        varying |= abs(J - whole[0]).max(axis=1).toarray().ravel() != 0
    return pattern, varying


def _rank(pattern: Matrix) -> int:
    """Return the structural rank of a sparse matrix."""
    with imports:
        from scipy.sparse.csgraph import structural_rank
    return int(structural_rank(pattern.tocsr())) if min(pattern.shape) else 0


def _nonlinear_hints(
    diagnosis: NonlinearInspection, is_undefined: bool
) -> Iterator[str]:
    """Yield hints at likely mistakes, each with evidence and advice."""
    problem, spread = diagnosis.problem, diagnosis.spread
    if diagnosis.undefined_rows:
        yield (
            "F is not finite at the start in "
            f"{_named(problem, diagnosis.undefined_rows)}: start inside its domain"
        )
    elif is_undefined:
        yield "J is not finite at the start: start inside the domain of F"
    k = diagnosis.equations
    of_rows = diagnosis.structural_rank_of_equations
    of_free = diagnosis.structural_rank_of_free
    if of_rows < k:
        few = (
            f"the {k} equations can be solved for at most {of_rows} unknowns, "
            "whatever the values"
        )
        yield f"{few}: some are redundant, or contradict each other"
    if of_free < k:
        yield (
            f"at most {of_free} of the {k} unknowns without bounds are determined "
            "by the rows in which they occur"
        )
    if (
        spread is not None
        and (decades := max(spread.rows, spread.columns)) > theory.BAD_SPREAD
    ):
        yield (
            "badly scaled: the largest entries of rows or columns of J at the "
            f"start vary by {decades:.1f} decades"
        )
    is_singular = (
        diagnosis.condition is not None and diagnosis.condition > theory.BAD_CONDITION
    )
    if is_singular and diagnosis.structural_rank == problem.n:
        yield "J is singular at the start, or almost so: another start may be better"


def _named(problem: NonlinearProblem, rows: Sequence[int]) -> str:
    """Return the numbers and names of rows in words."""
    named = ", ".join(f"{i + 1} {problem.names[i]}".rstrip() for i in rows[:MAX_NAMED])
    word = "rows" if len(rows) > 1 else "row"
    more = f" and {len(rows) - MAX_NAMED} more" if len(rows) > MAX_NAMED else ""
    return f"{word} {named}{more}"
