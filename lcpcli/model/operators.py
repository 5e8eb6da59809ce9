"""The operators of expressions in double precision, and their partial derivatives in any arithmetic."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from lcpcli.typing import Vector

Functions: TypeAlias = Mapping[str, Callable[..., Any]]
BRANCHES = {"if", "min", "max", "abs"}  # with derivatives that are 0 whatever becomes of an argument


def _true(relation: Callable[..., Any]) -> Callable[..., Any]:
    """Return a relation with the values 1.0 and 0.0."""
    return lambda a, b: relation(a, b).astype(float)


RELATIONS = {
    "<": _true(np.less),
    "<=": _true(np.less_equal),
    "=": _true(np.equal),
    ">=": _true(np.greater_equal),
    ">": _true(np.greater),
    "!=": _true(np.not_equal),
}
DOUBLES: Functions = {
    "number": float,
    **{
        name: getattr(np, name) for name in ("exp", "log", "log10", "sqrt", "sin", "cos", "tan", "sinh", "cosh", "tanh")
    },
    **{name: getattr(np, f"arc{name[1:]}") for name in ("asin", "acos", "atan", "asinh", "acosh", "atanh", "atan2")},
    **RELATIONS,
    "add": np.add,
    "product": np.multiply,
    "quotient": np.divide,
    "power": np.power,  # with an integer as exponent
    "^": np.power,
    "abs": np.abs,
    "min": np.minimum,
    "max": np.maximum,
    "if": lambda condition, a, b: np.where(condition != 0, a, b),
    "sign": np.sign,
    "chosen": lambda condition: (condition != 0).astype(float),
    "rejected": lambda condition: (condition == 0).astype(float),
}


def has_derivative(operator: str, argument: int) -> bool:
    """Return whether the values of an operator depend on this argument otherwise than by jumps."""
    return operator not in RELATIONS and (operator, argument) != ("if", 0)


def partials(f: Functions, operator: str, exponent: int, a: Sequence[Vector], value: Vector) -> list[Any]:
    """Return the derivatives of the values of an operator by its arguments; None for those that it jumps with.

    f : the functions of an arithmetic, as `DOUBLES`. exponent : of the operator "power". a : the arguments.
    """
    if operator == "power":
        return [f["product"](float(exponent), f["power"](a[0], exponent - 1))]
    if operator in _PARTIALS:
        return _PARTIALS[operator](f, *a, value)
    return [None] * len(a)  # relations


def _minus(f: Functions, a: Any) -> Any:
    return f["product"](-1.0, a)


def _over_root(f: Functions, radicand: Any, sign: float = 1.0) -> list[Any]:
    return [f["quotient"](sign, f["sqrt"](radicand))]


def _of_power(f: Functions, a: Any, b: Any, v: Any) -> list[Any]:
    return [f["product"](b, f["^"](a, f["add"](b, -1.0))), f["product"](v, f["log"](a))]


def _of_angle(f: Functions, a: Any, b: Any, _: Any) -> list[Any]:
    square = f["add"](f["power"](a, 2), f["power"](b, 2))
    return [f["quotient"](b, square), _minus(f, f["quotient"](a, square))]


_PARTIALS: Mapping[str, Callable[..., list[Any]]] = {
    "product": lambda _, a, b, __: [b, a],
    "quotient": lambda f, _, b, v: [f["quotient"](1.0, b), _minus(f, f["quotient"](v, b))],
    "^": _of_power,
    "exp": lambda _, __, v: [v],
    "log": lambda f, a, _: [f["quotient"](1.0, a)],
    "log10": lambda f, a, _: [f["quotient"](1.0, f["product"](a, f["log"](f["number"](10))))],
    "sqrt": lambda f, _, v: [f["quotient"](0.5, v)],
    "sin": lambda f, a, _: [f["cos"](a)],
    "cos": lambda f, a, _: [_minus(f, f["sin"](a))],
    "tan": lambda f, _, v: [f["add"](1.0, f["power"](v, 2))],
    "sinh": lambda f, a, _: [f["cosh"](a)],
    "cosh": lambda f, a, _: [f["sinh"](a)],
    "tanh": lambda f, _, v: [f["add"](1.0, _minus(f, f["power"](v, 2)))],
    "asin": lambda f, a, _: _over_root(f, f["add"](1.0, _minus(f, f["power"](a, 2)))),
    "acos": lambda f, a, _: _over_root(f, f["add"](1.0, _minus(f, f["power"](a, 2))), -1.0),
    "atan": lambda f, a, _: [f["quotient"](1.0, f["add"](1.0, f["power"](a, 2)))],
    "asinh": lambda f, a, _: _over_root(f, f["add"](1.0, f["power"](a, 2))),
    "acosh": lambda f, a, _: _over_root(f, f["add"](-1.0, f["power"](a, 2))),
    "atanh": lambda f, a, _: [f["quotient"](1.0, f["add"](1.0, _minus(f, f["power"](a, 2))))],
    "atan2": _of_angle,
    "abs": lambda f, a, _: [f["sign"](a)],
    "min": lambda f, a, b, _: [f["<="](a, b), f[">"](a, b)],
    "max": lambda f, a, b, _: [f[">="](a, b), f["<"](a, b)],
    "if": lambda f, c, _, __, ___: [None, f["chosen"](c), f["rejected"](c)],
}
