"""What cannot be measured and runs that cannot be compared are refused in one line."""

import pytest

from ..refusals import commands

REFUSALS = [
    *commands(
        r"""
bench quik => quik: is neither a suite nor a file; {DID_YOU_MEAN:quick}
bench nothing-like-it
    => nothing-like-it: is neither a suite nor a file; choose one of quick, paper,
    dense, sparse, hard, speed, peers, stiff, extreme, all,
    or name a file
bench nonlinear
    => nonlinear: is neither a suite nor a file; name files of models in .nl
bench missing.json => missing.json: {NO_SUCH_FILE}; {CHECK_PATH}
bench -
    => standard input: cannot be read again for a resumed bench; {NAME_A_FILE}
bench --peer quantecom => --peer: {UNKNOWN:'quantecom'}; {DID_YOU_MEAN:quantecon}
bench --method newtom => --method: {UNKNOWN:'newtom'}; {DID_YOU_MEAN:newton}
bench --time-limit 0 => --time-limit: {OUT_OF_RANGE:0.0}; {IT_MUST_BE:seconds > 0}
bench --time-limit inf
    => --time-limit: is infinite; give a number of seconds, the time counted for a
    failure
bench --accept 2 => --accept: {OUT_OF_RANGE:2.0}; {IT_MUST_BE:0 < accept < 1}
bench --budget -1 => --budget: {OUT_OF_RANGE:-1.0}; {IT_MUST_BE:seconds >= 0}
bench --tol nan => --tol: {OUT_OF_RANGE:nan}; {IT_MUST_BE:0 < tol < 1}
bench -o r.xlsx => r.xlsx: the suffix .xlsx is not a format; {SUFFIXES}
bench -o /nowhere/r.json
    => /nowhere/r.json: there is no folder /nowhere; {CREATE_FIRST}
bench --resume r.json => r.json: {NO_SUCH_FILE}; {CHECK_PATH}
bench --resume r.json quick
    => SUITE: {NO_EFFECT:--resume}, which keeps the options of the bench; {LEAVE_IT_OUT}
bench --resume r.json --method auto
    => --method: {NO_EFFECT:--resume}, which keeps the options of the bench;
    {LEAVE_IT_OUT}
bench --resume r.json --budget 1
    => --budget: {NO_EFFECT:--resume}, which keeps the options of the bench;
    {LEAVE_IT_OUT}
"""
    ),
]


@pytest.mark.parametrize("refusal", REFUSALS, ids=str)
def test_what_cannot_be_measured_or_compared_is_refused(refusal, refused):
    assert refused(refusal.command, refusal.files) == refusal.line
