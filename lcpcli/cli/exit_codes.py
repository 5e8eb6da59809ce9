"""Exit codes of lcp."""

from __future__ import annotations

INTERRUPTED = 130  # as shells report SIGINT
CLOSED_PIPE = 141  # as shells report SIGPIPE
