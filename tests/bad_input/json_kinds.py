"""What can be wrong with a problem in JSON: its text, its keys, M, q, and M in coordinates."""

from __future__ import annotations

import json
from typing import Any

from .kinds import GOOD, LONG, of_json


def of_M(name: str, M: str, *words: str) -> Any:
    return of_json(name, f'{{"M": {M}, "q": [-1, -1]}}', *words)


def of_q(name: str, q: str, *words: str) -> Any:
    return of_json(name, f'{{"M": [[2, 0], [0, 2]], "q": {q}}}', *words)


def of_key(name: str, key: str, value: str, *words: str) -> Any:
    return of_json(name, f'{GOOD[:-1]}, "{key}": {value}}}', *words)


def of_coo(name: str, parts: dict[str, Any], *words: str) -> Any:
    """A matrix in coordinate form with parts replaced, or left out where they are None."""
    whole = {"format": "coo", "shape": [2, 2], "rows": [0, 1], "cols": [0, 1], "values": [2, 2]} | parts
    M = json.dumps({key: value for key, value in whole.items() if value is not None})
    return of_M(f"coo-{name}", M, *words)


JSON = [
    of_json("broken", '{\n"M": [[1]],\n"q": [1,]}', "line 3, column", "not JSON", "correct"),
    of_json("payoffs", '{"payoffs": [[3, 0], [0, 2]]}', "payoffs:", "not a key", "of a game as A and B"),
    of_json("result", '{"version": "1", "status": "solved", "z": [1]}', "is a result, not a problem", "name the file"),
    of_json("truncated-below", GOOD[:-5] + "\n", "line 2, column 1: ends too early; is the file cut off?"),
    of_json("two-objects", GOOD + GOOD, f"line 1, column {len(GOOD) + 1}:", "not JSON"),
    of_json("list", "[[1, 2], [3, 4]]", "is a list", "object", "M and q"),
    of_json("text", '"M"', "is the text 'M'", "object", "M and q"),
    of_json("deeply-nested", '{"M": ' + "[" * 100_000 + "]" * 100_000 + ', "q": [1]}', "nested", "two levels"),
    of_json("no-M", '{"q": [1]}', " M:", "missing", "add"),
    of_json("no-q", '{"M": [[1]]}', "M, 1 x 1", "no q", "add q"),
    of_json("bounds-without-q", '{"M": [[1]], "lower": 0}', " q:", "is missing", "name the file of q"),
    of_json("matrix", '{"matrix": [[1]], "q": [1]}', " matrix:", "not a key", "did you mean M?"),
    of_key("unknown-key", "%", "1", " %:", "not a key", "the keys are", "M, q, lower, upper, x0, x1, solution"),
    of_key("line-separator-in-key", "a\\u2028b", "1", "a\\u2028b", "not a key"),
    of_key("long-key", LONG, "1", "aaa", "not a key"),
    of_key("q-twice", "q", "[1, 1]", " q:", "twice", "keep one"),
    of_key("x0-too-short", "x0", "[1]", " x0:", "1 entry", "2 unknowns"),
    of_key("x1-too-long", "x1", "[1, 2, 3]", " x1:", "3 entries", "2 unknowns"),
    of_key("solution-null", "solution", "null", " solution:", "null", "list of numbers"),
    of_key("second-solution-too-short", "solution", "[[1, 2], [1]]", " solution[1]:", "1 entry", "2 unknowns"),
    of_key("text-in-second-solution", "solution", '[[1, 2], [3, "4"]]', " solution[1][1]:", "text", "number"),
    of_key("name-number", "name", "3", " name:", "number", "text"),
    of_key("verdict-unknown", "verdict", '"maybe"', " verdict:", "'maybe'", "unknown", "infeasible, unsolvable, ray"),
]

