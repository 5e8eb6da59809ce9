"""Data of figures for tests, what a figure shows, and whether its texts, as they are
drawn, lie on one another."""

import math
from itertools import combinations

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.path import Path as Outline
from matplotlib.text import Text
from matplotlib.transforms import Affine2D

import lcpcli
from lcpcli import Problem, Trace, read, run
from lcpcli.enumeration.search import SolutionSet
from lcpcli.files import contents
from lcpcli.report import plotting
from lcpcli.report.figures import plane_figures, run_figures, style
from lcpcli.report.plotting import Curve, Panel, Profile
from lcpcli.solving import driver

METHODS = ("auto", "shi", "fixed-point", "newton", "lemke", "milp")
PEERS = ("piqp", "daqp", "quantecon", "highs", "gambit")


def drawn(draw, *given):
    with style.context():
        return draw(*given)


def convergence(*panels):
    return drawn(run_figures.draw_convergence, list(panels))


def bench(profiles, panels=()):
    return drawn(run_figures.draw_bench, profiles, panels)


def decaying(name, rate=0.5, count=40, label="", solved=True):
    """A run that starts at time 0 with error 10 and gains by a constant factor, faster
    for a smaller rate."""
    k = list(range(count))
    return Curve(
        name,
        label or name,
        k,
        [1e-5 * i / rate for i in k],
        [10 * rate**i for i in k],
        solved,
    )


def crowd(count):
    """As many runs: methods with many iterates, then peers with one; some unsolved."""
    runs = [
        decaying(name, 0.2 + 0.12 * i, 5 + 17 * i, solved=i != 1)
        for i, name in enumerate(METHODS)
    ]
    runs += [
        Curve(name, name, [None], [1e-4 * (i + 1)], [1e-9 * i], i != 2)
        for i, name in enumerate(PEERS)
    ]
    return Panel(f"{count} solvers, n = 100", "error", runs[:count])


def paper_panel():
    """The paper's first example by its two methods, as they really run."""
    problem = read(contents.shipped_path("paper-example-1.json"))
    runs = []
    for method in ("shi", "fixed-point"):
        result = run(
            problem, method, trace=Trace(components=np.array([], int), residuals=False)
        )
        rows = result.trace.rows if result.trace else []
        columns = (
            [row.k for row in rows],
            [row.seconds for row in rows],
            [row.error for row in rows],
        )
        runs.append(Curve(method, method, *columns, result.solved))
    return Panel(problem.name, "error", runs)


def profiles(count):
    names = (METHODS + PEERS)[:count]
    return [
        Profile(n, n, [1 + i * j / 3 for j in range(8)] + [math.inf] * i)
        for i, n in enumerate(names)
    ]


def odd(name, errors):
    return Curve(
        name,
        name,
        list(range(len(errors))),
        [float(i) for i in range(len(errors))],
        errors,
        False,
    )


def strange():
    return Curve(
        "my $\\solver", "_$\\x\n" + "long " * 60, [0, 1], [0.0, 1.0], [1.0, 0.1], True
    )


def grid_panel(ps=("1", "100", "1e4"), ks=("1", "5", "100")):
    """A method with a grid of two options, the last run of which fails, and another
    method."""
    runs = [
        decaying(
            "shi",
            0.2 + 0.1 * i + 0.05 * j,
            15 + 5 * i + 60 * j,
            f"shi:p={p},k-star={k}",
        )
        for i, p in enumerate(ps)
        for j, k in enumerate(ks)
    ]
    runs[-1] = runs[-1]._replace(solved=False)
    return Panel("grid, n = 2", "error", [decaying("fixed-point", 0.4, 20), *runs])


