"""Options, starts and functions with which no problem can be solved are refused in one
line, however the problem is given."""

from fractions import Fraction

import numpy as np
import pytest
from scipy.sparse.linalg import aslinearoperator

import lcpcli
from lcpcli import Problem
from lcpcli.model.nonlinear import NonlinearProblem

from ..refusals import calls, raised

M, q = np.array([[2.0, 1], [1, 2]]), np.array([-5.0, -6])
NAMES = {
    "Fraction": Fraction,
    "aslinearoperator": aslinearoperator,
    "NonlinearProblem": NonlinearProblem,
    "F": lambda z: z - 1,
    "M": M,
    "q": q,
    "steps": [Problem(M, q)],
    "Ms": [[[2.0, 1], [1, 2]], [[2, 0], [0, 4]]],
    "qs": [[-5.0, -6], [-4, 2]],
    "infeasible": Problem([[-1.0]], [-2.0]),
    "mixed": Problem(
        [[2, 1, 0, 0], [1, 2, 1, 0], [0, 1, 3, 0], [0, 0, 0, 1]],
        [-5, -6, 4, 1],
        lower=[-np.inf, 0, -1, 2],
        upper=[np.inf, 2, np.inf, 2],
    ),
}

# One problem whose solution is 0, one of which it is not, and six problems.
WAYS = (
    "solve([[1]], [1], {})",
    "solve([[1]], [-1], {})",
    "solve_many([[1]], [[1]], method={})",
    "solve_many([[1]], [[-1] * 6], method={})",
)
OPTIONS = [
    *calls(
        "ParameterError",
        r"""
"newtn" => method: {UNKNOWN:'newtn'}; {DID_YOU_MEAN:newton}
"auto", tol=0.0 => tol: {OUT_OF_RANGE:0.0}; {IT_MUST_BE:{OF_TOL}}
"auto", tol=1.0 => tol: {OUT_OF_RANGE:1.0}; {IT_MUST_BE:{OF_TOL}}
"auto", tol=nan => tol: {OUT_OF_RANGE:nan}; {IT_MUST_BE:{OF_TOL}}
"auto", max_iterations=-1 => max_iterations: {OUT_OF_RANGE:-1}; {IT_MUST_BE:{WHOLE:0}}
"auto", time_limit=0.0 => time_limit: {OUT_OF_RANGE:0.0}; {IT_MUST_BE:{OF_SECONDS}}
"auto", threads=0 => threads: {OUT_OF_RANGE:0}; {IT_MUST_BE:{WHOLE_TO:1|1024}}
"shi", p=-1 => p: {OUT_OF_RANGE:-1}; {IT_MUST_BE:{OF_P}}
"shi", p=0.0 => p: {OUT_OF_RANGE:0.0}; {IT_MUST_BE:{OF_P}}
"shi", p=inf => p: {OUT_OF_RANGE:inf}; {IT_MUST_BE:{OF_P}}
"shi", p=nan => p: {OUT_OF_RANGE:nan}; {IT_MUST_BE:{OF_P}}
"shi", k_star=0 => k_star: {OUT_OF_RANGE:0}; {IT_MUST_BE:{WHOLE:1}}
"shi", rho=0.5 => rho: {OUT_OF_RANGE:0.5}; {IT_MUST_BE:{OF_RHO}}
"shi", rho=0.0 => rho: {OUT_OF_RANGE:0.0}; {IT_MUST_BE:{OF_RHO}}
"shi", sigma=1.0 => sigma: {OUT_OF_RANGE:1.0}; {IT_MUST_BE:{OF_SIGMA}}
"shi", sigma=1e-4 => sigma: {OUT_OF_RANGE:0.0001}; {WITH_RHO:0.0001}
"shi", rho=0.4, sigma=0.2 => sigma: {OUT_OF_RANGE:0.2}; {WITH_RHO:0.4}
"shi", omega=2.0 => omega: {NO_EFFECT:the method shi}; {LEAVE_IT_OUT}
"newton", p=3 => p: {NO_EFFECT:the method newton}; {LEAVE_IT_OUT}
"fixed-point", omega=0.0 => omega: {OUT_OF_RANGE:0.0}; {IT_MUST_BE:{OF_OMEGA}}
"fixed-point", omega="best" => omega: {OUT_OF_RANGE:best}; {IT_MUST_BE:{OF_OMEGA}}
"fixed-point", omega=True => omega: {OUT_OF_RANGE:True}; {IT_MUST_BE:{OF_OMEGA}}
"fixed-point", anderson=-1 => anderson: {OUT_OF_RANGE:-1}; {IT_MUST_BE:{WHOLE:0}}
"fixed-point", anderson=0.5 => anderson: {OUT_OF_RANGE:0.5}; {IT_MUST_BE:{WHOLE:0}}
"fixed-point", anderson="auto" => anderson: {OUT_OF_RANGE:auto}; {IT_MUST_BE:{WHOLE:0}}
"reflections", beta=2.0 => beta: {OUT_OF_RANGE:2.0}; {IT_MUST_BE:0 < beta < 2}
"reflections", beta=0.0 => beta: {OUT_OF_RANGE:0.0}; {IT_MUST_BE:0 < beta < 2}
"reflections", walkers=0
    => walkers: {OUT_OF_RANGE:0}; {IT_MUST_BE:{WHOLE_TO:1|1000000}}
"reflections", seed=-1 => seed: {OUT_OF_RANGE:-1}; {IT_MUST_BE:{WHOLE:0}}
"interior", start_slack=-1
    => start_slack: {OUT_OF_RANGE:-1}; {IT_MUST_BE:0 < slack < infinity}
"interior", regularization=2
    => regularization: {OUT_OF_RANGE:2}; {IT_MUST_BE:0 < rho <= 1}
""",
        *WAYS,
    ),
    *calls(
        "OptionError",
        r"""
"auto", every=2 => every: {NO_OPTION:auto}; {IT_HAS:presolve}
"auto", max_iteration=3
    => max_iteration: {NO_OPTION:auto}; {DID_YOU_MEAN:max_iterations}
"shi", K_star=3 => K_star: {NO_OPTION:shi}; {DID_YOU_MEAN:k_star}
"shi", **{"%": 3} => %: {NO_OPTION:shi}; {IT_HAS:x1, p, k_star, rho, sigma}
"fixed-point", omgea=2.0 => omgea: {NO_OPTION:fixed-point}; {DID_YOU_MEAN:omega}
""",
        *WAYS,
    ),
    *(
        refusal
        for name, forms in {
            "auto": (
                "solve(M, q, {})",
                "run(Problem(M, q), {})",
                "solve_many(M, np.transpose([q]), {})",
                "solve_qp(M, q, {})",
            ),
            "Solver": ("Solver(M, {})",),
            "solve_mcp": ("solve_mcp(lambda z: z - 1.0, x0=[0.0], {})",),
        }.items()
        for refusal in calls(
            "OptionError",
            f"""
time_limt=3 => time_limt: {{NO_OPTION:{name}}}; {{DID_YOU_MEAN:time_limit}}
time_limt=None => time_limt: {{NO_OPTION:{name}}}; {{DID_YOU_MEAN:time_limit}}
""",
            *forms,
        )
    ),
    *calls(
        "OptionError",
        r"""
solve_many(np.eye(2), np.eye(2), tolerance=0.1)
    => tolerance: {NO_OPTION:auto}; {DID_YOU_MEAN:tol}
solve_many(Ms, qs, nonsense=1) => nonsense: {NO_OPTION:auto}; {IT_HAS:presolve}
solve(M, q, names=["a", "b"])
    => names: belongs to the problem; write Problem(M, q, names=...)
""",
    ),
    *calls(
        "ParameterError",
        r"""
solve(M, q, "lemke", scale=True) => scale: {NO_EFFECT:the method lemke}; {LEAVE_IT_OUT}
solve(M, q, "lemke", finish=True)
    => finish: {NO_EFFECT:the method lemke}; {LEAVE_IT_OUT}
solve(M, q, "shi", compiled=True)
    => compiled: {NO_EFFECT:the method shi}; {LEAVE_IT_OUT}
solve(M, q, callback=3)
    => callback: {IS:a number}; give a function of one argument, a TraceRow
run(Problem(M, q), presolve=1)
    => presolve: 1 is neither True nor False; give one of them
solve([[1]], [-1], gap=0) => gap: {OUT_OF_RANGE:0}; {IT_MUST_BE:error > 0}
Trace(columns=("aplha",)) => columns: {UNKNOWN:'aplha'}; {DID_YOU_MEAN:alpha}
run(Problem(M, q), "newton", trace=Trace(columns=("alpha",)))
    => columns: newton has no alpha; it belongs to shi
solve_mcp(F, x0=[0.0], trace=Trace(columns=["x"]))
    => columns: josephy-newton has no x; it belongs to auto, shi, fixed-point, newton,
    lemke, reflections and milp
Solver([[1]], tol=2) => tol: {OUT_OF_RANGE:2}; {IT_MUST_BE:{OF_TOL}}
""",
    ),
]

