"""Bad input is told in one line that names the place, the fault and the mend; nothing is printed or left behind."""

from __future__ import annotations

import gzip
import io
import json
import os
import sys
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lcpcli import Result, driver

from .conftest import Outcome

GOOD = '{"M": [[2, 0], [0, 2]], "q": [-1, -1]}'
LONG = "a" * 100_000
LONGEST_LINE = 1000
EYE, ONES = np.eye(2), np.ones(2)
HUGE = "1000000000000"
MTX = "%%MatrixMarket matrix"
ARRAY = f"{MTX} array real general\n2 2\n2\n0\n0\n2\n"


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


def of_file(name: str, content: str | bytes, line: str, *words: str) -> Any:
    """A command line in a folder that holds one more file."""
    return pytest.param(Kind(tuple(line.split(" ")), words, {name: content}), id=f"{line}-{'-'.join(words)}"[:60])


def of_mtx(name: str, content: str, *words: str) -> Any:
    """A matrix in a Matrix Market file beside q.csv."""
    kind = Kind(("solve", "bad.mtx", "q.csv"), ("bad.mtx: ", *words), {"bad.mtx": content})
    return pytest.param(kind, id=f"mtx-{name}")


def of_npz(name: str, content: bytes, *words: str) -> Any:
    return pytest.param(Kind(("solve", "bad.npz"), ("bad.npz:", *words), {"bad.npz": content}), id=f"npz-{name}")


def of_csr(name: str, parts: dict[str, Any], *words: str) -> Any:
    """A sparse matrix in an NPZ file with parts replaced, or left out where they are None."""
    whole = {"data": [1.0, 1.0], "indices": [0, 1], "indptr": [0, 1, 2], "shape": [2, 2], "q": ONES} | parts
    return of_npz(f"csr-{name}", archive(**{key: part for key, part in whole.items() if part is not None}), *words)


def archive(*unnamed: Any, **named: Any) -> bytes:
    file = io.BytesIO()
    np.savez(file, *unnamed, **named)
    return file.getvalue()


def npy(array: Any, shape: tuple[int, ...] | None = None) -> bytes:
    """An array as numpy.save writes it, but with that shape in its header."""
    file = io.BytesIO()
    header = {"descr": "<f8", "fortran_order": False, "shape": array.shape if shape is None else shape}
    np.lib.format.write_array_header_1_0(file, header)
    return file.getvalue() + array.tobytes()


def zip_of(files: dict[str, bytes]) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as writing:
        for name, content in files.items():
            writing.writestr(name, content)
    return file.getvalue()


def zipped(text: str) -> bytes:
    return gzip.compress(text.encode())


FILES = [
    of_line("missing-file", "solve elsewhere.txt", "elsewhere.txt:", "no such file", "check the path"),
    of_line("misspelt-file", "solve goood.json", "goood.json:", "no such file", "did you mean good.json?"),
    of_line("missing-folder", "solve nowhere/good.json", "nowhere/good.json:", "no folder nowhere"),
    of_line("missing-q-file", "solve M.csv qq.csv", "qq.csv:", "no such file", "did you mean q.csv?"),
    of_line("missing-file-to-compare", "compare good.json god.json", "god.json:", "no such file", "good.json"),
    of_line("no-name", "solve ", "empty", "file"),
    of_line("line-break-in-file-name", "solve a\nb.json", "a\\nb.json", "no such file"),
    of_line("file-name-not-utf-8", "solve \udcff.json", "\\udcff.json", "no such file"),
    of_line("directory", "solve results", "results:", "is a directory", "name a file"),
    of_line("unreadable", "solve /proc/self/mem", "/proc/self/mem:", "cannot be read"),
    of_line("link-to-itself", "solve loop", "loop:", "cannot be read"),
    of_json("empty", "", "is empty", "M and q"),
    of_json("only-blanks", " \r\n\t\n", "is empty", "M and q"),
    of_csv("q-not-last", "q;z1;z2\n1;2;3\n4;5;6\n", "line 1, column 1", "headed q", "last column"),
    of_csv("empty-csv", "", "is empty", "M and q"),
    of_json("latin-1", GOOD.replace("}", ', "name": "Schäfer"}').encode("latin-1"), "UTF-8"),
    of_json("utf-16", GOOD.encode("utf-16"), "UTF-8"),
    of_json("utf-16-without-mark", GOOD.encode("utf-16-le"), "UTF-8"),
    of_csv("csv-latin-1", "1,2 # ä\n".encode("latin-1"), "UTF-8"),
    of_csv("csv-utf-16", "2,-1\n".encode("utf-16"), "UTF-8"),
]

