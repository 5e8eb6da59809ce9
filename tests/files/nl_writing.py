"""Models for tests: expressions as nested tuples, written in AMPL's .nl format and
evaluated without the package."""

import math
import struct

UNARY = {
    "abs": (15, abs),
    "neg": (16, lambda a: -a),
    "tanh": (37, math.tanh),
    "tan": (38, math.tan),
    "sqrt": (39, math.sqrt),
    "sinh": (40, math.sinh),
    "sin": (41, math.sin),
    "log10": (42, math.log10),
    "log": (43, math.log),
    "exp": (44, math.exp),
    "cosh": (45, math.cosh),
    "cos": (46, math.cos),
    "atanh": (47, math.atanh),
    "atan": (49, math.atan),
    "asinh": (50, math.asinh),
    "asin": (51, math.asin),
    "acosh": (52, math.acosh),
    "acos": (53, math.acos),
    "square": (76, lambda a: a * a),
    "not": (34, lambda a: float(not a)),
}
BINARY = {
    "+": (0, lambda a, b: a + b),
    "-": (1, lambda a, b: a - b),
    "*": (2, lambda a, b: a * b),
    "/": (3, lambda a, b: a / b),
    "^": (5, math.pow),
    "less": (6, lambda a, b: max(a - b, 0.0)),
    "or": (20, lambda a, b: float(bool(a or b))),
    "and": (21, lambda a, b: float(bool(a and b))),
    "<": (22, lambda a, b: float(a < b)),
    "<=": (23, lambda a, b: float(a <= b)),
    "=": (24, lambda a, b: float(a == b)),
    ">=": (28, lambda a, b: float(a >= b)),
    ">": (29, lambda a, b: float(a > b)),
    "!=": (30, lambda a, b: float(a != b)),
    "atan2": (48, math.atan2),
    "<==>": (73, lambda a, b: float(bool(a) == bool(b))),
    "^constant": (75, math.pow),
    "constant^": (77, math.pow),
}
NARY = {
    "min": (11, min),
    "max": (12, max),
    "sum": (54, lambda *a: math.fsum(a)),
    "all": (70, lambda *a: float(all(a))),
    "any": (71, lambda *a: float(any(a))),
}


def value(expression, variables):
    if isinstance(expression, str):
        return variables[expression]
    if not isinstance(expression, tuple):
        return float(expression)
    operator, *arguments = expression
    # Slopes and the breakpoints between them, and the argument.
    if operator == "pieces":
        slopes, breakpoints, argument = arguments
        return _integral(slopes, breakpoints, value(argument, variables))
    if operator == "if":
        condition, then, otherwise = arguments
        return value(then if value(condition, variables) else otherwise, variables)
    function = {**UNARY, **BINARY, **NARY}[operator][1]
    return function(*(value(argument, variables) for argument in arguments))


def _integral(slopes, breakpoints, end):
    """The integral of a step function from 0."""
    ends, sign = sorted((0.0, end)), 1.0 if end > 0 else -1.0
    edges = [-math.inf, *breakpoints, math.inf]
    steps = zip(slopes, edges[:-1], edges[1:], strict=True)
    return sign * sum(
        slope * max(min(high, ends[1]) - max(low, ends[0]), 0.0)
        for slope, low, high in steps
    )


def terms(expression):
    """An expression as the letters and the numbers of the format."""
    if isinstance(expression, str) and expression.startswith("v"):
        return [("v", int(expression[1:]))]
    if not isinstance(expression, tuple):
        return [("n", expression)]
    operator, *arguments = expression
    if operator == "pieces":
        slopes, breakpoints, argument = arguments
        numbers = [
            slopes[0],
            *(
                number
                for pair in zip(breakpoints, slopes[1:], strict=True)
                for number in pair
            ),
        ]
        return [
            ("o", 64),
            ("", len(slopes)),
            *(("n", number) for number in numbers),
            *terms(argument),
        ]
    number = 35 if operator == "if" else {**UNARY, **BINARY, **NARY}[operator][0]
    count = [("", len(arguments))] if operator in NARY else []
    return [
        ("o", number),
        *count,
        *(term for argument in arguments for term in terms(argument)),
    ]


def model(
    n, rows, bounds, *, start=None, common=(), objective=0, header=None, binary=False
):
    """A file with n variables.

    rows : of each row its side as in the format, linear part and expression. bounds :
    of each variable, as in the format. header : lines of the header, by number, in
    place of the right ones.
    """
    entries = sum(len(linear) for _, linear, _ in rows)
    lines = ["b3 1 1 0" if binary else "g3 1 1 0\t# problem", f" {n} {len(rows)} 1 0 0"]
    lines += [
        " 0 0 0 0 0 0",
        " 0 0",
        " 0 0 0",
        " 0 0 0 1",
        " 0 0 0 0 0",
        f" {entries} 0",
        " 0 0",
    ]
    lines += [f" {len(common)} 0 0 0 0"]
    for number, line in (header or {}).items():
        lines[number - 1] = line
    tokens = []
    for i, (linear, expression) in enumerate(common):
        tokens += [
            ("V", n + i),
            ("", len(linear)),
            ("", 0),
            *_linear(linear),
            *terms(expression),
        ]
    for i, (_, _, expression) in enumerate(rows):
        tokens += [("C", i), *terms(expression)]
    tokens += [
        ("O", 0),
        ("", 0),
        *terms(objective),
        ("x", len(start or {})),
        *_linear(start or {}),
    ]
    tokens += [("r", None), *(token for side, _, _ in rows for token in _side(side))]
    tokens += [("b", None), *(token for side in bounds for token in _side(side))]
    tokens += [("k", max(n - 1, 0)), *[("", 0)] * (n - 1)]
    for i, (_, linear, _) in enumerate(rows):
        if linear:
            tokens += [("J", i), ("", len(linear)), *_linear(linear)]
    text = "\n".join(lines) + "\n"
    return text.encode() + b"".join(map(_packed if binary else _line, tokens))


def _linear(linear):
    return [
        token
        for variable, factor in linear.items()
        for token in (("", variable), ("=", factor))
    ]


def _side(side):
    """The kind of a bound with its numbers, which for complementarity are integers."""
    kind, *numbers = side
    return [("kind", kind), *(("" if kind == 5 else "=", number) for number in numbers)]


def _line(token):
    letter, number = token
    shown = letter if letter not in ("=", "kind") else ""
    return f"{shown}{'' if number is None else number}\n".encode()


def _packed(token):
    letter, number = token
    if letter == "kind":
        return str(number).encode()
    code = b"" if letter == "=" else letter.encode()
    if number is None:
        return code
    return code + (
        struct.pack("<d", float(number))
        if letter in ("n", "=")
        else struct.pack("<i", number)
    )
