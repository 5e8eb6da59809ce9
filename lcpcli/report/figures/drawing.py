"""Figures: pure functions from data to the bytes of a picture (matplotlib) or to text for a terminal (plotext).

Nothing is read or written here, and neither package is imported before a figure is asked for. Each function raises
OptionError where its package is missing. The form of a picture is one of FORMS.

The performance profile is that of E. D. Dolan and J. J. Moré, Benchmarking optimization software with performance
profiles, Math. Program. 91 (2002) 201-213. Complementary cones are those of K. G. Murty, On the number of solutions to
the complementarity problem and spanning properties of complementary cones, Linear Algebra Appl. 5 (1972) 65-108.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import PurePath

from lcpcli.errors import ParameterError
from lcpcli.report.figures.data import Cones, GrowthPanel, Panel, Profile

FORMS = ("png", "svg", "pdf")
MOST_PANELS = 7  # rows of axes on a page
PLOT = "plot"


def convergence(panels: Sequence[Panel], form: str) -> bytes:
    """A picture with one row a panel: the error against the run time and against the iteration."""
    require()
    require_room(len(panels))
    from lcpcli.report.figures import convergence_figure, style

    with style.context():
        told = [f"{panel.title}: {panel.provenance}" for panel in panels]
        return style.save(convergence_figure.draw(panels), form, "Error against run time and iteration", told)


def bench(
    profiles: Sequence[Profile],
    panels: Sequence[Panel],
    growth_panels: Sequence[GrowthPanel],
    form: str,
    provenance: Sequence[str] = (),
) -> bytes:
    """A picture of a benchmark: the performance profile, error against run time, and the growth of time over n.

    Each of the three may be empty and is then left out, but not all. provenance : lines on what was measured, and how,
    for the file's metadata.
    """
    require()
    from lcpcli.report.figures import bench_figure, style

    with style.context():
        return style.save(bench_figure.draw(profiles, panels, growth_panels), form, "Benchmark", provenance)


def cones(picture: Cones, form: str) -> bytes:
    """A picture of the complementary cones of an LCP with two unknowns, and of q, in whose cones the solutions are."""
    require()
    from lcpcli.report.figures import cones_figure, style

    with style.context():
        return style.save(cones_figure.draw(picture), form, "Complementary cones", picture.provenance)


def terminal(panels: Sequence[Panel], width: int, height: int, color: bool) -> str:
    """The error against the run time of each panel as text, `width` columns wide and `height` lines high a panel."""
    require("plotext")
    from lcpcli.report.figures import terminal_figure

    return terminal_figure.render(panels, width, height, color)


def form_of(path: str) -> str:
    """The form of the picture that a path's ending names."""
    ending = PurePath(path).suffix.lower().lstrip(".")
    if ending not in FORMS:
        endings = ", ".join(f".{form}" for form in FORMS)
        raise ParameterError(PLOT, f"{path!r} does not tell the form of the picture", f"end it in one of {endings}")
    return ending


def require_room(panels: int) -> None:
    """Refuse more panels than fit on a page of A4."""
    if panels > MOST_PANELS:
        fault = f"would draw {panels} problems, and a page has room for {MOST_PANELS}"
        raise ParameterError(PLOT, fault, "plot fewer at a time")


def require(package: str = "matplotlib") -> None:
    """Refuse before any work is done if the package that draws is missing: matplotlib, or plotext for a terminal."""
    if find_spec(package) is None:
        raise ParameterError(PLOT, f"needs {package}", "pip install 'linear-complementarity[plot]'")
