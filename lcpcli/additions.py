"""What other packages add, by entry points: asked for only where this package itself does not know a name."""

from __future__ import annotations

from typing import Any


def addition(group: str, name: str) -> Any:
    """The object of that name that another package has in the group lcpcli.GROUP; None if there is none."""
    from importlib.metadata import entry_points

    return next((point.load() for point in entry_points(group=f"lcpcli.{group}", name=name)), None)
