"""What can be wrong with bounds: their keys, their values, their columns, and the options that give them."""

from __future__ import annotations

from typing import Any

import numpy as np

from .json_kinds import of_key
from .kinds import GOOD, of_csv, of_file, of_json, of_line, of_solving, of_stdin
from .matrix_kinds import EYE, ONES, archive, mat, of_npz

GAME = '{"A": [[1]], "B": [[1]], "upper": 1}'
MIXED = GOOD[:-1] + ', "lower": [0, null], "upper": 1}'


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
    of_lower("object", "{}", " lower:", "object", "a number"),
    of_lower("text-in-list", '[0, "1"]', " lower[1]:", "text", "count from 0"),
    of_lower("nan-in-list", "[0, NaN]", " lower[1]:", "is not a number"),
    of_lower("infinite-in-list", "[0, 1e999]", " lower[1]:", "infinite"),
    of_lower("long-integer", f"[0, {'9' * 400}]", " lower[1]:", "infinite"),
    of_key("upper-minus-infinity", "upper", "-Infinity", " upper[0]:", "minus infinity", "inf for no bound"),
    of_key("upper-below-zero", "upper", "-1", " lower[0]:", "is 0", "upper[0] = -1"),
    of_both("crossed", "[0, 2]", "[1, 1]", " lower[1]:", "is 2, above upper[1] = 1", "count from 0"),
    of_both("second-too-short", "0", "[1]", " upper:", "1 entry", "2 unknowns"),
    of_npz("lower-square", archive(M=EYE, q=ONES, lower=EYE), " lower:", "2 dimensions"),
]

ELSEWHERE = [
    *(
        of_file(
            "p.mat", mat(M=EYE, q=ONES, **{name: held}), "solve p.mat", f"p.mat: {name}:", "lower and upper", "leave"
        )
        for name, held in (("lb", ONES), ("L", -1), ("bnds", EYE))
    ),
    of_file("g.json", GAME, "make --from-game g.json", "g.json: upper:", "not a key of a game", "leave it out"),
]

COLUMNS = [
    of_columns("without-q", "a,b,lower\n2,0,0\n0,2,0\n", "line 1:", "none for q"),
    of_columns("q-twice", "a,b,q,q,lower\n2,0,-1,-1,0\n0,2,-1,-1,0\n", "line 1:", "2 columns q", "keep one"),
    of_columns("lb", "a,b,q,lb\n2,0,-1,0\n0,2,-1,0\n", "line 1, column 4:", "'lb'", "call it lower"),
    of_columns("crossed", "a,b,q,lower,upper\n2,0,-1,0,1\n0,2,-1,2,1\n", " lower[1]:", "above upper[1]"),
    of_columns("infinite", "a,b,q,lower\n2,0,-1,inf\n0,2,-1,0\n", " lower[0]:", "infinite"),
    of_columns("wide", "a,b,c,q,lower\n2,0,0,-1,0\n0,2,0,-1,0\n", "2 rows and 3 columns of M"),
    of_columns("without-header", "2,0,-1,0,1\n0,2,-1,0,1\n", "2 rows of 5 columns", "q, lower and upper"),
    of_columns("cut-to-the-index", ",a,q\nx\n", "line 2:", "0 columns where line 1 has 2"),
]

GIVEN = [
    of_solving("lower-option-word", "--lower zero", "--lower:", "neither a file nor numbers", "none,0.5"),
    of_solving("lower-option-crossed", "--lower 1 --upper 0", "--lower[0]:", "above upper[0]"),
    of_solving("upper-option-negative", "--upper -1", "--upper:", "lower[0]", "above upper[0]"),
    of_solving("upper-option-long", "--upper 1,2,3", "--upper:", "3 entries", "2 unknowns"),
    of_solving("upper-option-fraction", "--upper 1/0,2", "--upper:", "not a fraction"),
    of_solving("lower-option-table", "--lower t.csv", "t.csv:", "--lower", "2 rows", t="1,2\n3,4\n"),
    of_solving("lower-option-empty-file", "--lower t.csv", "t.csv:", "is empty", "none", t=""),
    of_solving("lower-option-brackets", "--lower []", "--lower:", "neither a file nor numbers"),
    of_solving("infinity-zero", "--infinity 0", "--infinity:", "0.0", "size > 0"),
    of_solving("infinity-below-a-bound", "--lower 5 --upper 9 --infinity 4", "--infinity: lower[0]:", "is 5", "at 4"),
    of_line("infinity-of-many", "solve good.json good.json --infinity 0", "lcp: --infinity:", "size > 0"),
    of_line("infinity-of-a-suite", "bench quick --infinity 1e20", "--infinity:", "no effect", "suite", "name a file"),
    of_line("upper-overwritten", "convert M.csv q.csv --upper t.csv -o t.csv", "t.csv:", "another file", t="1\n1\n"),
    *(
        of_stdin(f"{line.split()[0]}-bounds-from-stdin", b"0\n0\n", "only once", line=f"{line} --lower - --upper -")
        for line in ("solve good.json", "check good.json 1,1", "inspect good.json", "compare good.json")
    ),
    of_file(
        "b.npz", archive(lower=[0, np.nan]), "solve good.json --lower b.npz", "--lower:", "b.npz: lower[1]:", "not a"
    ),
    of_file("b.npz", archive(x=ONES, y=ONES), "solve good.json --lower b.npz", "b.npz: lower:", "is missing"),
    of_mixed("convert mixed.json -o out.mtx", "out.mtx:", "cannot hold the bounds", ".json"),
    of_mixed("convert mixed.json -o out.npy", "out.npy:", "cannot hold the bounds", ".csv"),
    of_mixed("solve mixed.json --basis upper,upper,lower", "--basis", "3 entries"),
    of_mixed("solve mixed.json --basis lower,lower", "--basis[1]:", "no such bound"),
]

BOUNDS = [*NAMES, *VALUES, *ELSEWHERE, *COLUMNS, *GIVEN]