STARTS = [
    *calls(
        "ParameterError",
        r"""
solve(M, q, "shi", x0=[0, 0], z0=[0, 0]) => z0: {TWO_STARTS:x0}; {LEAVE_ONE_OUT}
solve(M, q, "lemke", x0=[1, 1]) => x0: {NO_START:lemke}; {LEAVE_IT_OUT}
solve(M, q, "milp", z0=[1, 1]) => z0: {NO_START:milp}; {LEAVE_IT_OUT}
""",
    ),
    *calls(
        "ProblemError",
        r"""
solve(M, q, "shi", z0=[1, 2, 3, 4]) => z0: {ENTRIES:4 entries|2 unknowns}; {AGREE}
run(mixed, basis=7) => basis: {IS:a number}; {LIST_OF_STATES}
run(mixed, basis="basic") => basis: {IS:the text 'basic'}; {LIST_OF_STATES}
run(mixed, basis=["basic", "basic"]) => basis: {ENTRIES:2 entries|4 unknowns}; {AGREE}
run(mixed, basis=["basic", "top", "lower", "lower"])
    => basis[1]: {IS:the text 'top'}; {A_STATE}{FROM_0}
run(mixed, basis=["basic", 1, "lower", "lower"])
    => basis[1]: {IS:a number}; {A_STATE}{FROM_0}
run(mixed, basis=["upper", "upper", "lower", "lower"])
    => basis[0]: {NO_SUCH_BOUND:upper}; {OTHER_STATE}{FROM_0}
run(mixed, basis=["lower", "upper", "lower", "lower"])
    => basis[0]: {NO_SUCH_BOUND:lower}; {OTHER_STATE}{FROM_0}
run(mixed, basis=["basic", "upper", "lower", "basic"])
    => basis[3]: is basic, but that variable is fixed; write lower{FROM_0}
""",
    ),
]

