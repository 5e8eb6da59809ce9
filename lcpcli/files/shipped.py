"""The problems shipped with the program: beside the package in a checkout, inside it once installed."""

from __future__ import annotations

import os
from pathlib import Path

PAPER_EXAMPLES = ("paper-example-1.json", "paper-example-2.json")
FOLDERS = (".", "programs", "games")


def path(name: str) -> str:
    """The path of a shipped problem's file."""
    package = Path(__file__).parent.parent
    installed = package / "problems" / name
    return str(installed if installed.exists() else package.parent / "problems" / name)


def problems() -> dict[str, Path]:
    """The files of the shipped problems, by the names under which every command reads them."""
    files = (file for folder in FOLDERS for file in sorted(Path(path(folder)).glob("*")))
    return {file.stem: file for file in files if file.suffix in (".json", ".nfg")}


def file_of(name: str) -> Path | None:
    """The file of the shipped problem with this name, which may have the file's suffix; None if there is none, or if a
    file of the user has that name."""
    file = None if os.path.lexists(name) else problems().get(Path(name).stem)
    return file if file is not None and name in (file.stem, file.name) else None
