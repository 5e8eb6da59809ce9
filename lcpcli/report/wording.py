"""The wording of numbers, sizes, names, advice and provenance that all formats share,
and the unknowns that a report shows. Nothing heavy is imported, as help names them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from fnmatch import fnmatchcase
from itertools import chain
from textwrap import wrap
from typing import TYPE_CHECKING, Any

from lcpcli.errors import ParameterError, likely, quoted, visible
from lcpcli.methods.registry import RESTARTS, SWITCHES
from lcpcli.version import VERSION

if TYPE_CHECKING:
    from lcpcli.model.nonlinear import NonlinearProblem
    from lcpcli.model.problem import Problem
    from lcpcli.solving.result import Options, Result


# Columns of text without a terminal, the width that terminals have by tradition.
PIPE_WIDTH = 80
# From here on numbers have an exponent: 7 decimals would make their column too wide.
LARGEST_FIXED = 1e6
# Below this, all numbers of a table have an exponent: 7 decimals would show too few
# digits.
SMALLEST_FIXED = 1e-3
ELLIPSIS = "..."
LINE_ENTRIES = 12  # entries of a vector in a line, of 7 digits each
# Errors, relative to the solution, for which a comparison reports the time.
LEVELS = (1e-3, 1e-6, 1e-9)
PROGRAM = f"lcp {VERSION}"
VECTORS = ("x1",)  # the options of methods that are vectors, too long to be repeated
UNITS = ((1.0, "s"), (1e-3, "ms"), (1e-6, "us"))


def components(values: Iterable[float], largest: float) -> list[str]:
    """Return components of z with 7 decimals, as in the paper's tables, or with 7
    significant digits if they are very large or very small. largest : the size of the
    largest component of the solution, which decides for a whole table."""
    scientific = 0 < largest < SMALLEST_FIXED or largest >= LARGEST_FIXED
    return [
        f"{v:.6e}"
        if scientific or abs(v) >= LARGEST_FIXED
        else f"{round(v, 7) + 0.0:.7f}"
        for v in values
    ]


def halves(values: Iterable[float], largest: float) -> list[str]:
    """Return components of x with the digits with which those of z = |x| + x are
    printed by `components`, and one more decimal: |x| + x and |x| - x are then z and w
    to the last printed digit. largest : as there."""
    cells = []
    for v in values:
        # The text of |2 x|, which is z or w.
        (twice,) = components([2 * abs(v)], largest)
        _, has_exponent, exponent = twice.partition("e")
        if not has_exponent:
            cells.append(f"{round(v, 8) + 0.0:.8f}")
            continue
        # z has 6 decimals before its exponent; in [5, 10) x has another exponent.
        exponent_of_x = int(f"{abs(v):.6e}".partition("e")[2])
        cells.append(f"{v + 0.0:.{7 + exponent_of_x - int(exponent)}e}")
    return cells


def plain_number(value: float) -> str:
    """Return a number with up to 7 significant digits, and 0 without a sign."""
    return f"{value + 0.0:.7g}"


def number(value: Any) -> str:
    """Return a float by `plain_number`, or a fraction if it is short."""
    if isinstance(value, float):
        return plain_number(value)
    from fractions import Fraction

    from lcpcli.rational.numbers import brief

    return brief(Fraction(value))


def headline(result: Result) -> list[str]:
    """Return the short statement of the answer of a solved result, if it has one."""
    text = getattr(result.answer, "headline", "") if result.solved else ""
    return [text] if text else []


def vector(entries: Sequence[Any], cell: Callable[[Any], str] = plain_number) -> str:
    """Return a vector in a line of text, as far as it fits."""
    texts = [cell(entry) for entry in entries[:LINE_ENTRIES]]
    if len(entries) > LINE_ENTRIES:
        texts.append(ELLIPSIS)
    return f"({', '.join(texts)})"


def named(
    values: list[Any],
    names: Sequence[str],
    cell: Callable[[Any], str] = plain_number,
    sparing: bool = False,
) -> str:
    """Return a vector, or its entries with their names if there are any. sparing :
    whether zeros are omitted."""
    if not names:
        return vector(values, cell)
    pairs = [
        (name, value)
        for name, value in zip(names, values, strict=True)
        if value or not sparing
    ]
    return vector(pairs, lambda each: f"{each[0]} {cell(each[1])}")


def folded(line: str, width: int | None) -> list[str]:
    """Return a line of words wrapped to this width, all lines but the first indented;
    None means no limit."""
    return (
        [line]
        if width is None or len(line) <= width
        else wrap(line, width, subsequent_indent="  ")
    )


def short_names(
    names: Sequence[str], max_length: float, letter: str = "z"
) -> list[str]:
    """Return the names, with a name that is too long replaced by its index, as in
    z1."""
    return [
        name if name and len(visible(name)) < max_length else f"{letter}{i}"
        for i, name in enumerate(names, 1)
    ]


def headings(problem: Problem, max_length: float) -> list[str]:
    """Return the names of the components for a table, by `short_names`; those that the
    formulation has for tables may be wider, as they are the only description."""
    from lcpcli.model.formulation import HEADINGS

    names = problem.names
    short = problem.formulation.names(problem.n, HEADINGS)
    return short_names(
        short, max_length if list(short) == list(names) else 2 * max_length
    )


def multiplier(value: float) -> str:
    """Return an entry of a proof as text: an integer with all digits, any other number
    rounded and marked by ~."""
    text = f"{value:.0f}" if float(value).is_integer() else f"{value:.7g}"
    return text if float(text) == value else f"~{text}"


def size(problem: Problem | NonlinearProblem) -> str:
    """Return the number of unknowns as text, for a mixed problem with the numbers of
    unknowns by their bounds."""
    kinds = problem.box.kinds
    if not kinds:
        return f"n = {problem.n}"
    counts = []
    for kind, k in kinds.items():
        # "free", "boxed" and "fixed" are adjectives.
        is_plural = k > 1 and kind.endswith("bound")
        counts.append(f"{k} {kind}s" if is_plural else f"{k} {kind}")
    return f"n = {problem.n} ({', '.join(counts)})"


def short(value: float | None, rounding: float = 0.0) -> str:
    """Return two significant digits of a residual or an error; 0 if it is only
    rounding, "" if there is none."""
    if value is None:
        return ""
    return "0" if value <= rounding else f"{value:.1e}"


def residual(result: Result) -> str:
    """Return the natural residual of a result, 0 if it is no more than the rounding of
    the terms of each row."""
    from lcpcli.linalg.doubles import ROW_ROUNDING

    return short(
        result.residual, math.inf if result.relative_residual <= ROW_ROUNDING else 0.0
    )


def error(value: float | None, problem: Problem) -> str:
    """Return an error as text, 0 if it is no more than the rounding of the solution."""
    from lcpcli.linalg.doubles import ROW_ROUNDING

    return short(value, ROW_ROUNDING * problem.size_of_solutions)


def above(value: float) -> str:
    """Return two significant digits of a bound, rounded up, so that the printed value
    is a bound too."""
    from decimal import ROUND_CEILING, Context

    rounded = Context(prec=2, rounding=ROUND_CEILING).create_decimal_from_float(value)
    return short(float(rounded))


def unit(seconds: float) -> tuple[float, str]:
    """Return the largest unit not exceeding a time rounded to three digits: (its length
    in seconds, its name)."""
    return next((u for u in UNITS if seconds >= 0.9995 * u[0]), UNITS[-1])


def common_unit(times: Iterable[float]) -> tuple[float, str]:
    """Return the unit of a column of times: (its length in seconds, its name);
    milliseconds unless all are longer than a second or all are shorter than a
    millisecond."""
    kinds = {unit(seconds) for seconds in times}
    return kinds.pop() if len(kinds) == 1 else UNITS[1]


def title(problem: Problem | NonlinearProblem) -> str:
    """Return the name of a problem as people see it, in one line."""
    return visible(problem.name).strip()


def title_and_size(problem: Problem | NonlinearProblem) -> str:
    return ", ".join(filter(None, (title(problem), size(problem))))


def all_visible(part: Any) -> Any:
    """Return a part of a report as people see it: a text, or the texts within lists and
    named tuples."""
    if isinstance(part, str):
        return visible(part)
    if not isinstance(part, (list, tuple)):
        return part
    seen = map(all_visible, part)
    return type(part)(*seen) if hasattr(part, "_fields") else list(seen)


def level(value: float) -> str:
    return f"{value:.0e}".replace("e-0", "e-")


def digits(value: float, number: int = 3) -> str:
    """Return some significant digits, without an exponent in large numbers."""
    return f"{value:.{number}g}" if value < 10**number - 0.5 else f"{value:.0f}"


def duration(seconds: float) -> str:
    """Return a time as text, with its unit and three significant digits."""
    length, name = unit(seconds)
    return f"{digits(seconds / length)} {name}"


def took(seconds: float, format_name: str) -> str:
    """Return a time for the line on what made a report, in any format but LaTeX, whose
    captions are printed."""
    return "" if format_name == "latex" else f", {duration(seconds)}"


def name(result: Result) -> str:
    return result.label or result.method


def flag(name: str) -> str:
    """Return an option's name, as in Python, as the command line has it."""
    return "-n" if name == "n" else "--" + name.replace("_", "-")