PROBLEMS = [
    *calls(
        "ProblemError",
        "M.tolist() => problem: {IS:a list}; {BY_READING}",
        *("run({})", "check({})", "inspect({})", "exact({})"),
        *("run({}, q)", "check({}, q)", "inspect({}, q)", "exact({}, q)"),
    ),
    *calls(
        "ProblemError",
        r"""
check(Problem(M, q), [1, 2, Fraction(1, 3)])
    => z: {ENTRIES:3 entries|2 unknowns}; {AGREE}
check(infeasible, z=[1.0, 2.0]) => z: {ENTRIES:2 entries|1 unknown}; {AGREE}
error_bound(infeasible, [1, 2]) => z: {ENTRIES:2 entries|1 unknown}; {AGREE}
from_qp(M, q, np.zeros((0, 3)), np.zeros(0))
    => A: {ENTRIES:3 columns|2 variables}; {AGREE}
from_qp(M, q, np.zeros((0, 2)), [1.0]) => b: {ENTRIES:1 entry|0 rows}; {AGREE}
""",
    ),
    *calls(
        "ParameterError",
        r"""
check(infeasible) => z: {MISSING}; give z, or a proof y
check(infeasible, z=[1.0], y=[1.0]) => y: cannot be combined with z; {LEAVE_ONE_OUT}
check(infeasible, y=[1.0], tol=0.1) => tol: {NO_EFFECT_ON:a proof}; {LEAVE_IT_OUT}
check(infeasible, z=[1.0], tol=0.0) => tol: {OUT_OF_RANGE:0.0}; {IT_MUST_BE:{OF_TOL}}
""",
    ),
]

