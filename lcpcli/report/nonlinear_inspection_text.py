"""An inspection of a nonlinear problem in each of the formats."""

from __future__ import annotations

import math
from typing import Any

from lcpcli.errors import count
from lcpcli.inspection.nonlinear import NonlinearInspection
from lcpcli.inspection.verdict import title
from lcpcli.report import json_lines, result_csv, wording
from lcpcli.report.document import Document, Section, Table, typeset
from lcpcli.report.wording import PIPE_WIDTH


def render(found: NonlinearInspection, form: str = "table", width: int | None = None, color: bool = False) -> str:
    """Return an inspection as text in a format. width, color : as for `formats.typeset`."""
    if form in ("json", "csv"):
        record = _record(found)
        return json_lines.line(record) if form == "json" else result_csv.records_text([record])
    name = wording.title(found.problem) or "problem"
    classes = [(title(each), verdict.word, verdict.evidence) for each, verdict in found.classes.items()]
    tables = [
        Table(("", ""), [_facts(found)], words=(0, 1), texts=(1,)),
        Table(("class of M = J at the start", "", "because"), [classes], words=(0, 1, 2), texts=(2,)),
    ]
    section = Section(f"{name}, nonlinear: {wording.size(found.problem)}", facts=list(found.hints), tables=tables)
    return typeset(Document(section.title, [section]), form, width or PIPE_WIDTH, color)


def _facts(found: NonlinearInspection) -> list[tuple[str, str]]:
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


def _record(found: NonlinearInspection) -> dict[str, Any]:
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
