"""The outcome of runs as lines of text; results, traces and problems as one line in the
interpreter."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from lcpcli.errors import ParameterError, count, missing, visible
from lcpcli.linalg import matrices
from lcpcli.linalg.doubles import ROW_ROUNDING
from lcpcli.methods.registry import declared
from lcpcli.model.box import WORDS
from lcpcli.model.problem import Problem
from lcpcli.model.words import in_stated_sense
from lcpcli.rational.numbers import approximate, brief
from lcpcli.report import wording
from lcpcli.report.wording import (
    ELLIPSIS,
    LEVELS,
    PIPE_WIDTH,
    duration,
    error,
    name,
    residual,
    short,
)
from lcpcli.solving.result import SAID_OF_SOLVED, Result
from lcpcli.solving.trace import Trace
from lcpcli.verify.digits import fewest_digits

if TYPE_CHECKING:
    from lcpcli.report.plotting import Picture


def proofs(result: Result) -> list[str]:
    """Return a line with the certificate and the numbers that make it a proof; or lines
    with the exact vectors, as far as they fit, and with the proof or its absence if no
    message contains it."""
    exact = result.exact
    problem = result.problem
    certificate = result.certificate
    if exact is not None:
        vectors = (
            (name, values)
            for name in "zw"
            if (values := getattr(exact, name)) is not None
        )
        lines = [
            f"exact {name} = {wording.vector(values, brief)}"
            for name, values in vectors
        ]
        if (y := exact.y) is not None:
            shown = wording.vector(y, brief)
            if len(y) > wording.LINE_ENTRIES:
                used = wording.vector(
                    [f"y{i} = {brief(value)}" for i, value in enumerate(y, 1) if value],
                    str,
                )
                shown = f"{used[:-1]}; 0 elsewhere)"
            lines.append(f"exact y = {shown}{_as_proof(problem, y)}")
        if result.solved:
            lines.append(exact.proof if exact.z is None else f"proof: {exact.proof}")
        return lines
    if certificate is None or certificate.vector is None:
        return [f"certificate: {certificate.kind}"] if certificate else []
    cell: Callable[[Any], str] = (
        wording.multiplier if certificate.exact is None else brief
    )
    vector: Sequence[Any] = certificate.exact or certificate.vector.tolist()
    if certificate.kind != "farkas":
        return [f"certificate: {certificate.kind} {wording.vector(vector, cell)}"]
    return [
        "Farkas certificate y = "
        f"{wording.vector(vector, cell)}{_as_proof(problem, vector)}"
    ]


def _as_proof(problem: Problem, y: Sequence[float | Fraction]) -> str:
    """Return the numbers by which a Farkas vector y >= 0 of an LCP proves that there is
    no solution, from the decimals of M and q; no text for a long y, or for bounds."""
    if len(y) > wording.LINE_ENTRIES or problem.bounds:
        return ""
    columns = [*matrices.dense(problem.M).T.tolist(), problem.q.tolist()]
    *first, last = (
        sum(
            (
                Fraction(str(a)) * Fraction(str(b))
                for a, b in zip(column, y, strict=True)
            ),
            Fraction(0),
        )
        for column in columns
    )
    of_y = f"M'y = {wording.vector(first, approximate)} and q'y = {approximate(last)}"
    return f": {of_y}, so y'(Mz + q) < 0 for every z >= 0"


DIGITS = 7  # digits of z, as in the paper's tables
# Digits of z: a line warns if the data determine fewer, as the other printed digits
# would then change with the rounding of the data.
ENOUGH_DIGITS = 6
MAX_NAMED = 4  # components in a line on those that are not unique
OTHERS_CLAUSES = {
    None: "",
    False: "; the only solution",
    True: "; one of several: --all lists them",
}
UNSOLVABLE = "; with the numbers as written there is no exact solution"
SETTLED = ("infeasible", "unsolvable")  # the statuses without a z of interest
# The statuses whose message is about the problem, not about the run.
PROBLEM_STATUSES = (*SETTLED, "ill_posed")
# From this tolerance on an error in the leading digits needs no warning: the tolerance
# explains it.
COARSE = 1e-6
# The ratio of the median to the smallest time from which a line warns of disturbances.
WIDE_SPREAD = 2.0


def proved_lines(result: Result) -> list[str]:
    """Return the lines of the answer if they say why the program or game has no
    solution, as that a program is infeasible; else none."""
    answer = result.answer
    is_proved = result.status.word in SETTLED and answer is not None and answer.word
    return answer.lines() if is_proved else []


def verdict(result: Result) -> str:
    """Return a line on how the run ended, and by which methods, unless it is on the
    problem alone."""
    if proved := proved_lines(result):
        return proved[0]
    if result.solved:
        said = [*wording.headline(result), *_about_objective(result)]
        objective = "".join(f"; {text}" for text in said)
        others = (
            UNSOLVABLE
            if result.exactly_solvable is False
            else OTHERS_CLAUSES[result.others]
        )
        return f"{result.status.word} {_work(result)}{objective}{others}{_why(result)}"
    if result.status.word in PROBLEM_STATUSES:
        return result.message
    by = f" (by {', '.join(result.route)})" * (result.route != (result.method,))
    return f"{name(result)}{by} {result.message}"


def _about_objective(result: Result) -> list[str]:
    """Return how many digits of a program's objective are known, if these are few."""
    if not (error := result.objective_error):
        return []
    from lcpcli.verify.objective import statement

    return list(filter(None, [statement(error)]))