MANY = [
    *calls(
        "ProblemError",
        r"""
solve_many(np.eye(2)) => Q: {MISSING}; give M and Q, or an iterable of Problems
solve_many(np.eye(2)[:1], np.eye(2)) => M: {SHAPE:1|2}; {SQUARE}
solve_many(M, np.array(q))
    => Q: {DIMENSIONS:1 dimension}; {COLUMNS_OF_Q}{ONE_BY_RESHAPE}
solve_many(np.eye(2), [1.0, 2.0])
    => Q: {DIMENSIONS:1 dimension}; {COLUMNS_OF_Q}{ONE_BY_RESHAPE}
solve_many(np.eye(2), np.ones((2, 2, 2)))
    => Q: {DIMENSIONS:3 dimensions}; {COLUMNS_OF_Q}
solve_many(np.eye(2), np.ones((3, 2)))
    => Q: {HAS_SHAPE:(3, 2)}, but M is 2 x 2; give one right-hand side in each column,
    as Q.T here
solve_many(np.eye(2), [[1.0, nan], [1.0, 2.0]])
    => Q[0][1]: {NOT_FINITE}; {FINITE}{FROM_0}
solve_many(M, ["a", "b"]) => Q[0]: {IS:the text 'a'}; {REAL}{FROM_0}
solve_many(np.eye(2), csr_array(np.eye(2))) => Q: {IS:sparse}; {A_DENSE_ARRAY}
solve_many(M, aslinearoperator(M)) => Q: {LINEAR_OPERATOR}; {ITS_MATRIX}
solve_many(M, M, upper=[[1], [1, 2]])
    => upper[1]: {ENTRIES_WHERE:2 entries|upper[0]|1}; {ALIKE_ROWS}{FROM_0}
solve_many(np.eye(2), np.eye(2), lower=np.ones((2, 3)))
    => lower: {HAS_SHAPE:(2, 3)}, but Q has (2, 2); give a number, one for each unknown,
    or one for each entry of Q
solve_many(np.eye(2), np.eye(2), lower=[0.0, 0.0, 0.0])
    => lower: {ENTRIES:3 entries|2 unknowns}; {AGREE}
list(solve_many(np.eye(2), np.eye(2), upper=[[1.0, -1.0], [1.0, 1.0]]))
    => column 1: lower[0]: {ABOVE:0|upper[0]|-1}; {IN_ORDER}{FROM_0}
solve_many(np.ones((2, 2, 3)), qs)
    => M: {HAS_SHAPE:(2, 2, 3)}; give one square matrix for each problem
solve_many([Ms[0], [[1]]], qs)
    => M[1]: {ENTRIES_WHERE:shape (1, 1)|M[0]|(2, 2)}; make all of them the same{FROM_0}
solve_many([Ms[0], [[1, nan], [0, 1]]], qs)
    => M[1][0][1]: {NOT_FINITE}; {FINITE}{FROM_0}
solve_many(Ms, np.ones((2, 3))) => q: {HAS_SHAPE:(2, 3)}; {GIVE_SHAPE:(2, 2)}
solve_many(Ms, [1, 2])
    => q: {DIMENSIONS:1 dimension}; {GIVE_SHAPE:(2, 2)}, a row for each problem
solve_many(Ms, [[1, 2], ["x", 1]]) => q[1][0]: {IS:the text 'x'}; {REAL}{FROM_0}
solve_many(Ms, qs, lower=np.zeros((3, 2)))
    => lower: {HAS_SHAPE:(3, 2)}; {GIVE_SHAPE:(2, 2)}
solve_many(Ms, qs, upper=[1, 2, 3]) => upper: {ENTRIES:3 entries|2 unknowns}; {AGREE}
solve_many(Ms, qs, lower=[[0, 0], [2, 0]], upper=1)
    => problem 1: lower[0]: {ABOVE:2|upper[0]|1}; {IN_ORDER}{FROM_0}
list(solve_many([1.0])) => problem: {IS:a number}; {BY_READING}
list(solve_many([*steps, "p.json"], sequence=True))
    => problem: {IS:the text 'p.json'}; {BY_READING}
Solver(None) => M: {IS:null}; {A_LIST_OF_ROWS}
Solver([[1, 2, 3], [4, 5, 6]]) => M: {SHAPE:2|3}; {SQUARE}
Solver(M).solve([1, 2, 3]) => q: {ENTRIES:3 entries|2 unknowns}; {AGREE}
Solver(M, upper=[1, 1]).update([[4]]) => M: {ENTRIES:1 row|2 bounds}; {OTHER_SOLVER}
Solver(np.eye(2), upper=[1, 1]).update(np.eye(3))
    => M: {ENTRIES:3 rows|2 bounds}; {OTHER_SOLVER}
""",
    ),
    *calls(
        "ParameterError",
        r"""
list(solve_many([], upper=1.0)) => upper: {OWN_BOUNDS:Problems}; {LEAVE_IT_OUT}
solve_many([Problem(np.eye(1), [0])], infinity=1e20)
    => infinity: {OWN_BOUNDS:Problems}; {LEAVE_IT_OUT}
solve_many(M, iter([q]), "lemke")
    => method: {NO_EFFECT_ON:an iterator of q}; give their columns as Q, of shape (n, k)
solve_many(steps, sequence=True, method="lemke")
    => method: {NO_EFFECT_ON:a sequence}; {LEAVE_IT_OUT}
solve_many(steps, sequence=True, x0=[1, 1])
    => x0: {NO_EFFECT_ON:a sequence}; {LEAVE_IT_OUT}
solve_many(steps, sequence=True, trace=True)
    => trace: {NO_EFFECT_ON:a sequence}; {LEAVE_IT_OUT}
solve_many(steps, sequence=True, p=2) => p: {NO_EFFECT:the method auto}; {LEAVE_IT_OUT}
solve_many(M, np.eye(2), sequence=True)
    => sequence: is for Problems; leave it out, or give q one by one, as by iter(Q.T)
""",
    ),
]