JSON = [
    of_json("broken", '{\n"M": [[1]],\n"q": [1,]}', "line 3, column", "not JSON", "correct"),
    of_json("truncated", GOOD[:-5], "line 1, column", "not JSON", "correct"),
    of_json("two-objects", GOOD + GOOD, f"line 1, column {len(GOOD) + 1}:", "not JSON"),
    of_json("list", "[[1, 2], [3, 4]]", "is a list", "object", "M and q"),
    of_json("number", "3", "is a number", "object", "M and q"),
    of_json("text", '"M"', "is the text 'M'", "object", "M and q"),
    of_json("null", "null", "is null", "object", "M and q"),
    of_json("deeply-nested", '{"M": ' + "[" * 100_000 + "]" * 100_000 + ', "q": [1]}', "nested", "two levels"),
    of_json("deeply-nested-objects", '{"M": ' * 100_000, "nested"),
    of_json("no-M", '{"q": [1]}', " M:", "missing", "add"),
    of_json("no-q", '{"M": [[1]]}', " q:", "missing", "add"),
    of_json("no-keys", "{}", " M:", "missing", "add"),
    of_json("lower-case-m", '{"m": [[1]], "q": [1]}', " m:", "no key", "did you mean M?"),
    of_json("upper-case-Q", '{"M": [[1]], "Q": [1]}', " Q:", "no key", "did you mean q?"),
    of_json("matrix", '{"matrix": [[1]], "q": [1]}', " matrix:", "no key", "did you mean M?"),
    of_key("sollution", "sollution", "[0, 0]", " sollution:", "no key", "did you mean solution?"),
    of_key("x_0", "x_0", "[0, 0]", " x_0:", "no key", "did you mean x0?"),
    of_key("unknown-key", "%", "1", " %:", "no key", "the keys are", "M, q, x0, x1, solution"),
    of_key("line-break-in-key", "a\\nb", "1", "a\\nb", "no key"),
    of_key("line-separator-in-key", "a\\u2028b", "1", "a\\u2028b", "no key"),
    of_key("long-key", LONG, "1", "aaa", "no key"),
    of_key("q-twice", "q", "[1, 1]", " q:", "twice", "keep one"),
    of_key("x0-too-short", "x0", "[1]", " x0:", "1 entry", "2 unknowns"),
    of_key("x1-too-long", "x1", "[1, 2, 3]", " x1:", "3 entries", "2 unknowns"),
    of_key("x0-null", "x0", "null", " x0:", "null", "list of numbers"),
    of_key("x1-number", "x1", "3", " x1:", "number", "list of numbers"),
    of_key("solution-too-short", "solution", "[1]", " solution:", "1 entry", "2 unknowns"),
    of_key("solution-empty", "solution", "[]", " solution:", "0 entries", "2 unknowns"),
    of_key("solution-null", "solution", "null", " solution:", "null", "list of numbers"),
    of_key("second-solution-too-short", "solution", "[[1, 2], [1]]", " solution[1]:", "1 entry", "2 unknowns"),
    of_key("second-solution-a-number", "solution", "[[1, 2], 3]", " solution[1]:", "number", "list of numbers"),
    of_key("text-in-second-solution", "solution", '[[1, 2], [3, "4"]]', " solution[1][1]:", "text", "number"),
    of_key("name-number", "name", "3", " name:", "number", "text"),
    of_key("note-null", "note", "null", " note:", "null", "text"),
    of_key("verdict-unknown", "verdict", '"maybe"', " verdict:", "'maybe'", "unknown", "infeasible, unsolvable, ray"),
    of_key("verdict-long", "verdict", f'"{LONG}"', " verdict:", "unknown", "infeasible, unsolvable, ray"),
    of_key("verdict-list", "verdict", '["ray"]', " verdict:", "list", "text"),
]

MATRICES = [
    of_M("M-ragged", "[[2, 0], [1]]", " M[1]:", "1 entry", "equally long"),
    of_M("M-wide", "[[2, 0, 1], [0, 2, 1]]", " M:", "2 x 3", "square"),
    of_M("M-tall", "[[2, 0], [0, 2], [1, 1]]", " M:", "3 x 2", "square"),
    of_M("M-number", "3", " M:", "number", "rows"),
    of_M("M-text", '"[[1]]"', " M:", "text", "rows"),
    of_M("M-null", "null", " M:", "null", "rows"),
    of_M("M-true", "true", " M:", "true", "rows"),
    of_M("M-empty", "[]", " M:", "empty", "rows"),
    of_M("M-of-empty-rows", "[[], []]", " M:", "2 x 0", "square"),
    of_M("M-flat", "[2, 0]", " M[0]:", "number", "row"),
    of_M("M-row-not-a-list", "[[2, 0], 3]", " M[1]:", "number", "row"),
    of_M("M-row-an-object", "[[2, 0], {}]", " M[1]:", "object", "row"),
    of_M("M-three-dimensional", "[[[2], [0]], [[0], [2]]]", " M[0][0]:", "list", "number"),
    of_M("M-too-large", "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]", " M:", "3 x 3", "2 entries", "agree"),
    of_M("text-in-M", '[[2, 0], ["0", 2]]', " M[1][0]:", "the text '0'", "number"),
    of_M("true-in-M", "[[2, 0], [0, true]]", " M[1][1]:", "true", "number"),
    of_M("null-in-M", "[[2, null], [0, 2]]", " M[0][1]:", "null", "number"),
    of_M("NaN-in-M", "[[2, 0], [NaN, 2]]", " M[1][0]:", "finite", "number"),
    of_M("Infinity-in-M", "[[2, Infinity], [0, 2]]", " M[0][1]:", "finite", "number"),
    of_M("minus-Infinity-in-M", "[[2, 0], [0, -Infinity]]", " M[1][1]:", "finite", "number"),
    of_M("1e999-in-M", "[[2, 0], [0, 1e999]]", " M[1][1]:", "finite", "double precision"),
    of_M("400-digits-in-M", f"[[2, 1{'0' * 400}], [0, 2]]", " M[0][1]:", "finite", "double precision"),
    of_M("5000-digits-in-M", f"[[2, 0], [-1{'0' * 5000}, 2]]", " M[1][0]:", "finite", "double precision"),
    of_q("q-too-short", "[1]", "q has 1 entry", "2 x 2", "agree"),
    of_q("q-too-long", "[1, 2, 3]", "q has 3 entries", "2 x 2", "agree"),
    of_q("q-nested", "[[1, 2]]", " q[0]:", "list", "number"),
    of_q("q-empty", "[]", " q:", "empty", "at least one"),
    of_q("q-number", "3", " q:", "number", "list of numbers"),
    of_q("q-object", "{}", " q:", "object", "list of numbers"),
    of_q("q-null", "null", " q:", "null", "list of numbers"),
    of_q("null-in-q", "[1, null]", " q[1]:", "null", "number"),
    of_q("text-in-q", '[1, "2"]', " q[1]:", "text", "number"),
    of_q("false-in-q", "[1, false]", " q[1]:", "false", "number"),
    of_q("NaN-in-q", "[NaN, 1]", " q[0]:", "finite", "number"),
    of_q("minus-1e999-in-q", "[1, -1e999]", " q[1]:", "finite", "double precision"),
    of_q("400-digits-in-q", f"[1{'0' * 400}, 1]", " q[0]:", "finite", "double precision"),
]