def _why(result: Result) -> str:
    """Return, as a clause, why z is accepted as a solution although its residual alone
    does not show that, and with what reservation; "" if the residual shows it, or if a
    proof says it."""
    message = result.message
    if result.exact is not None:
        if result.exact.status is not None:
            return ""
        message = message.removesuffix(f"; {result.exact.proof}")
    before, _, reason = message.partition(": ")
    return f"; {reason}" if before == SAID_OF_SOLVED and reason else ""


def _work(result: Result, with_route: bool = True) -> str:
    counts = (
        count(result.iterations, "iteration"),
        count(result.evaluations, "evaluation"),
    )
    by = f"by {', '.join(result.route)}: " * with_route
    return by + ", ".join([*counts, duration(result.seconds)])


def facts(
    result: Result, width: int | None, shows_all: bool, names: Sequence[str] = ()
) -> list[str]:
    """Return lines with the work and its parts, the residuals, the error and z, and
    with bounds also the basis. shows_all : whether to show all of a long z instead of a
    line. names : of the unknowns that are shown; empty for all."""
    parts = {
        "set-up": result.setup_seconds,
        "iterations": result.solve_seconds,
        "verification": result.verify_seconds,
    }
    of_answer = getattr(result.answer, "seconds", None)
    if of_answer is not None:
        parts["conclusions"] = of_answer
    times = ", ".join(f"{part} {duration(seconds)}" for part, seconds in parts.items())
    lines = (
        [times]
        if result.solved
        else [_work(result, result.status.word in PROBLEM_STATUSES), times]
    )
    if result.status.word in SETTLED:
        proved = proved_lines(result)
        of_conditions = [f"the problem in z {result.message}"] if proved else []
        return [*proved[1:], *lines, *of_conditions]
    measures = (
        f"residual {residual(result)}, relative "
        f"{short(result.relative_residual, ROW_ROUNDING)}"
    )
    if result.error is not None:
        measures += f", error {error(result.error, result.problem)}"
    lines.append(measures)
    min_digits, i = (
        fewest_digits(result.problem, result.z, np.array(result.digits, dtype=float))
        if result.digits
        else (DIGITS, 0)
    )
    if min_digits < ENOUGH_DIGITS:
        digits = f"about {count(min_digits, 'digit')}" if min_digits else "no digit"
        lines.append(
            f"the data determine {digits} of z{i + 1}: rounding the data once "
            "changes the others"
        )
    # exact arithmetic may have shown that there are no others
    if result.not_unique and result.others is not False:
        lines.append(_not_unique(result.not_unique))
    lines += _vector(result, width or PIPE_WIDTH, shows_all, names)
    if names or not result.problem.bounds:
        return lines
    basis, counts = f"basis = ({', '.join(result.basis)})", Counter(result.basis)
    if len(basis) > (width or PIPE_WIDTH):
        of_states = (
            f"{counts[state]} {state}" for state in WORDS.values() if counts[state]
        )
        basis = f"basis: {', '.join(of_states)}"
    return [*lines, basis]


