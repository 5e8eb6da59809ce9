"""What cannot be shown is refused in one line: unknowns of no such name, and pictures
of problems that have none."""

import pytest

from ..refusals import commands

SHOWN = commands(
    r"""
solve market.json --show flow --format json => --show: {HAS_ALL:json}; {LEAVE_IT_OUT}
solve market.json game.json --show flow
    => --show: chooses the unknowns of one problem only; {OR_COMPARE}
compare market.json --sweep p=1,10 --show flow --format csv
    => --show: has no effect where no unknowns are shown; {LEAVE_IT_OUT}
solve market.json --show flows => --show: {NO_UNKNOWN:'flows'}; {DID_YOU_MEAN:flow}
solve market.json --all --show flows
    => --show: {NO_UNKNOWN:'flows'}; {DID_YOU_MEAN:flow}
compare market.json --show flows => --show: {NO_UNKNOWN:'flows'}; {DID_YOU_MEAN:flow}
path market.json --direction 1,1,1 --to 9 --show flows
    => --show: {NO_UNKNOWN:'flows'}; {DID_YOU_MEAN:flow}
solve program.json --show 'y steel' => --show: {NO_UNKNOWN:'y steel'}; {WRITE_Z:3}
solve program.json --all --show 'y steel'
    => --show: {NO_UNKNOWN:'y steel'}; {WRITE_Z:3}
solve program.json --minimize a --show 'y steel'
    => --show: {NO_UNKNOWN:'y steel'}; {WRITE_Z:3}
path program.json other.json --show 'y steel'
    => --show: {NO_UNKNOWN:'y steel'}; {WRITE_Z:3}
""",
    {
        "market.json": (
            '{"M": [[2, 0, 0], [1, 2, 0], [0, 1, 2]], "q": [-2, -3, -3], '
            '"names": ["price n0", "flow", "price n1"]}'
        ),
        "game.json": '{"A": [[3, 0], [5, 1]], "B": [[3, 5], [0, 1]]}',
        "program.json": (
            '{"Q": [[2, 0], [0, 2]], "c": [-2, -5], "A": [[1, 2]], "row_upper": [3], '
            '"columns": ["a", "b"], "rows": ["wood"]}'
        ),
        "other.json": (
            '{"Q": [[2, 0], [0, 2]], "c": [-2, -6], "A": [[1, 2]], "row_upper": [3], '
            '"columns": ["a", "b"], "rows": ["wood"]}'
        ),
    },
)

PICTURES = commands(
    r"""
solve two.json --paths a.txt => --paths: {NO_PICTURE:'a.txt'}; {PICTURES}
solve two.json --all --plot cones.doc => --plot: {NO_PICTURE:'cones.doc'}; {PICTURES}
path two.json other.json --plot - => --plot: {NO_PICTURE:'-'}; {PICTURES}
solve paper-example-1 --paths a.svg => --paths: {NO_PLANE:4}; {LEAVE_IT_OUT}
solve bound.json --paths a.svg
    => --paths: {NO_PLANE:2 (1 lower bound, 1 boxed)}; {LEAVE_IT_OUT}
solve bimatrix --all --plot cones.svg => --plot: {NO_PLANE:5}; {LEAVE_IT_OUT}
solve line.json --all --plot cones.svg
    => --plot: {NO_PLANE:2 (1 free, 1 lower bound)}; {LEAVE_IT_OUT}
compare empty.json --paths figure.svg => --paths: {NO_PLANE:0}; {LEAVE_IT_OUT}
solve --all empty.json --plot figure.svg => --plot: {NO_PLANE:0}; {LEAVE_IT_OUT}
solve two.json two.json --paths a.svg => --paths: {ONE_PICTURE}; {OR_COMPARE}
solve two.json two.json --plot a.svg => --plot: {ONE_PICTURE}; {OR_COMPARE}
solve two.json --all --paths a.svg => --paths: {OWN_METHOD}; {LEAVE_IT_OUT}
compare two.json two.json two.json two.json two.json two.json two.json --paths a.svg
    => --paths: would draw 7 problems, and a page can hold 6; draw fewer at a time
solve two.json --paths a.svg --plot a.svg
    => --paths: {SAME_FILE:--plot}; {OTHER_FOR_ONE}
""",
    {
        "two.json": '{"M": [[2, 1], [1, 2]], "q": [-5, -6]}',
        "other.json": '{"M": [[2, 1], [1, 2]], "q": [-5, -5]}',
        "bound.json": '{"M": [[2, 1], [1, 2]], "q": [-5, -6], "upper": [1, null]}',
        "line.json": '{"M": [[0, 0], [0, 1]], "q": [0, -0.1], "lower": [null, 0]}',
        "empty.json": '{"M": [], "q": []}',
    },
)
REFUSALS = [*SHOWN, *PICTURES]


@pytest.mark.parametrize("refusal", SHOWN, ids=str)
def test_what_cannot_be_shown_is_refused(refusal, refused):
    assert refused(refusal.command, refusal.files) == refusal.line


@pytest.mark.parametrize("refusal", PICTURES, ids=str)
def test_what_cannot_be_drawn_is_refused(refusal, refused):
    pytest.importorskip("matplotlib")
    assert refused(refusal.command, refusal.files) == refusal.line
