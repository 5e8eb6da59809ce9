"""Proofs as lines of text: certificates, and exact solutions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from lcpcli.linalg import matrices
from lcpcli.model.problem import Problem
from lcpcli.report import wording
from lcpcli.solving.result import Exact, Result

if TYPE_CHECKING:
    from fractions import Fraction

    from lcpcli.verify.certificate import Certificate


def certificate_line(problem: Problem, certificate: Certificate) -> str:
    """Return a line with the vector of a certificate, as far as it fits, and with the numbers that make it a proof."""
    if certificate.vector is None:
        return f"certificate: {certificate.kind}"
    cell: Callable[[Any], str] = wording.multiplier
    vector: Sequence[Any] = certificate.vector.tolist()
    if certificate.exact is not None:
        from lcpcli.rational.numbers import brief

        cell, vector = brief, certificate.exact
    if certificate.kind != "farkas":
        return f"certificate: {certificate.kind} {wording.vector(vector, cell)}"
    return f"Farkas certificate y = {wording.vector(vector, cell)}{_as_proof(problem, vector)}"


def _as_proof(problem: Problem, y: Sequence[float | Fraction]) -> str:
    """Return the numbers by which a Farkas vector y >= 0 of an LCP proves that there is no solution, from the decimals
    of M and q; no text for a long y, or for bounds."""
    if len(y) > wording.LINE_ENTRIES or problem.bounds:
        return ""
    from fractions import Fraction

    from lcpcli.rational.numbers import approximate

    columns = [*matrices.dense(problem.M).T.tolist(), problem.q.tolist()]
    *first, last = (
        sum((Fraction(str(a)) * Fraction(str(b)) for a, b in zip(column, y, strict=True)), Fraction(0))
        for column in columns
    )
    of_y = f"M'y = {wording.vector(first, approximate)} and q'y = {approximate(last)}"
    return f": {of_y}, so y'(Mz + q) < 0 for every z >= 0"


def exact_lines(exact: Exact, result: Result) -> list[str]:
    """Return lines with the exact vectors, as far as they fit, and with the proof or its absence if no message states
    it."""
    from lcpcli.rational.numbers import brief

    vectors = [(name, values) for name in "zwy" if (values := getattr(exact, name)) is not None]
    lines = [f"exact {name} = {wording.vector(values, brief)}" for name, values in vectors]
    if exact.y:
        lines[-1] += _as_proof(result.problem, exact.y)
    if not result.solved:
        return lines
    return [*lines, f"proof: {exact.proof}"] if exact.z is not None else [exact.proof]
