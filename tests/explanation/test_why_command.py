"""lcp why: what it says, in the names of the input and as JSON, its exit codes, and
what is known at a limit and after Ctrl-C."""

import json
import signal

import numpy as np
import pytest

import lcpcli
from lcpcli.explanation import conflicts, ranges, repair
from lcpcli.files import writing
from lcpcli.files.input_file import InputFile
from lcpcli.files.inputs import Input

from ..conftest import save_json
from ..refusals import commands

pytestmark = pytest.mark.usefixtures("folder")
INFEASIBLE = {
    "c": [0.6, 1.5, 2],
    "A": [[0.1, 0.2, 0.3], [1, 1, 1], [0, 2.5, 1]],
    "row_lower": [3, None, None],
    "row_upper": [None, 8, 2],
    "rows": ["protein", "weight", "fat"],
    "columns": ["bread", "cheese", "eggs"],
}
UNSOLVABLE = {"M": [[0, 1], [0, 1]], "q": [-1, 0], "names": ["pump", "valve"]}
SOLVABLE = {"M": [[2, 1], [1, 2]], "q": [-5, -6]}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    own = {"diet": INFEASIBLE, "pipes": UNSOLVABLE, "two": SOLVABLE}
    for name, data in own.items():
        save_json(tmp_path / f"{name}.json", data)
    M = np.array([[0.0, 1.0], [0.0, 0.0]])
    writing.write(lcpcli.Problem(M, [-1.0, -1.0]), "rows.csv")
    return tmp_path


WRONG = commands(
    r"""
why diet.json --keep oil
    => --keep: 'oil' names nothing in this problem; write a name, or a name and what it
    is, as in 'bread lower bound'
why diet.json --change 'fat lower side'
    => --change: 'fat lower side' names nothing in this problem; {DID_YOU_MEAN:fat}
why diet.json --weights fat=0 => --weights: {IS:0 for 'fat'}; give a positive number
why diet.json --weights fat => --weights: 'fat' is not NAME=NUMBER; write z1=2
why diet.json --weights fat=much => --weights: {HAS_NO_NUMBER:'much'}; {A_NUMBER}
why diet.json --json => --json: {NO_OPTION:lcp why}; {DID_YOU_MEAN:--format json}
why diet.json --time-limit 0
    => --time-limit: {OUT_OF_RANGE:0.0}; {IT_MUST_BE:seconds > 0}
why diet.json none.csv => none.csv: {NO_SUCH_FILE}; {CHECK_PATH}
""",
    {"diet.json": json.dumps(INFEASIBLE)},
)


@pytest.mark.parametrize("refusal", WRONG, ids=str)
def test_wrong_options_are_told_in_one_line(refusal, refused):
    assert refused(refusal.command, refusal.files) == refusal.line


def test_json_has_all_keys_for_every_outcome(lcp):
    keys = (
        "version file item problem n names status message complete conflict "
        "irreducible fewest near repair repairable z ranges seconds"
    )
    found = {
        name: lcp(f"why {name}.json --format json").record
        for name in ("diet", "pipes", "two")
    }
    assert {" ".join(each) for each in found.values()} == {keys}
    diet, two = found["diet"], found["two"]
    assert (diet["status"], diet["irreducible"]) == ("unsolvable", True)
    assert diet["repair"]["changes"] == [
        {"name": "protein", "what": "lower side", "value": "3", "change": "-9/5"}
    ]
    assert diet["ranges"] is None
    assert two["conflict"] == []
    assert two["repair"] is None
    assert two["ranges"]["q"][0]["lower"] == "-12"
    assert two["ranges"]["q"][0]["leaves_below"] == ["z2"]
    assert two["ranges"]["upper"] == [None, None]
    same = lcpcli.why(lcpcli.read("two.json")).to_dict()
    assert {**same, "seconds": 0, "file": 0} == {**two, "seconds": 0, "file": 0}


def test_decimals_count_as_written(folder, lcp):
    """Three tenths are not more than 0.1 + 0.2, as they are in doubles."""
    data = {"c": [1], "A": [[1], [1]], "row_lower": [0.3, None]}
    save_json(folder / "sum.json", data | {"row_upper": [None, 0.3]})
    assert '"solved"' in lcp("why sum.json --format json").out
    text = '{"M": [[0]], "q": [-0.1]}'
    (folder / "tenth.json").write_text(text)
    assert '"change": "1/10"' in lcp("why tenth.json --format json").out


def test_runs_without_a_solution_end_with_the_hint(folder, lcp):
    for name in ("diet", "rows"):
        file = next(folder.glob(f"{name}.*")).name
        outcome = lcp(f"solve {file}")
        assert outcome.code == 3
        assert f"\ntry lcp why {file}\n" in outcome.out
    (folder / "M.csv").write_text("0,1\n0,0\n")
    (folder / "the q.csv").write_text("-1,-1\n")
    assert "\ntry lcp why M.csv 'the q.csv'\n" in lcp("solve M.csv 'the q.csv'").out
    # Another command cannot read standard input again, or name a line.
    piped, line = InputFile("-"), InputFile("many.jsonl", line=3)
    assert [*Input((piped,)).paths, *Input((line,)).paths] == []
    assert "try" not in lcp("solve two.json").out
    assert lcpcli.run(lcpcli.read("rows.csv")).advice == "try lcpcli.why(problem)"


