"""Arrays and other arguments that make no problem are refused in one line."""

from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
from scipy.sparse import coo_array, csc_array
from scipy.sparse.linalg import aslinearoperator

from lcpcli import Problem, run
from lcpcli.errors import ProblemError
from lcpcli.model.changes import with_infinity

from ..refusals import calls, raised

M, q = np.array([[2.0, 1], [1, 2]]), np.array([-5.0, -6])


class Broken:
    def __array__(self, dtype=None, copy=None):
        raise ZeroDivisionError


def with_entry(value):
    large = np.eye(150)
    large[7, 33] = value
    return large


NAMES = {
    "Decimal": Decimal,
    "Fraction": Fraction,
    "coo_array": coo_array,
    "csc_array": csc_array,
    "aslinearoperator": aslinearoperator,
    "with_infinity": with_infinity,
    "Broken": Broken,
    "with_entry": with_entry,
    "M": M,
    "q": q,
    "named": run(Problem(M, q, names=["price", "flow"])),
}

ARRAYS = calls(
    "ProblemError",
    r"""
solve(np.array([[2, 0], [0, nan]]), q) => M[1][1]: {NOT_FINITE}; {FINITE}{FROM_0}
solve(csr_array([[2, 0], [0, nan]]), q) => M[1][1]: {NOT_FINITE}; {FINITE}{FROM_0}
solve(coo_array(([1.7e308, 1.7e308], ([1, 1], [0, 0])), shape=(2, 2)), q)
    => M[1][0]: {NOT_FINITE}; {FINITE}{FROM_0}
solve(with_entry(nan), np.ones(150)) => M[7][33]: {NOT_FINITE}; {FINITE}{FROM_0}
solve(with_entry(-inf), np.ones(150)) => M[7][33]: {NOT_FINITE}; {FINITE}{FROM_0}
solve(np.asfortranarray(with_entry(inf)), np.ones(150))
    => M[7][33]: {NOT_FINITE}; {FINITE}{FROM_0}
solve([[10**400, 0], [0, 1]], q) => M[0][0]: {NOT_FINITE}; {FINITE}{FROM_0}
solve(M, [2**1024 - 2**970 - 1, 10**400]) => q[1]: {NOT_FINITE}; {FINITE}{FROM_0}
solve(M, [0, -Fraction(10**400, 3)]) => q[1]: {NOT_FINITE}; {FINITE}{FROM_0}
Problem(M, q, upper=[None, 10**400]) => upper[1]: {NOT_FINITE}; {FINITE}{FROM_0}
from_game([[1, Fraction(10) ** 400]], [[1, 1]])
    => A[0][1]: {NOT_FINITE}; {FINITE}{FROM_0}
solve(np.ones((2, 3)), q) => M: {SHAPE:2|3}; {SQUARE}
solve([[]], []) => M: {SHAPE:1|0}; {SQUARE}
solve(np.ones((200, 0)), np.ones(200)) => M: {SHAPE:200|0}; {SQUARE}
solve(csc_array(np.ones((3, 3))), q) => M: {SHAPE_BESIDE:3 x 3|q|2 entries}; {AGREE}
solve(csr_array((2, 2)), []) => M: {SHAPE_BESIDE:2 x 2|q|0 entries}; {AGREE}
solve([[1]], []) => M: {SHAPE_BESIDE:1 x 1|q|0 entries}; {AGREE}
solve([], [1]) => M: {SHAPE_BESIDE:0 x 0|q|1 entry}; {AGREE}
solve(np.ones(2), q) => M: {DIMENSIONS:1 dimension}; {A_LIST_OF_ROWS}
solve(np.ones((2, 2, 2)), q) => M: {DIMENSIONS:3 dimensions}; {A_LIST_OF_ROWS}
solve(M, np.ones((2, 2))) => q: {DIMENSIONS:2 dimensions}; {A_FLAT_LIST}
solve(M, np.float64(1)) => q: {DIMENSIONS:0 dimensions}; {A_FLAT_LIST}
solve([M[:, :1], M[:, 1:]], q) => M[0]: {DIMENSIONS:2 dimensions}; {A_ROW}{FROM_0}
from_qp(M, q, np.array(3.0), [1]) => A: {DIMENSIONS:0 dimensions}; {A_LIST_OF_ROWS}
from_qpsolvers(M, q, G=np.array(3.0), h=[1])
    => G: {DIMENSIONS:0 dimensions}; {A_LIST_OF_ROWS}
solve([M[0], M[1][:1]], q) => M[1]: {ENTRIES_WHERE:1 entry|M[0]|2}; {ALIKE_ROWS}{FROM_0}
solve([1, 2], q) => M[0]: {IS:a number}; {A_ROW}{FROM_0}
solve({"a": 1}, q) => M: {IS:an object}; {A_LIST_OF_ROWS}
solve([[True, 0], [0, 1]], q) => M[0][0]: {IS:true}; {REAL}{FROM_0}
solve([[1, 0], [np.False_, 1]], q) => M[1][0]: {IS:false}; {REAL}{FROM_0}
solve(M, np.array([None, 1])) => q[0]: {IS:null}; {REAL}{FROM_0}
solve(M, [Decimal("0.1"), 1]) => q[0]: {IS:of type Decimal}; {REAL}{FROM_0}
solve(M, None) => q: {IS:null}; {A_LIST}
solve(M, "12") => q: {IS:the text '12'}; {A_LIST}
solve(M, b"12") => q: {IS:of type bytes}; {A_LIST}
solve(M, {1.0, 2.0}) => q: {IS:of type set}; {A_LIST}
solve(M, iter(q)) => q: {IS:of type iterator}; {A_LIST}
solve(M, csr_array([q])) => q: {IS:sparse}; {A_DENSE_ARRAY}
solve(aslinearoperator(M), q) => M: {LINEAR_OPERATOR}; {ITS_MATRIX}
solve(Broken(), q) => M: {NO_ARRAY:Broken}; {A_LIST_OF_ROWS}
solve(M, Broken()) => q: {NO_ARRAY:Broken}; {A_LIST}
solve(M, q, upper=Broken()) => upper: {NO_ARRAY:Broken}; {ONE_OR_A_LIST}
Problem(M, q, solutions=7)
    => solutions: {IS:a number}; give a list of solutions, each a list of numbers
Problem(M, q, names=None) => names: {IS:null}; {A_LIST_OF_NAMES}
Problem(M, q, names=3.0) => names: {IS:a number}; {A_LIST_OF_NAMES}
Problem(np.eye(3), [-5, -6, -1], names=["price", "price", "flow"])
    => names: {ENTRIES:'price'|2 unknowns}; give each another name, or an empty one
from_efg(1) => efg: {IS:a number}; give the text of an .efg file
from_game([[1, 2]])
    => B: {MISSING}; give the payoffs of the column player; in a zero-sum game B = -A
from_efg("") => line 1: {NO_TREE}; {BEGIN_TREE}
""",
)