COORDINATES = [
    *(of_coo(f"no-{key}", {key: None}, f" M.{key}:", "missing", "add") for key in ("format", "shape", "rows", "cols")),
    of_coo("no-values", {"values": None}, " M.values:", "missing", "add"),
    of_coo("unknown-format", {"format": "csr"}, " M.format:", "csr", '"coo"'),
    of_coo("format-number", {"format": 3}, " M.format:", "number", '"coo"'),
    of_coo("misspelt-part", {"rows": None, "row": [0, 1]}, " M.row:", "no key", "did you mean rows?"),
    of_coo("index-out-of-range", {"rows": [0, 2]}, " M.rows[1]:", "is 2", "whole numbers from 0 to 1"),
    of_coo("index-negative", {"cols": [0, -1]}, " M.cols[1]:", "is -1", "whole numbers from 0 to 1"),
    of_coo("index-fractional", {"cols": [0.5, 1]}, " M.cols[0]:", "is 0.5", "whole numbers from 0 to 1"),
    of_coo("index-enormous", {"rows": [0, 1e300]}, " M.rows[1]:", "is 1e+300", "whole numbers from 0 to 1"),
    of_coo("index-true", {"rows": [0, True]}, " M.rows[1]:", "true", "number"),
    of_coo("indices-nested", {"rows": [[0, 1]]}, " M.rows[0]:", "list", "number"),
    of_coo("repeated-entry", {"rows": [1, 1], "cols": [0, 0]}, " M.rows[1]", "M.cols[1]", "again", "once"),
    of_coo("too-few-rows", {"rows": [0]}, " M.rows:", "1 entry", "M.values has 2", "agree"),
    of_coo("too-many-columns", {"cols": [0, 1, 1]}, " M.cols:", "3 entries", "M.values has 2", "agree"),
    of_coo("shape-too-large", {"shape": [3, 3]}, " M.shape:", "3 x 3", "2 entries", "agree"),
    of_coo("shape-beyond-memory", {"shape": [10**12, 10**12]}, " M.shape:", "1e+12 x 1e+12", "2 entries", "agree"),
    of_coo("shape-of-three", {"shape": [2, 2, 2]}, " M.shape:", "2 x 2 x 2", "2 entries", "agree"),
    of_coo("shape-of-none", {"shape": []}, " M.shape:", "empty"),
    of_coo("shape-number", {"shape": 2}, " M.shape:", "number", "list"),
    of_coo("value-text", {"values": [2, "2"]}, " M.values[1]:", "text", "number"),
    of_coo("value-NaN", {"values": [2, float("nan")]}, " M.values[1]:", "finite", "number"),
    of_M(
        "coo-shape-twice",
        '{"format": "coo", "shape": [2, 2], "shape": [3, 3], "rows": [], "cols": [], "values": []}',
        "shape:",
        "twice",
        "keep one",
    ),
]

CSV = [
    of_csv("ragged", "2,0,-1\n0,2\n", "line 2:", "2 columns", "line 1 has 3", "equally long"),
    of_csv("text-in-the-middle", "2,0,-1\n0,x,-1\n", "line 2, column 2:", "'x'", "number"),
    of_csv("long-text-in-the-middle", f"2,0,-1\n0,{LONG},-1\n", "line 2, column 2:", "number"),
    of_csv("two-headers", "a,b,c\nd,e,f\n2,0,-1\n0,2,-1\n", "line 2, column 1:", "'d'", "number"),
    of_csv("named-rows", "a,2,0,-1\nb,0,2,-1\n", "line 1, column 1:", "'a'", "number"),
    of_csv("empty-field", "# M | q\n\n2,0,-1\n0,,-1\n", "line 4, column 2:", "empty", "number"),
    of_csv("decimal-comma", "2;0;-1\n0;2,5;-1\n", "line 2, column 2:", "'2,5'", "decimal comma", "point"),
    of_csv("decimal-commas-throughout", "2,5;-1,5\n", "line 1, column 1:", "'2,5'", "decimal comma", "point"),
    of_csv("decimal-comma-with-tabs", "2,5\t-1\n", "line 1, column 1:", "decimal comma", "point"),
    of_csv("nan", "2,nan,-1\n0,2,-1\n", "line 1, column 2:", "nan", "finite"),
    of_csv("inf", "2,0,-1\n0,2,-inf\n", "line 2, column 3:", "-inf", "finite"),
    of_csv("1e999", "2,0,-1\n0,1e999,-1\n", "line 2, column 2:", "1e999", "finite", "double precision"),
    of_csv("5000-digits", f"2,0,-1\n0,1{'0' * 5000},-1\n", "line 2, column 2:", "1000", "finite", "double precision"),
    of_csv("nan-between-blanks", "2 0 -1\n0 nan -1\n", "line 2, column 2:", "nan", "finite"),
    of_csv("only-a-header", "a,b,c\n", "header", "no numbers", "row"),
    of_csv("only-comments", "# a\n# b\n", "no numbers", "row"),
    of_csv("M-without-q", "2,0\n0,2\n", "M, 2 x 2", "without q", "add q", "file for q"),
    of_csv("too-many-columns", "2,0,-1,0\n0,2,-1,0\n", "2 rows of 4 columns", "n + 1 columns"),
    of_csv("too-many-rows", "2,0,-1\n0,2,-1\n1,1,1\n1,1,1\n", "4 rows of 3 columns", "n + 1 columns"),
    of_csv("delimiter-at-the-end", "2,0,-1,\n0,2,-1,\n", "line 1, column 4:", "empty"),
    of_csv("unbalanced-quote", '2,0,-1\n0,"2,-1\n', "line 2:", "not CSV", "correct"),
    of_csv("underscore", "2,0,-1\n0,1_000,-1\n", "line 2, column 2:", "'1_000'", "not a number"),
    of_csv("underscores-throughout", "1_000,1_000\n", "line 1, column 1:", "'1_000'", "not a number"),
    of_csv("hexadecimal", "2,0,-1\n0,0x2,-1\n", "line 2, column 2:", "'0x2'", "not a number"),
    of_line("q-too-long-for-M", "solve M.csv q.csv", "M.csv:", "2 x 2", "q has 3 entries", "agree", q="1,2,3\n"),
    of_line("M-not-square", "solve M.csv q.csv", "M.csv:", "2 rows of 4 columns", "n columns", M="2,0,1,1\n0,2,1,1\n"),
    of_line("q-file-beside-q", "solve M.csv q.csv", "q.csv:", "not needed", "M.csv holds", M="2,0,1\n0,2,1\n"),
    of_line("q-a-matrix", "solve M.csv q.csv", "q.csv: q:", "2 rows and 2 columns", "one row", q="1,2\n3,4\n"),
    of_line("q-ragged", "solve M.csv q.csv", "q.csv: line 2:", "1 column", "equally long", q="1,2\n3\n"),
    of_line("text-in-q-file", "solve M.csv q.csv", "q.csv: line 1, column 2:", "'x'", "number", q="1,x\n"),
    of_line("text-in-M-file", "solve M.csv q.csv", "M.csv: line 2, column 1:", "'x'", "number", M="1,2\nx,4\n"),
    of_line("q-file-empty", "solve M.csv q.csv", "q.csv:", "empty", "one row", q=""),
    of_line("q-file-a-problem", "solve M.csv good.json", "good.json: q:", "object", "list of numbers"),
    of_line("q-file-nested-list", "solve M.csv q.csv", "q.csv: q[0]:", "list", "number", q="[[1, 2]]"),
    of_line("q-file-broken-list", "solve M.csv q.csv", "q.csv: line 1, column", "not JSON", q="[1, 2 "),
    of_line("q-file-with-JSON", "solve good.json q.csv", "q.csv:", "not needed", "good.json", "leave it out"),
]