def texts(figure):
    """All texts that are drawn, in their places."""
    FigureCanvasAgg(figure).draw()
    found = list(figure.texts)
    for axes in figure.axes:
        # Also the titles.
        found += [child for child in axes.get_children() if isinstance(child, Text)]
        if axes.axison:
            for axis, (low, high) in (
                (axes.xaxis, axes.get_xlim()),
                (axes.yaxis, axes.get_ylim()),
            ):
                ticks = zip(
                    axis.get_majorticklocs(), axis.get_majorticklabels(), strict=False
                )  # no labels if hidden
                found += [
                    axis.label,
                    axis.offsetText,
                    *(label for at, label in ticks if low <= at <= high),
                ]
    for legend in [
        *figure.legends,
        *filter(None, (axes.get_legend() for axes in figure.axes)),
    ]:
        found += [legend.get_title(), *legend.get_texts()]
    return [text for text in found if text.get_text() and text.get_visible()]


def corners(text):
    """Those of the box around a text, turned as it is."""
    around, angle = text.get_window_extent(), text.get_rotation()
    middle = np.mean(around.get_points(), axis=0)
    text.set_rotation(0)
    flat = text.get_window_extent().size / 2
    text.set_rotation(angle)
    box = flat * np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)])
    return Affine2D().rotate_deg(angle).transform(box) + middle


def assert_no_text_is_on_another_or_leaves(figure):
    with style.context():
        boxes = [(text.get_text(), corners(text)) for text in texts(figure)]
        page = figure.bbox
    for text, box in boxes:
        assert (page.min <= box).all(), text
        assert (box <= page.max).all(), text
    for (text, box), (other_text, other) in combinations(boxes, 2):
        is_on_it = Outline(box).intersects_path(Outline(other), filled=True)
        assert not is_on_it, (text, other_text)


def curves(axes):
    """The points of the lines that are drawn through data, without rules and markers
    alone."""
    return [
        np.array(line.get_xydata(), dtype=float)
        for line in axes.lines
        if line.get_linestyle() == "-" and line.get_transform() == axes.transData
    ]


def marks(axes, label=None):
    """The points with markers, or with the sign that has this label."""
    return [
        (float(x), float(y))
        for line in axes.lines
        if line.get_linestyle() == "None"
        and (line.get_label() == label if label else line.get_label()[0] == "_")
        for x, y in zip(line.get_xdata(), line.get_ydata(), strict=True)
    ]


def named(figure):
    """The texts of the legend below a figure."""
    return [text.get_text() for legend in figure.legends for text in legend.get_texts()]


SKEW = Problem([[1, 3], [-3, 1]], [-4, 3], name="skew", x0=[-2, -1])
TWO = Problem([[2, 1], [1, 2]], [-5, -6], name="two")
TWO_METHODS = ("fixed-point", "shi")


def data(problem, methods=TWO_METHODS, **trace):
    """The iterates x of runs on a problem of two unknowns."""
    runs = [
        driver.run(problem, method, curve=Trace(keeps_x=True, **trace))
        for method in methods
    ]
    (made,) = plotting.panels([runs])
    return made


def plane(problem, solutions, *curves):
    return Panel("", "", curves, "", problem, solutions)


MURTY = [[1, 2], [2, 1]]
DEGENERATE = {
    "opposite columns": [[0, 1], [1, 0]],
    "skew": [[0, -1], [1, 0]],
    "parallel columns": [[1, 1], [1, 1]],
    "parallel up to rounding": [[0.1, 0.3], [0.2, 0.6]],
    "opposite, of M alone": [[1, -1], [1, -1]],
    "zero": [[0, 0], [0, 0]],
    "zero column": [[0, 1], [0, 1]],
    "three of one direction": [[-1, -1], [0, 0]],
    "huge and tiny": [[1e308, 5e-324], [-1e308, 0]],
}


def picture(M, q, **more):
    search = lcpcli.solutions(Problem(M, q, **{"name": "problem", **more}))
    assert len(list(search)) == len(search.pieces)
    return SolutionSet(search, "", 0.0)


def cones(M, q):
    return drawn(plane_figures.draw, picture(M, q))
