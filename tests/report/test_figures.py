"""Figures: valid, deterministic, with every label, no text on another, and no value lost."""

from __future__ import annotations

import math
import subprocess
import sys
import zlib
from collections.abc import Callable
from itertools import combinations
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

from lcpcli.errors import OptionError
from lcpcli.files import contents
from lcpcli.report import plotting as figures
from lcpcli.report.figures import run_figures, style
from lcpcli.report.figures.data import Curve, Growth, GrowthPanel, Panel, Power, Profile

from .figure_samples import METHODS, PEERS, crowd, decaying, growth, odd, paper_panel, profiles, stiffness, strange

EXAMPLE = contents.shipped_path("paper-example-1.json")
MAGIC = {"png": b"\x89PNG\r\n\x1a\n", "svg": b"<?xml", "pdf": b"%PDF-1."}


def texts(figure: Figure) -> list[Text]:
    """All texts that are drawn, in their places."""
    FigureCanvasAgg(figure).draw()
    found: list[Text] = []
    for axes in figure.axes:
        found += [axes._left_title, axes.xaxis.label, axes.yaxis.label, *axes.texts]  # type: ignore[attr-defined]
        for axis, (low, high) in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
            ticks = zip(axis.get_majorticklocs(), axis.get_majorticklabels(), strict=False)  # no labels if hidden
            found += [label for at, label in ticks if low <= at <= high]
    for legend in [*figure.legends, *filter(None, (axes.get_legend() for axes in figure.axes))]:
        found += legend.get_texts()
    return [text for text in found if text.get_text()]


def boxes(figure: Figure) -> list[tuple[str, Any]]:
    return [(text.get_text(), text.get_window_extent()) for text in texts(figure)]


def overlaps(one: Any, other: Any, by: float = 0.3) -> bool:
    apart = one.x1 < other.x0 + by or other.x1 < one.x0 + by or one.y1 < other.y0 + by or other.y1 < one.y0 + by
    return not apart


def drawings() -> dict[str, Any]:
    """Figures by name, as functions that draw them."""
    crowds = {f"crowd {n}": lambda n=n: run_figures.draw_convergence([crowd(n)]) for n in (1, 2, 6, 11)}
    benches = {
        f"bench {n}": lambda n=n: run_figures.draw_bench(profiles(n), [crowd(n), crowd(1)], [growth(n)])
        for n in (1, 2, 6, 11)
    }
    others = {
        "paper": lambda: run_figures.draw_convergence([paper_panel()]),
        "7 panels": lambda: run_figures.draw_convergence([crowd(1 + i) for i in range(6)] + [paper_panel()]),
        "profile alone": lambda: run_figures.draw_bench(profiles(4), [], []),
        "stiffness": lambda: run_figures.draw_bench(profiles(3), [], [growth(2)], stiffness(6)),
        "growth alone": lambda: run_figures.draw_bench([], [], [growth(11), growth(2)]),
        "nothing measured": lambda: run_figures.draw_convergence([Panel("p", "residual", [odd("shi", [None, None])])]),
        "no curves": lambda: run_figures.draw_convergence([Panel("p", "error", [])]),
        "strange texts": lambda: run_figures.draw_convergence([Panel("$a$ \u4e2d _{ " * 30, "error", [strange()])]),
    }
    return crowds | benches | others


@pytest.mark.slow("draws many large figures")
@pytest.mark.parametrize("name", drawings())
def test_no_text_lies_on_another_or_leaves_the_figure(name: str) -> None:
    with style.context():
        figure = drawings()[name]()
        placed = boxes(figure)
        page = figure.bbox
        for text, box in placed:
            assert min(box.x0, box.y0, page.x1 - box.x1, page.y1 - box.y1) >= 0, text
        for (text, box), (other_text, other) in combinations(placed, 2):
            assert not overlaps(box, other), (text, other_text)


@pytest.mark.slow("draws large figures")
@pytest.mark.parametrize("count", [1, 2, 6, 11])
def test_one_legend_below_the_axes_names_every_curve_and_explains_the_signs(count: int) -> None:
    with style.context():
        figure = run_figures.draw_convergence([crowd(count), crowd(count)])
        (legend,) = figure.legends
        named = [text.get_text() for text in texts(figure) if text in legend.get_texts()]
        below = min(axes.xaxis.label.get_window_extent().y0 for axes in figure.axes)
        assert max(text.get_window_extent().y1 for text in legend.get_texts()) < below
    signs = ["0 or beyond the axis"] + ["not solved"] * (count > 1)
    assert named == [*(METHODS + PEERS)[:count], *signs]


