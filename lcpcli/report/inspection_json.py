"""An inspection as one JSON object. All keys are always present: null for missing and infinite values."""

from __future__ import annotations

import json
import math
from typing import Any

from lcpcli.inspection.difficulty import Factorization, Spread
from lcpcli.inspection.inspection import Inspection
from lcpcli.inspection.theory import Rate
from lcpcli.inspection.verdict import Verdict
from lcpcli.linalg.matrices import is_sparse
from lcpcli.report.numbers import finite


def render(inspection: Inspection) -> str:
    """One line."""
    return json.dumps(_object(inspection), allow_nan=False, ensure_ascii=False) + "\n"


def _object(found: Inspection) -> dict[str, Any]:
    problem, spectrum, cost = found.problem, found.spectrum, found.cost
    return {
        "problem": problem.name,
        "n": problem.n,
        "bounds": dict(problem.box.kinds) or None,
        "sparse": is_sparse(problem.M),
        "nonzeros": found.nonzeros,
        "density": found.nonzeros / problem.n**2,
        "classes": {name: _verdict(verdict) for name, verdict in found.classes.items()},
        "spread": _spread(found.spread),
        "equilibrated_spread": _spread(found.equilibrated_spread),
        "condition": finite(found.condition),
        "equilibrated_condition": finite(found.equilibrated_condition),
        "singular": None if found.equilibrated_condition is None else math.isinf(found.equilibrated_condition),
        "smallest_eigenvalue": finite(spectrum.smallest) if spectrum else None,
        "largest_eigenvalue": finite(spectrum.largest) if spectrum else None,
        "eigenvalues_estimated": spectrum.estimated if spectrum else None,
        "bytes": cost.bytes,
        "bandwidth": cost.bandwidth,
        "factor_entries": cost.factor_entries,
        "factor_operations": cost.factor_operations,
        "factorization": _factorization(found.factorization),
        "fixed_point": _rate(found.published),
        "fixed_point_best": _rate(found.best),
        "p": finite(found.smoothing.p),
        "smoothing_error": finite(found.smoothing.error),
        "methods": {name: {"guaranteed": g.word, "reason": g.reason} for name, g in found.guarantees.items()},
        "obvious": found.obvious or None,
        "hints": found.hints,
    }


def _verdict(verdict: Verdict) -> dict[str, Any]:
    return {
        "verdict": verdict.word,
        "evidence": verdict.evidence,
        "indices": None if verdict.indices is None else list(verdict.indices),
        "vector": None if verdict.vector is None else verdict.vector.tolist(),
    }


def _spread(spread: Spread) -> dict[str, float | None]:
    return {"rows_decades": finite(spread.rows), "columns_decades": finite(spread.columns)}


def _factorization(own: Factorization | None) -> dict[str, Any] | None:
    if own is None:
        return None
    return {
        "library": own.library,
        "nonzeros": own.nonzeros,
        "factor_nonzeros": own.factor_nonzeros,
        "ratio": own.ratio,
        "first_seconds": own.first,
        "repeated_seconds": own.repeated,
        "note": own.note or None,
    }


def _rate(rate: Rate | None) -> dict[str, Any]:
    if rate is None:
        return {"omega": None, "factor": None, "iterations": None}
    return {"omega": rate.omega, "factor": finite(rate.factor), "iterations": rate.iterations}