def test_what_is_proved_of_a_program_comes_before_the_proof_in_z(lcp):
    lines = lcp("solve diet.json").out.splitlines()
    assert lines[1] == "the program is infeasible: no x satisfies its constraints"
    assert lines[2].startswith("excluded within the bounds by its rows times (protein ")
    (of_z,) = (line for line in lines if "has no solution" in line)
    assert of_z.startswith("the problem in z has no solution: no z ")
    assert lines.index(of_z) < lines.index("try lcp why diet.json")


def test_a_kept_condition_is_not_blamed_but_its_numbers_may_change(lcp):
    keep = [word for name in ("protein", "weight") for word in ("--keep", name)]
    _, said, *_ = lcp("why", "diet.json", *keep).out.splitlines()
    blamed, _, change = said.partition("the cheapest change: ")
    assert not {"protein", "weight"} & {*blamed.replace(";", "").split()}
    assert change == "decrease the lower bound of row protein by 1.8"
    _, said, *_ = lcp("why", "diet.json", *keep, "--change", "fat").out.splitlines()
    assert not {"protein", "weight"} & {*said.replace(";", "").split()}


def _raising(number):
    """A function that gets a signal."""

    def run(*_):
        signal.raise_signal(number)
        lcpcli.interrupts.raise_if_timed_out()
        pytest.fail("nothing ended the search")

    return run


@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)]
)
def test_an_interrupt_shows_what_is_known(number, code, lcp):
    def shown(name):
        outcome = lcp(f"why {name} --format json")
        assert outcome.code == code
        assert outcome.err == ""
        found = outcome.record
        assert found["complete"] is False
        return found

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(repair.Repairs, "run", _raising(number))
        found = shown("diet.json")
    assert found["irreducible"] is True
    assert len(found["conflict"]) == 4
    assert found["status"] == "unsolvable"
    assert found["repair"] is None
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(ranges.Position, "farthest", _raising(number))
        patch.setattr(ranges.Position, "is_simple", lambda *_: False)
        found = shown("two.json")
    assert found["status"] == "solved"
    assert found["z"] == ["4/3", "7/3"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(conflicts.Finder, "contradict", _raising(number))
        found = shown("diet.json")
    assert found["status"] == "interrupted"
    assert found["conflict"] == []


def test_at_the_time_limit_nothing_else_is_said(lcp):
    problem = lcpcli.read("pipes.json")
    whole = lcpcli.why(problem)
    assert whole.complete
    late = lcpcli.why(problem, time_limit=1e-9)
    assert late.status == "time_limit"
    assert not late.complete
    assert late.conflict == ()
    assert late.message == "time limit: neither a conflict nor a solution is known"
    outcome = lcp("why pipes.json --time-limit 1e-9")
    assert outcome.code == 1
    assert "time limit: neither" in outcome.out


def test_a_conflict_that_is_not_reduced_is_told_as_such(monkeypatch, lcp):
    def late(*_):
        raise lcpcli.interrupts.TimeIsUp

    monkeypatch.setattr(conflicts.Finder, "_reduce", late)
    outcome = lcp("why pipes.json")
    assert outcome.code == 1
    assert "it is not proved that all of them are necessary" in outcome.out
    assert "the cheapest change" in outcome.out


def test_every_format_has_the_conflict(lcp):
    for form in ("table", "markdown", "latex", "html", "json", "csv"):
        out = lcp(f"why diet.json --format {form}").out
        assert "protein" in out
    outcome = lcp("why diet.json -o diet.html")
    assert outcome.out == ""
    assert outcome.err.startswith("lcp: diet.json: these 4 conditions cannot hold")
    assert lcp("why diet.json --quiet").out == ""


def test_a_solution_beyond_the_range_of_doubles_has_ranges(lcp, folder):
    """z = 1e400 is at no upper bound, although it is rounded to infinity."""
    problem = {"M": [["1e-400", 0], [0, 1]], "q": [-1, -1], "upper": [None, 5]}
    save_json(folder / "tiny.json", problem)
    told = lcp("why tiny.json -f json").record
    first, second = told["ranges"]["q"]
    assert first["lower"] is None
    assert first["upper"] == "0"
    assert second["lower"] == "-5"
    assert second["upper"] == "0"


@pytest.mark.parametrize("M", ["-1e-200", "-1e-320"])
def test_conditions_whose_quotients_overflow_are_proved_to_contradict_each_other(
    M, folder, lcp
):
    (folder / "p.json").write_text(f'{{"M": [[{M}]], "q": [-1e200]}}')
    outcome = lcp("why p.json")
    assert outcome.err == ""
    assert "these 2 conditions cannot hold together: z1 (lower bound)" in outcome.out
