"""The words of Gambit's files, https://www.gambit-project.org."""

from __future__ import annotations

import re

# A text, a brace, a word, or an open quote.
TOKEN = re.compile(r'"(?:\\.|[^"\\])*"|[{}]|[^\s,{}"]+|"', re.DOTALL)
