"""Kinds of bad input, each a command line, the files that it meets, and what the line about it must contain: files of
any format, CSV, standard input, and problems in JSON."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from typing import Any

import pytest

GOOD = '{"M": [[2, 0], [0, 2]], "q": [-1, -1]}'
LONG = "a" * 100_000


@dataclass(frozen=True)
class Kind:
    """A bad command line, the files and the standard input that it meets, and what the line must contain."""

    arguments: tuple[str, ...]
    words: tuple[str, ...]
    files: dict[str, str | bytes] = field(default_factory=dict)
    stdin: bytes = b""


def of_line(name: str, line: str, *words: str, stdin: bytes = b"", **files: str | bytes) -> Any:
    """A command line in a folder with good.json, M.csv, q.csv, results/ and loop -> loop; files by their stems."""
    named = {f"{stem}.csv": content for stem, content in files.items()}
    return pytest.param(Kind(tuple(line.split(" ")), words, named, stdin), id=name)


def of_json(name: str, content: str | bytes, *words: str) -> Any:
    return pytest.param(Kind(("solve", "bad.json"), ("bad.json: ", *words), {"bad.json": content}), id=name)


def of_csv(name: str, content: str | bytes, *words: str) -> Any:
    return pytest.param(Kind(("solve", "bad.csv"), ("bad.csv: ", *words), {"bad.csv": content}), id=name)


def of_stdin(name: str, content: bytes, *words: str, line: str = "solve -") -> Any:
    return of_line(name, line, "standard input", *words, stdin=content)


def of_solving(name: str, options: str, *words: str, **files: str | bytes) -> Any:
    return of_line(name, f"solve good.json {options}", *words, **files)


def of_file(name: str, content: str | bytes, line: str, *words: str) -> Any:
    """A command line in a folder that holds one more file."""
    return pytest.param(Kind(tuple(line.split(" ")), words, {name: content}), id=f"{line}-{'-'.join(words)}"[:60])


FILES = [
    of_line("missing-file", "solve elsewhere.txt", "elsewhere.txt:", "no such file", "check the path"),
    of_line("misspelt-file", "solve goood.json", "goood.json:", "no such file", "did you mean good.json?"),
    of_line("missing-folder", "solve nowhere/good.json", "nowhere/good.json:", "no folder nowhere"),
    of_line("missing-q-file", "solve M.csv qq.csv", "qq.csv:", "no such file", "did you mean q.csv?"),
    of_line("no-name", "solve ", "empty", "file"),
    of_line("line-break-in-file-name", "solve a\nb.json", "a\\nb.json", "no such file"),
    of_line("file-name-not-utf-8", "solve \udcff.json", "\\udcff.json", "no such file"),
    of_line("directory", "inspect results", "results:", "is a directory", "name a file"),
    of_line("unreadable", "solve /proc/self/mem", "/proc/self/mem:", "cannot be read"),
    of_json("empty", "", "is empty", "M and q"),
    of_csv("q-not-last", "q;z1;z2\n1;2;3\n4;5;6\n", "line 1, column 1", "headed q", "last column"),
    of_json("latin-1", GOOD.replace("}", ', "name": "Schäfer"}').encode("latin-1"), "UTF-8"),
    of_csv("csv-utf-16-cut-off", "2,-1\n".encode("utf-16")[:-1], "UTF-8"),
]
CSV = [
    of_csv("ragged", "2,0,-1\n0,2\n", "line 2:", "2 columns", "line 1 has 3", "same number of columns"),
    of_csv("text-in-the-middle", "2,0,-1\n0,x,-1\n", "line 2, column 2:", "'x'", "number"),
    of_csv("empty-field", "# M | q\n\n2,0,-1\n0,,-1\n", "line 4, column 2:", "empty", "number"),
    of_csv("thousands", "1.000,5;0;-1\n0;2,5;-1\n", "line 1, column 1:", "'1.000,5'", "decimal commas", "thousands"),
    of_csv("thousands-alone", "1.000;0;-1\n0;2,5;-1\n", "line 1, column 1:", "'1.000'", "decimal commas"),
    of_csv("index-without-header", "0,2,0,-1\n1,0,2,-1\n", "2 rows of 4 columns", "an index?", "index=False"),
    of_csv("numbered-columns", "0,1\n2,0\n0,2\n", "3 rows of 2 columns", "number the columns?", "header=False"),
    of_csv("complex", "2,0,-1\n0,1+2j,-1\n", "line 2, column 2:", "'1+2j'", "real problems"),
    of_csv("spreadsheet-error-first", "2;0;-1\n#NV;0;1\n0;2;-1\n", "line 2, column 1:", "'#NV', not a number"),
    of_csv("nan", "2,nan,-1\n0,2,-1\n", "line 1, column 2:", "nan", "finite"),
    of_csv("only-a-header", "a,b,c\n", "header", "no numbers", "row"),
    of_csv("M-without-q", "2,0\n0,2\n", "M, 2 x 2", "no q", "add q", "name the file of q after it"),
    of_csv("too-many-columns", "2,0,-1,0\n0,2,-1,0\n", "2 rows of 4 columns", "n + 1 columns"),
    of_csv("unbalanced-quote", '2,0,-1\n0,"2,-1\n', "line 2:", "not CSV", "correct"),
    of_line("q-too-long-for-M", "solve M.csv q.csv", "M.csv:", "2 x 2", "q has 3 entries", "agree", q="1,2,3\n"),
    of_line("q-file-beside-q", "solve M.csv q.csv", "q.csv:", "not needed", "M.csv contains", M="2,0,1\n0,2,1\n"),
    of_line("q-a-matrix", "solve M.csv q.csv", "q.csv: q:", "3 x 2", "M is 2 x 2", "one column", q="1,2\n3,4\n5,6\n"),
    of_line("q-file-empty", "solve M.csv q.csv", "q.csv:", "empty", "one row", q=""),
    of_line("q-file-a-problem", "solve M.csv good.json", "good.json: q:", "object", "list of numbers"),
    of_line("q-file-broken-list", "solve M.csv q.csv", "q.csv: line 1, column", "too early", q="[1, 2 "),
]
STANDARD_INPUT = [
    of_stdin("stdin-latin-1", "ä".encode("latin-1"), "UTF-8"),
    of_stdin("stdin-json-with-q-file", GOOD.encode(), "q.csv:", "not needed", "leave it out", line="solve - q.csv"),
    of_stdin("stdin-for-M-and-q", b"2,0\n0,2\n", "file", line="solve - -"),
    of_stdin("stdin-for-two-problems", GOOD.encode(), "file", line="compare - -"),
]


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
    of_json("deeply-nested", '{"M": ' + "[" * 100_000 + "]" * 100_000 + ', "q": [1]}', "nested", "two levels"),
    of_json("no-M", '{"q": [1]}', " M:", "missing", "add"),
    of_json("no-q", '{"M": [[1]]}', "M, 1 x 1", "no q", "add q"),
    of_json("bounds-without-q", '{"M": [[1]], "lower": 0}', " q:", "is missing", "name the file of q"),
    of_json("matrix", '{"matrix": [[1]], "q": [1]}', " matrix:", "not a key", "did you mean M?"),
    of_key("unknown-key", "%", "1", " %:", "not a key", "the keys are", "M, q, lower, upper, x0, x1, solution"),
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
    of_M("M-flat", "[2, 0]", " M[0]:", "number", "row"),
    of_M("M-too-large", "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]", " M:", "3 x 3", "2 entries", "agree"),
    of_M("text-in-M", '[[2, 0], ["0", 2]]', " M[1][0]:", "the text '0'", "number"),
    of_M("NaN-in-M", "[[2, 0], [NaN, 2]]", " M[1][0]:", "finite", "number"),
    of_M("1e999-in-M", "[[2, 0], [0, 1e999]]", " M[1][1]:", "finite", "double precision"),
    of_q("q-too-short", "[1]", "q has 1 entry", "2 x 2", "agree"),
    of_q("q-null", "null", " q:", "null", "list of numbers"),
    of_q("false-in-q", "[1, false]", " q[1]:", "false", "number"),
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
    of_coo("index-negative", {"cols": [0, -1]}, " M.cols[1]:", "-1)", "whole numbers from 0 to 1"),
    of_coo("index-fractional", {"cols": [0.5, 1]}, " M.cols[0]:", "0.5)", "whole numbers from 0 to 1"),
    of_coo("index-true", {"rows": [0, True]}, " M.rows[1]:", "true", "number"),
    of_coo("repeated-entry", {"rows": [1, 1], "cols": [0, 0]}, " M.rows[1]", "(1, 0)", "again", "once"),
    of_coo("too-few-rows", {"rows": [0]}, " M.rows:", "1 entry", "2 values", "agree"),
    of_coo("shape-beyond-memory", {"shape": [10**12, 10**12]}, " M.shape:", "1e+12 x 1e+12", "2 entries", "agree"),
    of_coo("shape-number", {"shape": 2}, " M.shape:", "number", "list"),
    of_coo("value-NaN", {"values": [2, float("nan")]}, " M.values[1]:", "finite", "number"),
]
