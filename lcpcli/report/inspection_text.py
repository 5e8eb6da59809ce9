"""Inspections in each of the formats, of linear problems and of nonlinear ones."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from lcpcli.errors import count
from lcpcli.files.contents import NO_SOURCE, Source
from lcpcli.inspection.inspection import Inspection, NonlinearInspection
from lcpcli.inspection.theory import MAX_WITH_NORM, Rate, Spread
from lcpcli.inspection.verdict import title
from lcpcli.linalg.matrices import is_sparse
from lcpcli.options import TOL
from lcpcli.presolve.presolve import Presolved
from lcpcli.report import result_formats, wording
from lcpcli.report.document import Document, Section, Table

UNKNOWN = "not computed: too expensive"
# Contraction factors from here on are shown as 1 - d, since four digits would round
# them to 1.
CLOSE_TO_ONE = 0.999
# An estimate of iterations above it is shown as "more than": the method is too slow.
MAX_ITERATIONS = 999_999
# The classes that decide about the methods.
DECISIVE = ("symmetric", "positive definite", "positive semidefinite", "P-matrix")
EIGENVALUES = ("smallest_eigenvalue", "largest_eigenvalue", "eigenvalues_estimated")
NO_RATE = {"omega": None, "factor": None, "iterations": None}
BINARY = ((2**30, "GiB"), (2**20, "MiB"), (2**10, "KiB"), (1, "bytes"))

Row = tuple[str, ...]


def inspection_report(
    diagnosis: Inspection | NonlinearInspection,
    shows_all: bool = True,
    source: Source = NO_SOURCE,
) -> result_formats.Report:
    """Return the report on an inspection of the problem in a source. shows_all :
    whether to show all in tables; otherwise only what decides about the methods."""
    name = wording.title(diagnosis.problem) or "problem"
    classes = [
        (title(class_name), verdict.word, verdict.evidence)
        for class_name, verdict in diagnosis.classes.items()
    ]

    def document(*_: Any) -> Document:
        if isinstance(diagnosis, Inspection):
            tables = _linear_tables(diagnosis, classes, shows_all)
            heading = f"{name}: {wording.size(diagnosis.problem)}"
        else:
            shown = [row for row in classes if shows_all or row[0] in DECISIVE]
            of_start = _table(("class of M = J at the start", "", "because"), shown)
            tables = [_table(("", ""), _nonlinear_facts(diagnosis)), of_start]
            heading = f"{name}, nonlinear: {wording.size(diagnosis.problem)}"
        facts = list(
            filter(None, [getattr(diagnosis, "obvious", ""), *diagnosis.hints])
        )
        return Document(heading, [Section(heading, facts=facts, tables=tables)])

    return result_formats.Report(
        document, lambda: [_record(diagnosis, source)], pipe=wording.PIPE_WIDTH
    )


def _linear_tables(
    diagnosis: Inspection, classes: Sequence[Row], shows_all: bool
) -> list[Table]:
    methods = [
        (name, guarantee.word, guarantee.reason)
        for name, guarantee in diagnosis.guarantees.items()
    ]
    guaranteed = _table(
        ("method", "guaranteed", "in exact arithmetic, because"), methods
    )
    attempts = [
        (
            attempt_row,
            f"{count(attempt_row[2], 'iteration')}, then twice as many"
            if attempt_row[2]
            else "",
        )
        for attempt_row in diagnosis.plan or ()
    ]
    plan = [
        (method, "; ".join(filter(None, (part, share))), why)
        for (method, part, _, why), share in attempts
    ]
    if shows_all:
        return [
            _table(("", ""), _facts(diagnosis) if diagnosis.problem.n else []),
            _table(("class of M", "", "because"), classes),
            guaranteed,
            _table(("auto attempts", "", "reason"), plan, texts=(1, 2)),
        ]
    shown = [
        ("condition", _condition(diagnosis)),
        *(
            (text, f"{word}: {reason}")
            for text, word, reason in classes
            if text in DECISIVE
        ),
        *_presolve(diagnosis.presolve),
        (
            "auto attempts",
            ", ".join(
                dict.fromkeys(attempt.method for attempt in diagnosis.plan or ())
            ),
        ),
        (
            "the rest",
            f"--all shows {len(classes)} classes, sizes, rates and why auto attempts "
            "what",
        ),
    ]
    return [_table(("", ""), shown if diagnosis.problem.n else []), guaranteed]


def verdict(diagnosis: Inspection | NonlinearInspection) -> str:
    """Return an inspection in a line: the obvious answer, else the classes that decide
    about the methods."""
    proved = [
        title(name)
        for name, class_verdict in diagnosis.classes.items()
        if class_verdict.word == "yes" and title(name) in DECISIVE
    ]
    obvious = getattr(diagnosis, "obvious", "")
    return (
        obvious
        or ", ".join(proved)
        or "no class of M that decides about the methods is proved"
    )


def _table(header: Row, rows: Sequence[Row], texts: Sequence[int] = ()) -> Table:
    return Table(
        header, [rows], words=range(len(header)), texts=texts or (len(header) - 1,)
    )


def _facts(diagnosis: Inspection) -> list[Row]:
    n = diagnosis.problem.n
    stored = "sparse" if is_sparse(diagnosis.problem.M) else "dense"
    percentage = f"{100 * diagnosis.nonzeros / n**2:.3g} %"
    nonzeros = f"{diagnosis.nonzeros} of {n**2} nonzero ({percentage})"
    unit, name = next(
        (unit, name) for unit, name in BINARY if diagnosis.cost.bytes >= unit
    )
    before = diagnosis.spread
    after = diagnosis.equilibrated_spread
    cost = diagnosis.cost
    size = f"{cost.factor_entries:.2g} entries, {cost.factor_operations:.2g} operations"
    if cost.bandwidth is not None:
        size = f"at most {size} (bandwidth {cost.bandwidth} after reordering)"
    eigenvalues = (
        "not computed: M is not symmetric"
        if diagnosis.classes["symmetric"].word == "no"
        else UNKNOWN
    )
    if (spectrum := diagnosis.spectrum) is not None:
        about = "about " if spectrum.estimated else ""
        eigenvalues = f"{about}{spectrum.smallest:.4g} to {spectrum.largest:.4g}"
    error = (
        f"p = {diagnosis.p:.2g} leaves a smoothing error of at most "
        f"{diagnosis.smoothing_error:.1e} in F"
    )
    return [
        ("entries", f"{stored}, {nonzeros}, {cost.bytes / unit:.3g} {name}"),
        (
            "scaling",
            f"{_spread(before)} ({after.rows:.1f} and {after.columns:.1f} after "
            "equilibration)",
        ),
        ("condition", _condition(diagnosis)),
        ("eigenvalues", eigenvalues),
        ("factorization", size),
        ("fixed-point", _contraction(diagnosis.published, diagnosis)),
        ("  omega=auto", _contraction(diagnosis.best, diagnosis)),
        ("shi", error),
        *_presolve(diagnosis.presolve),
    ]


def _spread(spread: Spread) -> str:
    return (
        f"row maxima span {spread.rows:.1f} decades, column maxima {spread.columns:.1f}"
    )


def _removed(presolved: Presolved | None) -> dict[str, object] | None:
    return (
        None
        if presolved is None
        else {
            "contradiction": False,
            "unknowns": presolved.kept_columns.size,
            "removed": presolved.removed,
        }
    )


def _presolve(presolved: Presolved | None) -> list[Row]:
    if presolved is None:
        return []
    n = presolved.original.n
    parts = ", ".join(
        f"{number} by {rule}" for rule, number in presolved.removed.items()
    )
    changed = "writes equations in another way" if presolved.has_new_rows else ""
    removes = (
        f"removes {n - presolved.kept_columns.size} of {count(n, 'unknown')}: {parts}"
        if parts
        else ""
    )
    return [("presolve", "; ".join(filter(None, (removes, changed))))]


def _condition(diagnosis: Inspection) -> str:
    unscaled, scaled = diagnosis.condition, diagnosis.equilibrated_condition
    if unscaled is None or scaled is None:
        return UNKNOWN
    if unscaled == scaled == math.inf:
        return "singular to working precision"
    one, other = (
        "infinite" if value == math.inf else f"{value:.2g}"
        for value in (unscaled, scaled)
    )
    return f"{one} in the 1-norm, {other} after equilibration"


def _contraction(rate: Rate | None, diagnosis: Inspection) -> str:
    if rate is None:
        return UNKNOWN
    start = f"omega = {rate.omega:.4g}:"
    if rate.factor is None:
        is_small = diagnosis.problem.n <= MAX_WITH_NORM
        return (
            f"{start} "
            f"{'omega I + M is singular, or almost so' if is_small else 'rate unknown'}"
        )
    if rate.iterations is None:
        return f"{start} |T| = {rate.factor:.4g}, no contraction"
    factor = (
        f"{rate.factor:.4g}"
        if rate.factor < CLOSE_TO_ONE
        else f"1 - {1 - rate.factor:.1e}"
    )
    many = rate.iterations > MAX_ITERATIONS
    times = (
        f"{rate.iterations:.1e} iterations"
        if many
        else count(rate.iterations, "iteration")
    )
    qualifier = (
        "about" if diagnosis.spectrum and diagnosis.spectrum.estimated else "at most"
    )
    return (
        f"{start} |T| = {factor}, {qualifier} {times} to {TOL.value:.0e} of the "
        "initial error"
    )


def _nonlinear_facts(diagnosis: NonlinearInspection) -> Sequence[Row]:
    n, named = diagnosis.problem.n, [name for name in diagnosis.problem.names if name]
    rows = (
        f"{count(diagnosis.equations, 'equation')}, "
        f"{count(n - diagnosis.equations, 'row')} "
        "of unknowns with bounds"
    )
    facts = [("rows", f"{rows}; {diagnosis.nonlinear_rows} of {n} nonlinear")]
    if diagnosis.operators is not None:
        constants = ", which are constants" * bool(diagnosis.fixed_variables)
        fixed = f"{diagnosis.fixed_variables}{constants}"
        operators = (
            ", ".join(
                f"{name} {number}" for name, number in diagnosis.operators.items()
            )
            or "none"
        )
        common = str(diagnosis.common_expressions)
        facts += [
            ("operators", operators),
            ("common expressions", common),
            ("fixed variables", fixed),
        ]
    density = f" ({100 * diagnosis.nonzeros / n**2:.3g} %)" if n else ""
    of_rows = diagnosis.structural_rank_of_equations
    of_free = diagnosis.structural_rank_of_free
    free = (
        f"; {of_rows} of the rows of equations, {of_free} of the columns of "
        "free unknowns" * bool(diagnosis.equations)
    )
    facts += [
        (
            "names",
            f"{named[0]}{f' to {named[-1]}' * (len(named) > 1)}" if named else "none",
        ),
        ("entries of J", f"{diagnosis.nonzeros} of {n**2} nonzero{density}"),
        ("structural rank", f"{diagnosis.structural_rank} of {n}{free}"),
        (
            "at the start",
            f"natural residual {wording.short(diagnosis.residual) or 'undefined'}",
        ),
    ]
    if (condition := diagnosis.condition) is not None:
        facts.append(
            (
                "condition of J",
                "singular"
                if math.isinf(condition)
                else f"{condition:.2g} in the 1-norm",
            )
        )
    return facts + (
        [("scaling of J", _spread(diagnosis.spread))] if diagnosis.spread else []
    )


def _record(
    diagnosis: Inspection | NonlinearInspection, source: Source
) -> dict[str, Any]:
    problem, is_linear = diagnosis.problem, isinstance(diagnosis, Inspection)
    condition = (
        diagnosis.equilibrated_condition
        if isinstance(diagnosis, Inspection)
        else diagnosis.condition
    )
    overrides = {
        **result_formats.source_record(source, problem),
        "bounds": dict(problem.box.kinds) or None,
        "density": diagnosis.nonzeros / problem.n**2 if problem.n else None,
        "classes": {
            name: {
                "verdict": overrides.word,
                "evidence": overrides.evidence,
                "indices": overrides.indices,
                "vector": overrides.vector,
            }
            for name, overrides in diagnosis.classes.items()
        },
        "spread": _decades(diagnosis.spread),
        "singular": None if condition is None else math.isinf(condition),
        "linear": is_linear,
    }
    if isinstance(diagnosis, Inspection):
        overrides |= {
            "sparse": is_sparse(diagnosis.problem.M),
            "equilibrated_spread": _decades(diagnosis.equilibrated_spread),
            **dict(
                zip(EIGENVALUES, diagnosis.spectrum or (None, None, None), strict=True)
            ),
            **vars(diagnosis.cost),
            "fixed_point": diagnosis.published or NO_RATE,
            "fixed_point_best": diagnosis.best or NO_RATE,
            "methods": {
                name: {"guaranteed": overrides.word, "reason": overrides.reason}
                for name, overrides in diagnosis.guarantees.items()
            },
            "presolve": _removed(diagnosis.presolve),
            "plan": None
            if diagnosis.plan is None
            else [attempt._asdict() for attempt in diagnosis.plan],
            "obvious": diagnosis.obvious or None,
            "stiffness": diagnosis.stiffness,
        }
    keys = result_formats.keys_of("inspect" if is_linear else "inspect-nonlinear")
    return result_formats.record(keys, diagnosis, overrides)


def _decades(spread: Spread | None) -> dict[str, float] | None:
    return spread and {
        f"{key}_decades": value for key, value in spread._asdict().items()
    }
