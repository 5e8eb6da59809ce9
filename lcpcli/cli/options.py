"""The options of the commands that solve: declared once, and converted to the arguments of the driver."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeVar, cast

import click

from lcpcli import options
from lcpcli.cli import candidates
from lcpcli.cli.command import SWEEP, Choice, argument, option
from lcpcli.cli.output import ITERATES
from lcpcli.errors import OptionError
from lcpcli.files.formats import FORMATS as suffixes
from lcpcli.methods import variants
from lcpcli.methods.registry import ADDITIONS, METHODS, OPTIONS, meanings, parameters_of
from lcpcli.methods.variants import Variant
from lcpcli.options import AUTO, EVERY, LIMITS, THREADS, Option, flag
from lcpcli.report.formats import FORMATS

if TYPE_CHECKING:
    from lcpcli.model.problem import Problem
    from lcpcli.solving.limits import Limits
    from lcpcli.typing import Vector

STARTS = {
    "x0": "Starting point x = (z - w) / 2: numbers, a file or a result.  [default: the problem's, else 0]",
    **{name: meaning for method in METHODS.values() for name, meaning in method.vectors.items()},
    "z0": "Starting point given as z, with w = Mz + q.  [default: see --x0]",
}

EXITS = {
    0: "solved",
    1: "not solved",
    2: "usage or input error (one-line message)",
    3: "proved to have no solution",
    130: "interrupted; the best iterate is reported",
}

Command = TypeVar("Command", bound=Callable[..., Any])
Declaration = Callable[[Any], Any]


def solving(command: Command) -> Command:
    """Declare the options of the methods, the limits and the output on a command; it gets them as keywords."""
    declarations = [
        *(numeric(f"Method {name}", declared) for name, method in METHODS.items() for declared in method.options),
        *_additions(),
        *_starts(),
        *(numeric("Stopping", limit) for limit in LIMITS),
        numeric("Computing", THREADS),
        option(
            "Proof",
            "--bound",
            is_flag=True,
            help="Prove a bound on the error of z; more expensive than solving.",
        ),
        format_option(FORMATS),
        option(
            "Output",
            "--trace",
            metavar="[FILE]",
            is_flag=False,
            flag_value=ITERATES,
            shell_complete=candidates.files(".csv"),
            help="Write the iterates to this .csv file; without a file, add them to JSON, or make CSV of them."
            "  [default: none]",
        ),
        numeric("Output", EVERY),
        option(
            "Output",
            "--plot",
            metavar="FILE",
            shell_complete=candidates.files(),
            help="Draw error against time and iteration: .png, .svg, .pdf, or - for the terminal.",
        ),
        output_file(),
        option("Output", "-q", "--quiet", is_flag=True, help="Print nothing; the exit code reports the outcome."),
    ]
    for declare in reversed(declarations):
        command = declare(command)
    return command


def problem_file(command: Command) -> Command:
    """Declare the problem of a command that takes one: its file, and that of q if it is separate."""
    complete = candidates.files(*candidates.PROBLEMS)
    file = {
        "FILE": "M and q as .json, .npz, .mat, or .csv with the columns [M | q]; or M alone, also as .mtx or .npy. - "
        "is standard input."
    }
    q_file = {"Q_FILE": "q, if FILE contains M alone; the formats may differ."}
    command = argument("Problem", "q_file", q_file, required=False, shell_complete=complete)(command)
    return argument("Problem", "file", file, shell_complete=complete)(command)


def format_option(formats: Mapping[str, str], default: str | None = None) -> Declaration:
    """The declaration of --format, one of these; without a default, None leaves it to the suffix of -o."""
    told = ", ".join(f"{name} ({meaning})" for name, meaning in formats.items())
    return option(
        "Output",
        "--format",
        "form",
        metavar="FORMAT",
        type=Choice(formats),
        default=default,
        help=f"{told}.  [default: {default or 'by the suffix of -o, else table'}]",
    )


class MethodChoice(Choice):
    """A method, with or without options of its own, as in shi:p=10."""

    name = "method"

    def __init__(self) -> None:
        super().__init__(meanings())

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Variant:
        if isinstance(value, Variant):
            return value
        super().convert(value.partition(":")[0], param, ctx)
        return variants.parse(value)


def several_methods(heading: str, purpose: str, default: Sequence[str]) -> Declaration:
    """The declaration of a repeatable --method, for a purpose, and of --sweep; see `chosen_variants`."""
    methods = option(
        heading,
        "--method",
        "methods",
        metavar="NAME[:OPTION=VALUE,...]",
        multiple=True,
        type=MethodChoice(),
        help=f"A method to {purpose}, from the list below, with options of its own as in shi:p=10,k-star=5; repeatable."
        f"  [default: {', '.join(default)}]",
    )
    sweep = option(
        heading,
        SWEEP,
        metavar="OPTION=VALUE,...",
        multiple=True,
        help="Run the methods that have this option once for each value, as in p=1,10,100; several make a grid."
        "  [default: none]",
    )
    return lambda command: methods(sweep(command))


def chosen_variants(given: dict[str, Any], default: Sequence[str]) -> list[Variant]:
    """The methods among the given options, or those by default, with the values of --sweep; what a sweep sets may not
    be given beside it."""
    asked = given["methods"] or [Variant(name) for name in default]
    for axis in given["sweep"]:
        name = axis.partition("=")[0].strip().replace("-", "_")
        if given.get(name) is not None:
            raise OptionError(SWEEP, f"{flag(name)} is given beside it", "leave one out")
    return variants.sweep(list(dict.fromkeys(asked)), given["sweep"])


def output_file(
    meaning: str = "Write to a file instead, completely or not at all.  [default: standard output]",
) -> Declaration:
    """The declaration of -o."""
    return option(
        "Output",
        "-o",
        "--output",
        metavar="FILE",
        shell_complete=candidates.files(),
        help=meaning,
    )


def problem_output(command: Command) -> Command:
    """Declare -o of a command that writes a problem."""
    meaning = f"Write to this file, in the format of its suffix: {', '.join(suffixes)}."
    return cast(Command, output_file(f"{meaning}  [default: JSON to standard output]")(command))


def _additions() -> list[Declaration]:
    iterative = [name for name, method in METHODS.items() if method.iterates]
    return [
        option(
            f"Methods {' and '.join(iterative)}",
            f"--{name}/--no-{name}",
            default=None,
            help=f"{meaning}  [default: --no-{name}]",
        )
        for name, meaning in ADDITIONS.items()
    ]


def _starts() -> list[Declaration]:
    complete = candidates.files(*candidates.VECTORS)
    return [
        option("Start", flag(name), metavar="NUMBERS|FILE", shell_complete=complete, help=meaning)
        for name, meaning in STARTS.items()
    ]


def limits(given: dict[str, Any]) -> Limits:
    """The limits among the given options, with defaults for the others."""
    from lcpcli.solving.limits import Limits

    return Limits(**{limit.name: given[limit.name] for limit in LIMITS if given[limit.name] is not None})


def for_methods(given: dict[str, Any], asked: Sequence[Variant], problem: Problem) -> list[dict[str, Any]]:
    """For each variant, its own options and those given that its method has; OptionError for one that none takes."""
    names = [variant.method for variant in asked]
    own_options = [variant.options for variant in asked]
    chosen = {name: given[name] for name in (*OPTIONS, *STARTS) if given[name] is not None}
    for name in STARTS:
        if name in chosen:
            chosen[name] = _vector(name, chosen[name], problem.n)
    if "x0" in chosen and "z0" in chosen:
        raise OptionError("--z0", "gives the starting point, and so does --x0", "leave one out")
    chosen |= {name: given[name] for name in ADDITIONS if given[name] is not None}
    known = [
        {*_starts_of(name), *parameters_of(name), *(ADDITIONS if METHODS[name].iterates else ())} - set(own)
        for name, own in zip(names, own_options, strict=True)
    ]
    for name in chosen:
        if not any(name in own for own in known):
            said = flag(f"no-{name}" if chosen[name] is False else name)
            why = f", which use{'s' * (len(asked) == 1)} no starting point" * (name in ("x0", "z0"))
            fault = f"has no effect with {' and '.join(map(str, asked))}{why}"
            raise OptionError(said, fault, "leave it out" if why else _remedy(name, asked))
    values = [
        {name: value for name, value in chosen.items() if name in free} | own
        for free, own in zip(known, own_options, strict=True)
    ]
    for name, own in zip(names, values, strict=True):
        options.check(METHODS[name].options, own)
    return values


def _starts_of(method: str) -> tuple[str, ...]:
    return ("x0", "z0") if METHODS[method].uses_start else ()


def _remedy(name: str, asked: Sequence[Variant]) -> str:
    """The hint for an option that none of the methods asked for has: which methods do."""
    owners = [own for own in METHODS if name in parameters_of(own) or (name in ADDITIONS and METHODS[own].iterates)]
    chosen = len(asked) == 1 and asked[0].method != "auto"
    cure = "leave it out, or give" if chosen else "add"
    return f"it belongs to {' and '.join(owners)}: {cure} --method {' or '.join(owners)}"


class _NumberOrAuto(click.ParamType):  # type: ignore[type-arg,unused-ignore]
    """A number, or the word for one derived from the problem."""

    name = "number|auto"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float | str:
        return AUTO if value == AUTO else float(click.FLOAT.convert(value, param, ctx))


def numeric(heading: str, declared: Option) -> Declaration:
    """The declaration of a numeric option under a heading; None where it is not given."""
    number = click.INT if declared.kind is int else click.FLOAT
    kind = _NumberOrAuto() if declared.auto else number
    default = f"; default {_default(declared.default)}" if declared.default is not None else ""
    meaning = f"{declared.meaning}  [{declared.range}{default}]"
    return option(heading, flag(declared.name), declared.name, type=kind, help=meaning)


def _default(value: float) -> str:
    return f"{value:g}" if value < math.inf else "no limit"


def _vector(name: str, given: str, n: int) -> Vector:
    from lcpcli.files import reading, typed

    if typed.numbers(given) is None and not (given and os.path.exists(given)):  # noqa: PTH110 (Path.exists raises an error for a long text)
        fault = f"{given!r} is neither a file nor numbers"
        raise OptionError(flag(name), fault, "write 1,-2,0.5 or name a file")
    return reading.read_start(flag(name), given, n, as_x=name != "z0")
