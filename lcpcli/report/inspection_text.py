"""Inspections in each of the formats, of linear problems and of nonlinear ones."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from lcpcli.errors import count
from lcpcli.files.contents import NO_SOURCE
from lcpcli.inspection.inspection import Inspection, NonlinearInspection
from lcpcli.inspection.theory import MAX_WITH_NORM, Rate, Spread
from lcpcli.inspection.verdict import title
from lcpcli.linalg.matrices import is_sparse
from lcpcli.options import TOL
from lcpcli.presolve.presolve import Presolved
from lcpcli.report import result_formats, wording
from lcpcli.report.document import Document, Section, Table

UNKNOWN = "not computed: too expensive"
# From here on, a contraction factor is shown by its distance from 1, as four digits
# would hide it.
CLOSE_TO_ONE = 0.999
# An estimate above it is shown as "more than": nobody waits for so many.
MAX_ITERATIONS = 999_999
# For the choice of a method.
DECISIVE = ("symmetric", "positive definite", "positive semidefinite", "P-matrix")
EIGENVALUES = ("smallest_eigenvalue", "largest_eigenvalue", "eigenvalues_estimated")
NO_RATE = {"omega": None, "factor": None, "iterations": None}
BINARY = ((2**30, "GiB"), (2**20, "MiB"), (2**10, "KiB"), (1, "bytes"))

Row = tuple[str, ...]


def report(
    found: Inspection | NonlinearInspection, whole: bool = True
) -> result_formats.Report:
    """Return the report on an inspection. whole : whether to show all in tables;
    otherwise only what decides about the methods."""
    name = wording.title(found.problem) or "problem"
    classes = [
        (title(name), verdict.word, verdict.evidence)
        for name, verdict in found.classes.items()
    ]

    def document(*_: Any) -> Document:
        if isinstance(found, Inspection):
            tables, heading = (
                _linear_tables(found, classes, whole),
                f"{name}: {wording.size(found.problem)}",
            )
        else:
            shown = [row for row in classes if whole or row[0] in DECISIVE]
            of_start = _table(("class of M = J at the start", "", "because"), shown)
            tables = [_table(("", ""), _nonlinear_facts(found)), of_start]
            heading = f"{name}, nonlinear: {wording.size(found.problem)}"
        facts = list(filter(None, [getattr(found, "obvious", ""), *found.hints]))
        return Document(heading, [Section(heading, facts=facts, tables=tables)])

    return result_formats.Report(
        document, lambda: [_record(found)], pipe=wording.PIPE_WIDTH
    )


def _linear_tables(
    found: Inspection, classes: Sequence[Row], whole: bool
) -> list[Table]:
    methods = [
        (name, guarantee.word, guarantee.reason)
        for name, guarantee in found.guarantees.items()
    ]
    guaranteed = _table(
        ("method", "guaranteed", "in exact arithmetic, because"), methods
    )
    tries = [
        (one, f"{count(one[2], 'iteration')}, then twice as many" if one[2] else "")
        for one in found.plan or ()
    ]
    plan = [
        (method, "; ".join(filter(None, (part, share))), why)
        for (method, part, _, why), share in tries
    ]
    if whole:
        return [
            _table(("", ""), _facts(found) if found.problem.n else []),
            _table(("class of M", "", "because"), classes),
            guaranteed,
            _table(("auto tries", "", "reason"), plan, texts=(1, 2)),
        ]
    shown = [
        ("condition", _condition(found)),
        *(
            (text, f"{word}: {reason}")
            for text, word, reason in classes
            if text in DECISIVE
        ),
        *_presolve(found.presolve),
        (
            "auto tries",
            ", ".join(dict.fromkeys(attempt.method for attempt in found.plan or ())),
        ),
        (
            "the rest",
            f"--all shows {len(classes)} classes, sizes, rates and why auto tries what",
        ),
    ]
    return [_table(("", ""), shown if found.problem.n else []), guaranteed]


def verdict(found: Inspection | NonlinearInspection) -> str:
    """Return an inspection in a line: the obvious answer, else the classes that decide
    about the methods."""
    proved = [
        title(name)
        for name, own in found.classes.items()
        if own.word == "yes" and title(name) in DECISIVE
    ]
    obvious = getattr(found, "obvious", "")
    return (
        obvious
        or ", ".join(proved)
        or "no class of M that decides about the methods is proved"
    )


def _table(header: Row, rows: Sequence[Row], texts: Sequence[int] = ()) -> Table:
    return Table(
        header, [rows], words=range(len(header)), texts=texts or (len(header) - 1,)
    )


def _facts(found: Inspection) -> list[Row]:
    n, stored = found.problem.n, "sparse" if is_sparse(found.problem.M) else "dense"
    nonzeros = (
        f"{found.nonzeros} of {n**2} nonzero ({100 * found.nonzeros / n**2:.3g} %)"
    )
    unit, name = next((unit, name) for unit, name in BINARY if found.cost.bytes >= unit)
    before, after, cost = found.spread, found.equilibrated_spread, found.cost
    size = f"{cost.factor_entries:.2g} entries, {cost.factor_operations:.2g} operations"
    if cost.bandwidth is not None:
        size = f"at most {size} (bandwidth {cost.bandwidth} after reordering)"
    eigenvalues = (
        "not computed: M is not symmetric"
        if found.classes["symmetric"].word == "no"
        else UNKNOWN
    )
    if (ends := found.spectrum) is not None:
        eigenvalues = (
            f"{'about ' * ends.estimated}{ends.smallest:.4g} to {ends.largest:.4g}"
        )
    error = (
        f"p = {found.p:.2g} leaves a smoothing error of at most "
        f"{found.smoothing_error:.1e} in F"
    )
    return [
        ("entries", f"{stored}, {nonzeros}, {cost.bytes / unit:.3g} {name}"),
        (
            "scaling",
            f"{_spread(before)} ({after.rows:.1f} and {after.columns:.1f} after "
            "equilibration)",
        ),
        ("condition", _condition(found)),
        ("eigenvalues", eigenvalues),
        ("factorization", size),
        ("fixed-point", _contraction(found.published, found)),
        ("  omega=auto", _contraction(found.best, found)),
        ("shi", error),
        *_presolve(found.presolve),
    ]


def _spread(spread: Spread) -> str:
    return (
        f"row maxima span {spread.rows:.1f} decades, column maxima {spread.columns:.1f}"
    )


def _removed(found: Presolved | None) -> dict[str, object] | None:
    return (
        None
        if found is None
        else {
            "contradiction": False,
            "unknowns": found.kept.size,
            "removed": found.removed,
        }
    )


def _presolve(found: Presolved | None) -> list[Row]:
    if found is None:
        return []
    n, parts = (
        found.original.n,
        ", ".join(f"{number} by {rule}" for rule, number in found.removed.items()),
    )
    changed = "writes equations in another way" * found.has_new_rows
    removes = (
        f"removes {n - found.kept.size} of {count(n, 'unknown')}: {parts}"
        if parts
        else ""
    )
    return [("presolve", "; ".join(filter(None, (removes, changed))))]


def _condition(found: Inspection) -> str:
    own, scaled = found.condition, found.equilibrated_condition
    if own is None or scaled is None:
        return UNKNOWN
    if own == scaled == math.inf:
        return "singular to working precision"
    one, other = (
        "infinite" if value == math.inf else f"{value:.2g}" for value in (own, scaled)
    )
    return f"{one} in the 1-norm, {other} after equilibration"


def _contraction(rate: Rate | None, found: Inspection) -> str:
    if rate is None:
        return UNKNOWN
    start = f"omega = {rate.omega:.4g}:"
    if rate.factor is None:
        is_small = found.problem.n <= MAX_WITH_NORM
        return (
            f"{start} "
            f"{'omega I + M is singular, or nearly' if is_small else 'rate unknown'}"
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
    most = "about" if found.spectrum and found.spectrum.estimated else "at most"
    return (
        f"{start} |T| = {factor}, {most} {times} to {TOL.value:.0e} of the initial "
        "error"
    )


def _nonlinear_facts(found: NonlinearInspection) -> Sequence[Row]:
    n, named = found.problem.n, [name for name in found.problem.names if name]
    rows = (
        f"{count(found.equations, 'equation')}, {count(n - found.equations, 'row')} "
        "of unknowns with bounds"
    )
    facts = [("rows", f"{rows}; {found.nonlinear_rows} of {n} nonlinear")]
    if found.operators is not None:
        constants = ", which are constants" * bool(found.fixed_variables)
        fixed = f"{found.fixed_variables}{constants}"
        operators = (
            ", ".join(f"{name} {number}" for name, number in found.operators.items())
            or "none"
        )
        common = str(found.common_expressions)
        facts += [
            ("operators", operators),
            ("common expressions", common),
            ("fixed variables", fixed),
        ]
    density = f" ({100 * found.nonzeros / n**2:.3g} %)" if n else ""
    of_rows, of_free = found.structural_rank_of_equations, found.structural_rank_of_free
    free = (
        f"; {of_rows} of the rows of equations, {of_free} of the columns of "
        "free unknowns" * bool(found.equations)
    )
    facts += [
        (
            "names",
            f"{named[0]}{f' to {named[-1]}' * (len(named) > 1)}" if named else "none",
        ),
        ("entries of J", f"{found.nonzeros} of {n**2} nonzero{density}"),
        ("structural rank", f"{found.structural_rank} of {n}{free}"),
        (
            "at the start",
            f"natural residual {wording.short(found.residual) or 'undefined'}",
        ),
    ]
    if (condition := found.condition) is not None:
        facts.append(
            (
                "condition of J",
                "singular"
                if math.isinf(condition)
                else f"{condition:.2g} in the 1-norm",
            )
        )
    return facts + ([("scaling of J", _spread(found.spread))] if found.spread else [])


def _record(found: Inspection | NonlinearInspection) -> dict[str, Any]:
    problem, is_linear = found.problem, isinstance(found, Inspection)
    condition = (
        found.equilibrated_condition
        if isinstance(found, Inspection)
        else found.condition
    )
    own = {
        **result_formats.place(NO_SOURCE, problem),
        "bounds": dict(problem.box.kinds) or None,
        "density": found.nonzeros / problem.n**2 if problem.n else None,
        "classes": {
            name: {
                "verdict": own.word,
                "evidence": own.evidence,
                "indices": own.indices,
                "vector": own.vector,
            }
            for name, own in found.classes.items()
        },
        "spread": _decades(found.spread),
        "singular": None if condition is None else math.isinf(condition),
        "linear": is_linear,
    }
    if isinstance(found, Inspection):
        own |= {
            "sparse": is_sparse(found.problem.M),
            "equilibrated_spread": _decades(found.equilibrated_spread),
            **dict(zip(EIGENVALUES, found.spectrum or (None, None, None), strict=True)),
            **vars(found.cost),
            "fixed_point": found.published or NO_RATE,
            "fixed_point_best": found.best or NO_RATE,
            "methods": {
                name: {"guaranteed": own.word, "reason": own.reason}
                for name, own in found.guarantees.items()
            },
            "presolve": _removed(found.presolve),
            "plan": None
            if found.plan is None
            else [attempt._asdict() for attempt in found.plan],
            "obvious": found.obvious or None,
            "stiffness": found.stiffness,
        }
    keys = result_formats.keys_of("inspect" if is_linear else "inspect-nonlinear")
    return result_formats.record(keys, found, own)


def _decades(spread: Spread | None) -> dict[str, float] | None:
    return spread and {
        f"{key}_decades": value for key, value in spread._asdict().items()
    }
