"""The options of the commands that solve: declared once, and turned into what the driver takes."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import click

from lcpcli import options
from lcpcli.errors import OptionError
from lcpcli.methods import ADDITIONS, ITERATIVE, load, options_of
from lcpcli.options import AUTO, OPTIONS, flag
from lcpcli.report import FORMATS

if TYPE_CHECKING:
    from lcpcli.limits import Limits
    from lcpcli.problem import Problem
    from lcpcli.typing import Vector

STARTS = ("x0", "x1", "z0")
OF_METHODS = ("p", "k_star", "rho", "sigma", "omega", "anderson", *STARTS)
LIMITS = ("tol", "max_iterations", "time_limit")

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
        click.option(
            "--bound", is_flag=True, help="Prove how far z can be from the solution; costs more than solving."
        ),
        click.option("--format", "form", type=click.Choice(list(FORMATS)), help=_formats()),
        click.option("--trace", is_flag=True, help="Add the iterates to JSON; the other formats show them anyway."),
        numeric("every"),
        click.option(
            "--plot", metavar="FILE", help="Draw error against time and iteration: .png, .svg, .pdf, or - for here."
        ),
        click.option("-o", "--output", metavar="FILE", help="Write to a file instead, whole or not at all."),
        click.option("-q", "--quiet", is_flag=True, help="Print nothing; the exit code tells."),
    ]
    for option in reversed(declared):
        command = option(command)
    return command


def limits(given: dict[str, Any]) -> Limits:
    """The limits among the given options; a default for each that is not given."""
    from lcpcli.limits import Limits

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