FUNCTIONS = [
    *calls(
        "ProblemError",
        r"""
solve_mcp(3, x0=[1, 2]) => F: {IS:a number}; give a function of z that returns F(z)
solve_mcp(lambda z: None, x0=[1, 2]) => F: {RETURNS_NOTHING}; {RETURN}
solve_mcp(lambda z: "two", x0=[1, 2]) => F: returns the text 'two'; {REAL_ARRAY}
solve_mcp(lambda z: [1.0, [2.0, 3.0]], x0=[1, 2]) => F: returns a list; {REAL_ARRAY}
solve_mcp(lambda z: [1.0], x0=[1, 2])
    => F: returns 1 number for 2 unknowns; return as many as there are unknowns
solve_mcp(lambda z: np.multiply(z, 2, out=z) - 1, x0=[1, 2])
    => F: changes its argument z; let it change a copy, such as z.copy()
solve_mcp(lambda z: np.log(z - 5), x0=[1, 2])
    => x0: F[0] is nan there; {WHERE_F_IS_DEFINED}{FROM_0}
solve_mcp(lambda z: np.log(z - 5), z0=[1, 2])
    => z0: F[0] is nan there; {WHERE_F_IS_DEFINED}{FROM_0}
solve_mcp(F, z0=1.0) => z0: is a number; give a list of numbers
solve_mcp(lambda z: np.ma.masked_array(z, [True, False]), x0=[1, 2])
    => F: has masked entries; fill them, or leave them out
solve_mcp(lambda z: z, lambda z: np.ma.masked_array(np.eye(2), np.eye(2)), x0=[1, 2])
    => J: has masked entries; fill them, or leave them out
solve_mcp(lambda z: z + 2j, x0=[1, 2])
    => x0: F[0] is the complex number 1+2j there; {WHERE_F_IS_DEFINED}{FROM_0}
solve_mcp(np.log, x0=[-1, -1], names=["a", "b"], lower=None)
    => x0: F is nan there, in row a; {WHERE_F_IS_DEFINED}{FROM_0}
solve_mcp(F) => x0: is missing, so that the number of unknowns is unknown; {X0_A_LIST}
solve_mcp(F, x0=1.0)
    => x0: is a number, so that the number of unknowns is unknown; {X0_A_LIST}
solve_mcp(F, [[1.0]], x0=[1, 2])
    => J: {IS:a list}; give a function of z that returns J(z)
solve_mcp(F, lambda z: None, x0=[1, 2]) => J: {RETURNS_NOTHING}; {RETURN}
solve_mcp(F, lambda z: np.eye(3), x0=[1, 2])
    => J: returns shape (3, 3) for 2 unknowns; return shape (2, 2)
solve_mcp(F, lambda z: aslinearoperator(np.eye(2)), x0=[1, 2])
    => J: returns a linear operator; return a matrix, dense or sparse, since its entries
    are needed
solve_mcp(F, x0=[1, 2], lower=[2, 0], upper=1)
    => lower[0]: {ABOVE:2|upper[0]|1}; {IN_ORDER}{FROM_0}
solve_mcp(F, x0=[1, 2], names=["a"]) => names: {ENTRIES:1 entry|2 unknowns}; {AGREE}
""",
    ),
    *calls(
        "ParameterError",
        r"""
solve_mcp(F, x0=[1, 2], restarts=-1)
    => restarts: {OUT_OF_RANGE:-1}; {IT_MUST_BE:{WHOLE:0}}
solve_mcp(F, x0=[1, 2], tol=2) => tol: {OUT_OF_RANGE:2}; {IT_MUST_BE:{OF_TOL}}
solve_mcp(F, x0=[1, 2], interrupts="never")
    => interrupts: {UNKNOWN:'never'}; give "raise" or "return"
solve_mcp(F, x0=[1, 2], pattern=np.eye(3))
    => pattern: {HAS_SHAPE:(3, 3)} for 2 unknowns; {GIVE_SHAPE:(2, 2)}
solve_mcp(F, z0=[3.0], difference_step=2.0)
    => difference_step: {OUT_OF_RANGE:2}; give one between 0 and 1
solve_mcp(F, lambda z: [[1.0]], z0=[3.0], difference_step=1e-3)
    => difference_step: {NO_EFFECT_ON:a J that is supplied}; leave one of them out
solve_mcp(F, z0=[1.0], x0=[1.0])
    => x0: is another name of z0, which is passed too; {LEAVE_IT_OUT}
""",
    ),
    *calls(
        "ParameterError",
        r"""
lower=None => lower: {OWN_DATA}; {LEAVE_IT_OUT}
lower=[0, 0] => lower: {OWN_DATA}; {LEAVE_IT_OUT}
upper=3 => upper: {OWN_DATA}; {LEAVE_IT_OUT}
infinity=1e20 => infinity: {OWN_DATA}; {LEAVE_IT_OUT}
J=lambda z: np.eye(2) => J: {OWN_DATA}; {LEAVE_IT_OUT}
""",
        "solve_mcp(NonlinearProblem(F, x0=[1, 1]), {})",
    ),
]

REFUSALS = [*OPTIONS, *STARTS, *PROBLEMS, *MANY, *FUNCTIONS]


@pytest.mark.parametrize("refusal", REFUSALS, ids=str)
def test_a_call_that_cannot_be_run_is_refused(refusal):
    assert raised(refusal.command, NAMES) == refusal.line


def test_a_start_by_states_is_taken():
    states = ["basic", "upper", "lower", "lower"]
    assert lcpcli.run(NAMES["mixed"], basis=states).solved