MATRIX_MARKET = [
    of_mtx("json", GOOD, "line 1:", "no header", "begin with %%MatrixMarket"),
    of_mtx("no-header", "2 2\n1\n2\n3\n4\n", "line 1:", "no header", "begin with %%MatrixMarket"),
    of_mtx("vector", "%%MatrixMarket vector array real general\n2\n1\n2\n", "line 1:", "no header"),
    of_mtx("long-line", LONG, "line 1:", "no header"),
    of_mtx("table", f"{MTX} table real general\n2 2\n", "line 1:", "'table'", "array or coordinate"),
    of_mtx("pattern", f"{MTX} coordinate pattern general\n2 2 1\n1 1\n", "line 1:", "'pattern'", "real"),
    of_mtx("complex", f"{MTX} array complex general\n1 1\n1 0\n", "line 1:", "'complex'", "real"),
    of_mtx("hermitian", f"{MTX} array real hermitian\n1 1\n1\n", "line 1:", "'hermitian'", "general"),
    of_mtx("no-size", f"{MTX} array real general\n% comment\n", "ends before its size", "rows and columns"),
    of_mtx("only-a-header", f"{MTX} array real general", "ends before its size", "rows and columns"),
    of_mtx("one-size", f"{MTX} array real general\n2\n1\n", "line 2:", "'2'", "rows, columns"),
    of_mtx("negative-size", f"{MTX} coordinate real general\n% c\n-2 2 1\n", "line 3:", "'-2 2 1'", "entries"),
    of_mtx("no-rows", f"{MTX} array real general\n0 0\n", "M:", "0 x 0", "at least one entry"),
    of_mtx("cut-off", f"{MTX} array real general\n2 2\n1\n2\n", "M:", "4 entries", "cut off?"),
    of_mtx("cut-off-by-one", f"{MTX} array real general\n2 2\n10\n20\n30\n", "M:", "4 entries but has 3", "agree"),
    of_mtx("too-long", f"{MTX} array real general\n1 1\n1\n2\n", "M:", "1 entry but has 2", "agree"),
    of_mtx("decimal-comma", f"{MTX} array real general\n1 1\n1,5\n", "line 3:", "'1,5'", "one number"),
    of_mtx("text-after-number", f"{MTX} array real general\n1 1\n3x\n", "line 3:", "'3x'", "one number"),
    of_mtx("two-a-line", f"{MTX} array real general\n2 1\n1 2\n", "line 3:", "'1 2'", "one number"),
    of_mtx("comment-inside", f"{MTX} array real general\n1 1\n% c\n1\n", "line 3:", "'% c'", "one number"),
    of_mtx("nan", f"{MTX} array real general\n1 1\nnan\n", "line 3:", "'nan'", "one number"),
    of_mtx("overflow", f"{MTX} array real general\n2 2\n1\n1e999\n1\n1\n", "M[1][0]:", "finite"),
    of_mtx("fraction", f"{MTX} array integer general\n1 1\n1.5\n", "line 3:", "'1.5'", "whole number"),
    of_mtx("long-integer", f"{MTX} array integer general\n2 2\n1\n1\n{'9' * 999}\n1\n", "M[0][1]:", "finite"),
    of_mtx("no-value", f"{MTX} coordinate real general\n2 2 1\n1 1   \n", "line 3:", "'1 1'", "a row, a column"),
    of_mtx("out-of-range", f"{MTX} coordinate real general\n2 2 1\n3 1 1\n", "M:", "(3, 1)", "2 x 2", "from 1"),
    of_mtx("twice", f"{MTX} coordinate real general\n2 2 2\n1 2 1\n1 2 3\n", "M:", "(1, 2) twice", "once"),
    of_mtx("mirrored", f"{MTX} coordinate real symmetric\n2 2 2\n1 2 1\n2 1 3\n", "M:", "twice", "once"),
    of_mtx("skew-diagonal", f"{MTX} coordinate real skew-symmetric\n2 2 1\n1 1 1\n", "M:", "diagonal", "leave"),
    of_mtx("symmetric-oblong", f"{MTX} array real symmetric\n2 1\n1\n2\n", "M:", "symmetric but 2 x 1", "square"),
    of_mtx("oblong", f"{MTX} array real general\n2 3\n" + "1\n" * 6, "M:", "2 x 3", "square"),
    of_mtx("other-size", f"{MTX} coordinate real general\n3 3 1\n1 1 1\n", "3 x 3", "q has 2 entries", "agree"),
    of_mtx("huge", f"{MTX} coordinate real general\n{HUGE} {HUGE} 1\n1 1 1\n", HUGE, "q has 2 entries", "agree"),
    of_mtx("huge-array", f"{MTX} array real general\n{HUGE} {HUGE}\n1\n", "M:", "memory", "sparse"),
    of_mtx("many-entries", f"{MTX} coordinate real general\n2 2 {HUGE}\n1 1 1\n", "M:", HUGE, "cut off?"),
    of_mtx("empty", "", "is empty", "M and q"),
    of_file("alone.mtx", ARRAY, "solve alone.mtx", "alone.mtx:", "M, 2 x 2", "without q", "name a file for q"),
    of_file("M.mtx.gz", b"\x1f\x8b\x08", "solve M.mtx.gz q.csv", "M.mtx.gz:", "uncompressed", "again"),
    of_file("M.mtx.gz", zipped(ARRAY)[:-9], "solve M.mtx.gz q.csv", "M.mtx.gz:", "uncompressed", "again"),
    of_file("q.mtx", ARRAY, "solve M.csv q.mtx", "q.mtx: q:", "2 rows and 2 columns", "one row or one column"),
    of_file(
        "q.mtx", f"{MTX} coordinate real general\n{HUGE} 1 0\n", "solve M.csv q.mtx", "q.mtx: q:", "memory", "sparse"
    ),
    of_file("x.mtx", f"{MTX} array real general\n1 1\n1\n", "solve good.json --x0 x.mtx", "x.mtx: --x0:", "1 entry"),
]

