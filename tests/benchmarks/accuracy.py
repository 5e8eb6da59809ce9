"""What a bench says of accuracy beyond its own tables: accuracy.py RECORD.json
[FIGURE.svg], a record that lcp bench -o has written

Tables: error and time on stiff structures against their condition number, as in the
figure; how far each solver gets as the problems of `lcp bench stiff` and `extreme`
become stiffer; how often each method is first to reach an error; and the convergence
factors of fixed-point, measured and from theory.
"""

import math
import statistics
import sys
from collections import Counter
from collections.abc import Sequence
from fractions import Fraction
from itertools import groupby, product
from operator import itemgetter
from typing import NamedTuple

import numpy as np

from lcpcli.bench import record as records
from lcpcli.bench.report import sheet
from lcpcli.bench.suites import prepare
from lcpcli.errors import count
from lcpcli.linalg import definite_systems, matrices
from lcpcli.linalg.doubles import EPS, ROW_ROUNDING
from lcpcli.linalg.factors import finite, well_conditioned_inverse
from lcpcli.model.box import BASIC
from lcpcli.model.changes import scale
from lcpcli.model.problem import Problem
from lcpcli.rational import elimination
from lcpcli.rational.numbers import in_integers, rounded
from lcpcli.report import wording
from lcpcli.report.document import Document, typeset
from lcpcli.report.wording import LEVELS

STRUCTURES = {"beam", "plate", "frame"}  # families of the gallery
# The suites whose families are in order of stiffness.
ORDERED = {"stiff", "extreme", "all"}
NO_ENTRY = "-"
# Times within this factor count as equal, as repeated measurements differ by as much.
ALIKE = 1.02
# Errors, relative to the solution: after the first phase, and before rounding.
RATE_BEGINS, RATE_ENDS = 1e-2, 1e-9
# Unknowns up to which the theoretical factors, from dense eigenvalues, take less than a
# second.
MAX_WITH_RATE = 400
MIN_ITERATES = 8  # for a rate by least squares, which fewer would leave uncertain
# The size of M_PP up to which the inverse is formed, in a few hundredths of a second.
MAX_INVERTED = 400
# The size of M_PP up to which it is inverted in rational arithmetic, in about a second.
MAX_INVERTED_EXACTLY = 64
# The condition number up to which an inverse in doubles has three correct digits.
LARGEST_CONDITION = 1e-3 / EPS
Curve = Sequence[tuple[int, float, float | None]]


def competing(record):
    """Yield the problems with a known solution on which at least two methods ran: the
    name, and the seconds of each method until each level of error, by the iterates that
    the record has."""
    cases = {case.name: case for case in record.cases}
    for name, group in groupby(record.measurements, key=lambda row: row.problem):
        curves = {
            row.solver: row.curve
            for row in group
            if row.curve and row.curve_of == "error"
        }
        if len(curves) >= 2:
            size = prepare(cases[name]).size_of_solutions
            yield (
                name,
                {
                    solver: dict(firsts_of(curve, size))
                    for solver, curve in curves.items()
                },
            )


def firsts_of(curve, size):
    """Yield each level of error that a run reaches, with the seconds until then. size :
    of the solution."""
    for level in LEVELS:
        times = [
            seconds
            for _, seconds, error in curve
            if error is not None and error <= level * size
        ]
        if times:
            yield level, times[0]


def condition(problem):
    """Return the condition of the only solution of a linear problem, its `sensitivity`
    over its largest component; None if it is unknown, or 0."""
    if (
        not isinstance(problem, Problem)
        or len(problem.solutions) != 1
        or problem.n > MAX_INVERTED
    ):
        return None
    found = sensitivity(problem, problem.solutions[0])
    return found / problem.size_of_solutions if found else None


def forward_error(problem, error):
    """Return an error in units of eps times the condition: the effect of rounding the
    data."""
    own = condition(problem)
    return (
        None
        if own is None or error is None
        else error / EPS / (own * problem.size_of_solutions)
    )


