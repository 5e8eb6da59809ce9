"""What can be wrong with options, starts and places for the output, with bounds, and with programs."""

from __future__ import annotations

import gzip
import json
from functools import partial
from typing import Any

import numpy as np

from .kinds import GOOD, of_csv, of_file, of_json, of_key, of_line, of_solving, of_stdin
from .matrix_kinds import EYE, ONES, archive, mat, of_npz

RESULT = '{"z": [0.5, 0.5], "w": [0, 0]}'
FROM_RESULTS = [
    of_file("r.json", '{"z": [1], "w": [0]}', "solve good.json --x0 r.json", "r.json: --x0: z:", "1 entry", "2 unkn"),
    of_file("r.json", '{"z": [1, null], "w": [0, 0]}', "solve good.json --z0 r.json", "--z0: z[1]:", "null", "number"),
    of_file("r.json", '{"z": [1, 2]}', "solve good.json --x1 r.json", "r.json: --x1:", "without z and w", "list"),
    of_file("r.json", RESULT[:-4], "solve good.json --x0 r.json", "r.json: line 1, column", "too early"),
    of_file("r.json", RESULT, "solve good.json --x0 r.json --z0 1,1", "--z0:", "--x0", "leave one out"),
    of_solving("z0-text", "--z0 a,b", "--z0:", "'a,b'", "neither", "1,-2,0.5"),
    of_solving("z0-too-large", "--z0 1e308,1", "M z0 + q[0]:", "finite"),
]
OPTIONS = [
    of_solving("rho-half", "--method shi --rho 0.5", "--rho:", "0.5", "0 < rho < 1/2"),
    of_solving("sigma-not-above-rho", "--method shi --rho .3 --sigma .3", "--sigma:", "0.3", "rho < sigma < 1"),
    of_solving("sigma-one", "--method shi --sigma 1", "--sigma:", "1.0", "rho < sigma < 1"),
    of_solving("p-zero", "--method shi --p 0", "--p:", "0.0", "0 < p < infinity"),
    of_solving("p-text", "--method shi --p large", "--p", "'large'", "float"),
    of_solving("k-star-zero", "--method shi --k-star 0", "--k-star: 0 ", "whole number >= 1"),
    of_solving("k-star-fractional", "--method shi --k-star 1.5", "--k-star", "'1.5'", "integer"),
    of_solving("anderson-negative", "--method fixed-point --anderson -1", "--anderson:", "-1", "whole number >= 0"),
    of_solving("k-star-for-auto", "--k-star 2", "has no effect with auto; it belongs to shi: add --method shi"),
    of_line(
        "k-star-for-two", "compare --method newton --method lemke --k-star 2", "no effect with newton and lemke; it"
    ),
    of_solving("omega-zero", "--method fixed-point --omega 0", "--omega:", "0.0", "0 < omega < infinity"),
    of_solving("tol-zero", "--tol 0", "--tol:", "0.0", "0 < tol < 1"),
    of_solving("max-iterations-negative", "--max-iterations -1", "--max-iterations: -1 ", ">= 0"),
    of_solving("time-limit-zero", "--time-limit 0", "--time-limit:", "0.0", "seconds > 0"),
    of_solving("threads-huge", f"--threads {10**29}", "--threads", "out of range"),
    of_solving("walkers-huge", f"--method reflections --walkers {10**29}", "--walkers", "out of range"),
    of_solving("objective-of-no-unknown", "--minimize foo", "lcp: --minimize: names 'foo'"),
    of_solving("every-huge", f"--every {'9' * 400}", "lcp: --every: is too large; it must be: whole number >= 1\n"),
    of_solving("every-zero", "--every 0", "--every: 0 ", "whole number >= 1"),
    of_solving("x1-for-fixed-point", "--method fixed-point --x1 1,1", "--x1:", "no effect", "fixed-point", "leave"),
    of_solving("bound-unseen", "--bound -q", "--bound:", "no effect", "leave it out"),
    of_solving("bound-in-csv", "--bound --format csv", "--bound:", "no effect", "holds no proofs"),
    of_solving("trace-to-json", "--trace t.json", "--trace:", "t.json", ".csv"),
    of_solving("trace-over-a-file", "--trace q.csv", "--trace:", "q.csv exists", "another file", q="1,2\n"),
    of_solving("trace-over-the-output", "-o t.csv --trace t.csv", "--trace:", "same file as --output"),
    of_solving("trace-unseen", "--trace --format json -q", "--trace:", "no effect", "leave it out"),
    of_solving("unknown-method", "--method newton-raphson", "--method", "'newton-raphson'", "did you mean newton?"),
    of_solving("unknown-format", "--format xml", "--format", "'xml'", "choose one of table, json"),
    of_solving("unknown-option-with-value", "--toll=1", "--toll: is not an option of lcp solve; did you mean --tol?"),
    of_solving("option-with-one-dash", "-max-iterations 1", "-max-iterations: is no", "did you mean --max-iterations?"),
    of_solving("format-as-an-option", "--json", "--json: is not an option of lcp solve; did you mean --format json?"),
    of_solving(
        "method-as-an-option", "--newton", "--newton: is not an option of lcp solve; did you mean --method newton?"
    ),
    of_solving("underscore-in-option", "--k_star 3", "did you mean --k-star?"),
    of_solving("unlike-any-option-in-one-letter", "-n 3", "-n: is not an option of lcp solve; see lcp solve --help\n"),
    of_solving("option-without-value", "--tol", "lcp: --tol: requires an argument; see lcp solve --help\n"),
    of_solving("flag-with-value", "--quiet=3", "lcp: --quiet: does not take a value; see lcp solve --help\n"),
    of_solving("option-given-twice", "--tol 1 --tol 2", "lcp: --tol: is given 2 times; give it once\n"),
    of_line("unknown-command", "solv good.json", "lcp: COMMAND: 'solv' is unknown; did you mean solve?\n"),
    of_line("unlike-any-command", "good.json", "'good.json'", "did you mean lcp solve good.json?"),
    of_line("no-such-command", "zzz", "'zzz'", "choose one of solve, compare"),
    of_line("misspelt-shell", "completion bahs", "lcp: SHELL: 'bahs'", "did you mean bash?"),
    of_line("no-file", "solve", "lcp: FILE: is missing; see lcp solve --help\n"),
    of_line("a-file-too-many", "inspect a b c", "lcp: inspect: ", "argument (c); see lcp inspect --help\n"),
    of_line("a-file-too-few", "check a", "FILE [Q_FILE] SOLUTION: stands for 2 or 3 files, not 1; give the file of"),
    of_line("misspelt-family", "make murtty", "lcp: FAMILY: 'murtty' is unknown; did you mean murty?\n"),
    of_line("misspelt-topic", "help metods", "lcp: TOPIC: 'metods' is unknown; did you mean methods?\n"),
]
STARTS = [
    of_solving("x0-missing-file", "--x0 start.csv", "--x0:", "'start.csv'", "neither", "name a file"),
    of_solving("x0-one-number", "--x0 1", "--x0:", "1 entry", "2 unknowns"),
    of_solving("x0-nan", "--x0 1,nan", "--x0[1]:", "finite"),
    of_solving("x0-file-too-long", "--x0 start.csv", "start.csv:", "--x0:", "3 entries", "2 unknowns", start="1,2,3"),
    of_solving("x0-file-of-text", "--x0 start.csv", "start.csv: line 1, column 2:", "'x'", "number", start="1,x"),
    of_solving("x0-file-a-matrix", "--x0 M.csv", "M.csv: --x0:", "2 rows and 2 columns", "one row"),
]
UNWRITABLE = [
    of_solving("output-into-no-folder", "-o nowhere/x.json", "nowhere/x.json:", "no folder", "create it first"),
    of_solving("output-below-a-file", "-o good.json/x.json", "good.json/x.json:", "no folder"),
    of_solving("output-a-directory", "-o results", "results:", "is a directory", "name a file"),
    of_solving("output-without-a-name", "-o ", "empty", "name a file"),
    of_solving("output-in-proc", "-o /proc/x.json", "/proc/x.json:", "cannot be written", "choose another"),
    of_solving("output-by-a-link-to-itself", "-o loop", "loop:", "cannot be written", "choose"),
    of_solving("output-name-too-long", f"-o {'a' * 300}", "aaa:", "cannot be written", "choose"),
]
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
    of_columns("wide", "a,b,c,q,lower\n2,0,0,-1,0\n0,2,0,-1,0\n", "2 rows and 3 columns of M"),
    of_columns("without-header", "2,0,-1,0,1\n0,2,-1,0,1\n", "2 rows of 5 columns", "q, lower and upper"),
    of_columns("cut-to-the-index", ",a,q\nx\n", "line 2:", "1 column where line 1 has 3"),
]
GIVEN = [
    of_line(
        "lower-option-of-many", "compare good.json good.json --lower zero", "--lower:", "neither a file nor numbers"
    ),
    of_solving("lower-option-word", "--lower zero", "--lower:", "neither a file nor numbers", "none,0.5"),
    of_solving("lower-option-crossed", "--lower 1 --upper 0", "--lower[0]:", "above upper[0]"),
    of_solving("upper-option-fraction", "--upper 1/0,2", "--upper:", "not a fraction"),
    of_solving("lower-option-table", "--lower t.csv", "t.csv:", "--lower", "2 rows", t="1,2\n3,4\n"),
    of_solving("lower-option-empty-file", "--lower t.csv", "t.csv:", "is empty", "none", t=""),
    of_solving("infinity-zero", "--infinity 0", "--infinity:", "0.0", "size > 0"),
    of_solving("infinity-below-a-bound", "--lower 5 --upper 9 --infinity 4", "--infinity: lower[0]:", "is 5", "at 4"),
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
NATIVE = {"Q": [[2, 0], [0, 2]], "c": [-1, -1], "A": [[1, 1]], "row_lower": [1]}
OF_QPSOLVERS = {"P": [[2, 0], [0, 2]], "q": [-1, -1], "G": [[1, 1]], "h": [1]}
ONLY_NATIVE = {"Q": [[2, 0], [0, 2]], "c": [1, 1], "row_upper": 0, "lower": 0, "upper": 9, "free": [0], "sense": "min"}
ONLY_NATIVE |= {"row_lower": 0, "constant": 1, "rows": ["r"], "columns": ["x", "y"]}
ONLY_FOREIGN = {"P": [[2, 0], [0, 2]], "q": [1, 1], "G": [[1, 1]], "h": [1], "lb": 0, "ub": 9}
ONLY_OSQP = {"l": [0], "u": 9}
OSQP = {"P": [[2, 0], [0, 2]], "q": [-1, -1], "A": [[1, 1]], "l": [1], "u": [2]}
READINGS = ("two ways to write a program", "row_lower <= Ax <= row_upper", "Gx <= h, Ax = b", "l <= Ax <= u")
MPS = """NAME p
ROWS
 N cost
 L limit
 G demand
COLUMNS
 x cost 1 limit 1
 x demand 1
 y cost 2 limit 1
RHS
 r limit 4 demand 1
BOUNDS
 UP b x 4
ENDATA
"""
LP = "min\n obj: x + 2 y\nst\n c1: x + y >= 1\nbounds\n x <= 3\nend\n"
HUGE_COORDINATES = '{"format": "coo", "shape": [1000000000, 1000000000], "rows": [0], "cols": [0], "values": [1]}'
HUGE_GAME = f'{{"A": {HUGE_COORDINATES}, "B": {HUGE_COORDINATES}}}'


def of_program(name: str, parts: dict[str, Any], *words: str, given: dict[str, Any] = NATIVE) -> Any:
    """A program with parts replaced, or left out where they are ..."""
    whole = {key: value for key, value in (given | parts).items() if value is not ...}
    return of_json(f"program-{name}", json.dumps(whole), *words)


of_foreign = partial(of_program, given=OF_QPSOLVERS)  # in the names of qpsolvers
of_osqp = partial(of_program, given=OSQP)


def of_mps(old: str, new: str, *words: str) -> Any:
    """The file with a part replaced."""
    assert old in MPS
    return of_file("bad.mps", MPS.replace(old, new), "solve bad.mps", "bad.mps: ", *words)


def of_lp(old: str, new: str, *words: str) -> Any:
    assert old in LP
    return of_file("bad.lp", LP.replace(old, new), "solve bad.lp", "bad.lp: ", *words)


PROGRAMS = [
    *(of_foreign(f"and-{key}", {key: value}, *READINGS) for key, value in ONLY_NATIVE.items()),
    *(of_program(f"and-{key}", {key: value}, *READINGS) for key, value in ONLY_FOREIGN.items()),
    *(of_osqp(f"and-{key}", {key: value}, *READINGS) for key, value in ONLY_NATIVE.items()),
    *(of_osqp(f"and-{key}", {key: ONLY_FOREIGN[key]}, f" {key}:", *READINGS) for key in ("G", "h", "lb", "ub")),
    *(of_osqp(f"and-b-without-{key}", {"b": [1], key: ...}, "and b belong", *READINGS) for key in "PAlu"),
    *(of_foreign(f"and-{key}", {key: value}, f" {key}:", *READINGS) for key, value in ONLY_OSQP.items()),
    *(of_program(f"and-{key}", {key: value}, f" {key}: and Q", *READINGS) for key, value in ONLY_OSQP.items()),
    of_osqp("no-P", {"P": ...}, " P:", "missing", "zeros", "is called M"),
    of_osqp("no-A", {"A": ...}, " A:", "missing", "with l"),
    of_osqp("no-ends", {"l": ..., "u": ...}, " b:", "missing", "with A"),
    of_osqp("M", {"P": ..., "A": ..., "M": [[1, 0], [0, 1]]}, " l:", "not a key of a problem", "lower"),
    of_osqp("misspelt", {"L": [1]}, " L:", "not a key of a program", "did you mean l?"),
    of_osqp("unsymmetric", {"P": [[1, 2], [3, 1]]}, " P[0][1]:", "unsymmetric", "(P + P') / 2"),
    of_osqp("crossed", {"l": [3]}, " l[0]:", "is 3, above u[0] = 2"),
    of_osqp("infinite", {"l": [1e20], "u": ...}, " l[0]:", "infinite", "1e+20", "-inf for no bound"),
    *(
        of_program(
            f"with-{key}", {key: [1]}, f" {key}: is not a key of a program", "row_lower <= Ax", "Gx <= h, Ax = b"
        )
        for key in ["Aeq", "beq", "A_eq", "b_eq", "A_ub", "b_ub", "H", "f"]
    ),
    of_json("quadprog", '{"H": [[1]], "f": [1]}', " H: is not a key", "x'Px/2 + q'x"),
    of_program("no-c", {"c": ...}, " c:", "missing", "c'x"),
    of_foreign("no-q", {"q": ...}, " q:", "missing", "q'x"),
    of_program("no-A", {"A": ...}, " A:", "missing", "row_lower"),
    of_program("no-ends", {"row_lower": ...}, " row_lower:", "missing", "with A"),
    of_program("bounds", {"bounds": [[0, 1]]}, " bounds:", "lower and upper"),
    of_program("empty", {"c": [], "Q": ..., "A": ..., "row_lower": ...}, " c:", "empty", "at least one variable"),
    of_program("wide-Q", {"Q": [[1, 2]]}, " Q:", "1 x 2", "square"),
    of_program("large-Q", {"Q": np.eye(3).tolist()}, " Q:", "3 x 3", "c has 2"),
    of_program("unsymmetric", {"Q": [[1, 2], [0, 1]]}, " Q[0][1]:", "unsymmetric", "(Q + Q') / 2"),
    of_foreign("columns", {"G": [[1]]}, " G:", "1 column for 2 variables"),
    of_program("row-lengths", {"row_lower": [1, 2]}, " row_lower:", "2 entries for 1 row"),
    of_foreign("b-lengths", {"A": [[1, 1]], "b": [1, 2]}, " b:", "2 entries for 1 row"),
    of_program("lower-lengths", {"lower": [1]}, " lower:", "1 entry for 2 variables"),
    of_program("crossed", {"lower": 2, "upper": 1}, " lower[0]:", "above upper[0]"),
    of_program("crossed-rows", {"row_lower": [2], "row_upper": [1]}, " row_lower[0]:", "above row_upper[0]"),
    of_program("b-and-row-lower", {"b": [1]}, " b:", "short for row_lower", "leave one out"),
    of_program("free-and-lower", {"free": [0], "lower": 1}, " free:", "beside lower", "null"),
    of_program("free-range", {"free": [2]}, " free[0]:", "is 2", "0 to 1"),
    of_program("sense", {"sense": "maximise"}, " sense:", "'maximise'", "min or max"),
    of_program("constant", {"constant": "1"}, " constant:", "text", "number"),
    of_program("names", {"rows": "r"}, " rows:", "text", "list of names"),
    of_program("name", {"columns": [1, "y"]}, " columns[0]:", "number", "text"),
    of_program("few-names", {"columns": ["x"]}, " columns:", "1 name for 2 variables", "agree"),
    of_program(
        "coordinates", {"A": json.loads(HUGE_COORDINATES) | {"shape": [1, 2], "rows": [1]}}, " A.rows[0]:", "0 to 0"
    ),
    of_program(
        "coordinate-shape", {"A": json.loads(HUGE_COORDINATES) | {"shape": [1.5, 2]}}, " A.shape:", "whole numbers"
    ),
    of_file("p.npz", archive(P=np.eye(2), c=np.ones(2)), "solve p.npz", "p.npz: P:", *READINGS),
    of_file("p.json", '{"c": [1]}', "convert p.json -o p.lp", "p.lp", "only read", ".json"),
    of_file("p.json", '{"M": [[1]], "q": [1]}', "make --from-qp p.json", "p.json", "is not a program", "Q and c"),
    of_file("p.json", HUGE_GAME, "solve p.json", "p.json: A:", "is declared as 1000000000 x 1000000000 with 1 entry"),
    of_file("p.json", '{"c": [1]}', "make --from-game p.json", "p.json", "is not a game", "A and B"),
    of_file("p.json", '{"c": [1]}', "solve p.json --lower 1", "--lower:", "for problems given by M", "in the file"),
    of_mps("x cost 1", "x cost one", "line 7", "'one'", "number"),
    of_mps("x demand", "x need", "line 8", "'need'", "not in ROWS"),
    of_mps("b x 4", "b z 4", "line 13", "'z'", "not in COLUMNS"),
    of_mps("UP b x 4", "UP b x -4", "line 13", "'x'", "below its lower bound 0", "MI"),
    of_mps("UP b x 4", "LO b x 5\n UP b x 4", "line 14", "'x'", "below its lower bound 5", "the smaller one"),
    of_mps("x 4", "x 4\n UP b x 5", "line 14", "second time"),
    of_mps(" x demand 1\n", " x limit 2\n", "line 8", "second entry"),
    of_mps("UP b x 4", "BV b x", "line 13", "'x'", "integer", "continuous"),
    of_mps("UP b x 4", "SC b x 4", "line 13", "semicontinuous"),
    of_mps(" x cost 1", " M1 'MARKER' 'INTORG'\n x cost 1", "'x'", "integer"),
    of_mps("ENDATA\n", "", "no ENDATA", "cut off"),
    of_mps("ROWS\n", "OBJSENSE\n BEST\nROWS\n", "line 3", "'BEST'", "MIN or MAX"),
    of_mps("ENDATA", "QCMATRIX limit\n x x 1\nENDATA", "quadratic constraints"),
    of_file("bad.mps", "NAME p\nROWS\n N cost\nCOLUMNS\nRHS\nENDATA\n", "solve bad.mps", "bad.mps: ", "no columns"),
    of_lp("x <= 3", "x <= -3", "'x'", "below its lower bound 0"),
    of_lp("c1: x + y", "c1: [x^2] + y", "quadratic constraints"),
    of_lp("st\n", "subject two\n", "LP format"),
    of_file("bad.mps.gz", gzip.compress(MPS.encode())[:40], "solve bad.mps.gz", "bad.mps.gz: ", "uncompressed"),
    of_stdin("two-lines", b'{"M": [[1]], "q": [-1]}\n' * 2, "line 2", "sed -n 1p", line="inspect -"),
    of_stdin("mps-misread", MPS.replace("x 4", "x four").encode(), "line 13", "'four'"),
]
