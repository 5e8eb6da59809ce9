"""The options of the commands that solve: declared once, and turned into what the driver takes."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from lcpcli import options
from lcpcli.errors import OptionError
from lcpcli.methods import ADDITIONS, ITERATIVE, load, options_of
from lcpcli.options import AUTO, OPTIONS, flag
from lcpcli.report import FORMATS, SUFFIXES, TABLES

if TYPE_CHECKING:
    from lcpcli.driver import Limits
    from lcpcli.problem import Problem
    from lcpcli.result import Trace
    from lcpcli.typing import Vector

STARTS = ("x0", "x1", "z0")
OF_METHODS = ("p", "k_star", "rho", "sigma", "omega", "anderson", *STARTS)
LIMITS = ("tol", "max_iterations", "time_limit")
MOST_ROWS = 60  # of one method in a table, unless --every asks for more

Command = TypeVar("Command", bound=Callable[..., Any])


def solving(command: Command) -> Command:
    """Declare the options of the methods, the limits and the output on a command; it gets them as keywords."""
    declared = [
        *(numeric(name) for name in OF_METHODS if name not in STARTS),
        click.option(
            "--x0",
            metavar="NUMBERS|FILE",
            help="Start x = (z - w) / 2, comma-separated, in a file or of a result in JSON.  "
            "[default: the problem's, else 0]",
        ),
        click.option(
            "--x1", metavar="NUMBERS|FILE", help="Second point of shi.  [default: the problem's, else a descent step]"
        ),
        click.option("--z0", metavar="NUMBERS|FILE", help="Start given as z instead, with w = Mz + q."),
        click.option(
            "--scale/--no-scale", default=None, help="Let shi or fixed-point work on the equilibrated problem."
        ),
        click.option("--finish/--no-finish", default=None, help="Let shi or fixed-point end on their active set."),
        *(numeric(name) for name in LIMITS),
        click.option("--format", "form", type=click.Choice(list(FORMATS)), help=_formats()),
        click.option("--trace", is_flag=True, help="Add the iterates to JSON; the other formats show them anyway."),
        numeric("every"),
        click.option("-o", "--output", metavar="FILE", help="Write to a file instead, whole or not at all."),
        click.option("-q", "--quiet", is_flag=True, help="Print nothing; the exit code tells."),
    ]
    for option in reversed(declared):
        command = option(command)
    return command


def limits(given: dict[str, Any]) -> Limits:
    """The limits among the given options; a default for each that is not given."""
    from lcpcli.driver import Limits

    return Limits(**{name: given[name] for name in LIMITS if given[name] is not None})


def for_methods(given: dict[str, Any], names: Sequence[str], problem: Problem) -> list[dict[str, Any]]:
    """For each method, those of the given options that it has; an option that none of them has is an OptionError."""
    chosen = {name: given[name] for name in OF_METHODS if given[name] is not None}
    for name in STARTS:
        if name in chosen:
            chosen[name] = _vector(name, chosen[name], problem.n)
    if "x0" in chosen and "z0" in chosen:
        raise OptionError("--z0", "gives the start, and so does --x0", "leave one out")
    chosen |= {name: True for name in ADDITIONS if given[name]}
    known = [{"x0", "z0", *options_of(load(name)), *(ADDITIONS if name in ITERATIVE else ())} for name in names]
    for name in chosen:
        if not any(name in own for own in known):
            raise OptionError(flag(name), f"has no effect with {' and '.join(names)}", "leave it out")
    options.check(**{name: value for name, value in chosen.items() if name in OPTIONS})
    return [{name: value for name, value in chosen.items() if name in own} for own in known]


class Output:
    """What is to be shown, in which format and where, found consistent before any work is done."""

    def __init__(self, form: str | None, trace: bool, every: int | None, output: str | None, quiet: bool) -> None:
        output = None if output == "-" else output
        self.form = form or form_of(output)
        self.path, self.silent = output, quiet and output is None
        if trace and self.silent:
            raise OptionError("--trace", "has no effect with --quiet", "leave it out")
        if trace and self.form != "json":
            raise OptionError(
                "--trace", f"has no effect on the format {self.form}, which shows the iterates", "leave it out"
            )
        if every is not None and (self.silent or (self.form == "json" and not trace)):
            raise OptionError("--every", "has no effect where no iterates are shown", "add --trace or leave it out")
        options.check(every=every)
        if output is not None:
            from lcpcli.files import refuse_unwritable

            refuse_unwritable(output)
        self._iterates = not self.silent and (trace or self.form != "json")
        self._every = every

    def trace(self, problem: Problem, width: int | None) -> Trace | None:
        """An empty trace for a run whose iterates will be shown in that width, to keep only what will be read."""
        if not self._iterates:
            return None
        from lcpcli.result import Trace

        if self.form not in TABLES:
            return Trace(self._every or 1)
        from lcpcli.report.iterations import shown_components

        components = shown_components(problem.n, width if self.form == "table" else None)
        every, most = (self._every, None) if self._every else (int(OPTIONS["every"].default or 1), MOST_ROWS)
        return Trace(every, most, components, residuals=not problem.solutions)


def form_of(output: str | None) -> str:
    """The format that an output file's ending asks for; without an ending, the table."""
    ending = Path(output or "").suffix.lower()
    if ending not in SUFFIXES:
        endings = ", ".join(known for known in SUFFIXES if known)
        raise OptionError(str(output), f"the ending {ending} is no format", f"use {endings} or give --format")
    return SUFFIXES[ending]


class _NumberOrAuto(click.ParamType):  # type: ignore[type-arg,unused-ignore]
    """A number, or the word that stands for one derived from the problem."""

    name = "number|auto"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float | str:
        return AUTO if value == AUTO else float(click.FLOAT.convert(value, param, ctx))


def numeric(name: str) -> Callable[[Command], Command]:
    """The declaration of one of `lcpcli.options.OPTIONS`; None where it is not given."""
    option = OPTIONS[name]
    number = click.INT if option.kind is int else click.FLOAT
    kind = _NumberOrAuto() if option.auto else number
    default = f"; default {option.default:g}" if option.default is not None and option.default < math.inf else ""
    return click.option(flag(name), name, type=kind, help=f"{option.meaning}  [{option.range}{default}]")


def _formats() -> str:
    forms = ", ".join(f"{name} ({meaning})" for name, meaning in FORMATS.items())
    return f"{forms}.  [default: by the ending of -o, else table]"


def _vector(name: str, given: str, n: int) -> Vector:
    from lcpcli.files import read_start
    from lcpcli.problem import as_vector

    if given and os.path.exists(given):  # noqa: PTH110 (Path.exists raises an error for a long text)
        return read_start(flag(name), given, n, as_x=name != "z0")
    try:
        if "_" in given:
            raise ValueError
        numbers = [float(number) for number in given.split(",")]
    except ValueError:
        fault = f"{given!r} is neither a file nor numbers"
        raise OptionError(flag(name), fault, "write 1,-2,0.5 or name a file") from None
    return as_vector(flag(name), numbers, n)
