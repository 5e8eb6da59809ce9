"""--show chooses unknowns by their names; bounds are named, and sentences do not speak
of z >= 0 beside them."""

import numpy as np
import pytest

from lcpcli import Problem, plot, run, solve
from lcpcli.errors import OptionError
from lcpcli.report.wording import selected_components

from ..conftest import save_json
from ..wordings import NO_UNKNOWN

NAMES = ["price n0", "price n1", "flow", "", "price *"]
MARKET = {
    "M": [[2, 0, 0], [1, 2, 0], [0, 1, 2]],
    "q": [-2, -3, -3],
    "names": ["price n0", "flow", "price n1"],
}
GAME = {
    "A": [[3, 0], [5, 1]],
    "B": [[3, 5], [0, 1]],
    "rows": ["co", "de"],
    "columns": ["co", "de"],
}


@pytest.fixture(autouse=True)
def _files(in_folder):
    save_json(in_folder / "market.json", MARKET)
    save_json(in_folder / "game.json", GAME)


def test_patterns_choose_unknowns_in_their_order_and_each_once():
    assert (
        selected_components(["x[1]", "x[2]"], ["x[*]"])
        == selected_components(["", ""], ["z*"])
        == [0, 1]
    )
    one = {
        "flow": [2],
        "price n*": [0, 1],
        "price *": [0, 1, 4],
        "*": [0, 1, 2, 4],
        "": [0, 1, 2, 3, 4],
    }
    several = {
        "price n1, price n0": [1, 0],
        "price n?, price n1": [0, 1],
        "z4, z1": [3, 0],
    }
    for patterns, expected in (one | several).items():
        assert (
            selected_components(NAMES, patterns.split(", ") if patterns else [])
            == expected
        ), patterns


@pytest.mark.parametrize("pattern", ["prices", "z6", "z0", "Flow", ""])
def test_a_name_of_none_is_refused(pattern):
    with pytest.raises(OptionError, match=rf"show: {NO_UNKNOWN.format('.*')}; "):
        selected_components(NAMES, [pattern])


MIXED = {
    "M": [[2, 1, 0], [1, 2, 1], [0, 1, 3]],
    "q": [-5, -6, 4],
    "lower": [None, 0, -1],
    "upper": [None, 2, None],
    "name": "mixed",
}
SIZE = "n = 3 (1 free, 1 lower bound, 1 boxed)"


def test_long_basis_is_counted_in_the_table(lcp, tmp_path):
    path = tmp_path / "long.json"
    save_json(
        path,
        {
            "M": np.eye(30).tolist(),
            "q": [-3] * 10 + [0] * 20,
            "lower": -1,
            "upper": 2,
        },
    )
    assert "basis: 20 basic, 10 upper\n" in lcp(f"solve {path}").out
    save_json(path, MIXED)
    assert "basis = (basic, upper, lower)\n" in lcp(f"solve {path}").out


def test_interpreter_and_notebook_show_bounds():
    result = run(Problem(**MIXED))
    assert SIZE in repr(result)
    assert SIZE in result._repr_html_()


def test_runs_on_different_bounds_do_not_share_a_panel():
    pytest.importorskip("matplotlib")
    runs = [solve([[2]], [-5], lower=lower, trace=True) for lower in (0, 0, 1)]
    assert repr(plot(runs)) == "<Picture: 3 runs on 2 problems>"