NPZ = [
    of_npz("text", b"hello", "not NPZ", "not a zip file", "numpy.savez"),
    of_npz("cut-off", archive(M=EYE, q=ONES)[:-30], "not NPZ", "cut off?", "numpy.savez"),
    of_npz("cut-off-early", archive(M=EYE, q=ONES)[:50], "not NPZ", "cut off?"),
    of_npz("damaged", archive(M=EYE, q=ONES).replace(EYE.tobytes(), b"x" * 32), " M:", "cannot be read", "again"),
    of_npz("single-array", npy(EYE), "single array", "numpy.savez"),
    of_npz("no-array", zip_of({"M.npy": b"hello"}), " M:", "cannot be read", "again"),
    of_npz("other-files", zip_of({"readme.txt": b"hello"}), "readme.txt:", "cannot be read"),
    of_npz("twice", zip_of({"M.npy": npy(EYE), "M": npy(EYE)}), " M:", "twice", "keep one"),
    of_npz("no-keys", archive(), " M:", "missing", "add"),
    of_npz("no-M", archive(q=ONES), " M:", "missing", "add"),
    of_npz("no-q", archive(M=EYE), "M, 2 x 2", "without q", "add q"),
    of_npz("lower-case-m", archive(m=EYE, q=ONES), " m:", "no key", "did you mean M?"),
    of_npz("unnamed", archive(EYE, ONES), " arr_0:", "no key", "the keys are"),
    of_npz("objects", archive(M=EYE.astype(object), q=ONES), " M:", "objects", "numbers"),
    of_npz("name-of-objects", archive(M=EYE, q=ONES, name=np.array(None)), " name:", "objects"),
    of_npz("complex", archive(M=EYE * 1j, q=ONES), " M:", "complex128", "real numbers"),
    of_npz("bool", archive(M=EYE > 0, q=ONES), " M:", "bool", "real numbers"),
    of_npz("records", archive(M=np.zeros(2, dtype=[("a", float)]), q=ONES), " M:", "void", "real numbers"),
    of_npz("texts", archive(M=EYE, q=["a", "b"]), " q:", "str", "real numbers"),
    of_npz("nan", archive(M=EYE, q=[1, np.nan]), " q[1]:", "finite"),
    of_npz("one-dimension", archive(M=ONES, q=ONES), " M:", "1 dimension", "rows"),
    of_npz("other-size", archive(M=np.eye(3), q=ONES), " M:", "3 x 3", "q has 2 entries", "agree"),
    of_npz("x0-too-short", archive(M=EYE, q=ONES, x0=[1]), " x0:", "1 entry", "2 unknowns"),
    of_npz("solution-too-short", archive(M=EYE, q=ONES, solution=[1]), " solution:", "1 entry", "2 unknowns"),
    of_npz("name-number", archive(M=EYE, q=ONES, name=3), " name:", "int64", "text"),
    of_npz("verdict-unknown", archive(M=EYE, q=ONES, verdict="maybe"), " verdict:", "'maybe'", "unknown"),
    of_npz("huge", zip_of({"M.npy": npy(EYE, (10**9, 10**9))}), " M:", "1000000000 x 1000000000", "32 bytes", "again"),
    of_npz("negative", zip_of({"M.npy": npy(EYE, (-2, -2))}), " M:", "cannot be read"),
    of_csr("no-data", {"data": None}, " data:", "missing", "add"),
    of_csr("no-shape", {"shape": None}, " shape:", "missing", "add"),
    of_csr("beside-M", {"M": EYE}, " data:", "beside a dense M", "keep one"),
    of_csr("index-too-large", {"indices": [0, 7]}, " M:", "fit together", "save_npz"),
    of_csr("index-negative", {"indices": [0, -1]}, " M:", "fit together", "save_npz"),
    of_csr("index-a-fraction", {"indices": [0.0, 1.0]}, " indices:", "float64", "whole numbers"),
    of_csr("pointers-falling", {"indptr": [0, 5, 2]}, " M:", "fit together", "save_npz"),
    of_csr("pointers-too-few", {"indptr": [0, 2]}, " M:", "fit together", "save_npz"),
    of_csr("one-side", {"shape": [2]}, " shape:", "[2]", "two numbers"),
    of_csr("huge", {"shape": [10**12, 10**12]}, " M:", "fit together", "save_npz"),
    of_csr("negative", {"shape": [-2, -2]}, " M:", "fit together", "save_npz"),
    of_csr("unknown-format", {"format": "lil"}, " format:", "'lil'", "csr, csc"),
    of_csr("complex", {"data": [1j, 1]}, " M:", "complex128", "real numbers"),
    of_csr("nan", {"data": [1, np.nan]}, " M[1][1]:", "finite"),
    of_file("q.npz", archive(a=ONES, b=ONES), "solve M.csv q.npz", "q.npz: q:", "missing", "add the key q"),
    of_file("q.npz", archive(q=EYE), "solve M.csv q.npz", "q.npz: q:", "2 dimensions", "flat"),
    of_file("p.npz", archive(M=EYE, q=ONES), "solve p.npz q.csv", "q.csv:", "not needed", "p.npz holds", "leave"),
]

