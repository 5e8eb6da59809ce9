"""What made a result: the program's version, the problem, the tolerance, the limits and the options in force.

Every format takes it from here, so that a table, a file or a figure that is found later can be made again.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from lcpcli import __version__
from lcpcli.report import numbers, summary
from lcpcli.solving.result import Result

PROGRAM = f"lcp {__version__}"
VECTORS = ("x1",)  # among a method's options: starting points, which are too long to be repeated


def data(result: Result) -> dict[str, Any]:
    """As keys of JSON: null for no limit."""
    limits = result.limits
    return {
        "version": __version__,
        "tol": limits.tol,
        "max_iterations": limits.max_iterations,
        "time_limit": numbers.finite(limits.time_limit),
        "options": {name: _json(value) for name, value in result.options.items() if name not in VECTORS},
    }


def line(results: Sequence[Result]) -> str:
    """In one line, for results with the same limits: the version, the limits, and the options of each method.

    Options in which runs of one method differ are left out where the names of the runs have them.
    """
    parts = [f"{PROGRAM}, {_limits(results[0])}"]
    for method in dict.fromkeys(result.method for result in results):
        own = [result for result in results if result.method == method]
        runs = [_options(result, whole=False) for result in own]
        shared = {name: value for name, value in runs[0].items() if all(run.get(name) == value for run in runs)}
        parts += _written(method, shared)
        for result, run in zip(own, runs, strict=True):
            if ":" not in result.label:
                parts += _written(f"default {method}", {name: run[name] for name in run if name not in shared})
    return "; ".join(dict.fromkeys(parts))


def _written(name: str, options: Mapping[str, str]) -> list[str]:
    told = ", ".join(f"{option}={value}" for option, value in options.items())
    return [f"{name}: {told}"] if told else []


def lines(results: Sequence[Result]) -> list[str]:
    """For a file: the program, then for each result its problem, methods, options in force and how it ended."""
    told = [f"{PROGRAM}, {_limits(results[0])}"]
    for result in results:
        by = f" by {', '.join(result.route)}" * (result.route != (result.method,))
        options = "".join(f", {name}={value}" for name, value in _options(result, whole=True).items())
        problem = f"{numbers.title(result.problem) or 'problem'}, {numbers.size(result.problem)}"
        told.append(f"{problem}: {summary.name(result)}{by}{options}: {' '.join(result.message.split())}")
    return told


def _limits(result: Result) -> str:
    limits = result.limits
    seconds = f", time limit {limits.time_limit:.15g} s" if limits.time_limit < math.inf else ""
    return f"tol {limits.tol:.15g}, at most {limits.max_iterations} iterations{seconds}"


def _options(result: Result, whole: bool) -> dict[str, str]:
    """The options in force as texts, by their names on the command line, without those that are off.

    whole : give long numbers, such as a computed p, with all digits instead of three.
    """
    options = {name: value for name, value in result.options.items() if name not in (*VECTORS, "time_limit")}
    return {name.replace("_", "-"): _text(value, whole) for name, value in options.items() if value is not False}


def _text(value: Any, whole: bool) -> str:
    if isinstance(value, (bool, str)):
        return str(value).lower()
    if not isinstance(value, float):
        return str(value)
    short = f"{value:g}"
    if float(short) == value:
        return short
    return repr(float(value)) if whole else f"{value:.3g}"


def _json(value: Any) -> Any:
    return value if isinstance(value, (bool, str)) else numbers.finite(value)