def advice(result: Result, files: Sequence[str] = ()) -> str:
    """Return the advice of a result, in options of the command line; "" if there is
    none. files : the files of the problem, if another command can read them."""

    def written(options: Options) -> str:
        from lcpcli.solving.advice import EXACT, WHY, value_text

        if options == EXACT:
            return "lcp solve --exact"
        if options == WHY:
            from shlex import join

            return f"lcp why {join(files) or 'FILE'}"
        if RESTARTS.name in options:
            value = value_text(options[RESTARTS.name], False)
            return f"--method {result.method}:{RESTARTS.name}={value}"
        texts = (
            (name, "" if value is True else f" {value_text(value, False)}")
            for name, value in options.items()
        )
        return " ".join(f"{flag(name)}{text}" for name, text in texts)

    return "" if result.solved else result.suggestions.line(written)


def made_by(results: Sequence[Result]) -> str:
    """Return, in one line, the version, the limits, which are the same, and the options
    that all runs of a method share; the names of runs have the others."""
    parts = [f"{PROGRAM}, {_limits(results[0])}"]
    for method in dict.fromkeys(result.method for result in results):
        runs = [
            options_of(each, shows_all_digits=False)
            for each in results
            if each.method == method
        ]
        names = dict.fromkeys(chain.from_iterable(runs))
        values = {name: {run.get(name) for run in runs} for name in names}
        shared = [
            f"{name}={next(iter(each))}{_note(name, results)}"
            for name, each in values.items()
            if len(each) == 1
        ]
        parts += [f"{method}: {', '.join(shared)}"] * bool(shared)
    return "; ".join(parts)