def _not_unique(indices: list[int]) -> str:
    """Return a line on components that are not unique, some of which it names."""
    named = [f"z{i + 1}" for i in indices[:MAX_NAMED]]
    if len(indices) > MAX_NAMED:
        named.append(count(len(indices) - MAX_NAMED, "other"))
    *first, last = named
    names = f"{', '.join(first)} and {last}" if first else last
    are = "are" if first else "is"
    return f"{names} {are} not unique: to working precision, other values solve it too"


def short_vector(result: Result, width: int) -> str:
    """Return z in a line of this width: all components, or the first ones and the
    last."""
    n = result.problem.n
    for n_shown in range(max(min(n, width // 3), 1), 0, -1):
        cells = _cells(result, slice(n_shown - (n_shown < n)))
        cells += [ELLIPSIS, *_cells(result, slice(n - 1, n))] if n_shown < n else []
        line = f"({', '.join(cells)})"
        if len(line) <= width or n_shown <= 2:
            break
    return line


def _vector(
    result: Result, width: int, shows_all: bool, names: Sequence[str]
) -> list[str]:
    """Return z in one line, elided if necessary; or all of z, in as many lines as it
    needs."""
    start = (
        "z =" if result.solved or result.status.word in PROBLEM_STATUSES else "best z ="
    )
    if names:
        names_of_unknowns = result.names
        cells = _cells(result, slice(None), by_name=True)
        selected = wording.selected_components(wording.labels_of(result.problem), names)
        shown = [
            (names_of_unknowns[i] or f"z{i + 1}", cells[i].split()[-1])
            for i in selected
        ]
        return [
            f"{start} ({', '.join(f'{visible(name)} {cell}' for name, cell in shown)})"
        ]
    if not shows_all:
        return [f"{start} {short_vector(result, width - len(start) - 1)}"]
    return wording.folded(f"{start} ({', '.join(_cells(result, slice(None)))})", width)


def _cells(result: Result, part: slice, by_name: bool = False) -> list[str]:
    """Return a part of z to the known digits, at most 7, with names for an LCP. by_name
    : whether with their signs."""
    error_bound = (
        result.bound.value if result.bound and result.bound.proved else result.error
    )
    last_decade = -math.inf
    if result.solved and error_bound is not None and 0 < error_bound < math.inf:
        last_decade = math.floor(math.log10(error_bound))
    problem, z = result.problem, result.z.tolist()
    cells = list[str]()
    for v in (in_stated_sense(problem, z) if by_name else z)[part]:
        digits = (
            1
            if v == 0 or not math.isfinite(v)
            else min(math.floor(math.log10(abs(v))) - last_decade + 1, DIGITS)
        )
        cells.append(f"{v + 0.0:.{digits}g}" if digits > 0 else "0")
    if problem.origin is None:
        return cells
    names = problem.names[part] if problem.origin.is_names_alone else [""] * len(cells)
    return [
        f"{visible(name)} {cell}".strip()
        for name, cell in zip(names, cells, strict=True)
    ]


def doubt(result: Result) -> str:
    """Return a warning for a solved run whose z differs from the solution in its
    leading digits; else ""."""
    is_close = (
        result.error is None
        or result.error <= LEVELS[0] * result.problem.size_of_solutions
    )
    if is_close or not result.solved or result.tol > COARSE:
        return ""
    far = (
        f"the residual is small but z is far from the {result.problem.reference} "
        "solution"
    )
    other = "it is another solution, which lcp solve --all would list"
    return (
        f"{far}: either {other}, or M is so ill-conditioned that the residual says "
        "little"
    )


def why_unsolved(results: Sequence[Result]) -> str:
    """Return a sentence on why no run of an iteration on x among compared runs has
    solved the problem, and what does; "" if one has, or if nothing is known."""
    from lcpcli.inspection.failure import explanation

    runs = [result for result in results if declared(result.method).iterates]
    if not runs or any(result.solved or result.interrupted for result in runs):
        return ""
    names = list(dict.fromkeys(result.method for result in runs))
    subject = (
        f"neither {' nor '.join(names)} solves the problem"
        if len(names) > 1
        else f"{names[0]} does not solve the problem"
    )
    others = [result for result in results if result not in runs]
    if any(result.status.word in SETTLED for result in others):
        return f"{subject}, as it has no solution"
    failure = explanation(results[0].problem, names)
    solver = next((result for result in others if result.solved), None)
    remedy = failure.guarantee
    if solver is not None:
        by = f" by {', '.join(solver.route)}" * (solver.route != (solver.method,))
        remedy = f"{name(solver)} solves it{by}"
    if not failure.causes:
        return ""
    remedies = ", and ".join(filter(None, [failure.need, remedy]))
    return "; ".join(
        filter(None, [f"{subject}: {', and '.join(failure.causes)}", remedies])
    )


def spread(results: Sequence[Result]) -> str:
    """Return a warning if times of runs, even the shortest of their repetitions, may be
    unreliable; else ""."""
    wide = [
        (result.spread, name(result))
        for result in results
        if result.spread and result.spread > WIDE_SPREAD
    ]
    if not wide:
        return ""
    runs = (
        " and ".join(run for _, run in wide) if len(wide) <= 2 else f"{len(wide)} runs"
    )
    return f"times of {runs} vary by more than {min(wide)[0]:.1f}x between repeats"


def bound(result: Result) -> str:
    """Return a line with the proved bound on the error, or on why there is none; "" if
    no bound was requested."""
    if (error_bound := result.bound) is None:
        return ""
    return (
        f"|z - z*| <= {wording.above(error_bound.value)} ({error_bound.source})"
        if error_bound.proved
        else f"no bound: {error_bound.source}"
    )


def result_text(result: Result) -> str:
    exact = ((key, getattr(result.exact, key, None)) for key in "zy")
    proved = [
        f"exact {key} = {wording.vector(values, brief)}"
        for key, values in exact
        if values is not None
    ]
    by = f"{result.status.word.replace('_', ' ')} by {', '.join(result.route)}"
    parts = [by, wording.size(result.problem), f"residual {residual(result)}"]
    parts += (
        [] if result.error is None else [f"error {error(result.error, result.problem)}"]
    )
    parts += [
        f"in {duration(result.seconds)}",
        *(proved or [f"z = {short_vector(result, 60)}"]),
    ]
    return f"<Result: {', '.join(parts)}>"


def problem_text(problem: Problem) -> str:
    stored = (
        f"sparse, {count(problem.M.nnz, 'stored entry')}"
        if matrices.is_sparse(problem.M)
        else "dense"
    )
    facts_known = (
        [count(len(problem.solutions), f"{problem.reference} solution")]
        if problem.solutions
        else []
    )
    facts_known += [f"known verdict: {problem.verdict}"] if problem.verdict else []
    return (
        f"<{f'Problem {wording.title(problem)}'.rstrip()}: "
        f"{', '.join([wording.size(problem), stored, *facts_known])}>"
    )


def frame(result: Result) -> Any:
    try:
        import pandas
    except ModuleNotFoundError:
        raise ParameterError("to_frame", *missing("pandas")) from None
    labels = [name or f"z{i}" for i, name in enumerate(result.names, 1)]
    return pandas.DataFrame(
        {"z": result.z, "w": result.w, "state": result.basis}, index=labels
    )


def trace_text(trace: Trace) -> str:
    rows = trace.rows
    span = f", k = {rows[0].k} to {rows[-1].k}" if rows else ""
    return f"<Trace: {count(len(rows), 'iterate')}{span}, every = {trace.every}>"


def figure(results: Sequence[Result]) -> Picture:
    from lcpcli.report import plotting

    return plotting.runs_or_answer([results])
