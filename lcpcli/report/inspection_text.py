"""An inspection in each of the formats.

An inspection of a nonlinear problem in each of the formats.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

from lcpcli.errors import count
from lcpcli.inspection.inspection import Attempt, Inspection
from lcpcli.inspection.nonlinear import NonlinearInspection
from lcpcli.inspection.theory import MOST_WITH_NORM, Rate
from lcpcli.inspection.verdict import title
from lcpcli.linalg.matrices import is_sparse
from lcpcli.options import TOL
from lcpcli.presolve.presolve import Presolved, Refuted
from lcpcli.report import json_lines, result_csv, wording
from lcpcli.report.document import Document, Section, Table, typeset
from lcpcli.report.wording import PIPE_WIDTH

UNKNOWN = "not computed: too expensive"
CLOSE_TO_ONE = 0.999  # from here on, a contraction factor is shown by its distance from 1, as four digits would hide it
MOST_ITERATIONS = 999_999  # an estimate above it is shown as "more than": nobody waits for so many
DECISIVE = ("symmetric", "positive definite", "positive semidefinite", "P-matrix")  # for the choice of a method
NO_RATE = {"omega": None, "factor": None, "iterations": None}
BINARY = ((2**30, "GiB"), (2**20, "MiB"), (2**10, "KiB"), (1, "bytes"))

Row = tuple[str, ...]


def render(
    found: Inspection, form: str = "table", width: int | None = None, color: bool = False, whole: bool = True
) -> str:
    """Return an inspection as text in a format. width, color : as for `formats.typeset`. whole : whether to show all in
    tables; otherwise only what decides about the methods."""
    if form in ("json", "csv"):
        record = _record(found)
        return json_lines.line(record) if form == "json" else result_csv.records_text([record])
    name = wording.title(found.problem) or "problem"
    classes = [(title(name), verdict.word, verdict.evidence) for name, verdict in found.classes.items()]
    methods = [(name, guarantee.word, guarantee.reason) for name, guarantee in found.guarantees.items()]
    guaranteed = _table(("method", "guaranteed", "in exact arithmetic, because"), methods)
    tables = [
        _table(("", ""), _facts(found) if found.problem.n else []),
        _table(("class of M", "", "because"), classes),
        guaranteed,
        _table(("auto tries", "", "reason"), _plan(found.plan or ()), texts=(1, 2)),
    ]
    if not whole:
        decisive = [(text, f"{word}: {reason}") for text, word, reason in classes if text in DECISIVE]
        tried = [("auto tries", ", ".join(dict.fromkeys(attempt.method for attempt in found.plan or ())))]
        rest = [("the rest", f"--all shows {len(classes)} classes, sizes, rates and why auto tries what")]
        removed = [("presolve", _presolve(found.presolve))] if found.presolve is not None else []
        shown = [("condition", _condition(found)), *decisive, *removed, *tried, *rest]
        tables = [_table(("", ""), shown if found.problem.n else []), guaranteed]
    facts = [text for text in (found.obvious, *found.hints) if text]
    section = Section(f"{name}: {wording.size(found.problem)}", facts=facts, tables=tables)
    return typeset(Document(section.title, [section]), form, width or PIPE_WIDTH, color)


def _table(header: Row, rows: Sequence[Row], texts: Sequence[int] = ()) -> Table:
    """Return a table of words, the last column of sentences."""
    return Table(header, [rows], words=range(len(header)), texts=texts or (len(header) - 1,))


def _plan(attempts: Iterable[Attempt]) -> list[Row]:
    """Return a row for each attempt: the method; what of it, and how long at first; why."""
    rows: list[Row] = []
    for method, part, iterations, reason in attempts:
        share = "" if iterations is None else f"{count(iterations, 'iteration')}, then twice as many"
        rows.append((method, "; ".join(filter(None, (part, share))), reason))
    return rows


def _facts(found: Inspection) -> list[Row]:
    n, stored = found.problem.n, "sparse" if is_sparse(found.problem.M) else "dense"
    nonzeros = f"{found.nonzeros} of {n**2} nonzero ({100 * found.nonzeros / n**2:.3g} %)"
    unit, name = next((unit, name) for unit, name in BINARY if found.cost.bytes >= unit)
    before, after, cost = found.spread, found.equilibrated_spread, found.cost
    spread = f"row maxima span {before.rows:.1f} decades, column maxima {before.columns:.1f}"
    size = f"{cost.factor_entries:.2g} entries, {cost.factor_operations:.2g} operations"
    if cost.bandwidth is not None:
        size = f"at most {size} (bandwidth {cost.bandwidth} after reordering)"
    error = f"p = {found.smoothing.p:.2g} leaves a smoothing error of at most {found.smoothing.error:.1e} in F"
    return [
        ("entries", f"{stored}, {nonzeros}, {found.cost.bytes / unit:.3g} {name}"),
        ("scaling", f"{spread} ({after.rows:.1f} and {after.columns:.1f} after equilibration)"),
        ("condition", _condition(found)),
        ("eigenvalues", _eigenvalues(found)),
        ("factorization", size),
        ("fixed-point", _contraction(found.published, found)),
        ("  --omega auto", _contraction(found.best, found)),
        ("shi", error),
        *([("presolve", _presolve(found.presolve))] if found.presolve is not None else []),
    ]


def _removed(found: Presolved | Refuted | None) -> dict[str, object] | None:
    """Return what presolve removes, as JSON has it."""
    if found is None or isinstance(found, Refuted):
        return None if found is None else {"contradiction": True, "unknowns": None, "removed": {}}
    return {"contradiction": False, "unknowns": found.kept.size, "removed": found.removed}


def _presolve(found: Presolved | Refuted) -> str:
    if isinstance(found, Refuted):
        return "finds a row that cannot have its sign for any z within the bounds"
    n, parts = found.original.n, ", ".join(f"{number} by {rule}" for rule, number in found.removed.items())
    changed = "writes equations in another way" * found.has_new_rows
    removes = f"removes {n - found.kept.size} of {count(n, 'unknown')}: {parts}" if parts else ""
    return "; ".join(filter(None, (removes, changed)))


def _condition(found: Inspection) -> str:
    own, scaled = found.condition, found.equilibrated_condition
    if own is None or scaled is None:
        return UNKNOWN
    if math.isinf(own) and math.isinf(scaled):
        return "singular to working precision"
    texts = ["infinite" if math.isinf(value) else f"{value:.2g}" for value in (own, scaled)]
    return f"{texts[0]} in the 1-norm, {texts[1]} after equilibration"


def _eigenvalues(found: Inspection) -> str:
    if found.spectrum is None:
        return "not computed: M is not symmetric" if found.classes["symmetric"].word == "no" else UNKNOWN
    about = "about " if found.spectrum.estimated else ""
    return f"{about}{found.spectrum.smallest:.4g} to {found.spectrum.largest:.4g}"


def _contraction(rate: Rate | None, found: Inspection) -> str:
    if rate is None:
        return UNKNOWN
    if rate.factor is None:
        is_small = found.problem.n <= MOST_WITH_NORM
        return f"omega = {rate.omega:.4g}: {'omega I + M is singular, or nearly' if is_small else 'rate unknown'}"
    if rate.iterations is None:
        return f"omega = {rate.omega:.4g}: |T| = {rate.factor:.4g}, no contraction"
    factor = f"{rate.factor:.4g}" if rate.factor < CLOSE_TO_ONE else f"1 - {1 - rate.factor:.1e}"
    many = rate.iterations > MOST_ITERATIONS
    times = f"{rate.iterations:.1e} iterations" if many else count(rate.iterations, "iteration")
    most = "about" if found.spectrum and found.spectrum.estimated else "at most"
    return f"omega = {rate.omega:.4g}: |T| = {factor}, {most} {times} to {TOL.value:.0e} of the initial error"


def _record(found: Inspection) -> dict[str, Any]:
    """Return an object for JSON. All keys are always present: None for missing and infinite values."""
    problem, spectrum = found.problem, found.spectrum
    scaled = found.equilibrated_condition
    record = {
        "problem": problem.name,
        "n": problem.n,
        "bounds": dict(problem.box.kinds) or None,
        "sparse": is_sparse(problem.M),
        "nonzeros": found.nonzeros,
        "density": found.nonzeros / problem.n**2 if problem.n else None,
        "classes": {
            name: {"verdict": own.word, "evidence": own.evidence, "indices": own.indices, "vector": own.vector}
            for name, own in found.classes.items()
        },
        "spread": {f"{key}_decades": value for key, value in found.spread._asdict().items()},
        "equilibrated_spread": {f"{key}_decades": value for key, value in found.equilibrated_spread._asdict().items()},
        "condition": found.condition,
        "equilibrated_condition": scaled,
        "singular": None if scaled is None else math.isinf(scaled),
        "smallest_eigenvalue": spectrum and spectrum.smallest,
        "largest_eigenvalue": spectrum and spectrum.largest,
        "eigenvalues_estimated": spectrum and spectrum.estimated,
        **json_lines.plain(found.cost),
        "fixed_point": found.published or NO_RATE,
        "fixed_point_best": found.best or NO_RATE,
        "p": found.smoothing.p,
        "smoothing_error": found.smoothing.error,
        "methods": {name: {"guaranteed": own.word, "reason": own.reason} for name, own in found.guarantees.items()},
        "presolve": _removed(found.presolve),
        "plan": None if found.plan is None else [attempt._asdict() for attempt in found.plan],
        "obvious": found.obvious or None,
        "hints": found.hints,
    }
    return dict(json_lines.plain(record))


def render_nonlinear(
    found: NonlinearInspection, form: str = "table", width: int | None = None, color: bool = False, whole: bool = True
) -> str:
    """Return an inspection as text in a format; the rest is as for `render`."""
    if form in ("json", "csv"):
        record = _nonlinear_record(found)
        return json_lines.line(record) if form == "json" else result_csv.records_text([record])
    name = wording.title(found.problem) or "problem"
    classes = [(title(each), verdict.word, verdict.evidence) for each, verdict in found.classes.items()]
    if not whole:
        classes = [row for row in classes if row[0] in DECISIVE]
    tables = [
        Table(("", ""), [_nonlinear_facts(found)], words=(0, 1), texts=(1,)),
        Table(("class of M = J at the start", "", "because"), [classes], words=(0, 1, 2), texts=(2,)),
    ]
    section = Section(f"{name}, nonlinear: {wording.size(found.problem)}", facts=list(found.hints), tables=tables)
    return typeset(Document(section.title, [section]), form, width or PIPE_WIDTH, color)


def _nonlinear_facts(found: NonlinearInspection) -> list[tuple[str, str]]:
    n = found.problem.n
    rows = f"{count(found.equations, 'equation')}, {count(n - found.equations, 'row')} of unknowns with bounds"
    facts = [("rows", f"{rows}; {found.nonlinear_rows} of {n} nonlinear")]
    if found.operators is not None:
        operators = ", ".join(f"{name} {number}" for name, number in found.operators.items())
        facts.append(("operators", operators or "none"))
        facts.append(("common expressions", str(found.common)))
        facts.append(("fixed variables", f"{found.fixed}{', which are constants' * bool(found.fixed)}"))
    named = [name for name in found.problem.names if name]
    facts.append(("names", f"{named[0]}{f' to {named[-1]}' * (len(named) > 1)}" if named else "none"))
    density = f" ({100 * found.nonzeros / n**2:.3g} %)" if n else ""
    facts.append(("entries of J", f"{found.nonzeros} of {n**2} nonzero{density}"))
    free = f"{found.rank_of_equations} of the rows of equations, {found.rank_of_free} of the columns of free unknowns"
    facts.append(("structural rank", f"{found.rank} of {n}; {free}" if found.equations else f"{found.rank} of {n}"))
    facts.append(("at the start", f"natural residual {wording.short(found.residual) or 'undefined'}"))
    if found.condition is not None:
        infinite = math.isinf(found.condition)
        facts.append(("condition of J", "singular" if infinite else f"{found.condition:.2g} in the 1-norm"))
    if found.spread is not None:
        spread = f"row maxima span {found.spread.rows:.1f} decades, column maxima {found.spread.columns:.1f}"
        facts.append(("scaling of J", spread))
    return facts


def _nonlinear_record(found: NonlinearInspection) -> dict[str, Any]:
    """Return an object for JSON. All keys are always present: None for missing and infinite values."""
    problem, n = found.problem, found.problem.n
    record = {
        "problem": problem.name,
        "n": n,
        "names": list(problem.names) if any(problem.names) else None,
        "bounds": dict(problem.box.kinds) or None,
        "linear": False,
        "equations": found.equations,
        "nonlinear_rows": found.nonlinear_rows,
        "operators": found.operators,
        "common_expressions": found.common,
        "fixed_variables": found.fixed,
        "nonzeros": found.nonzeros,
        "density": found.nonzeros / n**2 if n else None,
        "structural_rank": found.rank,
        "structural_rank_of_equations": found.rank_of_equations,
        "structural_rank_of_free": found.rank_of_free,
        "undefined_rows": list(found.undefined),
        "residual": found.residual,
        "condition": found.condition,
        "singular": None if found.condition is None else math.isinf(found.condition),
        "spread": found.spread and {f"{key}_decades": value for key, value in found.spread._asdict().items()},
        "classes": {
            name: {"verdict": own.word, "evidence": own.evidence, "indices": own.indices, "vector": own.vector}
            for name, own in found.classes.items()
        },
        "hints": list(found.hints),
    }
    return dict(json_lines.plain(record))