def provenance(results: Sequence[Result]) -> list[str]:
    """Return lines for a file: the program, then for each result the problem, methods,
    options in force and status."""
    lines = [f"{PROGRAM}, {_limits(results[0])}"]
    for result in results:
        by = f" by {', '.join(result.route)}" * (result.route != (result.method,))
        options = "".join(
            f", {name}={value}{_note(name, [result])}"
            for name, value in options_of(result, shows_all_digits=True).items()
        )
        problem = f"{title(result.problem) or 'problem'}, {size(result.problem)}"
        lines.append(
            f"{problem}: {name(result)}{by}{options}: "
            f"{' '.join(visible(result.message).split())}"
        )
    return lines


def _limits(result: Result) -> str:
    limits = result.limits
    seconds = (
        f", time limit {limits.time_limit:.15g} s"
        if limits.time_limit < math.inf
        else ""
    )
    return f"tol {limits.tol:.15g}, at most {limits.max_iterations} iterations{seconds}"


def options_of(result: Result, shows_all_digits: bool) -> dict[str, str]:
    """Return the options in force as texts, by their names on the command line, without
    additions that are off and switches that are on, as they are by default.
    shows_all_digits : whether long numbers, as a computed p, have more than three
    digits."""
    shown = (
        (name, value) for name, value in result.options.items() if name not in VECTORS
    )
    return {
        name.replace("_", "-"): _text(value, shows_all_digits)
        for name, value in shown
        if value is not (name in SWITCHES)
    }