# A matrix of another type, or a row of it, in the place of each array of a problem.
PLACES = {
    "M": ("Problem({}, q)", "Problem(csr_array({}), q)"),
    "q": ("Problem(M, {}[0])",),
    "x0": ("Problem(M, q, x0={}[0])",),
    "x1": ("Problem(M, q, x1={}[0])",),
    "solution": ("Problem(M, q, solutions=[{}[0]])",),
}
TYPES = [
    refusal
    for place, forms in PLACES.items()
    for refusal in calls(
        "ProblemError",
        f"""
np.array(M, dtype=complex) => {place}: is complex (complex128); {{REAL}}
np.array(M, dtype=bool) => {place}: {{OF_OTHER_TYPE:bool}}; {{NUMBERS}}
np.array([["2", "0"], ["0", "2"]]) => {place}: {{OF_OTHER_TYPE:str32}}; {{NUMBERS}}
np.array([[b"2", b"0"], [b"0", b"2"]])
    => {place}: {{OF_OTHER_TYPE:bytes8}}; {{NUMBERS}}
np.array([["2004-07-01", "2012-02-01"]] * 2, dtype="datetime64[D]")
    => {place}: {{OF_OTHER_TYPE:datetime64[D]}}; {{NUMBERS}}
""",
        *forms,
    )
    # scipy has no sparse matrices of texts and dates.
    if "csr_array(np.array([[" not in refusal.command
]