def test_figure_is_no_higher_than_its_rows_and_its_legend() -> None:
    with style.context():
        figure = run_figures.draw_convergence([paper_panel()])
        assert figure.get_figheight() < 1.12 * style.ROW


@pytest.mark.slow("draws many large figures")
@pytest.mark.parametrize("form", figures.FORMS)
def test_every_form_is_a_file_of_its_kind_and_always_the_same(form: str) -> None:
    first, second = (figures.convergence([crowd(6)], form) for _ in range(2))
    assert first.startswith(MAGIC[form])
    assert first == second
    if form == "svg":
        assert ElementTree.fromstring(first).tag.endswith("svg")
    if form == "pdf":
        assert first.rstrip().endswith(b"%%EOF")
        assert b"CreationDate" not in first
    if form == "png":
        assert first.endswith(b"IEND\xaeB`\x82")
        assert len(zlib.decompress(_image_data(first))) > 10**6


def _image_data(png: bytes) -> bytes:
    """The compressed pixels: what the IDAT chunks hold."""
    data, at = b"", 8
    while at < len(png):
        size = int.from_bytes(png[at : at + 4], "big")
        if png[at + 4 : at + 8] == b"IDAT":
            data += png[at + 8 : at + 8 + size]
        at += size + 12
    return data


@pytest.mark.slow("draws many large figures")
@pytest.mark.parametrize("form", figures.FORMS)
def test_a_benchmark_is_always_the_same(form: str) -> None:
    first, second = (figures.bench(profiles(3), [crowd(2)], [growth(3)], form) for _ in range(2))
    assert first.startswith(MAGIC[form])
    assert first == second


@pytest.mark.slow("draws large figures")
def test_svg_holds_every_label_and_no_date() -> None:
    text = figures.convergence([crowd(11), paper_panel()], "svg").decode()
    for label in (
        *METHODS,
        *PEERS,
        "paper-example-1",
        "11 solvers, n = 100",
        "iteration",
        "run time (s)",
        "not solved",
    ):
        assert f"<!-- {label} -->" in text
    assert "<text" not in text
    assert "dc:date" not in text


def test_long_runs_make_small_files() -> None:
    random = np.random.default_rng(0)
    k = list(range(10_000))
    errors = (np.exp(-np.arange(10_000) / 700) * random.uniform(0.1, 1, 10_000)).tolist()
    data = figures.convergence([Panel("long", "error", [Curve("shi", "shi", k, k, errors, True)])], "svg")
    assert len(data) < 200_000


def test_a_curve_has_few_markers_and_its_ends_among_them() -> None:
    with style.context():
        figure = run_figures.draw_convergence([Panel("p", "error", [decaying("shi", 0.99, 1000)])])
    for axes in figure.axes:
        markers = [line for line in axes.lines if line.get_marker() == style.METHODS["shi"].marker]
        xs = np.concatenate([line.get_xdata() for line in markers[:1]])
        assert 5 <= xs.size <= run_figures.MOST_MARKERS + 2
        line = next(line for line in axes.lines if line.get_linestyle() != "None")
        assert {xs[0], xs[-1]} == {line.get_xdata()[0], line.get_xdata()[-1]}


def test_lines_are_solid() -> None:
    with style.context():
        figure = run_figures.draw_convergence([crowd(15)])
    drawn = {line.get_linestyle() for axes in figure.axes for line in axes.lines}
    assert drawn <= {"-", "None"}


@pytest.mark.slow("draws many large figures")
def test_figure_of_the_most_problems_fits_on_a_page(lcp: Callable[..., Any], tmp_path: Path) -> None:
    with style.context():
        figure = run_figures.draw_convergence([crowd(15)] * figures.MOST_PANELS)
        FigureCanvasAgg(figure).draw()
    assert figure.get_figwidth() <= 8.27
    assert figure.get_figheight() <= 11.69
    one_more = [EXAMPLE] * (figures.MOST_PANELS + 1)
    outcome = lcp("compare", *one_more, "--plot", str(tmp_path / "figure.svg"))
    assert (outcome.code, outcome.out, outcome.err.count("\n")) == (2, "", 1)
    assert "8 problems" in outcome.err


def test_a_profile_is_the_share_of_problems_within_each_ratio() -> None:
    with style.context():
        figure = run_figures.draw_bench([Profile("shi", "shi", [1.0, 2.0, 2.0, math.inf])], [], [])
    line = figure.axes[0].lines[0]
    assert list(zip(*line.get_data(), strict=True))[:2] == [(1.0, 0.25), (2.0, 0.75)]
    assert line.get_ydata()[-1] == 0.75