MATRICES = [
    of_M("M-ragged", "[[2, 0], [1]]", " M[1]:", "1 entry", "same length"),
    of_M("M-wide", "[[2, 0, 1], [0, 2, 1]]", " M:", "2 x 3", "square"),
    of_M("M-number", "3", " M:", "number", "rows"),
    of_M("M-empty", "[]", " M:", "0 x 0", "2 entries", "agree"),
    of_M("M-of-empty-rows", "[[], []]", " M:", "2 x 0", "square"),
    of_M("M-flat", "[2, 0]", " M[0]:", "number", "row"),
    of_M("M-three-dimensional", "[[[2], [0]], [[0], [2]]]", " M[0][0]:", "list", "number"),
    of_M("M-too-large", "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]", " M:", "3 x 3", "2 entries", "agree"),
    of_M("text-in-M", '[[2, 0], ["0", 2]]', " M[1][0]:", "the text '0'", "number"),
    of_M("NaN-in-M", "[[2, 0], [NaN, 2]]", " M[1][0]:", "finite", "number"),
    of_M("1e999-in-M", "[[2, 0], [0, 1e999]]", " M[1][1]:", "finite", "double precision"),
    of_M("5000-digits-in-M", f"[[2, 0], [-1{'0' * 5000}, 2]]", " M[1][0]:", "finite", "double precision"),
    of_q("q-too-short", "[1]", "q has 1 entry", "2 x 2", "agree"),
    of_q("q-nested", "[[1, 2]]", " q[0]:", "list", "number"),
    of_q("q-empty", "[]", " M:", "2 x 2", "0 entries", "agree"),
    of_q("q-null", "null", " q:", "null", "list of numbers"),
    of_q("text-in-q", '[1, "2"]', " q[1]:", "text", "number"),
    of_q("false-in-q", "[1, false]", " q[1]:", "false", "number"),
    of_q("minus-1e999-in-q", "[1, -1e999]", " q[1]:", "finite", "double precision"),
    of_q("400-digits-in-q", f"[1{'0' * 400}, 1]", " q[0]:", "finite", "double precision"),
]

COORDINATES = [
    *(
        of_coo(f"no-{key}", {key: None}, f" M.{key}:", "missing", "add")
        for key in ["format", "shape", "rows", "cols", "values"]
    ),
    of_coo("unknown-format", {"format": "csr"}, " M.format:", "csr", '"coo"'),
    of_coo("format-number", {"format": 3}, " M.format:", "number", '"coo"'),
    of_coo("misspelt-part", {"rows": None, "row": [0, 1]}, " M.row:", "not a key", "did you mean rows?"),
    of_coo("index-out-of-range", {"rows": [0, 2]}, " M.rows[1]:", "is 2", "whole numbers from 0 to 1"),
    of_coo("index-negative", {"cols": [0, -1]}, " M.cols[1]:", "is -1", "whole numbers from 0 to 1"),
    of_coo("index-fractional", {"cols": [0.5, 1]}, " M.cols[0]:", "is 0.5", "whole numbers from 0 to 1"),
    of_coo("index-true", {"rows": [0, True]}, " M.rows[1]:", "true", "number"),
    of_coo("repeated-entry", {"rows": [1, 1], "cols": [0, 0]}, " M.rows[1]", "M.cols[1]", "again", "once"),
    of_coo("too-few-rows", {"rows": [0]}, " M.rows:", "1 entry", "M.values has 2", "agree"),
    of_coo("shape-beyond-memory", {"shape": [10**12, 10**12]}, " M.shape:", "1e+12 x 1e+12", "2 entries", "agree"),
    of_coo("shape-of-three", {"shape": [2, 2, 2]}, " M.shape:", "2 x 2 x 2", "2 entries", "agree"),
    of_coo("shape-of-none", {"shape": []}, " M.shape:", "empty"),
    of_coo("shape-number", {"shape": 2}, " M.shape:", "number", "list"),
    of_coo("value-NaN", {"values": [2, float("nan")]}, " M.values[1]:", "finite", "number"),
]
