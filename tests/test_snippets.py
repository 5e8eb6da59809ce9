"""The snippets of README.md and of the pages of help pass the strictest checks of types, as a user would write them."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "lcpcli" / "topics").glob("*.md"))]
BLOCK = r"^```python\n(.*?)^```$"


@pytest.mark.slow("a run of mypy over the package")
@pytest.mark.skipif(find_spec("mypy") is None, reason="mypy is not installed")
def test_snippets_pass_mypy_in_its_strict_mode(tmp_path: Path) -> None:
    snippets = {
        f"{page.stem.lower()}_{i}": code
        for page in PAGES
        for i, code in enumerate(re.findall(BLOCK, page.read_text("utf-8"), re.MULTILINE | re.DOTALL))
    }
    assert {"python_0", "many_0"} <= snippets.keys()
    for name, code in snippets.items():
        (tmp_path / f"{name}.py").write_text(code, encoding="utf-8")
    (tmp_path / "mypy.ini").write_text("[mypy]\n[mypy-scipy.*]\nignore_missing_imports = True\nfollow_imports = skip\n")
    command = [sys.executable, "-m", "mypy", "--strict", "--follow-imports=silent", "--config-file", "mypy.ini", "."]
    own = os.environ | {"MYPYPATH": str(ROOT)}  # before an installed package
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False, env=own)
    assert (done.returncode, done.stderr) == (0, ""), done.stdout
