"""What can be wrong with bounds: their keys, their values, their columns, and the options that give them."""

from __future__ import annotations

from typing import Any

import numpy as np

from .json_kinds import of_key
from .kinds import GOOD, LONG, of_csv, of_file, of_json, of_line, of_solving, of_stdin
from .matrix_kinds import EYE, ONES, archive, mat, of_npz

GAME = '{"A": [[1]], "B": [[1]], "upper": 1}'
MIXED = GOOD[:-1] + ', "lower": [0, null], "upper": 1}'


NAN_FILES = {"b.npz": archive(lower=np.array([0, np.nan])), "b.mat": mat(lower=[0, np.nan]), "b.json": "[0, NaN]"}


def of_lower(name: str, value: str, *words: str) -> Any:
    return of_key(f"lower-{name}", "lower", value, *words)


def of_both(name: str, lower: str, upper: str, *words: str) -> Any:
    return of_json(f"bounds-{name}", f'{GOOD[:-1]}, "lower": {lower}, "upper": {upper}}}', *words)


def of_columns(name: str, content: str, *words: str) -> Any:
    return of_csv(f"columns-{name}", content, *words)


def of_mixed(line: str, *words: str) -> Any:
    return of_file("mixed.json", MIXED, line, *words)


NAMES = [
    *(
        of_key(f"{key}-for-{meant}", key, "0", f" {key}:", "not a key", f"did you mean {meant}?")
        for meant, keys in (("lower", "l lb lo L low lowerbound"), ("upper", "u ub hi U high upperbound"))
        for key in keys.split()
    ),
    *(of_key(f"key-{key}", key, "[0, 1]", f" {key}:", "not a key", "lower and upper") for key in ("bounds", "box")),
]

VALUES = [
    of_lower("text", '"0"', " lower:", "text", "a number, or a list of numbers"),
    of_lower("word", '"none"', " lower:", "text"),
    of_lower("true", "true", " lower:", "true", "a number"),
    of_lower("object", "{}", " lower:", "object", "a number"),
    of_lower("empty", "[]", " lower:", "0 entries", "2 unknowns"),
    of_lower("too-short", "[0]", " lower:", "1 entry", "2 unknowns"),
    of_lower("too-long", "[0, 0, 0]", " lower:", "3 entries", "2 unknowns"),
    of_lower("text-in-list", '[0, "1"]', " lower[1]:", "text", "count from 0"),
    of_lower("true-in-list", "[0, true]", " lower[1]:", "true"),
    of_lower("list-in-list", "[[0], [1]]", " lower[0]:", "list"),
    of_lower("nan", "NaN", " lower[0]:", "is not a number", "count from 0"),
    of_lower("nan-in-list", "[0, NaN]", " lower[1]:", "is not a number"),
    of_lower("infinite", "Infinity", " lower[0]:", "infinite", "-inf"),
    of_lower("infinite-in-list", "[0, 1e999]", " lower[1]:", "infinite"),
    of_lower("long-integer", f"[0, {'9' * 400}]", " lower[1]:", "infinite"),
    of_key("upper-minus-infinity", "upper", "-Infinity", " upper[0]:", "minus infinity", "inf for no bound"),
    of_key("upper-minus-infinity-in-list", "upper", "[1, -Infinity]", " upper[1]:", "minus infinity"),
    of_key("upper-nan", "upper", "[NaN, 1]", " upper[0]:", "is not a number"),
    of_key("upper-text", "upper", '"1"', " upper:", "text"),
    of_key("upper-below-zero", "upper", "-1", " lower[0]:", "is 0", "upper[0] = -1"),
    of_both("crossed", "[0, 2]", "[1, 1]", " lower[1]:", "is 2, above upper[1] = 1", "count from 0"),
    of_both("all-crossed", "1", "0", " lower[0]:", "above upper[0]"),
    of_both("second-too-short", "0", "[1]", " upper:", "1 entry", "2 unknowns"),
    of_json("bounds-twice", f'{GOOD[:-1]}, "lower": 0, "lower": 1}}', " lower:", "twice", "keep one"),
    of_npz("lower-text", archive(M=EYE, q=ONES, lower=np.array("a")), " lower:"),
    of_npz("lower-complex", archive(M=EYE, q=ONES, lower=np.array([1j, 0])), " lower:", "complex"),
    of_npz("lower-square", archive(M=EYE, q=ONES, lower=EYE), " lower:", "2 dimensions"),
    of_npz("lower-long", archive(M=EYE, q=ONES, lower=np.zeros(3)), " lower:", "3 entries", "2 unknowns"),
    of_npz("lower-nan", archive(M=EYE, q=ONES, lower=np.array([0, np.nan])), " lower[1]:", "is not a number"),
    of_npz("lower-without-q", archive(M=EYE, lower=ONES), " q:", "is missing", "name the file of q"),
    of_npz("lb", archive(M=EYE, q=ONES, lb=ONES), " lb:", "did you mean lower?"),
]