def test_growth_draws_the_fit_the_quartiles_and_the_interval_of_the_exponent() -> None:
    fit = Power(2.0, 0.25, 1e-3, 1.0)
    with style.context():
        figure = run_figures.draw_bench(
            [], [], [GrowthPanel("p", [Growth("shi", "shi", [10, 1000], [1.0, 3.0], [1.0, 2.0], [1.0, 4.0], fit)])]
        )
    axes = figure.axes[0]
    assert axes.lines[0].get_ydata() == pytest.approx([0.1, 1000.0])
    assert [text.get_text() for text in axes.get_legend().get_texts()] == [r"$n^{2.00 \pm 0.25}$"]
    assert [part[:, 1].tolist() for part in axes.collections[0].get_segments()] == [[1.0, 1.0], [2.0, 4.0]]


def test_times_of_few_sizes_are_joined_and_no_exponent_is_named() -> None:
    with style.context():
        figure = run_figures.draw_bench(
            [], [], [GrowthPanel("p", [Growth("shi", "shi", [10, 1000], [1.0, 3.0], [1.0, 2.0], [1.0, 4.0], None)])]
        )
    assert figure.axes[0].lines[0].get_ydata() == pytest.approx([1.0, 3.0])
    assert figure.axes[0].get_legend() is None


@pytest.mark.slow("draws large figures")
@pytest.mark.parametrize("count", [1, 6, 11])
def test_exponents_stand_in_the_order_of_the_lines_and_clear_of_them(count: int) -> None:
    with style.context():
        figure = run_figures.draw_bench([], [crowd(1)], [growth(count)])
        FigureCanvasAgg(figure).draw()
        axes = figure.axes[1]
        legend = axes.get_legend()
        right = max(axes.transData.transform(line.get_xydata())[:, 0].max() for line in axes.lines)
        box = legend.get_window_extent()
        assert box.x0 > right
        assert axes.bbox.y0 < box.y0 < box.y1 < axes.bbox.y1
    exponents = sorted((one.fit.exponent for one in growth(count).growths if one.fit), reverse=True)
    assert [text.get_text() for text in legend.get_texts()] == [rf"$n^{{{e:.2f} \pm 0.10}}$" for e in exponents]


def test_long_text_is_cut_on_one_line_and_nothing_in_it_is_parsed() -> None:
    cut = style.fitted("$\\alpha_1$ \n\u4e2d " + "long " * 60, style.FONT, 2.0)
    assert cut.startswith(r"\$\alpha_1\$ \n? long")
    assert cut.endswith("...")
    with style.context():
        figure = Figure()
        box = figure.text(0, 0, cut, fontsize=style.FONT).get_window_extent()
    assert 1.9 < box.width / figure.dpi < 2.05


@pytest.mark.parametrize("path", ["a.png", "b/c.SVG", "d.e.pdf"])
def test_the_ending_determines_the_format(path: str) -> None:
    assert figures.form_of(path) == path.rsplit(".", 1)[1].lower()


@pytest.mark.parametrize("path", ["a", "a.jpg", "png", ".png", "a.png/b"])
def test_another_ending_is_refused_with_the_endings(path: str) -> None:
    with pytest.raises(OptionError, match=r"^plot: .*\.png, \.svg, \.pdf"):
        figures.form_of(path)


def test_a_missing_package_is_reported_in_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(figures, "find_spec", lambda _: None)
    for call in (lambda: figures.convergence([], "png"), lambda: figures.bench([], [], [], "png"), figures.require):
        with pytest.raises(OptionError) as caught:
            call()
        assert str(caught.value) == "plot: needs matplotlib; pip install 'linear-complementarity[plot]'"


def test_neither_reports_nor_the_data_of_figures_load_a_drawing_package() -> None:
    code = (
        "import sys, lcpcli.report.plotting as f; f.require(); f.form_of('a.png');"
        "print([m for m in ('matplotlib', 'numpy') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_the_users_settings_neither_change_a_figure_nor_are_changed() -> None:
    import matplotlib

    usual = figures.convergence([crowd(2)], "png")
    with matplotlib.rc_context({"font.size": 20, "axes.grid": True, "text.usetex": True}):
        assert figures.convergence([crowd(2)], "png") == usual
        assert matplotlib.rcParams["font.size"] == 20