OTHERS = [
    *calls(
        "ProblemError",
        r"""
Problem(np.eye(2), [0, 0], lower=[0, 1e20], upper=1e21, infinity=1e15)
    => lower[1]: {INFINITE_AS:infinite|1e+20|1e+15}; {NO_BOUND_BELOW}{FROM_0}
with_infinity(from_qp(None, [1], [[1]], row_upper=[-1e30]), 1e20)
    => row_upper[0]: {INFINITE_AS:minus infinity|-1e+30|1e+20}; {NO_BOUND_ABOVE}{FROM_0}
from_qpsolvers(None, [1], [[1]], [-1e20], infinity=1e20)
    => h[0]: {INFINITE_AS:minus infinity|-1e+20|1e+20}; {NO_BOUND_ABOVE}{FROM_0}
""",
    ),
    *calls(
        "ParameterError",
        r"""
0 => infinity: {OUT_OF_RANGE:0}; {IT_MUST_BE:{OF_SIZE}}
-1 => infinity: {OUT_OF_RANGE:-1}; {IT_MUST_BE:{OF_SIZE}}
nan => infinity: {OUT_OF_RANGE:nan}; {IT_MUST_BE:{OF_SIZE}}
"1e20" => infinity: {OUT_OF_RANGE:1e20}; {IT_MUST_BE:{OF_SIZE}}
None => infinity: {OUT_OF_RANGE:None}; {IT_MUST_BE:{OF_SIZE}}
""",
        "Problem(np.eye(1), [0], upper=1, infinity={})",
    ),
    *calls(
        "KeyError",
        r"""
run(from_qp([[2.0]], [-2.0], [[1.0]], row_upper=[5.0], columns=["x"], rows=["x"]))["x"]
    => "'x' is the name of 2 unknowns; take z, with their indices"
named["prise"] => "{NO_UNKNOWN:'prise'}; {DID_YOU_MEAN:price}"
named[""] => "{NO_UNKNOWN:''}; choose one of price, flow"
named[0] => '{NO_UNKNOWN:0}; choose one of price, flow'
run(Problem(M, q))["x"]
    => "{NO_UNKNOWN:'x'}; the problem has no names; take z, with its indices"
""",
    ),
    *calls(
        "AttributeError",
        r"""
named.exit_code => 'Result' object has no attribute 'exit_code'
named.solvd => 'Result' object has no attribute 'solvd'
""",
    ),
    *calls(
        "TypeError",
        r"""
bool(named)
    => a Result is neither true nor false, as a problem that is not solved may be proved
    to have no solution; use result.solved or result.status
""",
    ),
]
REFUSALS = [*ARRAYS, *TYPES, *OTHERS]


@pytest.mark.parametrize("refusal", REFUSALS, ids=str)
def test_what_makes_no_problem_is_refused(refusal):
    assert raised(refusal.command, NAMES) == refusal.line


LONG = np.array([[1, 1], [0, 1]], dtype=np.longdouble)
LONG[0, 1] = np.nextafter(np.longdouble(0), np.longdouble(1))


def test_names_may_be_empty():
    assert list(Problem(M, q, names=["", ""]).names) == ["", ""]


@pytest.mark.parametrize(
    ("M", "q", "where"),
    [
        ([[1, 0], [Fraction(1, 10**400), 1]], [-1, -1], "M[1][0]"),
        ([[1]], [Fraction(-1, 10**400)], "q[0]"),
        (LONG, [-1, -1], "M[0][1]"),
        (csc_array(LONG), [-1, -1], "M[0][1]"),
        (np.eye(2), LONG[0], "q[1]"),
    ],
)
def test_a_number_that_is_0_only_in_double_precision_is_refused(M, q, where):
    if LONG.dtype.itemsize == 8 and not isinstance(M, list):
        pytest.skip("long doubles are doubles here")
    with pytest.raises(ProblemError) as refused:
        Problem(M, q)
    assert refused.value.where == where
    assert "0 in double precision" in refused.value.fault
    assert Problem([[Fraction(1)]], [Fraction(0)]).q[0] == 0


def test_a_number_beyond_doubles_is_refused_without_a_warning():
    large = np.array([[np.longdouble(2)]]) ** np.longdouble(2000)
    for M, q in (([[1]], large[0]), (large, [1]), (csc_array(large), [1])):
        with pytest.raises(ProblemError, match="is not a finite number"):
            Problem(M, q)
