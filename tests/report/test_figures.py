"""Figures have no text on another one or off the page, whole and small files, and looks
that are told apart."""

import math
import subprocess
import sys
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("matplotlib")

from matplotlib.figure import Figure

import lcpcli
from lcpcli import Problem
from lcpcli.errors import OptionError
from lcpcli.files import contents
from lcpcli.report import plotting
from lcpcli.report import plotting as figures
from lcpcli.report.figures import plane_figures, run_figures, style
from lcpcli.report.figures.style import grid_positions_of
from lcpcli.report.plotting import Curve, Panel

from .figure_samples import (
    DEGENERATE,
    MURTY,
    SKEW,
    TWO,
    TWO_METHODS,
    assert_no_text_is_on_another_or_leaves,
    bench,
    convergence,
    crowd,
    data,
    decaying,
    drawn,
    grid_panel,
    odd,
    paper_panel,
    picture,
    profiles,
    strange,
)
from .path_samples import cornered, entering, frontier, small

EXAMPLE = contents.shipped_path("paper-example-1.json")


def test_long_runs_make_small_files():
    k = list(range(10_000))
    errors = (
        np.exp(-np.arange(10_000) / 700)
        * np.random.default_rng(0).uniform(0.1, 1, 10_000)
    ).tolist()
    panel = Panel("long", "error", [Curve("shi", "shi", k, k, errors, True)])
    assert len(figures.convergence([panel]).content("svg")) < 200_000


@pytest.mark.slow("draws many large figures")
def test_the_figure_of_the_most_problems_fits_on_a_page(lcp, tmp_path):
    figure = convergence(*[crowd(15)] * figures.MAX_PANELS)
    assert figure.get_figwidth() <= 8.27
    assert figure.get_figheight() <= 11.69
    one_more = [EXAMPLE] * (figures.MAX_PANELS + 1)
    outcome = lcp("compare", *one_more, "--plot", str(tmp_path / "figure.svg"))
    assert outcome.code == 2
    assert outcome.out == ""
    assert outcome.err.count("\n") == 1
    assert "8 problems" in outcome.err


def test_long_text_is_cut_on_one_line_and_nothing_in_it_is_parsed():
    cut = style.fitted_text("$\\alpha_1$ \n\u4e2d " + "long " * 60, style.FONT, 2.0)
    assert cut.startswith(r"\$\alpha_1\$ \n? long")
    assert cut.endswith("...")
    with style.context():
        figure = Figure()
        box = figure.text(0, 0, cut, fontsize=style.FONT).get_window_extent()
    assert 1.9 < box.width / figure.dpi < 2.05


def test_the_suffix_determines_the_form_and_another_is_refused():
    assert [figures.form_of(path) for path in ("a.png", "b/c.SVG", "d.e.pdf")] == [
        "png",
        "svg",
        "pdf",
    ]
    for path in ("a", "a.jpg", "png", ".png", "a.png/b"):
        with pytest.raises(OptionError, match=r"^plot: .*\.png, \.svg, \.pdf"):
            figures.form_of(path)


def test_a_missing_package_is_reported_in_one_line(monkeypatch):
    monkeypatch.setattr(figures, "find_spec", lambda _: None)
    for call in (lambda: figures.convergence([]).content("png"), figures.require):
        with pytest.raises(OptionError) as caught:
            call()
        assert str(caught.value) == "plot: needs matplotlib; pip install matplotlib"


