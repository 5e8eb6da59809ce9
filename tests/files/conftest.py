"""The fixtures of the commands that compare sessions, and an empty folder, entered."""

from pathlib import Path

import pytest

from ..cli.conftest import session as session
from ..cli.conftest import still as still


@pytest.fixture
def in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path
