"""Results as JSON, one object per line. All keys are always present: null for missing and infinite values."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any, TypedDict, cast

from lcpcli import __version__
from lcpcli.files.contents import NOWHERE, Source
from lcpcli.model.problem import Problem
from lcpcli.report import advice, answers, provenance, summary
from lcpcli.report.numbers import finite
from lcpcli.solving.result import Result


class ResultDict(TypedDict):
    """The keys of a result; `lcp help json` has their meanings."""

    version: str
    file: str | None
    item: int | None
    problem: str | None
    n: int | None
    names: list[str] | None
    method: str | None
    label: str | None
    route: list[str] | None
    status: str
    message: str
    advice: str | None
    solved: bool
    verified: bool | None
    z: list[float | None] | None
    w: list[float | None] | None
    basis: list[str] | None
    iterations: int | None
    evaluations: int | None
    residual: float | None
    relative_residual: float | None
    digits: list[int] | None
    error: float | None
    error_bound: float | None
    error_bound_source: str | None
    reference: str | None
    milestones: list[dict[str, Any]] | None
    warm: bool | None
    setup_seconds: float | None
    solve_seconds: float | None
    verify_seconds: float | None
    seconds: float | None
    spread: float | None
    certificate: dict[str, Any] | None
    exact: dict[str, Any] | None
    answer: dict[str, Any] | None
    others: bool | None
    exactly_solvable: bool | None
    tol: float | None
    max_iterations: int | None
    time_limit: float | None
    options: dict[str, Any] | None
    trace: list[dict[str, Any]] | None


def render(results: Sequence[Result], source: Source) -> str:
    """One line per result on the problem that was read there."""
    return "".join(line(data(result, source)) for result in results)


def line(record: ResultDict, source: Source = NOWHERE) -> str:
    """The object in a line, with the mark of its problem in a log."""
    return json.dumps({**record, **(source.mark or {})}, allow_nan=False, ensure_ascii=False) + "\n"


def without_result(source: Source, status: str, message: str) -> ResultDict:
    """What is said of a problem that could not be read, or whose result was lost."""
    held: Any = dict.fromkeys(ResultDict.__annotations__)
    held |= {"version": __version__, "file": source.file, "item": source.item}
    held |= {"status": status, "message": message, "solved": False}
    return cast(ResultDict, held)


def data(result: Result, source: Source = NOWHERE) -> ResultDict:
    """A result as the object of its line."""
    made_by = provenance.data(result)
    return {
        "version": made_by["version"],
        "file": source.file,
        "item": source.item,
        "problem": result.problem.name,
        "n": result.problem.n,
        "names": names(result.problem),
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
        "digits": result.digits,
        "error_bound": finite(result.bound.value) if result.bound else None,
        "error_bound_source": result.bound.source if result.bound and result.bound.proved else None,
        "reference": result.problem.reference if result.problem.solutions else None,
        "milestones": _milestones(result),
        "warm": result.warm,
        "setup_seconds": result.setup_seconds,
        "solve_seconds": result.solve_seconds,
        "verify_seconds": result.verify_seconds,
        "seconds": result.seconds,
        "spread": finite(result.spread),
        "certificate": _certificate(result),
        "exact": _exact(result),
        "answer": answers.data(result),
        "others": result.others,
        "exactly_solvable": result.exactly_solvable,
        "tol": made_by["tol"],
        "max_iterations": made_by["max_iterations"],
        "time_limit": made_by["time_limit"],
        "options": made_by["options"],
        "trace": _trace(result),
    }


def names(problem: Problem) -> list[str] | None:
    """The names of the components of z; None if they have none."""
    return list(problem.names) if any(problem.names) else None


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
