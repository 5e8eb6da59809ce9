"""Which problems have the pictures that are requested, and how many a page has room for, before any is solved."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from lcpcli.cli.terminal import STANDARD
from lcpcli.methods.registry import declared
from lcpcli.methods.variants import labels

if TYPE_CHECKING:
    from lcpcli.cli.request import Request
    from lcpcli.model.problem import Problem


def require(request: Request, problems: Sequence[Problem]) -> None:
    """Refuse more problems than a picture has room for, and problems without a picture of paths."""
    if request.paths is not None:
        from lcpcli.report import paths

        paths.require(problems)
    if request.plot not in (None, STANDARD):
        from lcpcli.report import plotting

        plotting.require_room(len(problems), _maps(request))


def _maps(request: Request) -> int:
    """Return how many methods run with a grid of options, for which the picture has heat maps."""
    from lcpcli.report.figures.grids import grids

    entries = []
    for variant, label in zip(request.variants, labels(request.variants), strict=True):
        entries.append((variant.method, label))
        if request.warm is not None and declared(variant.method).uses_start:
            entries.append((variant.method, f"{label}, warm"))
    return len(grids(entries))
