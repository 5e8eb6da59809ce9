"""The programs that ship have the optimal values of their sources, and the suite of programs measures them."""

from __future__ import annotations

from pathlib import Path

import pytest

from lcpcli import read, run
from lcpcli.bench import suites
from lcpcli.files import contents
from lcpcli.solving.answer import Minimum

FOLDER = Path(contents.shipped_path("programs/portfolio.json")).parent
OPTIMA = {  # Hock and Schittkowski 1981, Dantzig 1963, Klee and Minty 1972; of the portfolio, computed in fractions
    "hs21": -99.96,
    "hs35": 1 / 9,
    "hs53": 176 / 43,
    "hs76": -4.681818181818182,
    "klee-minty": 1e8,
    "portfolio": 1091 / 99_200,
    "transport": 153.675,
}


def test_these_programs_ship_and_are_measured() -> None:
    names = sorted(path.stem for path in FOLDER.glob("*.json"))
    assert names == sorted(OPTIMA)
    files = [Path(case.file).stem for case in suites.cases_of(["programs"]) if case.file]
    assert files == names


@pytest.mark.parametrize("name", OPTIMA)
def test_each_has_a_source_and_the_optimal_value_that_is_known(name: str) -> None:
    problem = read(FOLDER / f"{name}.json")
    answer = run(problem).answer
    assert problem.source
    assert problem.name == name
    assert isinstance(answer, Minimum)
    assert answer.objective == pytest.approx(OPTIMA[name], rel=1e-12)


def test_a_folder_stands_for_its_files() -> None:
    cases = suites.cases_of([str(FOLDER)])
    assert [case.name for case in cases] == [f"{name}.json" for name in sorted(OPTIMA)]
