"""lcp make: write a gallery problem or the problem of a program or game, or list the gallery."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any

import click

from lcpcli.cli.command import Command, argument, option
from lcpcli.cli.convert import write
from lcpcli.cli.options import ANY_FILE, Candidates, problem_output
from lcpcli.cli.output import emit, terminal
from lcpcli.cli.problems import Inputs
from lcpcli.errors import OptionError, quoted
from lcpcli.files.formats import COMPLETE
from lcpcli.gallery import families as gallery

if TYPE_CHECKING:
    from lcpcli.model.problem import Problem

WORDS = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}
KINDS = {bool: "true or false", int: "a whole number", float: "a number"}


@click.command(
    cls=Command,
    short_help="Write a gallery problem, or that of a program or game.",
    examples=(
        "lcp make --list",
        "lcp make obstacle -n 100 | lcp solve -",
        "lcp make murty",
        "lcp make harker-pang -n 50 --seed 3 --set symmetric=true -o problem.npz",
    ),
    exits={0: "written", 2: "usage error (one-line message)"},
    epilog=f"The same arguments give the same problem. {', '.join(COMPLETE)} also hold its known solutions and, for a "
    "program or a game, what lcp solve needs to report the minimizer or the equilibrium. lcp solve also takes the file "
    "of a program or a game itself; lcp help programs has the keys.",
)
@argument(
    "Family",
    "family",
    {"FAMILY": "One of those that lcp make --list shows with their parameters and the class of M."},
    required=False,
    shell_complete=Candidates(gallery.FAMILIES),
)
@option("Family", "--list", "listed", is_flag=True, help="List the families instead of writing a problem.")
@option("Problem", "-n", "n", type=int, help="Approximate number of unknowns.  [default: 10, or the family's own]")
@option("Problem", "--seed", type=int, help="Seed of the random numbers, if any.  [whole number >= 0; default 0]")
@option(
    "Problem",
    "--set",
    "settings",
    multiple=True,
    metavar="NAME=VALUE",
    help="Set a parameter of the family; repeatable.",
)
@option(
    "Program or game, in place of a family",
    "--from-qp",
    metavar="FILE",
    shell_complete=ANY_FILE,
    help="A linear or quadratic program, as in lcp help programs.",
)
@option(
    "Program or game, in place of a family",
    "--from-game",
    metavar="FILE",
    shell_complete=ANY_FILE,
    help="A game of two players, as in lcp help programs.",
)
@problem_output
def make(
    family: str | None,
    n: int | None,
    seed: int | None,
    settings: tuple[str, ...],
    from_qp: str | None,
    from_game: str | None,
    output: str | None,
    listed: bool,
) -> int:
    """Write a problem of FAMILY, a family of the gallery, or that of a program or a game."""
    given = {"FAMILY": family, "-n": n, "--seed": seed, "--set": settings or None}
    sources = {"--from-qp": from_qp, "--from-game": from_game}
    if listed:
        _refuse_beside("--list", **given, **sources, **{"-o": output})
        return _show_list()
    Inputs([source for source in sources.values() if source is not None]).prepare({"--output": output})
    for name, source in sources.items():
        if source is not None:
            _refuse_beside(name, **given, **{other: file for other, file in sources.items() if other != name})
            write(partial(_converted, name, source), output)
            return 0
    if family is None:
        raise OptionError("FAMILY", "is missing", "name a family; lcp make --list shows them")
    parameters = _parameters(family, settings)
    if seed is not None and not gallery.is_random(family):
        raise OptionError("--seed", f"has no effect on {family}, which has no random entries", "leave it out")
    write(partial(gallery.make, family, n, seed or 0, **parameters), output)
    return 0


def _converted(option: str, source: str) -> Problem:
    from lcpcli.files import reading

    return reading.read_origin(option.removeprefix("--from-"), source)


def _show_list() -> int:
    from lcpcli.report.terminal import listing

    rows = [
        (
            name,
            gallery.class_of(name),
            "\n".join(f"{p}={_text(v)}" for p, v in gallery.parameters_of(name).items()),
            told,
        )
        for name, told in gallery.FAMILIES.items()
    ]
    width, color = terminal()
    emit(listing(("family", "class of M", "parameters", "description"), rows, width, color), color)
    return 0


def _refuse_beside(option: str, **given: Any) -> None:
    for name, value in given.items():
        if value is not None:
            raise OptionError(name, f"has no effect with {option}", "leave one out")


def _parameters(family: str, settings: tuple[str, ...]) -> dict[str, Any]:
    """The settings NAME=VALUE as parameters of the family, each of the type of its default."""
    defaults = gallery.parameters_of(family)
    values: dict[str, Any] = {}
    for setting in settings:
        name, equals, text = setting.partition("=")
        if not equals:
            raise OptionError("--set", f"{quoted(setting)} has no value", "write NAME=VALUE")
        if name in values:
            raise OptionError("--set", f"{name} is set twice", "leave one out")
        gallery.refuse_unknown(family, name)
        values[name] = _value(name, text, type(defaults[name]))
    return values


def _value(name: str, text: str, kind: type) -> Any:
    try:
        if "_" in text:
            raise ValueError
        return WORDS[text.casefold()] if kind is bool else kind(text)
    except (KeyError, ValueError):
        raise OptionError("--set", f"{quoted(text)} is not a value of {name}", f"give {KINDS[kind]}") from None


def _text(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else f"{value:g}"
