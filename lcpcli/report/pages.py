"""Pages of help, from Markdown to a terminal."""

from __future__ import annotations

import re
from io import StringIO

from rich.markdown import Markdown
from rich.theme import Theme

from lcpcli.report.terminal import console_on, trimmed

# In place of colours that need a dark background.
THEME = Theme({"markdown.code": "bold", "markdown.code_block": "none", "markdown.h1": "bold", "markdown.h2": "bold"})


def render(page: str, width: int, color: bool) -> str:
    """The page in that width."""
    out = StringIO()
    console = console_on(out, width, color)
    console.push_theme(THEME)
    console.print(Markdown(page, code_theme="ansi_light", hyperlinks=False))
    return re.sub(r"\n{3,}", "\n\n", trimmed(out))