ELSEWHERE = [
    *(
        of_file(
            "p.mat", mat(M=EYE, q=ONES, **held), "solve p.mat", f"p.mat: {name}:", "lower and upper", "leave it out"
        )
        for name, held in {"lb": {"lb": ONES}, "L": {"L": -1}, "xu": {"xu": ONES}, "bnds": {"bnds": EYE}}.items()
    ),
    of_file("g.json", GAME, "make --from-game g.json", "g.json: upper:", "not a key of a game", "leave it out"),
]

COLUMNS = [
    of_columns("without-q", "a,b,lower\n2,0,0\n0,2,0\n", "line 1:", "none for q"),
    of_columns("q-twice", "a,b,q,q,lower\n2,0,-1,-1,0\n0,2,-1,-1,0\n", "line 1:", "2 columns q", "keep one"),
    of_columns("lower-twice", "a,b,q,lower,lower\n2,0,-1,0,0\n0,2,-1,0,0\n", "line 1:", "2 columns lower"),
    of_columns("lb", "a,b,q,lb\n2,0,-1,0\n0,2,-1,0\n", "line 1, column 4:", "'lb'", "call it lower"),
    of_columns("ub", "a,b,q,lower,ub\n2,0,-1,0,1\n0,2,-1,0,1\n", "line 1, column 5:", "'ub'", "call it upper"),
    of_columns("text", "a,b,q,lower\n2,0,-1,zero\n0,2,-1,0\n", "line 2, column 4:", "'zero'"),
    of_columns("nan", "a,b,q,upper\n2,0,-1,1\n0,2,-1,nan\n", "line 3, column 4:", "nan"),
    of_columns("empty-q", "a,b,q,lower\n2,0,,0\n0,2,-1,0\n", "line 2, column 3:", "empty"),
    of_columns("empty-M", "a,b,q,lower\n2,,-1,0\n0,2,-1,0\n", "line 2, column 2:", "empty"),
    of_columns("infinite", "a,b,q,lower\n2,0,-1,inf\n0,2,-1,0\n", " lower[0]:", "infinite"),
    of_columns("crossed", "a,b,q,lower,upper\n2,0,-1,0,1\n0,2,-1,2,1\n", " lower[1]:", "above upper[1]"),
    of_columns("wide", "a,b,c,q,lower\n2,0,0,-1,0\n0,2,0,-1,0\n", "2 rows and 3 columns of M"),
    of_columns("without-header", "2,0,-1,0,1\n0,2,-1,0,1\n", "2 rows of 5 columns", "q, lower and upper"),
    of_columns("ragged", "a,b,q,lower\n2,0,-1\n0,2,-1,0\n", "line 3:", "4 columns where line 2 has 3"),
    of_columns("cut", "a,b,q,lower\n2,0\n0,2\n", "line 2:", "2 columns where line 1 has 4"),
    of_columns("cut-index", ",a,b,q,lower\nx,2\ny,0\n", "line 2:", "1 column where line 1 has 4"),
    of_columns("cut-to-the-index", ",a,q\nx\n", "line 2:", "0 columns where line 1 has 2"),
]