def test_neither_reports_nor_the_data_of_figures_load_a_drawing_package():
    code = (
        "import sys, lcpcli.report.plotting as f; f.require(); f.form_of('a.png');"
        "print([m for m in ('matplotlib', 'numpy') if m in sys.modules])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[]"


def test_the_users_settings_neither_change_a_figure_nor_are_changed():
    import matplotlib

    picture = figures.Picture("bench", (profiles(1), []), ())
    usual = picture.content("png")
    with matplotlib.rc_context(
        {"font.size": 20, "axes.grid": True, "text.usetex": True}
    ):
        assert picture.content("png") == usual
        assert matplotlib.rcParams["font.size"] == 20


VALUES = st.one_of(
    st.floats(min_value=0), st.sampled_from([0.0, math.nan, 1.0, 1e-12]), st.none()
)


@given(st.lists(st.lists(VALUES, max_size=8), max_size=4))
def test_no_measured_value_is_lost(series):
    panel = [odd("shi", errors) for errors in series]
    up = run_figures.errors(panel)
    assert 0 < up.low < up.high < math.inf
    for curve in panel:
        across = run_figures.times(curve.seconds)
        points = run_figures.inside(curve.seconds, curve.errors, across, up)
        measured = [
            (x, y)
            for x, y in zip(curve.seconds, curve.errors, strict=True)
            if y is not None
        ]
        assert len(points) == len(measured)
        for (at, height, is_beyond), (x, y) in zip(points, measured, strict=True):
            assert up.low <= height <= up.high
            assert at == x or (x == 0 and at == across.low)
            assert height == y or (is_beyond and height in up)


def test_a_run_without_any_error_stands_far_down():
    up = run_figures.errors([odd("newton", [0.0])])
    assert up.high <= 1e-15


ALL = [*style.METHODS.values(), *style.SPARE]


def lightness(color):
    """L* of a colour (CIE 1976) from its relative luminance."""
    parts = [int(color[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    red, green, blue = [
        c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in parts
    ]
    luminance = 0.2126 * red + 0.7152 * green + 0.0722 * blue
    return (
        116 * luminance ** (1 / 3) - 16 if luminance > 0.008856 else 903.3 * luminance
    )


def test_looks_differ_in_colour_marker_and_grey_and_are_visible_on_white():
    assert (
        len({look.color for look in ALL})
        == len({look.marker for look in ALL})
        == len(ALL)
    )
    grey = sorted(lightness(look.color) for look in style.METHODS.values())
    assert min(b - a for a, b in pairwise(grey)) > 6
    assert max(lightness(look.color) for look in ALL) < 75


def test_looks_are_of_methods_and_peers_and_the_others_take_spare_ones():
    from lcpcli.methods.registry import METHODS as methods
    from lcpcli.peers.registry import PEERS as peers

    assert style.METHODS.keys() <= methods.keys()
    found = style.styles_of([(name, name) for name in (*methods, *peers)])
    assert len({look.marker for look in found.values()}) == len(found)


def test_runs_of_one_method_share_its_colour_and_differ_in_their_markers():
    cold, warm, other = style.styles_of(
        [("shi", "cold"), ("shi", "warm"), ("shi", "cold"), ("other", "other")]
    ).values()
    assert cold == style.METHODS["shi"]
    assert warm.color == cold.color
    assert warm.fill != cold.fill
    assert other in style.SPARE


@pytest.mark.parametrize("name", [*style.METHODS, "path-start"])
def test_runs_of_a_sweep_go_from_light_to_dark_with_markers_of_their_own(name):
    other = "fixed-point" if name != "fixed-point" else "shi"
    found = style.styles_of(
        [(other, other), *((name, f"{name}:p={i}") for i in range(8))]
    )
    grey = [lightness(look.color) for (own, _), look in found.items() if own == name]
    assert min(a - b for a, b in pairwise(grey)) > 6
    assert max(grey) < 75.5
    assert len({look.marker for look in found.values()}) == len(found)


def test_a_grid_of_two_options_is_read_from_the_labels_of_its_runs():
    assert grid_positions_of(
        ["shi:p=1,k-star=5", "shi:p=1,k-star=9", "shi:p=1e4,k-star=5"]
    ) == [(0, 0), (0, 1), (1, 0)]
    switches = [
        "fixed-point:omega=1,scale",
        "fixed-point:omega=2,scale",
        "fixed-point:omega=1,scale=false",
    ]
    assert grid_positions_of(switches) == [(0, 0), (1, 0), (0, 1)]


@pytest.mark.parametrize(
    "labels",
    [
        "shi:p=1 shi:p=2 shi:p=3",
        "shi:p=1,k-star=5 shi:p=1,k-star=9 shi:p=1,k-star=7",
        "shi:p=1,k-star=5 shi:p=1,rho=9 shi:p=2,rho=9",
        "shi:p=1,k-star=5 shi:p=1,k-star=9 shi:p=2,k-star=5 shi",
        "shi:a=1,b=5,c=0 shi:a=1,b=5,c=1 shi:a=2,b=5,c=1",
    ],
)
def test_other_runs_make_no_grid(labels):
    assert grid_positions_of(labels.split()) == [
        (i, i) for i in range(len(labels.split()))
    ]


EIGHT = grid_panel(ks=[str(k) for k in range(1, 9)])
RUNS = {
    **{f"crowd {n}": lambda n=n: convergence(crowd(n)) for n in (1, 6, 11)},
    **{
        f"bench {n}": lambda n=n: bench(profiles(n), [crowd(n), crowd(1)])
        for n in (1, 6, 11)
    },
    "paper": lambda: convergence(paper_panel()),
    "7 panels": lambda: convergence(*(crowd(1 + i) for i in range(6)), paper_panel()),
    "grid and others": lambda: convergence(
        Panel("p", "error", [*crowd(11).curves, *EIGHT.curves[1:]])
    ),
    "strange texts": lambda: convergence(
        Panel("$a$ \u4e2d _{ " * 30, "error", [strange()])
    ),
}
CONES = [
    ([[2, 1], [1, 2]], (-5, -6)),
    (MURTY, (-1, -1)),
    ([[-1, 2], [2, -1]], (1, 0)),
]
CONES += [([[1, 1], [1, 1.001]], (-1, -1.0005)), ([[-1, -2], [0.2, -3]], (4, 0))]
CONES += [
    (M, ((0, 0), (0, 1), (-1, -1))[k % 3]) for k, M in enumerate(DEGENERATE.values())
]
FOUR = (*TWO_METHODS, "newton", "lemke")
FAR = Problem([[-1, 3], [2, -1]], [-400, -3e4], x0=[1e4, -1])
PATHS = {
    "one": ([TWO], TWO_METHODS),
    "four methods": ([SKEW], FOUR),
    "three problems": ([TWO, SKEW, FAR], TWO_METHODS),
    "all zero": ([Problem([[0, 0], [0, 0]], [0, 0])], TWO_METHODS),
    "huge": ([Problem([[1e200, 0], [0, 1]], [-1e300, -1])], TWO_METHODS),
}
ENDS = [
    Problem(np.eye(2), q, names=["$x_{", "long " * 60], name="$a$ " * 50)
    for q in ([1, 1], [1, -1])
]
RESPONSES = {
    "small": small,
    "cornered": cornered,
    "frontier": frontier,
    "12 lines": lambda: entering(12),
    "many": lambda: entering(80),
    "point": lambda: lcpcli.path(Problem([[-1]], [0]), Problem([[-1]], [-1])),
    "nothing": lambda: lcpcli.path(Problem([[-1]], [-2]), Problem([[-1]], [2])),
    "strange names": lambda: lcpcli.path(*ENDS),
}


def long_names(M, q):
    return drawn(plane_figures.draw, picture(M, q, names=("price of $x", "y " * 60)))


def iterates(problems, methods):
    return drawn(
        plane_figures.draw_paths, [data(problem, methods) for problem in problems]
    )


LONG_TITLE = picture(MURTY, (-1, -1), name="$\\alpha_ " * 30)
TEXTS = {
    **RUNS,
    **{
        f"cones {k}": lambda given=given: long_names(*given)
        for k, given in enumerate(CONES)
    },
    "cones with a long title": lambda: drawn(plane_figures.draw, LONG_TITLE),
    **{
        f"iterates {name}": lambda given=given: iterates(*given)
        for name, given in PATHS.items()
    },
    **{
        f"path {name}": lambda make=make: drawn(run_figures.draw, make())
        for name, make in RESPONSES.items()
    },
}
SLOW = [
    pytest.param(name, marks=pytest.mark.slow("many large figures"))
    for name in TEXTS
    if name[:4] != "path"
]


@pytest.mark.parametrize("name", [*SLOW, *(f"path {name}" for name in RESPONSES)])
def test_texts_are_apart(name):
    assert_no_text_is_on_another_or_leaves(TEXTS[name]())


MADE_BY = "lcp solve murty.json (exact)"
FILES = {
    "convergence": lambda form: plotting.convergence(
        [Panel("p", "error", [decaying("shi")], MADE_BY)]
    ).content(form),
    "bench": lambda form: plotting.Picture(
        "bench", (profiles(3), [crowd(2)]), ()
    ).content(form),
    "cones": lambda form: plotting.cones(picture(MURTY, (-1, -1))).content(form),
    "paths": lambda form: plotting.paths([data(TWO)]).content(form),
    "response": lambda form: plotting.plot_path(frontier()).content(form),
}
BEGINNING = {"png": b"\x89PNG\r\n\x1a\n", "svg": b"<?xml", "pdf": b"%PDF-1."}
END = {"png": b"IEND\xaeB`\x82", "svg": b"</svg>", "pdf": b"%%EOF"}
SLOWLY = [
    pytest.param(kind, marks=pytest.mark.slow("draws figures twice"))
    for kind in FILES
    if kind != "cones"
]


@pytest.mark.parametrize("form", plotting.FORMS)
@pytest.mark.parametrize("kind", ["cones", *SLOWLY])
def test_a_file_is_whole_tells_what_made_it_and_is_always_the_same(kind, form):
    first, second = FILES[kind](form), FILES[kind](form)
    assert first == second
    assert first.startswith(BEGINNING[form])
    assert first.rstrip().endswith(END[form])
    assert not [
        word for word in (b"CreationDate", b"dc:date", b"<text") if word in first
    ], "texts are curves"
    assert kind != "convergence" or MADE_BY.encode() in first.replace(b"\\", b"")


def test_a_picture_of_a_path_is_saved_as_often_as_one_likes(tmp_path):
    picture = small().plot(tmp_path / "path.svg")
    assert repr(picture) == "<Picture: path of 4 breakpoints>"
    assert picture._repr_svg_() == (tmp_path / "path.svg").read_text()
    picture.save(tmp_path / "path.pdf")
    assert (tmp_path / "path.pdf").read_bytes().startswith(BEGINNING["pdf"])
    assert sorted(file.name for file in tmp_path.iterdir()) == ["path.pdf", "path.svg"]
