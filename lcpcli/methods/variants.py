"""Variants of methods: a method with values for options of its own, written shi:p=10,k-star=5, and sweeps over values.

Nothing heavy is imported, so that a mistake in a variant is reported at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from lcpcli import options
from lcpcli.errors import ParameterError, likely, listed, quoted
from lcpcli.methods.registry import ADDITIONS, METHODS, NONLINEAR, OPTIONS, SWITCHES, declared

TRUTHS = {"true": True, "false": False}
FLAGS = (*ADDITIONS, *SWITCHES)  # options that may stand alone, which means true


class Variant(NamedTuple):
    """A method with the options that are set for a run of it, as texts: ("shi", (("p", "10"), ("k_star", "5")))."""

    method: str
    settings: tuple[tuple[str, str], ...] = ()

    @property
    def options(self) -> dict[str, Any]:
        return {name: _value(name, text) for name, text in self.settings}

    def __str__(self) -> str:
        """Return the variant as it is written: shi:p=10,k-star=5."""
        alone = {(name, "true") for name in FLAGS}
        parts = [_dashed(each[0]) + ("" if each in alone else f"={each[1]}") for each in self.settings]
        return f"{self.method}:{','.join(parts)}" if parts else self.method


def parse(text: str) -> Variant:
    """Return the variant written METHOD or METHOD:OPTION=VALUE,...; an addition such as scale may stand alone.

    Raises OptionError for an unknown method, for an option that it does not have, and for a value out of range.
    """
    method, _, rest = text.partition(":")
    return _checked(Variant(method, tuple(_setting(part) for part in rest.split(",") if rest)), "method")


def sweep(variants: Sequence[Variant], axes: Sequence[str]) -> list[Variant]:
    """Return each variant once for every value, written OPTION=VALUE,VALUE,...; several options make a grid.

    A variant of a method without the option remains as it is. Raises OptionError for an option that no variant has, and
    for one that a variant sets already.
    """
    for axis in axes:
        name, _, text = axis.partition("=")
        name, values = name.strip().replace("-", "_"), [value.strip() for value in text.split(",")]
        if not all(values):
            hint = "write OPTION=VALUE,VALUE,..., as in p=1,10,100"
            raise ParameterError("sweep", f"{quoted(axis)} lacks a value", hint)
        if not any(name in _known(variant.method) for variant in variants):
            if owners := _owners(name):
                fault = f"{_dashed(name)} has no effect with {' and '.join(dict.fromkeys(v.method for v in variants))}"
                raise ParameterError("sweep", fault, f"add --method {owners[0]}")
            fault, words = f"{quoted(_dashed(name))} is not an option of any method", map(_dashed, (*OPTIONS, *FLAGS))
            raise ParameterError("sweep", fault, likely(_dashed(name), [*words]))
        swept = list[Variant]()
        for variant in variants:
            if name in dict(variant.settings):
                raise ParameterError("sweep", f"{_dashed(name)} is also set by {variant}", "leave one out")
            more = [((name, value),) for value in values] if name in _known(variant.method) else [()]
            swept += [Variant(variant.method, variant.settings + setting) for setting in more]
        variants = [_checked(variant, "sweep") for variant in swept]
    return list(dict.fromkeys(variants))


def labels(variants: Sequence[Variant]) -> list[str]:
    """Return a name for each variant: its method, with the settings in which the variants of that method differ."""
    names = []
    for variant in variants:
        alike = [set(each.settings) for each in variants if each.method == variant.method]
        shared = set.intersection(*alike) if len(alike) > 1 else set()
        settings = tuple(setting for setting in variant.settings if setting not in shared)
        names.append(str(Variant(variant.method, settings)))
    return names


def _dashed(name: str) -> str:
    return name.replace("_", "-")


def _setting(part: str) -> tuple[str, str]:
    """Return the name of an option as in Python, and the text after it; an addition such as scale may stand alone."""
    name, equals, value = (word.strip() for word in part.partition("="))
    name = name.replace("-", "_")
    if not equals and name in FLAGS:
        return name, "true"
    if not value:
        raise ParameterError("method", f"{quoted(part)} has no value", "write METHOD:OPTION=VALUE, as in shi:p=10")
    return name, value


def _known(method: str) -> list[str]:
    """Return the options that a variant of the method may set."""
    found = declared(method)
    return [*(option.name for option in found.options), *found.switches, *(ADDITIONS if found.iterates else ())]


def _checked(variant: Variant, where: str) -> Variant:
    """Return the variant if its options are known, set once and in their ranges; else raise OptionError.

    where : the option of the command that has set them.
    """
    known = _known(variant.method)
    for i, (name, _) in enumerate(variant.settings):
        if name not in known:
            words = [_dashed(one) for one in known]
            hint = likely(_dashed(name), words, f"it has {', '.join(words)}") if words else "it has none"
            if owners := _owners(name):
                hint = f"it belongs to {listed(owners)}"
            raise ParameterError("method", f"{variant.method} has no option {_dashed(name)}", hint)
        if name in dict(variant.settings[:i]):
            raise ParameterError("method", f"{_dashed(name)} is set twice in {variant}", "leave one out")
    try:
        options.check(declared(variant.method).options, variant.options)
    except ParameterError as error:
        raise ParameterError(where, f"{_dashed(error.where)}: {error.fault}", error.hint) from None
    return variant


def _value(name: str, text: str) -> Any:
    """Return the value of an option from its text: a number, one of its words, or true or false for one of FLAGS."""
    if name in FLAGS:
        if text not in TRUTHS:
            raise ParameterError(name, f"{quoted(text)} is neither true nor false", "write true or false")
        return TRUTHS[text]
    option = OPTIONS[name]
    if text in option.words:
        return text
    try:
        if "_" in text:
            raise ValueError
        number = float(text)
    except ValueError:
        fault = f"{quoted(text)} is not a number"
        raise ParameterError(name, fault, f"it must be: {option.range}") from None
    return int(number) if option.kind is int and number.is_integer() else number


def _owners(name: str) -> list[str]:
    return [method for method in (*METHODS, *NONLINEAR) if name in _known(method)]
