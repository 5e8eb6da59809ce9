"""Data of figures for tests, a figure as a text, and whether its texts, as they are
drawn, lie on one another."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from itertools import combinations
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure
from matplotlib.patches import Wedge
from matplotlib.path import Path as Outline
from matplotlib.text import Text

import lcpcli
from lcpcli import Problem, Trace, read, run
from lcpcli.files import contents
from lcpcli.model.box import BASIC, LOWER, UPPER
from lcpcli.parametric.path import ENDS, ExactPath, Family, Path
from lcpcli.report.figures import run_figures, style
from lcpcli.report.path_formats import report
from lcpcli.report.plotting import Curve, Growth, Panel, Power, Profile

METHODS = ("auto", "shi", "fixed-point", "newton", "lemke", "milp")
PEERS = ("piqp", "clarabel", "quantecon", "osqp", "daqp")


def convergence(*panels: Panel) -> Figure:
    with style.context():
        return run_figures.draw_convergence(list(panels))


def bench(
    profiles: Sequence[Profile],
    panels: Sequence[Panel] = (),
    *growths: dict[str, list[Growth]],
) -> Figure:
    with style.context():
        return run_figures.draw_bench(
            profiles,
            panels,
            {family: own for each in growths for family, own in each.items()},
        )


def decaying(
    name: str, rate: float = 0.5, count: int = 40, label: str = "", solved: bool = True
) -> Curve:
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


def crowd(count: int) -> Panel:
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


def paper_panel() -> Panel:
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


def profiles(count: int) -> list[Profile]:
    names = (METHODS + PEERS)[:count]
    return [
        Profile(n, n, [1 + i * j / 3 for j in range(8)] + [math.inf] * i)
        for i, n in enumerate(names)
    ]


def growth(count: int, family: str = "random") -> dict[str, list[Growth]]:
    n = [10, 100, 1000, 10000]
    growths = []
    for i, name in enumerate((METHODS + PEERS)[:count]):
        times = [1e-6 * v ** (2 + i / 50) for v in n]
        lower, upper = [0.9 * t for t in times], [1.2 * t for t in times]
        growths.append(
            Growth(
                name, name, n, times, lower, upper, Power(2 + i / 50, 0.1, 1e-6, 1.0)
            )
        )
    return {family: growths}


def odd(name: str, errors: list[float | None]) -> Curve:
    return Curve(
        name,
        name,
        list(range(len(errors))),
        [float(i) for i in range(len(errors))],
        errors,
        False,
    )


def strange() -> Curve:
    return Curve(
        "my $\\solver", "_$\\x\n" + "long " * 60, [0, 1], [0.0, 1.0], [1.0, 0.1], True
    )


def grid_panel(
    ps: Sequence[str] = ("1", "100", "1e4"), ks: Sequence[str] = ("1", "5", "100")
) -> Panel:
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


def texts(figure: Figure) -> list[Text]:
    """All texts that are drawn, in their places."""
    FigureCanvasAgg(figure).draw()
    found = list(figure.texts)
    for axes in figure.axes:
        found += axes.texts
        found += [axes._left_title, axes.title]  # type: ignore[attr-defined]
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


def corners(text: Text) -> np.ndarray:
    """Those of the box around a text, turned as it is."""
    around = text.get_window_extent()
    middle = np.array([(around.x0 + around.x1) / 2, (around.y0 + around.y1) / 2])
    angle = math.radians(text.get_rotation())
    text.set_rotation(0)
    flat = text.get_window_extent()
    text.set_rotation(math.degrees(angle))
    box = (
        np.array([(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)])
        * np.array([flat.width, flat.height])
        / 2
    )
    cos, sin = math.cos(angle), math.sin(angle)
    return box @ [[cos, sin], [-sin, cos]] + middle


def assert_no_text_is_on_another_or_leaves(figure: Figure) -> None:
    with style.context():
        boxes = [(text.get_text(), corners(text)) for text in texts(figure)]
        page = figure.bbox
    for text, box in boxes:
        assert page.x0 <= box[:, 0].min() <= box[:, 0].max() <= page.x1, text
        assert page.y0 <= box[:, 1].min() <= box[:, 1].max() <= page.y1, text
    for (text, box), (other_text, other) in combinations(boxes, 2):
        if (box.min(axis=0) < other.max(axis=0)).all() and (
            other.min(axis=0) < box.max(axis=0)
        ).all():
            assert not Outline(box).intersects_path(Outline(other), filled=True), (
                text,
                other_text,
            )


def points(pairs: Any) -> str:
    """How many points, and the first ones and the last one."""
    pairs = np.asarray(pairs, dtype=float).reshape(-1, 2)
    pairs = np.where(np.abs(pairs) < 1e-12, 0.0, pairs)
    shown = [f"({x:.4g}, {y:.4g})" for x, y in pairs]
    return " ".join(
        shown
        if len(shown) <= 4
        else [*shown[:3], f"... {len(shown)} in all ...", shown[-1]]
    )


def described(figure: Figure) -> str:
    """What a figure shows: of all axes the scales, the texts and the lines, and the
    legends."""
    width, height = figure.get_size_inches()
    lines = [f"{width:.1f} x {height:.1f}"]
    for axes in figure.axes:
        kinds = (
            f"{axes.get_xlabel()!r} {axes.get_xscale()}, {axes.get_ylabel()!r} "
            f"{axes.get_yscale()}"
        )
        lines.append(f"axes {axes.get_title('left')!r}: {kinds}")
        for line in (line for line in axes.lines if len(line.get_xdata())):
            kind = (
                to_hex(line.get_color()),
                line.get_linestyle(),
                f"{line.get_linewidth():g}",
                line.get_marker(),
            )
            filled = (
                f"{to_hex(line.get_markerfacecolor(), True)} {line.get_markersize():g}"
            )
            lines.append(
                f"  line {' '.join(map(str, kind))} {filled}: "
                f"{points(line.get_xydata())}"
            )
        for patch in axes.patches:
            if isinstance(patch, Wedge):
                lines.append(
                    f"  wedge {patch.theta1:.1f} to {patch.theta2:.1f}, "
                    f"{patch.r:.3g}, filled {patch.get_fill()}"
                )
        for each in axes.collections:
            if isinstance(each, LineCollection):
                lines += [f"  segment {points(part)}" for part in each.get_segments()]
        lines += [
            f"  text {text.get_text()!r}" for text in axes.texts if text.get_text()
        ]
        lines += [
            f"  {legend_of(legend)}" for legend in filter(None, [axes.get_legend()])
        ]
    return "\n".join(
        [
            *lines,
            *(f"text {text.get_text()!r}" for text in figure.texts),
            *map(legend_of, figure.legends),
        ]
    )


def legend_of(legend: Any) -> str:
    return (
        f"legend: {[text.get_text() for text in legend.get_texts() if text.get_text()]}"
    )


SMALL = [Problem([[2, 1], [1, 2]], q, name="small") for q in ([1, 1], [-5, -6])]


def small(**others: Any) -> Path:
    """q goes from (1, 1) to (-5, -6): z2 enters at 1/7, and z1 at 1/5."""
    return replace(lcpcli.path(*SMALL), **others)


def small_in_fractions() -> Path:
    t, z = (
        [Fraction(0), Fraction(1, 7), Fraction(1, 5), Fraction(1)],
        [(0, 0), (0, 0), (0, 1), (20, 35)],
    )
    exact = [[Fraction(a, 15 if k == 3 else 5) for a in row] for k, row in enumerate(z)]
    q = [(1 - 6 * s, 1 - 7 * s) for s in t]
    w = [
        [2 * x + y + a, x + 2 * y + b] for (x, y), (a, b) in zip(exact, q, strict=True)
    ]
    return small(exact=ExactPath(t, exact, w))


def entering(n: int) -> Path:
    """As many components, each of which enters at a t of its own."""
    return lcpcli.path(
        Problem(np.eye(n), np.ones(n)), Problem(np.eye(n), -np.arange(1.0, n + 1))
    )


def made(
    family: Family, t: Sequence[float], z: Any, states: Any, end: str = "reached"
) -> Path:
    """A path with these breakpoints, and w as it follows from z."""
    n = family.problem.n
    z = np.array(z, dtype=float).reshape(len(t), n)
    w = np.array(
        [family.at(each).w(own) for each, own in zip(t, z, strict=True)]
    ).reshape(z.shape)
    states = np.array(states).reshape(max(len(t) - 1, 0), n)
    return Path(
        family, np.array(t, dtype=float), z, w, states, end, ENDS[end], True, 1e-3
    )


def cornered() -> Path:
    """0 <= z <= 3 with w = 1 - t: a jump at t = 1 from the upper bound to the lower
    one, and there, as no path does, a turn."""
    first, last = (
        Problem([[0.0]], [q], name="cornered", upper=3.0) for q in (-1.0, 1.0)
    )
    return made(
        Family(first, last, 0.0, 2.0),
        [0, 1, 1, 0],
        [3, 3, 0, 0],
        [UPPER, BASIC, LOWER],
        "turn",
    )


def portfolio(least: float | str, sense: str = "min", **changes: Any) -> Problem:
    """The shipped portfolio with at least this return, and no limit above."""
    with open(
        contents.shipped_path("programs/portfolio.json"), encoding="utf-8"
    ) as file:
        data = json.load(file)
    given = {
        **data,
        "row_lower": [1, least],
        "row_upper": [1, np.inf],
        "sense": sense,
        **changes,
    }
    if sense == "max":
        given["Q"] = -np.array(given["Q"])
    return lcpcli.from_qp(**given)


def frontier(**changes: Any) -> Path:
    """From a return of at least 0.05 to 0.12, which only goes up to 0.1."""
    return lcpcli.path(portfolio(0.05, **changes), portfolio(0.12, **changes))


def written(
    form: str, path: Path, *at: float, files: tuple[str, str] = ("a", "b")
) -> str:
    """A path as a text in a format with all numbers."""
    return report(path, at, files).render(form)
