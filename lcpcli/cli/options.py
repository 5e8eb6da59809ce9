"""The options of the commands that solve, each declared once; those that choose methods are in `methods`."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, TypeVar, cast

import click

from lcpcli.cli import candidates
from lcpcli.cli.command import Choice, argument, option
from lcpcli.cli.output import ITERATES
from lcpcli.files.formats import WRITTEN
from lcpcli.methods.registry import ADDITIONS, METHODS
from lcpcli.options import AUTO, EVERY, INFINITY, LIMITS, THREADS, Option, flag
from lcpcli.report.formats import FORMATS

if TYPE_CHECKING:
    from lcpcli.options import Limits

STARTS = {
    "x0": "Starting point x = (z - w) / 2: numbers, a file or a result.  [default: the problem's, else 0]",
    **{name: meaning for method in METHODS.values() for name, meaning in method.vectors.items()},
    "z0": "Starting point given as z, with w = Mz + q.  [default: see --x0]",
    "basis": "Starting point given by states: lower,basic,upper, a list in JSON, or a result.  [default: see --x0]",
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
    complete = candidates.problems()
    file = {
        "FILE": "M and q as .json, .npz, .mat, or .csv with the columns [M | q]; or M alone, also as .mtx or .npy. - "
        "is standard input, and the name of a shipped problem stands for it."
    }
    command = with_bounds(command)
    q_file = {"Q_FILE": "q, if FILE contains M alone; the formats may differ."}
    command = argument("Problem", "q_file", q_file, required=False, shell_complete=complete)(command)
    return argument("Problem", "file", file, shell_complete=complete)(command)


def problem_files(command: Command) -> Command:
    """Declare the problems of a command that takes one or several."""
    declare = argument(
        "Problem",
        "files",
        {
            "FILE [Q_FILE]": "M and q as .json, .npz, .mat, or .csv with the columns [M | q]; M alone, also as .mtx or "
            ".npy, followed by q, or by several q in columns; .jsonl with a problem in each line. - is standard input, "
            "and the name of a shipped problem stands for it.",
            "FOLDER": "All problem files in it, in order of their names.",
        },
        metavar="FILE [Q_FILE]|FOLDER...",
        nargs=-1,
        required=True,
        shell_complete=candidates.problems(),
    )
    return declare(with_bounds(command))


def with_bounds(command: Command) -> Command:
    """Declare what a command that reads problems is told about them: the bounds of z, and whether two files are a
    game."""
    complete = candidates.files(*candidates.VECTORS)
    meaning = "Two files have the payoffs A and B of a game as tables."
    command = option("Problem", "--game", is_flag=True, help=meaning)(command)
    command = numeric("Problem", INFINITY)(command)
    for name, side in (("upper", "Upper"), ("lower", "Lower")):
        meaning = f"{side} bound of z: a number for all, none, or one each, typed or a file.  [default: the problem's]"
        declare = option("Problem", f"--{name}", metavar="NUMBER|FILE", shell_complete=complete, help=meaning)
        command = declare(command)
    return command


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
    meaning = f"Write to this file, in the format of its suffix: {WRITTEN}."
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
        option("Start", flag(name), metavar=_forms(name), shell_complete=complete, help=meaning)
        for name, meaning in STARTS.items()
    ]


def _forms(start: str) -> str:
    return "STATES|FILE" if start == "basis" else "NUMBERS|FILE"


def limits(given: dict[str, Any]) -> Limits:
    """The limits among the given options, with defaults for the others."""
    from lcpcli.options import Limits

    return Limits(**{limit.name: given[limit.name] for limit in LIMITS if given[limit.name] is not None})


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