@np.errstate(all="ignore")
def sensitivity(problem, z):
    """Return the largest component of |M_PP^-1| (|M| |z| + |q|)_P at the solution z,
    shape (n,), in units of z, for P with l_i < z_i < u_i or w_i = 0; None if M_PP is
    singular or too large, or too ill-conditioned where it is not small."""
    w = problem.w(z)
    terms = matrices.absolute_product(problem.M, np.abs(z)) + np.abs(problem.q)
    box = problem.box
    between = (z > box.lower) & (z < box.upper)
    vanishing = ~box.fixed & (np.abs(w) <= ROW_ROUNDING * terms)
    for active in (between | vanishing, between):
        P = np.flatnonzero(active)
        if not P.size:
            return 0.0
        inverse = _inverse(problem, P)
        if inverse is not None:
            largest = float((inverse @ terms[P]).max())
            return largest if np.isfinite(largest) else None
    return None


def _inverse(problem, P):
    """Return |M_PP^-1|, shape (k, k); None if M_PP is singular, too large or too
    ill-conditioned."""
    if P.size > MAX_INVERTED:
        return None
    units = scale(problem)
    A = matrices.dense(units.problem.M[P][:, P])
    if P.size <= MAX_INVERTED_EXACTLY:
        whole, power = in_integers(A.ravel())
        rows = np.array(whole, dtype=object).reshape(A.shape).tolist()
        unit = Fraction(2) ** -power
        columns = [
            elimination.particular(rows, each)
            for each in np.eye(P.size, dtype=int).tolist()
        ]
        found = [
            rounded(unit * value for value in column)
            for column in columns
            if column is not None
        ]
        inverse = np.array(found).T if len(found) == P.size else None
    else:
        inverse = well_conditioned_inverse(A, LARGEST_CONDITION)
    return (
        None
        if inverse is None
        else np.abs(units.C[P, np.newaxis] * inverse * units.R[P])
    )


def structures(record):
    """Return a row per stiff structure, in order of its condition number: what remains
    of the solution by each solver, and in which time."""
    header = ["problem", "condition", *record.solvers]
    rows = [
        [
            name,
            wording.short(size),
            *(_remains(own.get(each)) for each in record.solvers),
        ]
        for name, size, own in _structures(record)
    ]
    notes = [
        "condition: of M in units of its diagonal, estimated. Of each solver: the "
        "error relative to the largest component of the solution, which is known to "
        "its last digits, and the time; or how the run ended."
    ]
    return sheet("Error against condition", header, [rows], *notes)


def _structures(record):
    """Return the name, the condition number, and by solver the measurement and the
    relative error of each structure, in order of the condition number."""
    found = []
    for each in record.cases:
        if each.family not in STRUCTURES:
            continue
        problem = prepare(each)
        own = {
            row.solver: (row, row.error / problem.size_of_solutions)
            for row in record.measurements
            if row.problem == each.name and row.error is not None
        }
        found.append((each.name, definite_systems.condition(problem.M), own))
    return sorted(found, key=itemgetter(1))


def _remains(row):
    if row is None:
        return NO_ENTRY
    measured, error = row
    seconds = statistics.median(measured.seconds)
    return (
        f"{wording.short(error, EPS)} in {wording.duration(seconds)}"
        if measured.success
        else measured.status.replace("_", " ")
    )


