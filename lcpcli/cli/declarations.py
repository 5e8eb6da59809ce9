"""The arguments and options that several commands share, each declared once, with their
values in a request; and which have no effect together."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from enum import Flag, auto
from functools import reduce
from typing import Any, NamedTuple

import click

from lcpcli.cli.command import Candidates, Choice
from lcpcli.cli.terminal import NAMES_OF_OUTPUT
from lcpcli.errors import LEAVE_ONE_OUT, LEAVE_OUT, OptionError, listed
from lcpcli.files.fields import BOUNDS
from lcpcli.files.formats import WRITTEN
from lcpcli.methods import registry
from lcpcli.methods.registry import (
    METHODS,
    OPTIONS,
    Variant,
    meanings,
)
from lcpcli.model import formulations
from lcpcli.options import EVERY, INFINITY, LIMITS, THREADS, Option
from lcpcli.report.columns import OF_EVERY_METHOD
from lcpcli.report.document import FIGURES, MEANINGS
from lcpcli.report.wording import flag

STARTS = {
    "x0": (
        "Starting point x = (z - w) / 2: numbers, a file or a result.  [default: "
        "the problem's, else 0]"
    ),
    **{
        name: meaning
        for method in METHODS.values()
        for name, meaning in method.vectors.items()
    },
    "z0": "Starting point z, with w = Mz + q.  [default: see --x0]",
    "basis": (
        "Starting point as a basis: lower,basic,upper, a list in JSON, or a "
        "result.  [default: see --x0]"
    ),
}

# The options of the paper's methods; those of others are in METHOD:option=value.
PAPER = ("p", "k_star", "rho", "sigma")
# The options of methods that have flags, by name.
OF_METHODS = (*PAPER, *STARTS)
SWEEP = "--sweep"
# Options of a command that solves which its help shows on one screen: the paper's,
# limits and output.
COMMON = (
    "--lower",
    "--upper",
    "--method",
    "--p",
    "--k-star",
    "--rho",
    "--sigma",
    "--tol",
    "--max-iterations",
    "--time-limit",
    "--format",
    "--every",
    "--plot",
    "--output",
    "--quiet",
)
TO_FILE = "Write to a file instead, completely or not at all."
Declaration = Callable[[Any], Any]


FILES = Candidates(files=True)
PROBLEM_FILES = FILES._replace(problems=True)
FLAGS: dict[str, str] = {}  # of all options that are declared, by name


# Requests are neither compared nor printed: methods for that, and for refusing changes,
# would take 15 ms to make at each start.
@dataclass(eq=False, repr=False)
class Writing:
    """The request of a command that writes: -o and --quiet."""

    output: str | None = None
    quiet: bool = False

    @property
    def option_values(self) -> dict[str, Any]:
        """Return the values of the options by flag."""
        return {FLAGS.get(name, name): value for name, value in vars(self).items()}


@dataclass(eq=False, repr=False)
class Reporting(Writing):
    """The request of a command that reports; form : the format by --format, None for
    that of the suffix of -o."""

    form: str | None = None


@dataclass(eq=False, repr=False)
class Bounds:
    """How problems are to be read.

    lower, upper : bounds of z that replace those of the problem, numbers or a file.
    infinity : bounds of at least this size are infinite. tables : the formulation of
    which the files are tables, "" if they are none.
    """

    lower: str | None = None
    upper: str | None = None
    infinity: float | None = None
    tables: str = ""


@dataclass(eq=False, repr=False)
class OneProblem(Bounds):
    """The files of one problem: that of M and q, or that of M and another one of q."""

    file: str = ""
    q_file: str | None = None

    @property
    def files(self) -> list[str]:
        return [self.file] if self.q_file is None else [self.file, self.q_file]


@dataclass(eq=False, repr=False)
class ManyProblems(Bounds):
    """Files and folders of one problem or several."""

    files: Sequence[str] = ()


def option(heading: str, *rows: str | Option, **attributes: Any) -> Declaration:
    """Declare options under a heading of the help. A row has the names of an option,
    that of its value in capitals unless it is a flag or has a type, and, after two
    blanks, its meaning; or it is a numeric option, with its range, and None by default.
    The attributes are those of `click.option`."""
    made = list[Any]()
    for row in rows:
        text, how = (
            _numeric(row) if isinstance(row, Option) else (row, dict(attributes))
        )
        names, _, meaning = text.partition("  ")
        *flags, last = names.split()
        if last.isupper():
            how["metavar"] = last
        else:
            flags.append(last)
            # is_flag=False would allow an option without its value.
            if "type" not in how:
                how["is_flag"] = True
        how |= {"shell_complete": FILES} if "FILE" in last else {}
        made.append(click.Option(flags, help=meaning, **how))
        made[-1].heading, FLAGS[made[-1].name] = heading, made[-1].opts[-1]

    def declare(function: Any) -> Any:
        function.__click_params__ = [
            *getattr(function, "__click_params__", []),
            *reversed(made),
        ]
        return function

    return declare


def _numeric(declared: Option) -> tuple[str, dict[str, Any]]:
    def in_range(_: Any, __: Any, text: str | None) -> float | str | None:
        if text is None:
            return None
        value = declared.value_of(text)
        declared.check(value)
        return value

    default = (
        "" if declared.default is None else f"; default {declared.written_default}"
    )
    names = (
        f"{flag(declared.name)} {'SIZE' if declared is INFINITY else declared.metavar}"
    )
    return f"{names}  {declared.meaning}  [{declared.range}{default}]", {
        "callback": in_range,
    }


def argument(
    heading: str, name: str, word_meanings: Mapping[str, str], **attributes: Any
) -> Declaration:
    """Declare an argument under a heading, with the meanings of its words; the rest is
    as for `click.argument`."""

    def declare(function: Any) -> Any:
        function = click.argument(name, **attributes)(function)
        made = function.__click_params__[-1]
        made.heading, made.words = heading, word_meanings
        FLAGS.setdefault(made.name, name.upper())  # an option of this name comes first
        return function

    return declare


def declared(*declarations: Declaration) -> Declaration:
    """Return a declaration that combines several, in the order in which help shows
    them."""
    return lambda command: reduce(
        lambda made, declare: declare(made), reversed(declarations), command
    )


def reporting(
    formats: Mapping[str, str],
    *others: Declaration,
    file: str = f"{TO_FILE}  [default: standard output]",
    quiet: str = "Print no results, only errors; the exit code tells the outcome.",
) -> Declaration:
    """Declare --format, one of these formats if there are any, None leaving it to the
    suffix of -o; the others; -o and --quiet, with their meanings."""
    declaration = (
        "-f --format form FORMAT  {}.  [default: by the suffix of -o, else table]"
    )
    choice = (
        [
            option(
                "Output",
                declaration.format(listed(formats, "or")),
                type=Choice(formats),
            )
        ]
        if formats
        else []
    )

    def path_of(_: Any, __: Any, file: str | None) -> str | None:
        return None if file in NAMES_OF_OUTPUT else file

    return declared(
        *choice,
        *others,
        option("Output", f"-o --output FILE  {file}", callback=path_of),
        option("Output", f"-q --quiet  {quiet}"),
    )


def figure_options(command: str) -> Declaration:
    """Declare the options of a command that draw figures, each once: a figure without a
    meaning replaces another one of the same option."""
    rows = (
        f"--{figure.option} FILE  {figure.meaning}"
        for figure in FIGURES.values()
        if command in figure.commands and figure.meaning
    )
    return option("Output", *rows)


# A method, with or without options, as in shi:p=10.
METHOD = Choice(meanings(), parse=registry.parse)
METHOD_NAMES = listed(METHOD.meanings, "or")
show_option = option(
    "Output",
    "--show names NAME  Show only the unknowns of this name, or z1, z2, ...; * matches "
    "any text, as in 'price *'; "
    "repeatable. JSON has all.  [default: as many as fit]",
    multiple=True,
)


def several_methods(heading: str, purpose: str, default: Sequence[str]) -> Declaration:
    """Declare a repeatable --method, for a purpose, and --sweep; see
    `chosen_variants`."""
    one = (
        f"A method to {purpose}: {METHOD_NAMES}, with options as in shi:p=10,k-star=5; "
        "repeatable."
    )
    every = (
        "Run the methods that have this option once for each value, as in "
        "p=1,10,100; several make a grid."
    )
    names, axes = "-m --method methods NAME[:...]", f"{SWEEP} OPTION=VALUE,..."
    return declared(
        option(
            heading,
            f"{names}  {one}  [default: {', '.join(default)}]",
            multiple=True,
            type=METHOD,
        ),
        option(heading, f"{axes}  {every}  [default: none]", multiple=True),
    )


def files_argument(
    heading: str,
    name: str,
    metavar: str,
    word_meanings: Mapping[str, str],
    offered: Candidates = PROBLEM_FILES,
    **attributes: Any,
) -> Declaration:
    word_meanings = {
        **word_meanings,
        "FOLDER": "All files in it that hold one problem, by name.",
    }
    return argument(
        heading,
        name,
        word_meanings,
        metavar=metavar,
        nargs=-1,
        shell_complete=offered,
        **attributes,
    )


def refuse(is_wrong: bool, where: str, reason: str, hint: str = LEAVE_OUT) -> None:
    if is_wrong:
        raise OptionError(where, reason, hint)


def chosen_variants(
    methods: Sequence[Variant],
    sweep: Sequence[str],
    default: Sequence[str],
    option_names: Collection[str] = (),
) -> list[Variant]:
    """Return the requested methods, or the default ones, for all values of --sweep,
    which must not set an option that the command line has too."""
    for axis in sweep:
        name = axis.partition("=")[0].strip().replace("-", "_")
        refuse(
            name in option_names,
            SWEEP,
            f"{flag(name)} cannot be combined with it",
            LEAVE_ONE_OUT,
        )
    variants = list(dict.fromkeys(methods or map(Variant, default)))
    return registry.sweep(variants, sweep)


def _names(_: click.Context, __: click.Parameter, text: str | None) -> tuple[str, ...]:
    """Return the names in a text; those of columns depend on the methods."""
    return tuple(name.strip() for name in text.split(",")) if text is not None else ()


BOUND = "a number, none, a list or a file.  [default: the problem's]"
M_AND_Q = (
    "M and q as .json, .npz, .mat, or .csv with the columns [M | q]; M alone, also "
    "as .mtx or .npy"
)
BESIDES_FILES = "- is standard input, and the name of a shipped problem can replace it."
# The problems that a file may hold.
OTHERS = "Programs: .mps, .qps, .lp; models: .nl; games: .nfg, .efg."
bounds_options = option(
    "Problem",
    *(
        f"--{name} NUMBER|FILE  {name.capitalize()} bound of z: {BOUND}"
        for name in BOUNDS
    ),
    INFINITY,
)
tables_options = [
    option(
        "Problem",
        f"{row.tables.option} tables  {row.tables.meaning}",
        flag_value=kind,
        default="",
    )
    for kind, row in formulations.TABLE.items()
    if row.tables is not None
]
# The options of a command that reads problems.
with_bounds = declared(bounds_options, *tables_options)
# The problem of a command that takes one: its file, and the file of q if it is
# separate.
problem_file = declared(
    argument(
        "Problem",
        "file",
        {"FILE": f"{M_AND_Q}. {OTHERS} {BESIDES_FILES}"},
        shell_complete=PROBLEM_FILES,
    ),
    argument(
        "Problem",
        "q_file",
        {"Q_FILE": "q, if FILE contains M alone; the formats may differ."},
        required=False,
        shell_complete=FILES,
    ),
    with_bounds,
)
problem_files = declared(  # the problems of a command that takes one or several
    files_argument(
        "Problem",
        "files",
        "FILE [Q_FILE]|FOLDER...",
        {
            "FILE": (
                f"{M_AND_Q}; .jsonl with a problem in each line. {OTHERS} "
                f"{BESIDES_FILES}"
            ),
            "Q_FILE": "q, or several q in columns, if FILE contains M alone.",
        },
        required=True,
    ),
    with_bounds,
)
problem_output = reporting(  # of a command that writes a problem
    {},
    file=(
        f"Write to this file, in the format of its suffix: {WRITTEN}.  [default: "
        "JSON to standard output]"
    ),
    quiet="Say nothing on standard error but errors.",
)


def _methods(option: Option) -> str:
    names = [name for name, method in METHODS.items() if option in method.options]
    noun = "Method" if len(names) == 1 else "Methods"
    return f"{noun} {listed(names)}"


def of_variants(name: str, option: Option | str) -> tuple[str, str]:
    """Return an option of a method as it is written in METHOD:option=value, and its
    meaning."""
    if isinstance(option, str):
        return f"{name}, {name}=false", option
    term, _, meaning = _numeric(option)[0].partition("  ")
    return term.removeprefix("--").replace(" ", "="), meaning


# The options of the methods, the limits and the output of a command that solves.
solving = declared(
    *(option(_methods(OPTIONS[name]), OPTIONS[name]) for name in PAPER),
    option(
        "Start",
        *(
            f"--{n} {'STATES' if n == 'basis' else 'NUMBERS'}|FILE  {text}"
            for n, text in STARTS.items()
        ),
    ),
    option("Stopping", *LIMITS),
    option("Computing", THREADS),
    option(
        "Answer",
        "--bound  Prove a bound on the error of z; this costs more than solving.",
    ),
    reporting(
        MEANINGS,
        option(
            "Output",
            "--trace  Add the iterates to JSON, or write them as CSV instead of the "
            "answer.",
        ),
        show_option,
        option("Output", EVERY),
        option(
            "Output",
            "--columns NAME,...  Show only these columns of the iterates, and "
            f"no summary: {', '.join(OF_EVERY_METHOD)}, those of the method's steps, "
            "such as x, which lcp help METHOD lists, or all; JSON has "
            "the others anyway.  [default: those of every method]",
            callback=_names,
        ),
        figure_options("solve"),
    ),
)


class Needs(Flag):
    """What an option needs a command to do, or to write."""

    METHOD = auto()  # one that the user chooses
    RUN = auto()  # of a method, to one solution
    LINEAR = auto()  # problem
    RESIDUAL = auto()  # that decides
    ITERATES = auto()  # that are shown
    CHOICE_OF_ITERATES = auto()
    COLUMNS = auto()  # of the iterates, of which some can be left out
    UNKNOWNS = auto()  # of which some can be left out
    FIGURE = auto()  # of one problem
    TRAJECTORIES = auto()
    PROOF = auto()  # that is shown
    TEXT = auto()  # on standard output, or in a file
    DESTINATION = auto()
    PROCESSES = auto()  # of this run
    LOCAL = auto()  # processes on this machine
    ONE_OBJECTIVE = auto()
    PIECES = auto()  # of the set of all solutions, of which one is requested
    LIST = auto()  # of all solutions
    NEW_BENCH = auto()
    FAMILY = auto()
    PROBLEM = auto()  # that is written


OF_METHOD = Needs.METHOD | Needs.RUN
OF_START = OF_METHOD | Needs.LINEAR
# The capabilities without which an option has no effect, by option.
NEEDS = {
    **{flag(name): OF_START for name in OF_METHODS},
    "--z0": OF_METHOD,
    "--method": OF_METHOD | Needs.NEW_BENCH,
    "--tol": Needs.RUN | Needs.RESIDUAL | Needs.NEW_BENCH,
    "--max-iterations": Needs.RUN,
    "--time-limit": Needs.NEW_BENCH,
    "--bound": Needs.RUN | Needs.PROOF | Needs.TEXT,
    "--exact": Needs.LINEAR,
    **{flag(name): Needs.LINEAR for name in BOUNDS},
    "--infinity": Needs.LINEAR | Needs.NEW_BENCH,
    "--trace": Needs.RUN | Needs.ITERATES | Needs.TEXT,
    "--every": Needs.RUN | Needs.ITERATES | Needs.CHOICE_OF_ITERATES,
    "--columns": Needs.ITERATES | Needs.CHOICE_OF_ITERATES | Needs.COLUMNS,
    "--show": Needs.UNKNOWNS,
    "--plot": Needs.FIGURE,
    "--paths": Needs.RUN | Needs.FIGURE | Needs.LINEAR | Needs.TRAJECTORIES,
    "--jobs": Needs.RUN | Needs.PROCESSES | Needs.LOCAL,
    "--cluster": Needs.RUN | Needs.PROCESSES,
    "--resume": Needs.RUN,
    "--sequence": Needs.RUN,
    "--output": Needs.DESTINATION | Needs.PROBLEM,
    "--format": Needs.DESTINATION,
    "--minimize": Needs.PIECES,
    "--maximize": Needs.PIECES | Needs.ONE_OBJECTIVE,
    "--max-solutions": Needs.LIST,
    **dict.fromkeys(
        (SWEEP, "SUITE", "--peer", "--accept", "--budget"), Needs.NEW_BENCH
    ),
    **dict.fromkeys(("FAMILY", "-n", "--seed", "--set"), Needs.FAMILY),
}
NOTHING = Needs(0)
COMPARE = "leave it out, or use lcp compare"


class Refusal(NamedTuple):
    """Capabilities that a mode lacks, with the reason for refusing the options that
    need one of them."""

    lacks: Needs
    reason: str = "has no effect with {mode}"
    hint: str = LEAVE_OUT


@dataclass(eq=False, repr=False)
class Mode:
    """A request or a kind of input that excludes options: its name in messages, and
    what it excludes."""

    name: str
    refusals: Sequence[Refusal]


OWN_METHOD = Refusal(OF_METHOD, "has no effect with {mode}, which has a fixed method")
ALL = Mode("--all", [Refusal(Needs.PIECES, hint=LEAVE_ONE_OUT), OWN_METHOD])
MINIMIZE = Mode(
    "--minimize",
    [
        Refusal(Needs.ONE_OBJECTIVE, hint=LEAVE_ONE_OUT),
        OWN_METHOD,
        Refusal(Needs.FIGURE),
    ],
)
MAXIMIZE = Mode("--maximize", [OWN_METHOD, Refusal(Needs.FIGURE)])
OBJECTIVE = Mode("the model's objective", [OWN_METHOD, Refusal(Needs.FIGURE)])
ONE = Mode(
    "one solution",
    [Refusal(Needs.LIST, "has no effect without --all", "add --all")],
)
SEVERAL = Mode(
    "several problems",
    [
        Refusal(Needs.FIGURE, "draws one problem only", COMPARE),
        Refusal(Needs.UNKNOWNS, "chooses the unknowns of one problem only", COMPARE),
    ],
)
SEVERAL_IN_TABLES = Mode(
    "several problems but in JSON",
    [Refusal(Needs.ITERATES, "has no effect on {mode}", "give --format json")],
)
SEQUENCE = Mode(
    "--sequence",
    [
        Refusal(
            Needs.METHOD | Needs.ITERATES | Needs.PROCESSES,
            "has no effect with {mode}, where auto solves each problem from the basis "
            "of the last one",
        )
    ],
)
RESUME = Mode(
    "--resume",
    [
        Refusal(
            Needs.DESTINATION,
            "has no effect with {mode}, which continues its file",
        )
    ],
)
CLUSTER = Mode(
    "--cluster",
    [
        Refusal(
            Needs.LOCAL,
            "has no effect with {mode}, which uses the workers of the cluster",
        )
    ],
)
QUIET = Mode("--quiet", [Refusal(Needs.TEXT)])
# JSON has all unknowns and, unless --columns names more, the same columns of iterates.
JSON = Mode("json", [Refusal(Needs.UNKNOWNS, "has no effect on {mode}, which has all")])
ITERATES_IN_JSON = Mode(
    "the iterates in json",
    [Refusal(Needs.COLUMNS, "has no effect on {mode}, which have these anyway")],
)
CSV = Mode(
    "the format csv",
    [Refusal(Needs.PROOF, "has no effect on {mode}, which holds no proofs")],
)
NO_ITERATES = Mode(
    "iterates",
    [Refusal(Needs.CHOICE_OF_ITERATES, "has no effect where no {mode} are shown")],
)
NO_UNKNOWNS = Mode(
    "unknowns", [Refusal(Needs.UNKNOWNS, "has no effect where no {mode} are shown")]
)
NONLINEAR_MODEL = Mode(
    "a nonlinear model",
    [
        Refusal(Needs.LINEAR, "has no effect on {mode}"),
    ],
)
EXACT = Mode("--exact", [Refusal(Needs.RESIDUAL)])
PROOF = Mode("a proof", [Refusal(Needs.RESIDUAL, "has no effect on {mode}")])
RESUMED_BENCH = Mode(
    "--resume",
    [
        Refusal(
            Needs.NEW_BENCH,
            "has no effect with {mode}, which keeps the options of the bench",
        )
    ],
)
LIST = Mode(
    "--list",
    [Refusal(Needs.FAMILY | Needs.PROBLEM, hint=LEAVE_ONE_OUT)],
)


def reject_conflicting_options(option_values: Mapping[str, Any], *modes: Mode) -> None:
    """Raise OptionError for an option that has no effect in one of these modes.
    option_values : the values of options by flag; None, False and an empty tuple mean
    that the command line does not have the option."""
    names = [
        name
        for name, value in option_values.items()
        if value is not None and value is not False and value != ()
    ]
    for mode in modes:
        for lacks, reason, hint in mode.refusals:
            for name in names:
                is_lacking = bool(NEEDS.get(name, NOTHING) & lacks)
                refuse(is_lacking, name, reason.format(mode=mode.name), hint)


def among(modes: Mapping[Mode, bool]) -> list[Mode]:
    """Return the modes whose condition holds."""
    return [mode for mode, is_asked in modes.items() if is_asked]
