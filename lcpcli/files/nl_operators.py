"""The operators in expressions of AMPL's .nl files, by number (D. M. Gay, "Writing .nl files", 2005, table 5)."""

from __future__ import annotations

PIECEWISE_LINEAR = 64
REFUSED = {"mod", "floor", "ceil", "div", "precision", "round", "trunc", "count", "numberof", "atleast", "atmost"}
REFUSED |= {"exactly", "not atleast", "not atmost", "not exactly", "alldiff", "if of texts"}

# The name in AMPL, and the number of arguments, 0 if it is in the file.
MEANINGS = {
    0: ("+", 2), 1: ("-", 2), 2: ("*", 2), 3: ("/", 2), 4: ("mod", 2), 5: ("^", 2), 6: ("less", 2), 11: ("min", 0),
    12: ("max", 0), 13: ("floor", 1), 14: ("ceil", 1), 15: ("abs", 1), 16: ("negative", 1), 20: ("or", 2),
    21: ("and", 2), 22: ("<", 2), 23: ("<=", 2), 24: ("=", 2), 28: (">=", 2), 29: (">", 2), 30: ("!=", 2),
    34: ("not", 1), 35: ("if", 3), 37: ("tanh", 1), 38: ("tan", 1), 39: ("sqrt", 1), 40: ("sinh", 1), 41: ("sin", 1),
    42: ("log10", 1), 43: ("log", 1), 44: ("exp", 1), 45: ("cosh", 1), 46: ("cos", 1), 47: ("atanh", 1),
    48: ("atan2", 2), 49: ("atan", 1), 50: ("asinh", 1), 51: ("asin", 1), 52: ("acosh", 1), 53: ("acos", 1),
    54: ("sum", 0), 55: ("div", 2), 56: ("precision", 2), 57: ("round", 2), 58: ("trunc", 2), 59: ("count", 0),
    60: ("numberof", 0), 61: ("numberof", 0), 62: ("atleast", 2), 63: ("atmost", 2), PIECEWISE_LINEAR: ("<<>>", 0),
    65: ("if of texts", 3), 66: ("exactly", 2), 67: ("not atleast", 2), 68: ("not atmost", 2), 69: ("not exactly", 2),
    70: ("and", 0), 71: ("or", 0), 72: ("if", 3), 73: ("<==>", 2), 74: ("alldiff", 0), 75: ("^", 2), 76: ("square", 1),
    77: ("^", 2),
}  # fmt: skip