RESULT = '{"z": [0.5, 0.5], "w": [0, 0]}'
FROM_RESULTS = [
    of_file(
        "r.json", '{"z": [1], "w": [0]}', "solve good.json --x0 r.json", "r.json: --x0: z:", "1 entry", "2 unknowns"
    ),
    of_file("r.json", '{"z": [1, null], "w": [0, 0]}', "solve good.json --z0 r.json", "--z0: z[1]:", "null", "number"),
    of_file("r.json", '{"z": [1, 2]}', "solve good.json --x1 r.json", "r.json: --x1:", "without z and w", "list"),
    of_file("r.json", f"{RESULT} 3", "solve good.json --x0 r.json", "r.json: line 1, column", "not JSON"),
    of_file("r.json", RESULT[:-4], "solve good.json --x0 r.json", "r.json: line 1, column", "not JSON"),
    of_file("r.json", RESULT, "solve good.json --x0 r.json --z0 1,1", "--z0:", "--x0", "leave one out"),
    of_file("r.json", RESULT, "solve M.csv r.json", "r.json: q:", "object", "list of numbers"),
    of_solving("z0-text", "--z0 a,b", "--z0:", "'a,b'", "neither", "1,-2,0.5"),
    of_solving("z0-one-number", "--z0 1", "--z0:", "1 entry", "2 unknowns"),
    of_solving("z0-too-large", "--z0 1e308,1", "M z0 + q[0]:", "finite"),
]

STANDARD_INPUT = [
    of_stdin("stdin-empty", b"", "empty", "M and q"),
    of_stdin("stdin-blank", b"\n\n", "empty", "M and q"),
    of_stdin("stdin-broken-json", b'{"M": ', "line 1, column", "not JSON", "correct"),
    of_stdin("stdin-json-list", b"[[2, -1]]", "list", "object", "M and q"),
    of_stdin("stdin-bad-csv", b"2,0,-1\n0,x,-1\n", "line 2, column 2:", "'x'", "number"),
    of_stdin("stdin-latin-1", "ä".encode("latin-1"), "UTF-8"),
    of_stdin("stdin-bad-field", b'{"M": [[1]], "q": [true]}', "q[0]:", "true", "number"),
    of_stdin("stdin-bad-q", b"1,x\n", "line 1, column 2:", "'x'", "number", line="solve M.csv -"),
    of_stdin("stdin-json-with-q-file", GOOD.encode(), "q.csv:", "not needed", "leave it out", line="solve - q.csv"),
    of_stdin("stdin-for-M-and-q", b"2,0\n0,2\n", "file", line="solve - -"),
    of_stdin("stdin-for-two-problems", GOOD.encode(), "file", line="compare - -"),
]

