"""What cannot be measured and runs that cannot be compared are refused in one line."""

import pytest

from ..refusals import commands, contents
from .bench_problems import asdict, changed, measured, measurement

NAMES = {
    function.__name__: function for function in (asdict, changed, measured, measurement)
}
RECORDS = contents(
    "r.json",
    r"""
"" => is empty; {NAME_A_RECORD}
"nonsense" => {NO_RECORD:}; {NAME_A_RECORD}
"[" * 10000 => {NO_RECORD:}; {NAME_A_RECORD}
changed(options={"tol"\x3a "small", "time_limit"\x3a 1, "accept"\x3a 1, "budget"\x3a 1})
    => {NO_RECORD: (tol has the wrong type)}; {NAME_A_RECORD}
changed(more=1)
    => {NO_RECORD: (its fields do not fit a record)}; {NAME_A_RECORD}
changed(missing=None) => {NO_RECORD: (missing has the wrong type)}; {NAME_A_RECORD}
changed(versions=dict(numpy=2))
    => {NO_RECORD: (versions has the wrong type)}; {NAME_A_RECORD}
measured(n=0)
    => {NO_RECORD: (a.json, auto: n or seconds are inconsistent)}; {NAME_A_RECORD}
measured(seconds=[])
    => {NO_RECORD: (a.json, auto: n or seconds are inconsistent)}; {NAME_A_RECORD}
measured(seconds=[10**400]) => {NO_RECORD:}; {NAME_A_RECORD}
measured().replace("[1.0]", "[1e999]")
    => {NO_RECORD: (seconds has the wrong type)}; {NAME_A_RECORD}
measured(solver="nobody")
    => {NO_RECORD: (a.json, nobody: it was not requested, or occurs twice)};
    {NAME_A_RECORD}
changed(measurements=2 * [asdict(measurement("a.json", "auto"))])
    => {NO_RECORD: (a.json, auto: it was not requested, or occurs twice)};
    {NAME_A_RECORD}
measured(curve=[[0, 1.0]]) => {NO_RECORD: (curve has the wrong type)}; {NAME_A_RECORD}
measured(parameters=dict(a=[1]))
    => {NO_RECORD: (parameters has the wrong type)}; {NAME_A_RECORD}
measured() + "\\n\\nnonsense\\n"
    => {NO_RECORD: (line 3 is not a measurement)}; {NAME_A_RECORD}
measured() + '\\n{"problem"\x3a "a.json"}'
    => {NO_RECORD: (line 2 is not a measurement)}; {NAME_A_RECORD}
measured() + '\\n{"problem"\x3a \\n'
    => {NO_RECORD: (line 2 is not a measurement)}; {NAME_A_RECORD}
b"\\xff" => {NOT_UTF_8}; {AS_UTF_8}
""",
    made=lambda text: eval(text, NAMES),
    command="bench --resume {}",
)
REFUSALS = [
    *RECORDS,
    *commands(
        r"""
bench quik => quik: is neither a suite nor a file; {DID_YOU_MEAN:quick}
bench nothing-like-it
    => nothing-like-it: is neither a suite nor a file; choose one of quick, paper,
    dense, sparse, hard, speed, peers, stiff, extreme, all,
    or name a file
bench nonlinear
    => nonlinear: is neither a suite nor a file; choose one of quick, paper, dense,
    sparse, hard, speed, peers, stiff, extreme, all, or name a file
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
