"""Methods run on problems: timed, with references for errors, proved if requested, as far as Ctrl-C lets them."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from lcpcli.cli.output import Output, Plot
from lcpcli.cli.progress import Line
from lcpcli.cli.repetition import timed
from lcpcli.interrupts import TimeIsUp, within

if TYPE_CHECKING:
    from lcpcli.methods.variants import Variant
    from lcpcli.model.problem import Problem
    from lcpcli.options import Limits
    from lcpcli.rational.problem import ExactProblem
    from lcpcli.solving.result import Result
    from lcpcli.typing import Vector


def each(
    problems: Sequence[Problem],
    variants: Sequence[Variant],
    chosen: Sequence[Sequence[dict[str, Any]]],
    bounds: Limits,
    warm: float | None,
    shown: tuple[Output, Plot, int | None],
    watched: bool,
) -> Iterator[tuple[int, Result]]:
    """One result per problem and variant, each with the number of its problem; with `warm`, a second one started near
    the solution."""
    from lcpcli.methods.registry import METHODS
    from lcpcli.methods.variants import labels
    from lcpcli.solving import driver as driver

    output, plot, width = shown
    compared = plot.path is not None or (output.compared and not output.silent)

    def run_once(problem: Problem, variant: Variant, label: str, values: dict[str, Any]) -> Result:
        trace, curve = output.trace(problem, width), plot.curve(problem)
        with Line() as line:
            observe = line.tell if watched else None
            result = driver.run(
                problem,
                variant.method,
                limits=bounds,
                trace=trace,
                curve=curve,
                observe=observe,
                conclude=False,
                **values,
            )
            return replace(result, label=label)

    for i, (problem, own) in enumerate(zip(problems, chosen, strict=True)):
        near = None if warm is None else _near(problem, warm)
        for variant, label, values in zip(variants, labels(variants), own, strict=True):
            for result in timed(partial(run_once, problem, variant, label, values), compared):
                yield i, result
            if near is not None and METHODS[variant.method].uses_start:
                again = {**values, "x0": near, "z0": None, "basis": None}
                for result in timed(partial(run_once, problem, variant, label, again), compared):
                    yield i, replace(result, warm=True)


def finished(
    runs: Iterator[tuple[int, Result]], proofs: Sequence[Callable[[], ExactProblem]], bounds: Limits, with_bound: bool
) -> tuple[list[list[Result]], bool]:
    """The results by problem with the proofs requested, those before Ctrl-C if it came, and whether it came."""
    results: dict[int, list[Result]] = {}
    try:
        for i, result in runs:
            results.setdefault(i, []).append(result)
            if result.interrupted:
                return list(results.values()), True
        for i, own in results.items():
            if proofs:
                own[:] = _proved(proofs[i], own, bounds)
        for own in results.values():
            for k, result in enumerate(own if with_bound else []):
                own[k] = result if result.interrupted else bounded(result)
    except KeyboardInterrupt:
        if not results:
            raise
        return list(results.values()), True
    return list(results.values()), any(result.interrupted for own in results.values() for result in own)


def _proved(data: Callable[[], ExactProblem], results: Sequence[Result], bounds: Limits) -> list[Result]:
    """Each result with what is proved about it in the time that the run has left."""
    from lcpcli.solving.proof import prove

    return [prove(data, result, bounds.time_limit - result.seconds) for result in results]


def _near(problem: Problem, size: float) -> Vector:
    from lcpcli.solving import reference

    return reference.near(problem, size)


def bounded(result: Result) -> Result:
    """The result with what is proved about its error in the time that the run has left."""
    from lcpcli.verify.error_bound import LATE, NO_BOUND, error_bound

    try:
        with within(result.limits.time_limit - result.seconds):
            bound = error_bound(result.problem, result.z) or NO_BOUND
    except TimeIsUp:
        bound = LATE
    return replace(result, bound=bound)


def all_referred(problems: Sequence[Problem], bounds: Limits) -> list[Problem]:
    """The problems with reference solutions. Ctrl-C is reported, as there is no iterate yet to report."""
    try:
        return [_referred(problem, bounds) for problem in problems]
    except KeyboardInterrupt:
        if sys.stderr is not None:
            click.echo("lcp: interrupted while solving for the reference of the errors, before the first run", err=True)
        raise


def _referred(problem: Problem, bounds: Limits) -> Problem:
    """The problem with a reference solution for errors, if one is found within the time limit of a run."""
    from lcpcli.solving import reference

    return reference.with_reference(problem, min(bounds.time_limit, reference.SECONDS))
