"""The exit codes of lcp, with what they mean."""

from __future__ import annotations

INTERRUPTED = 130  # as shells report SIGINT
CLOSED_PIPE = 141  # as shells report SIGPIPE
