"""--show chooses the unknowns of tables, figures and CSV by their names."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import lcpcli
from lcpcli.errors import OptionError
from lcpcli.files import contents
from lcpcli.report import pictures
from lcpcli.report.selection import places

NAMES = ["price n0", "price n1", "flow", "", "price *"]
MARKET = {"M": [[3, 1, 0], [1, 3, 1], [0, 1, 3]], "q": [-4, -5, -4], "names": ["price n0", "flow", "price n1"]}
GAME = {"A": [[3, 0], [5, 1]], "B": [[3, 5], [0, 1]], "rows": ["co", "de"], "columns": ["co", "de"]}

Lcp = Callable[..., Any]


@pytest.fixture(autouse=True)
def _in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("market.json").write_text(json.dumps(MARKET))
    Path("game.json").write_text(json.dumps(GAME))


def test_patterns_choose_unknowns_in_their_order_and_each_once() -> None:
    assert places(["x[1]", "x[2]"], ["x[*]"]) == places(["", ""], ["z*"]) == [0, 1]
    one = {"flow": [2], "price n*": [0, 1], "price *": [0, 1, 4], "*": [0, 1, 2, 4], "": [0, 1, 2, 3, 4]}
    several = {"price n1, price n0": [1, 0], "price n?, price n1": [0, 1], "z4, z1": [3, 0]}
    for patterns, expected in (one | several).items():
        assert places(NAMES, patterns.split(", ") if patterns else []) == expected, patterns


@pytest.mark.parametrize("pattern", ["prices", "z6", "z0", "Flow", ""])
def test_a_name_of_none_is_refused(pattern: str) -> None:
    with pytest.raises(OptionError, match=r"show: '.*' is not the name of an unknown; "):
        places(NAMES, [pattern])


def headings(text: str, first: str) -> list[str]:
    return next(words for line in text.splitlines() if (words := line.split())[:1] == [first])


def test_tables_have_the_chosen_unknowns_alone(lcp: Lcp) -> None:
    for command, first in ((("solve",), "method"), (("solve", "--all"), "piece"), (("compare",), "method")):
        shown = lcp(command[0], "market.json", *command[1:], "--show", "price *").out
        assert headings(shown, first).count("price") == 2
        assert "flow" not in shown
    result = lcp("solve", "market.json", "--show", "flow").out
    assert "z = (flow 1)" in result
    path = lcp("path", "market.json", "--direction", "1,1,1", "--to", "9", "--show", "flow").out
    assert headings(path, "t") == ["t", "change", "flow"]


def test_a_multiplier_is_called_as_its_row_or_with_y_by_every_command(lcp: Lcp) -> None:
    for file, c in (("p.json", [-2, -5]), ("to.json", [-2, -6])):
        own = {"Q": [[2, 0], [0, 2]], "c": c, "A": [[1, 2]], "row_upper": [1], "rows": ["wood"], "columns": ["a", "b"]}
        Path(file).write_text(json.dumps(own))
    for words in ("path p.json to.json", "solve p.json", "solve p.json --all", "solve p.json --minimize a"):
        for name, code in (("y wood", 0), ("wood", 0), ("y steel", 2)):
            outcome = lcp(*words.split(), "--show", name)
            assert (outcome.code, "wood" in outcome.out, " a " in outcome.out.replace("(a ", "")) == (
                code,
                code == 0,
                False,
            ), (words, name)


def test_CSV_has_the_chosen_unknowns_alone(lcp: Lcp) -> None:
    def rows(*arguments: str) -> list[dict[str, str]]:
        lines = lcp(*arguments, "--format", "csv").out.splitlines()
        return list(csv.DictReader(line for line in lines if not line.startswith("#")))

    (answer,) = rows("solve", "market.json", "--show", "flow")
    assert (answer["component"], float(answer["z"]), answer["name"]) == ("2", pytest.approx(1), "flow")
    iterates = rows("solve", "market.json", "--method", "shi", "--trace", "--show", "price n1")
    assert [name for name in iterates[0] if name[0] == "z"] == ["z3"]
    first, second = rows("solve", "market.json", "--all", "--show", "price *")
    assert [(row["component"], row["name"]) for row in (first, second)] == [("1", "price n0"), ("3", "price n1")]
    path = rows("path", "market.json", "--direction", "1,1,1", "--to", "9", "--show", "flow")
    assert list(path[0]) == ["breakpoint", "t", "change", "flow", "w flow"]
    assert float(path[0]["flow"]) == pytest.approx(1)


def test_strategies_of_a_game_are_chosen_by_the_headings_of_the_table(lcp: Lcp) -> None:
    shown = lcp("solve", "game.json", "--all", "--show", "row *").out
    assert "row co  row de  row gets" in shown
    assert "column co" not in shown
    lines = lcp("solve", "game.json", "--all", "--show", "column de", "--format", "csv").out.splitlines()
    assert lines[2:] == ["1,column,2,1.0,1.0,de"]


def test_a_figure_of_a_path_has_the_chosen_lines_alone_and_multipliers_too() -> None:
    first, last = (lcpcli.Problem(MARKET["M"], q, names=MARKET["names"]) for q in (MARKET["q"], [5, 4, 5]))
    response = pictures.response(lcpcli.path(first, last), ["flow"])
    assert response.names == ["flow"]
    assert response.lines[0][0] == pytest.approx(1)
    programs = [lcpcli.from_qp([[2, 0], [0, 2]], [-2, -5], [[1, 2]], row_upper=[b], rows=["steel"]) for b in (1, 4)]
    shown = pictures.response(lcpcli.path(*programs), ["y steel"])
    assert shown.names == ["y steel"]
    assert abs(shown.lines[0][0]) > 0.1


UNKNOWN = "'flows' is not the name of an unknown; did you mean flow?"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ("solve market.json --show flow --format json", "has no effect on json, which has all"),
        ("solve market.json game.json --show flow", "chooses the unknowns of one problem only"),
        ("compare market.json --sweep p=1,10 --show flow --format csv", "has no effect where no unknowns are shown"),
        ("solve market.json --show flows", UNKNOWN),
        ("solve market.json --all --show flows", UNKNOWN),
        ("compare market.json --show flows", UNKNOWN),
        ("path market.json --direction 1,1,1 --to 9 --show flows", UNKNOWN),
    ],
)
def test_show_is_refused_before_a_path_is_followed(
    arguments: str, words: str, lcp: Lcp, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lcpcli.parametric.following.follow", None)
    outcome = lcp(*arguments.split())
    assert (outcome.code, outcome.out, outcome.err.count("\n")) == (2, "", 1)
    assert outcome.err.startswith(f"lcp: --show: {words}")


def test_digits_under_the_pointer_are_those_of_the_components_that_a_page_shows(
    lcp: Lcp, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("lcpcli.report.html_page.find_spec", lambda _: None)  # without a figure
    page = lcp("solve", contents.shipped_path("tridiagonal-100.json"), "--method", "newton", "--format", "html").out
    assert "z100 = 0.0" in page
    assert "z12 = " not in page
    chosen = lcp("solve", "market.json", "--method", "newton", "--format", "html", "--show", "flow").out
    assert "z2 = " in chosen
    assert "z1 = " not in chosen
