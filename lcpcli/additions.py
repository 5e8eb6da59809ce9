"""Additions by other packages, by entry points. They are loaded only for names that
this package does not define.
"""

from __future__ import annotations

from functools import cache
from typing import Any

from lcpcli.clock import imports
from lcpcli.errors import LCPError, raised


def addition(group: str, name: str) -> Any:
    """Return the object with this name that another package declares in the group
    lcpcli.GROUP, None if there is none; raise LCPError if it cannot be loaded."""
    # A search for one name among all installed packages takes milliseconds each time.
    if name not in names(group):
        return None
    with imports:
        from importlib.metadata import entry_points

        for point in entry_points(group=f"lcpcli.{group}", name=name):
            try:
                return point.load()
            except Exception as error:
                reason = (
                    f"is {point.value} of another package, which cannot be loaded: "
                    f"{raised(error)}"
                )
                raise LCPError(
                    name,
                    reason,
                    "correct its entry point, or install that package again",
                ) from None
    return None


def package(group: str, name: str) -> str | None:
    """Return the name and the version of the other package that declares a name; None
    if there is none."""
    with imports:
        from importlib.metadata import entry_points
    distributions = (
        point.dist
        for point in entry_points(group=f"lcpcli.{group}", name=name)
        if point.dist is not None
    )
    return next((f"{dist.name} {dist.version}" for dist in distributions), None)


@cache
def names(group: str) -> frozenset[str]:
    """Return the names that other packages declare. A process searches the disk for
    them once.
    """
    with imports:
        from importlib.metadata import entry_points
    return frozenset(point.name for point in entry_points(group=f"lcpcli.{group}"))