OPTIONS = [
    of_solving("rho-half", "--method shi --rho 0.5", "--rho:", "0.5", "0 < rho < 1/2"),
    of_solving("rho-zero", "--method shi --rho 0", "--rho:", "0.0", "0 < rho < 1/2"),
    of_solving("rho-negative", "--method shi --rho -1", "--rho:", "-1.0", "0 < rho < 1/2"),
    of_solving("rho-nan", "--method shi --rho nan", "--rho:", "nan", "0 < rho < 1/2"),
    of_solving("sigma-not-above-rho", "--method shi --rho .3 --sigma .3", "--sigma:", "0.3", "rho < sigma < 1"),
    of_solving("sigma-below-default-rho", "--method shi --sigma 1e-5", "--sigma:", "1e-05", "rho < sigma < 1"),
    of_solving("sigma-one", "--method shi --sigma 1", "--sigma:", "1.0", "rho < sigma < 1"),
    of_solving("p-zero", "--method shi --p 0", "--p:", "0.0", "0 < p < infinity"),
    of_solving("p-negative", "--method shi --p -3", "--p:", "-3.0", "0 < p < infinity"),
    of_solving("p-infinite", "--method shi --p inf", "--p:", "inf", "0 < p < infinity"),
    of_solving("p-nan", "--method shi --p nan", "--p:", "nan", "0 < p < infinity"),
    of_solving("p-text", "--method shi --p large", "--p", "'large'", "float", "--help"),
    of_solving("k-star-zero", "--method shi --k-star 0", "--k-star: 0 ", "whole number >= 1"),
    of_solving("k-star-fractional", "--method shi --k-star 1.5", "--k-star", "'1.5'", "integer", "--help"),
    of_solving("omega-word", "--method fixed-point --omega best", "--omega", "best"),
    of_solving("anderson-negative", "--method fixed-point --anderson -1", "--anderson:", "-1", "whole number >= 0"),
    of_solving("anderson-for-shi", "--method shi --anderson 5", "--anderson:", "no effect", "shi", "leave it out"),
    of_solving("omega-zero", "--method fixed-point --omega 0", "--omega:", "0.0", "0 < omega < infinity"),
    of_solving("omega-negative", "--method fixed-point --omega -1", "--omega:", "-1.0", "0 < omega < infinity"),
    of_solving("omega-infinite", "--method fixed-point --omega inf", "--omega:", "inf", "0 < omega < infinity"),
    of_solving("tol-zero", "--tol 0", "--tol:", "0.0", "0 < tol < 1"),
    of_solving("tol-negative", "--tol -1e-9", "--tol:", "-1e-09", "0 < tol < 1"),
    of_solving("tol-one", "--tol 1", "--tol:", "1.0", "0 < tol < 1"),
    of_solving("tol-nan", "--tol nan", "--tol:", "nan", "0 < tol < 1"),
    of_solving("max-iterations-negative", "--max-iterations -1", "--max-iterations: -1 ", ">= 0"),
    of_solving("max-iterations-text", "--max-iterations many", "--max-iterations", "'many'", "integer"),
    of_solving("time-limit-zero", "--time-limit 0", "--time-limit:", "0.0", "seconds > 0"),
    of_solving("time-limit-negative", "--time-limit -1", "--time-limit:", "-1.0", "seconds > 0"),
    of_solving("time-limit-nan", "--time-limit nan", "--time-limit:", "nan", "seconds > 0"),
    of_solving("every-zero", "--every 0", "--every: 0 ", "whole number >= 1"),
    of_solving("every-negative", "--format csv --every -2", "--every:", "-2", "whole number >= 1"),
    of_solving("omega-for-shi", "--method shi --omega 1", "--omega:", "no effect", "shi", "leave it out"),
    of_solving("p-for-fixed-point", "--method fixed-point --p 1", "--p:", "no effect", "fixed-point", "leave it out"),
    of_solving("x1-for-fixed-point", "--method fixed-point --x1 1,1", "--x1:", "no effect", "fixed-point", "leave"),
    of_line("omega-for-shi-alone", "compare good.json --method shi --omega 2", "--omega:", "no effect", "shi"),
    of_solving("trace-as-table", "--trace", "--trace:", "no effect", "table", "leave it out"),
    of_solving("trace-as-csv", "--trace --format csv", "--trace:", "no effect", "csv", "leave it out"),
    of_solving("trace-unseen", "--trace --format json -q", "--trace:", "no effect", "leave it out"),
    of_solving("every-without-trace", "--every 2 --format json", "--every:", "no effect", "--trace"),
    of_solving("every-unseen", "--every 2 -q", "--every:", "no effect", "leave it out"),
    of_solving("unknown-method", "--method newton-raphson", "--method", "'newton-raphson'", "did you mean newton?"),
    of_solving("unknown-format", "--format xml", "--format", "'xml'", "choose one of table, json", "--help"),
    of_solving("misspelt-format", "--format jsn", "--format", "'jsn'", "did you mean json?"),
    of_solving("unknown-option", "--toll 1", "'--toll'", "did you mean --tol?", "lcp solve --help"),
    of_solving("unknown-option-with-value", "--toll=1", "no option '--toll';", "did you mean --tol?"),
    of_solving("option-with-one-dash", "-max-iterations 1", "'-max-iterations'", "did you mean --max-iterations?"),
    of_solving("beginning-of-an-option", "--max 1", "did you mean --max-iterations?"),
    of_solving("unlike-any-option", "--zzzzz", "'--zzzzz'", "lcp solve --help)"),
    of_solving("long-option", f"--{LONG}", "no option", "..."),
    of_solving("method-in-capitals", "--method NEWTON", "'NEWTON'", "did you mean newton?"),
    of_solving("unlike-any-method", "--method zzz", "'zzz'", "choose one of auto, shi"),
    of_solving("option-without-value", "--tol", "'--tol'", "--help"),
    of_line("unknown-command", "solv good.json", "'solv'", "did you mean solve?", "lcp --help"),
    of_line("misspelt-compare", "comapre", "lcp: no command 'comapre'; did you mean compare?"),
    of_line("beginning-of-a-command", "insp good.json", "did you mean inspect?"),
    of_line("unlike-any-command", "good.json", "'good.json'", "choose one of solve, compare"),
    of_line("long-command", LONG, "no command", "..."),
    of_line("misspelt-method-to-compare", "compare --method lemk", "lcp compare:", "did you mean lemke?"),
    of_line("misspelt-suite", "bench spase", "spase:", "did you mean sparse?"),
    of_line("misspelt-peer", "bench quick --peer ciconos", "--peer:", "did you mean siconos"),
    of_line("misspelt-family", "make obstcle", "'obstcle'", "did you mean obstacle?"),
    of_line("misspelt-parameter", "make contact --set fricton=1", "'fricton'", "did you mean friction?"),
    of_line("misspelt-shell", "completion bahs", "'bahs'", "did you mean bash?"),
    of_line("format-of-inspect", "inspect good.json --format jsno", "'jsno'", "did you mean json?"),
    of_line("unknown-option-of-lcp", "--fast", "--fast", "lcp --help"),
    of_line("no-file", "solve", "FILE", "missing", "lcp solve --help"),
    of_line("too-many-files", "solve M.csv q.csv good.json", "good.json", "unexpected", "lcp solve --help"),
]

STARTS = [
    of_solving("x0-text", "--x0 a,b", "--x0:", "'a,b'", "neither", "1,-2,0.5"),
    of_solving("x0-without-a-number", "--x0 1,,2", "--x0:", "'1,,2'", "neither", "1,-2,0.5"),
    of_solving("x0-missing-file", "--x0 start.csv", "--x0:", "'start.csv'", "neither", "name a file"),
    of_solving("x0-empty", "--x0 ", "--x0:", "name a file"),
    of_solving("x0-underscore", "--x0 1_0,1", "--x0:", "1_0", "numbers"),
    of_solving("x0-long-text", f"--x0 {'a' * 300}", "--x0:", "neither", "name a file"),
    of_solving("x0-one-number", "--x0 1", "--x0:", "1 entry", "2 unknowns"),
    of_solving("x0-three-numbers", "--x0 1,2,3", "--x0:", "3 entries", "2 unknowns"),
    of_solving("x0-nan", "--x0 1,nan", "--x0[1]:", "finite"),
    of_solving("x1-infinite", "--method shi --x1 inf,1", "--x1[0]:", "finite"),
    of_solving("x1-one-number", "--method shi --x1 1", "--x1:", "1 entry", "2 unknowns"),
    of_solving("x0-directory", "--x0 results", "results:", "is a directory", "name a file"),
    of_solving("x0-file-too-long", "--x0 start.csv", "start.csv:", "--x0:", "3 entries", "2 unknowns", start="1,2,3"),
    of_solving("x0-file-of-text", "--x0 start.csv", "start.csv: line 1, column 2:", "'x'", "number", start="1,x"),
    of_solving("x0-file-a-matrix", "--x0 M.csv", "M.csv: --x0:", "2 rows and 2 columns", "one row"),
    of_solving("x0-file-a-problem", "--x0 good.json", "good.json: --x0:", "object", "list of numbers"),
    of_solving("x0-file-empty", "--x0 start.csv", "start.csv:", "empty", "one row", start=""),
]

