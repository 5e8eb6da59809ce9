"""Searches for all solutions that cannot end, and objectives that are no sums, are
refused in one line."""

import numpy as np
import pytest

from ..refusals import calls, raised

NAMES = {"coupled": np.eye(700) + np.eye(700, k=1) * (np.arange(700) < 600)}
REFUSALS = [
    *calls(
        "ParameterError",
        r"""
max_solutions=0 => max_solutions: {OUT_OF_RANGE:0}; {IT_MUST_BE:{WHOLE:1}}
max_solutions=1.5 => max_solutions: {OUT_OF_RANGE:1.5}; {IT_MUST_BE:{WHOLE:1}}
time_limit=0 => time_limit: {OUT_OF_RANGE:0}; {IT_MUST_BE:{OF_SECONDS}}
""",
        "solutions(Problem([[1]], [1]), {})",
    ),
    *calls(
        "ProblemError",
        r"""
coupled => M: {DEPENDENT:600}; {UP_TO_500}
csr_array(coupled) => M: {DEPENDENT:600}; {UP_TO_500}
""",
        "solutions(Problem({}, -np.ones(700)))",
    ),
    *calls(
        "ProblemError",
        r"""
"" => objective: {NAMES:''}; {USE_NAMES:1}
"z1 +"
    => objective: {IN_PLACE_OF:'+'|a term}; {WRITE_A_SUM}
"z1 z2"
    => objective: {IN_PLACE_OF:'z2'|a term}; {WRITE_A_SUM}
"3"
    => objective: {IN_PLACE_OF:'3'|a term}; {WRITE_A_SUM}
"z1 + 3"
    => objective: {IN_PLACE_OF:'+ 3'|a term}; {WRITE_A_SUM}
"z1 * z2"
    => objective: {IN_PLACE_OF:'* z2'|a term}; {WRITE_A_SUM}
"2 +"
    => objective: {IN_PLACE_OF:'2 +'|a term}; {WRITE_A_SUM}
""",
        "optimum(Problem([[1]], [1]), {})",
    ),
]


@pytest.mark.parametrize("refusal", REFUSALS, ids=str)
def test_a_search_that_has_no_answer_is_refused(refusal):
    assert raised(refusal.command, NAMES) == refusal.line
