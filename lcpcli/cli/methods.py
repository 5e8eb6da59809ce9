"""Which methods run and with which options: --method and --sweep declared, and what is given sorted by method."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import click

from lcpcli import options
from lcpcli.cli.command import SWEEP, Choice, option
from lcpcli.cli.options import STARTS, Declaration
from lcpcli.errors import OptionError
from lcpcli.methods import variants
from lcpcli.methods.registry import ADDITIONS, METHODS, OPTIONS, meanings, parameters_of
from lcpcli.methods.variants import Variant
from lcpcli.options import flag

if TYPE_CHECKING:
    from lcpcli.model.problem import Problem
    from lcpcli.typing import Vector

OF_START = ("x0", "z0", "basis")  # of which one may be given


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


def for_methods(given: dict[str, Any], asked: Sequence[Variant], problem: Problem) -> list[dict[str, Any]]:
    """For each variant, its own options and those given that its method has; OptionError for one that none takes."""
    names = [variant.method for variant in asked]
    own_options = [variant.options for variant in asked]
    chosen = {name: given[name] for name in (*OPTIONS, *STARTS) if given[name] is not None}
    for name in STARTS:
        if name in chosen:
            chosen[name] = _basis(chosen[name], problem) if name == "basis" else _vector(name, chosen[name], problem)
    first, *others = [name for name in OF_START if name in chosen] or [""]
    if others:
        raise OptionError(flag(others[0]), f"gives the starting point, and so does {flag(first)}", "leave one out")
    chosen |= {name: given[name] for name in ADDITIONS if given[name] is not None}
    known = [
        {*_starts_of(name), *parameters_of(name), *(ADDITIONS if METHODS[name].iterates else ())} - set(own)
        for name, own in zip(names, own_options, strict=True)
    ]
    for name in chosen:
        if not any(name in own for own in known):
            said = flag(f"no-{name}" if chosen[name] is False else name)
            why = f", which use{'s' * (len(asked) == 1)} no starting point" * (name in OF_START)
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
    return OF_START if METHODS[method].uses_start else ()


def _remedy(name: str, asked: Sequence[Variant]) -> str:
    """The hint for an option that none of the methods asked for has: which methods do."""
    owners = [own for own in METHODS if name in parameters_of(own) or (name in ADDITIONS and METHODS[own].iterates)]
    chosen = len(asked) == 1 and asked[0].method != "auto"
    cure = "leave it out, or give" if chosen else "add"
    return f"it belongs to {' and '.join(owners)}: {cure} --method {' or '.join(owners)}"


def _basis(given: str, problem: Problem) -> list[str]:
    from lcpcli.files.beside import read_states

    return read_states(given, problem)


def _vector(name: str, given: str, problem: Problem) -> Vector:
    from lcpcli.files import beside

    if beside.typed_numbers(given) is None and not (given and beside.is_there(given)):
        fault = f"{given!r} is neither a file nor numbers"
        raise OptionError(flag(name), fault, "write 1,-2,0.5 or name a file")
    return beside.read_start(flag(name), given, problem.n, None if name == "z0" else problem.box)