UNWRITABLE = [
    of_solving("output-into-no-folder", "-o nowhere/x.json", "nowhere/x.json:", "no folder", "make it first"),
    of_solving("output-below-a-file", "-o good.json/x.json", "good.json/x.json:", "no folder"),
    of_solving("output-a-directory", "-o results", "results:", "is a directory", "name a file"),
    of_solving("output-without-a-name", "-o ", "empty", "name a file"),
    of_solving("output-in-proc", "-o /proc/x.json", "/proc/x.json:", "cannot be written", "choose another"),
    of_solving("output-over-a-file-in-proc", "-o /proc/version", "/proc/version:", "cannot be written", "choose"),
    of_solving(
        "output-over-a-file-in-sys", "-o /sys/kernel/notes", "/sys/kernel/notes:", "cannot be written", "choose"
    ),
    of_solving("output-by-a-link-to-itself", "-o loop", "loop:", "cannot be written", "choose"),
    of_solving("output-name-too-long", f"-o {'a' * 300}", "aaa:", "cannot be written", "choose"),
]


@pytest.fixture
def meet(
    lcp: Callable[..., Outcome], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> Callable[[Kind], tuple[Outcome, bool]]:
    """Run a kind of bad input in a folder of its own: how it ends, and whether the folder is as it was."""

    def run(kind: Kind) -> tuple[Outcome, bool]:
        files = {"good.json": GOOD, "M.csv": "2,0\n0,2\n", "q.csv": "-1\n-1\n"} | kind.files
        for name, content in files.items():
            (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
        (tmp_path / "results").mkdir()
        (tmp_path / "loop").symlink_to("loop")
        monkeypatch.chdir(tmp_path)
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(kind.stdin)))
        before = contents(tmp_path)
        return lcp(*kind.arguments), contents(tmp_path) == before

    return run


def contents(folder: Path) -> dict[Path, bytes | None]:
    return {path: path.read_bytes() if path.is_file() else None for path in folder.rglob("*")}


def is_one_readable_line(text: str) -> bool:
    return text.endswith("\n") and text[:-1].isprintable() and len(text) <= LONGEST_LINE


@pytest.mark.parametrize(
    "kind",
    [
        *(*FILES, *JSON, *MATRICES, *COORDINATES, *CSV, *MATRIX_MARKET, *NPZ),
        *(*FROM_RESULTS, *STANDARD_INPUT, *OPTIONS, *STARTS, *UNWRITABLE),
    ],
)
def test_one_line_names_place_and_fault_and_mend(meet: Callable[[Kind], tuple[Outcome, bool]], kind: Kind) -> None:
    outcome, unchanged = meet(kind)
    assert is_one_readable_line(outcome.err), outcome.err[:LONGEST_LINE]
    assert [word for word in kind.words if word not in outcome.err] == [], outcome.err
    assert (outcome.code, outcome.out, unchanged) == (2, "", True)


@pytest.mark.parametrize("kind", UNWRITABLE)
def test_nothing_is_solved_for_an_output_that_cannot_be_written(
    meet: Callable[[Kind], tuple[Outcome, bool]], kind: Kind, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(driver, "run", lambda *_, **__: pytest.fail("solved in vain"))
    outcome, _ = meet(kind)
    assert outcome.code == 2


def test_nothing_is_solved_if_an_option_of_the_last_method_is_out_of_range(
    meet: Callable[[Kind], tuple[Outcome, bool]], monkeypatch: pytest.MonkeyPatch
) -> None:
    solved: list[Result] = []
    run = driver.run
    monkeypatch.setattr(driver, "run", lambda *given, **named: solved.append(run(*given, **named)) or solved[-1])
    line = "compare good.json --method fixed-point --method shi --rho 2"
    outcome, _ = meet(Kind(tuple(line.split()), ()))
    assert (outcome.code, solved) == (2, [])


@pytest.mark.parametrize("kind", [*JSON[:3], *MATRICES[:3], *CSV[:3], *OPTIONS[:3]])
def test_a_failing_run_leaves_the_old_output_as_it_is(meet: Callable[[Kind], tuple[Outcome, bool]], kind: Kind) -> None:
    outcome, unchanged = meet(Kind((*kind.arguments, "-o", "old.csv"), (), {**kind.files, "old.csv": "old"}))
    assert (outcome.code, unchanged) == (2, True)


def test_a_closed_standard_input_is_told_in_one_line(
    lcp: Callable[..., Outcome], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "stdin", None)
    outcome = lcp("solve", "-")
    assert is_one_readable_line(outcome.err)
    assert "standard input" in outcome.err
    assert (outcome.code, outcome.out) == (2, "")


def test_a_missing_file_in_a_folder_that_cannot_be_listed_is_told_in_one_line(
    lcp: Callable[..., Outcome], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(folder: Path) -> Iterator[Path]:
        raise PermissionError(13, os.strerror(13), str(folder))

    monkeypatch.setattr(Path, "iterdir", refuse)
    outcome = lcp("solve", str(tmp_path / "good.json"))
    assert is_one_readable_line(outcome.err)
    assert "no such file" in outcome.err
    assert (outcome.code, outcome.out) == (2, "")