def draw(record, path):
    """Draw the errors of all runs on stiff structures against the condition number, and
    eps times that: what rounding of the data alone does."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(6.0, 4.0), layout="constrained")
    axes = figure.add_subplot()
    found = [each for each in _structures(record) if math.isfinite(each[1]) and each[2]]
    for solver in record.solvers:
        points = [
            (size, max(own[solver][1], EPS)) for _, size, own in found if solver in own
        ]
        axes.loglog(*zip(*points, strict=True), "o-", label=solver, markersize=4)
    sizes = [size for _, size, _ in found]
    axes.loglog(
        sizes, [min(EPS * size, 1.0) for size in sizes], "k:", label="eps * condition"
    )
    axes.set_xlabel("condition number of M, in units of its diagonal")
    axes.set_ylabel("relative error")
    axes.legend()
    figure.savefig(path)


def stability(record):
    """Return one row per family and solver, or no rows if the suite is not in order of
    stiffness."""
    groups = (
        [_rungs(record, *ladder) for ladder in ladders(record.cases)]
        if ORDERED & {*record.suite}
        else []
    )
    header = ["family", "up", "solver", "to", "error", "cond.", "then"]
    notes = [
        "to: the last value up to which all problems are solved, by recomputed "
        "residuals. error: the largest error on "
        "them, against the exact solution, in units of eps times the condition: "
        "the effect of rounding the data. "
        "cond.: the largest condition of their solutions. then: how the run on "
        "the next problem ends."
    ]
    return sheet("Stability", header, [group for group in groups if group], *notes)


def ladders(cases):
    """Return the families of the cases, the parameter that varies in each, and its
    values by case, in order of stiffness; a problem in a file belongs to no family."""
    families = {}
    for case in cases:
        if case.family:
            families.setdefault((case.family, *case.parameters), []).append(case)
    found = []
    for (family, *parameters), own in families.items():
        axis = next(
            (
                name
                for name in parameters
                if len({str(case.parameters[name]) for case in own}) > 1
            ),
            "n",
        )
        values = {
            case.name: str(case.parameters[axis] if axis in parameters else case.n)
            for case in own
        }
        found.append((family, axis, values))
    return found


def _rungs(record, family, axis, values):
    """Return up to what stiffness each solver measured on a ladder succeeds, and how it
    ends at the next step."""
    group = []
    cases = {case.name: case for case in record.cases}
    for solver in record.solvers:
        rows = {row.problem: row for row in record.measurements if row.solver == solver}
        own = [rows[problem] for problem in values if problem in rows]
        if len(own) < len(values) or any(row.excluded for row in own):
            continue
        good = next((i for i, row in enumerate(own) if not row.success), len(own))
        cells, then = [NO_ENTRY, "", ""], "all"
        if good:
            problems = [prepare(cases[row.problem]) for row in own[:good]]
            errors = [
                forward_error(each, row.error)
                for each, row in zip(problems, own, strict=False)
            ]
            measures = errors, list(map(condition, problems))
            largest = (
                max((size for size in sizes if size is not None), default=None)
                for sizes in measures
            )
            cells = [values[own[good - 1].problem], *map(wording.short, largest)]
        if good < len(own):
            row = own[good]
            outcome = (
                row.status.replace("_", " ")
                if row.kind == "method" or not row.claimed
                else "claims to solve it"
            )
            then = f"{values[row.problem]}: {'wrong' if row.false_success else outcome}"
        group.append([*(["", ""] if group else [family, axis]), solver, *cells, then])
    return group


def firsts(record):
    """Return on how many problems each method reached each level of error first;
    methods that tie all count."""
    problems, wins = [own for _, own in competing(record)], Counter[tuple[str, float]]()
    for own, level in product(problems, LEVELS):
        times = {
            method: reached[level]
            for method, reached in own.items()
            if level in reached
        }
        wins.update(
            (method, level)
            for method in times
            if times[method] <= ALIKE * min(times.values())
        )
    rows = [
        [method, *(str(wins[method, level]) for level in LEVELS)]
        for method in record.methods
        if problems
    ]
    header = ["solver", *(f"to {wording.level(level)}" for level in LEVELS)]
    notes = [
        f"Times within {ALIKE - 1:.0%} count as equal: several methods are then first."
    ]
    return sheet(
        f"How often first to reach an error, on {count(len(problems), 'problem')}",
        header,
        [rows],
        *notes,
    )


def rates(record):
    """Return the convergence factors of fixed-point, measured and from theory."""
    factors = ("measured", "local", "bound")
    rows = []
    cases = {case.name: case for case in record.cases}
    for row in record.measurements:
        rate = None
        if row.solver == "fixed-point" and row.curve:
            problem = prepare(cases[row.problem])
            rate = (
                rate_of_fixed_point(problem, row.curve)
                if isinstance(problem, Problem)
                else None
            )
        if rate is not None:
            cells = [f"{rate[name]:.4f}" if name in rate else "" for name in factors]
            rows.append([row.problem, str(row.iterations), *cells])
    notes = [
        "measured: least-squares fit to the logarithms of the errors. local: "
        "the spectral radius of the iteration at a "
        "nondegenerate solution. bound: |(I + M)^-1 (I - M)|_2; max |1 - "
        "lambda| / |1 + lambda| for symmetric M."
    ]
    title = "Linear convergence of fixed-point: factor per iteration"
    return sheet(title, ["problem", "iterations", *factors], [rows], *notes)


class Contraction(NamedTuple):
    """The reduction of the error per iteration of fixed-point: at most |T|_2 with T =
    (I + M)^-1 (I - M), and near a solution x* without kink the spectral
    radius of T S, where S_ii is 1 if l_i < 2x*_i < u_i, else -1; None if some 2x*_i is
    at a bound, where the iteration has a kink."""

    bound: float
    local: float | None


def contraction(problem, x):
    """Return the theoretical factors at the solution x = (z - w) / 2, shape (n,); None
    if I + M is singular."""
    box = problem.box
    dense, one = matrices.dense(problem.M), np.eye(problem.n)
    kinks = ((2 * x == box.lower) | (2 * x == box.upper)) & ~box.fixed
    S = np.where(box.basis_of(x) == BASIC, 1.0, -1.0)
    try:
        T = finite(np.linalg.solve(one + dense, one - dense))
    except np.linalg.LinAlgError:
        return None
    local = None if kinks.any() else float(np.abs(np.linalg.eigvals(T * S)).max())
    return Contraction(float(np.linalg.norm(T, 2)), local)


def rate_of_fixed_point(problem, curve):
    """Return the convergence factors of fixed-point: measured, the local one of theory
    if it exists, and the bound.

    The result is None if the run shows no rate, for several known solutions, or beyond
    MAX_WITH_RATE unknowns.
    """
    if len(problem.solutions) != 1 or problem.n > MAX_WITH_RATE:
        return None
    size, z = problem.size_of_solutions, problem.solutions[0]
    errors = [error if error is not None else 0.0 for _, _, error in curve]
    factor = empirical_rate(
        [k for k, _, _ in curve], errors, RATE_BEGINS * size, RATE_ENDS * size
    )
    theory = (
        contraction(problem, problem.box.x_of(z, problem.w(z)))
        if factor is not None
        else None
    )
    if factor is None or theory is None:
        return None
    local = {} if theory.local is None else {"local": theory.local}
    return {"measured": factor, **local, "bound": theory.bound}


def empirical_rate(k, errors, largest, smallest):
    """Return the reduction of the error per iteration, by least squares on the
    logarithms of the errors, from the first error below `largest` to the last one above
    `smallest`; None for fewer than MIN_ITERATES iterates."""
    below = next((i for i, error in enumerate(errors) if error < largest), len(errors))
    above = max((i for i, error in enumerate(errors) if error > smallest), default=-1)
    kept = [i for i in range(below, above + 1) if errors[i] > 0]
    if len(kept) < MIN_ITERATES:
        return None
    slope = float(
        np.polyfit([k[i] for i in kept], [math.log(errors[i]) for i in kept], 1)[0]
    )
    return math.exp(slope)


def main(path, figure=""):
    record = records.read(path)
    sections = structures, stability, firsts, rates
    tables = [own for own in (each(record) for each in sections) if own.tables[0].rows]
    print(typeset(Document(path, tables), "table", None, False), end="")
    if figure:
        draw(record, figure)


if __name__ == "__main__":
    main(*sys.argv[1:])