def _note(name: str, results: Sequence[Result]) -> str:
    """Return what to know about the value of an option in runs: whether p is so large
    that |x| is smoothed by less than the rounding of z or w, as by the default p.

    By default (ln 3 / p) (1 + |M|) = eps |q|, and q = w - M z, so that ln 3 / p <= eps
    max(|z|, |w|) at a solution.
    """
    with_p = [result for result in results if name == "p" and "p" in result.options]
    if not with_p or any(_smooths(result) for result in with_p):
        return ""
    return " (no smoothing in double precision)"


def _smooths(result: Result) -> bool:
    from lcpcli.linalg.doubles import EPS

    largest = max(abs(result.z).max(initial=0.0), abs(result.w).max(initial=0.0))
    return bool(math.log(3) / result.options["p"] > EPS * largest)


def _text(value: Any, shows_all_digits: bool) -> str:
    if not isinstance(value, float):
        return str(value).lower()
    short = f"{value:g}"
    if float(short) == value:
        return short
    return repr(float(value)) if shows_all_digits else f"{value:.3g}"


def selected_components(names: Sequence[str], patterns: Sequence[str]) -> list[int]:
    """Return the indices of the unknowns that `--show` chooses, in the order of the
    patterns; all without patterns.

    names : those of the unknowns, "" for none. patterns : each is a name, in which *
    matches any text and ? a character, or z1, z2, ... for an index. Raises
    ParameterError for a pattern that no unknown matches.
    """
    if not patterns:
        return list(range(len(names)))
    selected: dict[int, None] = {}
    # Names as narrow tables have them, and those of rows.
    short = [name.replace("column ", "col ", 1).removeprefix("y ") for name in names]
    for pattern in patterns:
        escaped = pattern.replace("[", "[[]")  # brackets are literal, as in x[1]
        matches = [
            i
            for i, each in enumerate(names)
            if each and (fnmatchcase(each, escaped) or fnmatchcase(short[i], escaped))
        ]
        matches = matches or [
            i for i in range(len(names)) if fnmatchcase(f"z{i + 1}", escaped)
        ]
        if not matches:
            numbers = "write z1"
            if len(names) > 1:
                numbers += f" to z{len(names)}"
            named = (
                "; a file has names in its header, or under the key names"
                if not any(names)
                else ""
            )
            hint = likely(
                pattern, list(filter(None, names)), f"{numbers}, or a name{named}"
            )
            raise ParameterError(
                "show", f"{quoted(pattern)} is not the name of an unknown", hint
            )
        selected |= dict.fromkeys(matches)
    return list(selected)


def require(problem: Problem | NonlinearProblem, patterns: Sequence[str]) -> None:
    """Raise ParameterError, before any work, for a pattern that no unknown of the
    problem matches."""
    selected_components(labels_of(problem), patterns)


def labels_of(problem: Problem | NonlinearProblem) -> Sequence[str]:
    """Return the names by which the unknowns of a problem are chosen: of a game, those
    of the strategies; those of a program's multipliers begin with y."""
    from lcpcli.model.formulation import LABELS

    return problem.formulation.names(problem.n, LABELS)
