"""What can be wrong with a program: the two ways to name its parts, its shapes, bounds and texts, and MPS files."""

from __future__ import annotations

import gzip
import json
from functools import partial
from typing import Any

import numpy as np

from .kinds import of_file, of_json, of_stdin
from .matrix_kinds import archive

NATIVE = {"Q": [[2, 0], [0, 2]], "c": [-1, -1], "A": [[1, 1]], "row_lower": [1]}
FOREIGN = {"P": [[2, 0], [0, 2]], "q": [-1, -1], "G": [[1, 1]], "h": [1]}
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

COORDINATES = '{"format": "coo", "shape": [1000000000, 1000000000], "rows": [0], "cols": [0], "values": [1]}'
HUGE_GAME = f'{{"A": {COORDINATES}, "B": {COORDINATES}}}'


def of_program(name: str, parts: dict[str, Any], *words: str, given: dict[str, Any] = NATIVE) -> Any:
    """A program with parts replaced, or left out where they are ..."""
    whole = {key: value for key, value in (given | parts).items() if value is not ...}
    return of_json(f"program-{name}", json.dumps(whole), *words)


of_foreign = partial(of_program, given=FOREIGN)  # in the names of qpsolvers
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
    of_foreign("no-h", {"h": ...}, " h:", "missing", "with G"),
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
    of_program("coordinates", {"A": json.loads(COORDINATES) | {"shape": [1, 2], "rows": [1]}}, " A.rows[0]:", "0 to 0"),
    of_program("coordinate-shape", {"A": json.loads(COORDINATES) | {"shape": [1.5, 2]}}, " A.shape:", "whole numbers"),
    of_file("p.npz", archive(P=np.eye(2), c=np.ones(2)), "solve p.npz", "p.npz: P:", *READINGS),
    of_file("p.json", '{"c": [1]}', "convert p.json -o p.lp", "p.lp", "only read", ".json"),
    of_file("p.json", '{"M": [[1]], "q": [1]}', "make --from-qp p.json", "p.json", "is not a program", "Q and c"),
    of_file("p.json", HUGE_GAME, "solve p.json", "p.json: A:", "is declared as 1000000000 x 1000000000 with 1 entry"),
    of_file("p.json", '{"c": [1]}', "make --from-game p.json", "p.json", "is not a game", "A and B"),
    of_file("p.json", '{"c": [1]}', "solve p.json --lower 1", "--lower:", "for problems given by M", "in the file"),
    of_mps("x cost 1", "x cost one", "line 7", "'one'", "number"),
    of_mps("limit 4", "limit 1D2", "line 11", "'1D2'", "number"),
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
    of_lp("end", "general\n x\nend", "'x'", "integer"),
    of_lp("c1: x + y", "c1: [x^2] + y", "quadratic constraints"),
    of_lp("st\n", "subject two\n", "LP format"),
    of_file("bad.mps.gz", gzip.compress(MPS.encode())[:40], "solve bad.mps.gz", "bad.mps.gz: ", "uncompressed"),
    of_stdin("two-lines", b'{"M": [[1]], "q": [-1]}\n' * 2, "line 2", "sed -n 1p", line="inspect -"),
    of_stdin("mps-misread", MPS.replace("x 4", "x four").encode(), "line 13", "'four'"),
]