GIVEN = [
    of_solving("lower-option-word", "--lower zero", "--lower:", "neither a file nor numbers", "none,0.5"),
    of_solving("lower-option-crossed", "--lower 1 --upper 0", "--lower[0]:", "above upper[0]"),
    of_solving("lower-option-infinite", "--lower inf", "--lower[0]:", "infinite"),
    of_solving("lower-option-nan", "--lower nan", "--lower[0]:", "is not a number"),
    of_solving("upper-option-negative", "--upper -1", "--upper:", "lower[0]", "above upper[0]"),
    of_solving("upper-option-long", "--upper 1,2,3", "--upper:", "3 entries", "2 unknowns"),
    of_solving("upper-option-fraction", "--upper 1/0,2", "--upper:", "not a fraction"),
    of_solving("lower-option-directory", "--lower results", "results:", "is a directory"),
    of_solving("lower-option-table", "--lower t.csv", "t.csv:", "--lower", "2 rows", t="1,2\n3,4\n"),
    of_solving("lower-option-empty-file", "--lower t.csv", "t.csv:", "is empty", "none", t=""),
    of_solving("lower-option-words", "--lower t.csv", "t.csv:", "line 2", "'b'", t="a\nb\n1\n"),
    of_solving("lower-option-short-file", "--lower t.csv", "--lower:", "t.csv", "1 entry", t="1\n"),
    of_solving("lower-option-empty", "--lower ", "--lower:", "neither a file nor numbers"),
    of_solving("lower-option-brackets", "--lower []", "--lower:", "neither a file nor numbers"),
    of_solving("lower-option-long-text", f"--lower {LONG}", "--lower:", "neither a file nor numbers"),
    of_solving("infinity-zero", "--infinity 0", "--infinity:", "0.0", "size > 0"),
    of_solving("infinity-negative", "--infinity -1e20", "--infinity:", "-1e+20", "size > 0"),
    of_solving("infinity-nan", "--infinity nan", "--infinity:", "nan", "size > 0"),
    of_solving("infinity-text", "--infinity none", "--infinity", "'none'", "float", "--help"),
    of_solving(
        "infinity-of-lower", "--lower 5 --upper 9 --infinity 4", "--infinity: lower[0]:", "it is 5", "begins at 4"
    ),
    of_line("infinity-of-many", "solve good.json good.json --infinity 0", "lcp: --infinity:", "size > 0"),
    of_line("infinity-of-a-suite", "bench quick --infinity 1e20", "--infinity:", "no effect", "suite", "name a file"),
    of_solving("lower-option-overwritten", "--lower t.csv -o t.csv", "t.csv:", "holds the problem", t="0\n0\n"),
    of_line("upper-overwritten", "convert M.csv q.csv --upper t.csv -o t.csv", "t.csv:", "another file", t="1\n1\n"),
    *(
        of_stdin(f"{line.split()[0]}-bounds-from-stdin", b"0\n0\n", "only once", line=f"{line} --lower - --upper -")
        for line in ("solve good.json", "check good.json 1,1", "inspect good.json", "compare good.json")
    ),
    *(
        of_file(name, content, f"solve good.json --lower {name}", "--lower:", f"{name}:", "lower[1]:", "not a number")
        for name, content in NAN_FILES.items()
    ),
    of_file("b.npz", archive(x=ONES, y=ONES), "solve good.json --lower b.npz", "b.npz: lower:", "is missing"),
    of_file("b.json", '{"lower": 1}', "solve good.json --lower b.json", "b.json:", "lower", "object"),
    of_file("b.json", "[0, 1", "solve good.json --lower b.json", "b.json:", "ends too early"),
    of_mixed("convert mixed.json -o out.mtx", "out.mtx:", "cannot hold the bounds", ".json"),
    of_mixed("convert mixed.json -o out.npy", "out.npy:", "cannot hold the bounds", ".csv"),
    of_mixed("solve mixed.json --basis upper,upper,lower", "--basis", "3 entries"),
    of_mixed("solve mixed.json --basis lower,lower", "--basis[1]:", "no such bound"),
]

BOUNDS = [*NAMES, *VALUES, *ELSEWHERE, *COLUMNS, *GIVEN]
