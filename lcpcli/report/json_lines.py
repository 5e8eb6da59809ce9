"""Results as JSON, one object per line. All keys are always present: null for missing and infinite values."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from lcpcli.report import advice, answers, provenance, summary
from lcpcli.report.numbers import finite
from lcpcli.solving.result import Result


def render(results: Sequence[Result]) -> str:
    """One line per result."""
    return "".join(json.dumps(data(result), allow_nan=False, ensure_ascii=False) + "\n" for result in results)


def data(result: Result) -> dict[str, Any]:
    """A result as the object of its line."""
    made_by = provenance.data(result)
    return {
        "version": made_by["version"],
        "problem": result.problem.name,
        "n": result.problem.n,
        "method": result.method,
        "label": summary.name(result),
        "route": list(result.route),
        "status": result.status.word,
        "message": result.message,
        "advice": advice.line(result) or None,
        "solved": result.solved,
        "verified": result.verified,
        "z": _numbers(result.z.tolist()),
        "w": _numbers(result.w.tolist()),
        "basis": result.basis if result.problem.is_mixed else None,
        "iterations": result.iterations,
        "evaluations": result.evaluations,
        "residual": finite(result.residual),
        "relative_residual": finite(result.relative_residual),
        "error": finite(result.error),
        "error_bound": finite(result.bound.value) if result.bound else None,
        "error_bound_source": result.bound.source if result.bound and result.bound.proved else None,
        "reference": result.problem.reference if result.problem.solutions else None,
        "milestones": _milestones(result),
        "warm": result.warm,
        "setup_seconds": result.setup_seconds,
        "solve_seconds": result.solve_seconds,
        "verify_seconds": result.verify_seconds,
        "seconds": result.seconds,
        "certificate": _certificate(result),
        "exact": _exact(result),
        "answer": answers.data(result),
        "tol": made_by["tol"],
        "max_iterations": made_by["max_iterations"],
        "time_limit": made_by["time_limit"],
        "options": made_by["options"],
        "trace": _trace(result),
    }


def _milestones(result: Result) -> list[dict[str, Any]] | None:
    if result.curve is None or not result.curve.levels:
        return None
    return [{"level": m.level, "k": m.k, "seconds": m.seconds} for m in result.curve.milestones]


def _trace(result: Result) -> list[dict[str, Any]] | None:
    if result.trace is None:
        return None
    return [
        {
            "k": row.k,
            "z": _numbers(row.z.tolist()),
            "residual": finite(row.residual),
            "error": finite(row.error),
            "seconds": row.seconds,
            "step": row.step or None,
            "method": row.method,
        }
        for row in result.trace.rows
    ]


def _certificate(result: Result) -> dict[str, Any] | None:
    proof = result.certificate
    if proof is None:
        return None
    vector = None if proof.vector is None else _numbers(proof.vector.tolist())
    return {"kind": proof.kind, "statement": proof.statement, "vector": vector}


def _exact(result: Result) -> dict[str, Any] | None:
    exact = result.exact
    if exact is None:
        return None
    from lcpcli.rational.numbers import text

    named = {"z": exact.z, "w": exact.w, "y": exact.y}
    vectors = {name: None if values is None else [text(value) for value in values] for name, values in named.items()}
    return {"status": exact.status.word if exact.status else None, **vectors, "proof": exact.proof}


def _numbers(values: list[float]) -> list[float | None]:
    return [finite(value) for value in values]
