"""The problems shipped with the program: beside the package in a checkout, inside it once installed."""

from __future__ import annotations

from pathlib import Path

PAPER_EXAMPLES = ("paper-example-1.json", "paper-example-2.json")


def path(name: str) -> str:
    """The path of a shipped problem's file."""
    package = Path(__file__).parent.parent
    installed = package / "problems" / name
    return str(installed if installed.exists() else package.parent / "problems" / name)
