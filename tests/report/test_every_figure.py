"""Every figure: no text lies on another or leaves the page, and its files are whole, tell what made them, always the
same."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

import lcpcli
from lcpcli import Problem
from lcpcli.parametric.path import Path as Solutions
from lcpcli.report import plotting
from lcpcli.report.figures import cones_figure, paths_figure, run_figures, style
from lcpcli.report.figures.data import Cones, Panel
from lcpcli.report.pictures import response

from . import test_path_figures as paths
from . import test_solution_figures as cones
from .drawn_texts import assert_no_text_is_on_another_or_leaves
from .figure_samples import bench, convergence, crowd, decaying, growth, odd, paper_panel, profiles, strange
from .path_samples import cornered, entering, frontier, small

NOTHING_MEASURED = Panel("p", "residual", [odd("shi", [None, None])])
RUNS: dict[str, Callable[[], Figure]] = {
    **{f"crowd {n}": lambda n=n: convergence(crowd(n)) for n in (1, 2, 6, 11)},
    **{f"bench {n}": lambda n=n: bench(profiles(n), [crowd(n), crowd(1)], [growth(n)]) for n in (1, 2, 6, 11)},
    "paper": lambda: convergence(paper_panel()),
    "7 panels": lambda: convergence(*(crowd(1 + i) for i in range(6)), paper_panel()),
    "profile alone": lambda: bench(profiles(4)),
    "growth alone": lambda: bench([], [], [growth(11), growth(2)]),
    "nothing measured": lambda: convergence(NOTHING_MEASURED),
    "no curves": lambda: convergence(Panel("p", "error", [])),
    "strange texts": lambda: convergence(Panel("$a$ \u4e2d _{ " * 30, "error", [strange()])),
}
CONES = [([[2, 1], [1, 2]], (-5, -6)), (cones.MURTY, (-1, -1)), ([[-1, 2], [2, -1]], (1, 0))]
CONES += [([[-1, 0], [0, -1]], (1, 1)), ([[1, 1], [1, 1.001]], (-1, -1.0005)), ([[-1, -2], [0.2, -3]], (4, 0))]
CONES += [([[-1, -1], [0, 0]], (1, 0))]
CONES += [(M, ((0, 0), (0, 1), (-1, -1))[k % 3]) for k, (M, _) in enumerate(cones.DEGENERATE.values())]
FOUR = (*paths.METHODS, "newton", "lemke")
FAR = Problem([[-1, 3], [2, -1]], [-400, -3e4], x0=[1e4, -1])
PATHS: dict[str, tuple[list[Problem], tuple[str, ...]]] = {
    "one": ([paths.TWO], paths.METHODS),
    "four methods": ([paths.SKEW], FOUR),
    "three problems": ([paths.TWO, paths.SKEW, FAR], paths.METHODS),
    "all zero": ([Problem([[0, 0], [0, 0]], [0, 0])], paths.METHODS),
    "huge": ([Problem([[1e200, 0], [0, 1]], [-1e300, -1])], paths.METHODS),
}
ENDS = [Problem(np.eye(2), q, names=["$x_{", "long " * 60], name="$a$ " * 50) for q in ([1, 1], [1, -1])]
RESPONSES: dict[str, Callable[[], Solutions]] = {
    "small": small,
    "cornered": cornered,
    "frontier": frontier,
    "12 lines": lambda: entering(12),
    "many": lambda: entering(80),
    "point": lambda: lcpcli.path(Problem([[-1]], [0]), Problem([[-1]], [-1])),
    "nothing": lambda: lcpcli.path(Problem([[-1]], [-2]), Problem([[-1]], [2])),
    "strange names": lambda: lcpcli.path(*ENDS),
}


@pytest.mark.slow("draws many large figures")
@pytest.mark.parametrize("name", RUNS)
def test_texts_of_runs_are_apart(name: str) -> None:
    assert_no_text_is_on_another_or_leaves(RUNS[name]())


@pytest.mark.slow("draws many figures")
@pytest.mark.parametrize(("M", "q"), CONES)
def test_texts_of_cones_are_apart(M: list[list[float]], q: tuple[float, float]) -> None:
    with style.context():
        figure = cones_figure.draw(cones.picture(M, q, names=("price of $x", "y " * 60)))
    assert_no_text_is_on_another_or_leaves(figure)


@pytest.mark.slow("draws large figures")
@pytest.mark.parametrize("name", PATHS)
def test_texts_of_paths_of_iterates_are_apart(name: str) -> None:
    problems, methods = PATHS[name]
    with style.context():
        figure = paths_figure.draw([paths.data(problem, methods) for problem in problems])
    assert_no_text_is_on_another_or_leaves(figure)


@pytest.mark.parametrize("name", RESPONSES)
def test_texts_of_paths_of_solutions_are_apart(name: str) -> None:
    with style.context():
        figure = run_figures.draw(response(RESPONSES[name]()))
    assert_no_text_is_on_another_or_leaves(figure)


def test_a_long_title_and_count_of_cones_are_cut_and_nothing_in_them_is_parsed() -> None:
    long = Cones("$\\alpha_ " * 30, cones.MURTY, (-1, -1), [False] * 4, "at least $3 " * 20)
    with style.context():
        figure = cones_figure.draw(long)
        title, count = (text.get_window_extent() for text in figure.texts[:2])
    assert figure.bbox.x0 <= title.x0 < title.x1 < count.x0 < count.x1 <= figure.bbox.x1


MADE_BY = "lcp solve murty.json (exact)"
FILES: dict[str, Callable[[str], bytes]] = {
    "convergence": lambda form: plotting.convergence([Panel("p", "error", [decaying("shi")], MADE_BY)], form),
    "bench": lambda form: plotting.bench(profiles(3), [crowd(2)], [growth(3)], form),
    "cones": lambda form: plotting.cones(cones.picture(cones.MURTY, (-1, -1), provenance=[MADE_BY]), form),
    "paths": lambda form: plotting.paths([paths.data(paths.TWO)], form),
    "response": lambda form: plotting.response(response(frontier()), form),
}
BEGINNING = {"png": b"\x89PNG\r\n\x1a\n", "svg": b"<?xml", "pdf": b"%PDF-1."}
END = {"png": b"IEND\xaeB`\x82", "svg": b"</svg>", "pdf": b"%%EOF"}


SLOWLY = [pytest.param(kind, marks=pytest.mark.slow("draws figures twice")) for kind in FILES if kind != "cones"]


@pytest.mark.parametrize("form", plotting.FORMS)
@pytest.mark.parametrize("kind", ["cones", *SLOWLY])
def test_a_file_is_whole_tells_what_made_it_and_is_always_the_same(kind: str, form: str) -> None:
    first, second = FILES[kind](form), FILES[kind](form)
    assert first == second
    assert first.startswith(BEGINNING[form])
    assert first.rstrip().endswith(END[form])
    assert not [word for word in (b"CreationDate", b"dc:date", b"<text") if word in first], "texts are curves"
    assert kind not in ("convergence", "cones") or MADE_BY.encode() in first.replace(b"\\", b"")


def test_a_picture_of_a_path_is_saved_as_often_as_one_likes(tmp_path: Any) -> None:
    picture = small().plot(tmp_path / "path.svg")
    assert repr(picture) == "<Picture: path of 4 breakpoints>"
    assert picture._repr_svg_() == (tmp_path / "path.svg").read_text()
    picture.save(tmp_path / "path.pdf")
    assert (tmp_path / "path.pdf").read_bytes().startswith(BEGINNING["pdf"])
    assert sorted(file.name for file in tmp_path.iterdir()) == ["path.pdf", "path.svg"]
