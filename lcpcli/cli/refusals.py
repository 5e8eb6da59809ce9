"""Which options have no effect together: for each option, format or kind of problem the options that it refuses."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any, NamedTuple

from lcpcli.cli.declarations import OF_METHODS
from lcpcli.errors import OptionError
from lcpcli.methods.registry import NONLINEAR, options_of
from lcpcli.report.wording import flag

ITERATES = ("--trace", "--every", "--columns")
OWN = {flag(f"{no}{name}") for name in OF_METHODS for no in ("", "no-")}
OF_LINEAR = OWN - {flag(name) for name in (*options_of(NONLINEAR), "z0")}
ONE_SOLUTION = {*OWN, *ITERATES[:2], "--method", "--tol", "--max-iterations", "--paths", "--bound"}
ONE_SOLUTION |= {"--jobs", "--cluster", "--resume", "--sequence"}
FAMILY = ("FAMILY", "-n", "--seed", "--set")
BENCH = ("SUITE", "--method", "--sweep", "--peer", "--infinity", "--tol", "--time-limit", "--accept", "--budget")
COMPARE, ONE_LEFT_OUT = "leave it out, or use lcp compare", "leave one out"


class Refusal(NamedTuple):
    """Options that are refused, why, and what to do."""

    options: Collection[str]
    fault: str = "has no effect with {mode}"
    hint: str = "leave it out"


OF_SEARCH = Refusal(ONE_SOLUTION, "has no effect with {mode}, which has a method of its own")
TABLE = {  # by what is asked for
    "--all": [Refusal(("--minimize", "--maximize"), hint=ONE_LEFT_OUT), OF_SEARCH],
    "--minimize": [Refusal(("--maximize",), hint=ONE_LEFT_OUT), OF_SEARCH, Refusal(("--plot",))],
    "--maximize": [OF_SEARCH, Refusal(("--plot",))],
    "the model's objective": [OF_SEARCH, Refusal(("--plot",))],
    "one solution": [Refusal(("--max-solutions",), "has no effect without --all", "add --all")],
    "several problems": [
        Refusal(("--plot", "--paths"), "draws one problem only", COMPARE),
        Refusal(("--show",), "chooses the unknowns of one problem only", COMPARE),
    ],
    "tables of several problems": [
        Refusal(ITERATES, "has no effect on several problems but in JSON", "give --format json")
    ],
    "--sequence": [
        Refusal(
            {*OWN, *ITERATES, "--jobs", "--cluster", "--method"},
            "has no effect with {mode}, where auto solves each problem from the states of the last one",
        )
    ],
    "--resume": [Refusal(("--output", "--format"), "has no effect with {mode}, which goes on with its file")],
    "--cluster": [Refusal(("--jobs",), "has no effect with {mode}, which has workers of its own")],
    "--quiet": [Refusal(("--trace", "--bound"))],
    "json": [Refusal(("--columns", "--show"), "has no effect on {mode}, which has all")],
    "csv": [Refusal(("--bound",), "has no effect on the format {mode}, which holds no proofs")],
    "no iterates": [Refusal(ITERATES[1:], "has no effect where no iterates are shown")],
    "no unknowns": [Refusal(("--show",), "has no effect where no unknowns are shown")],
    "a nonlinear model": [
        Refusal({*OF_LINEAR, "--exact", "--paths", "--lower", "--upper", "--infinity"}, "has no effect on {mode}")
    ],
    "--exact": [Refusal(("--tol",))],
    "a proof": [Refusal(("--tol",), "has no effect on {mode}")],
    "a bench that is resumed": [Refusal(BENCH, "has no effect with --resume, which keeps the options of the bench")],
    "--list": [Refusal((*FAMILY, "--from-qp", "--from-game", "--output"), hint=ONE_LEFT_OUT)],
    "--from-qp": [Refusal((*FAMILY, "--from-game"), hint=ONE_LEFT_OUT)],
    "--from-game": [Refusal(FAMILY, hint=ONE_LEFT_OUT)],
}


def refuse_beside(mode: str, given: Mapping[str, Any]) -> None:
    """Raise OptionError if one of some options has no effect in a mode, one of TABLE. given : the values of options by
    flag; None, False and an empty tuple stand for one that is not given."""
    for options, fault, hint in TABLE[mode]:
        for name, value in given.items():
            if name in options and value is not None and value is not False and value != ():
                raise OptionError(name, fault.format(mode=mode), hint)
