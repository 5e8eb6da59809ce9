"""Checks, before any problem is solved, that all have the requested pictures, and that a page has room for them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lcpcli.cli.request import Request


def require(request: Request, problems: Sequence[Any]) -> None:
    """Refuse more problems than a picture has room for, and problems without a picture of paths."""
    if request.paths is not None:
        from lcpcli.report import paths

        paths.require(problems)
    if request.plot is not None:
        from lcpcli.report import plotting

        plotting.require_room(len(problems))
