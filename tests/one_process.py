"""Commands of lcp one after the other in a fresh process, which starts but once: a program that reads them as lines."""

from __future__ import annotations

BATCH = """
import sys
from lcpcli.cli import main as cli
cli.leave = sys.exit  # it would end the process
for line in sys.stdin:
    sys.argv = ["lcp", *line.split()]
    try:
        cli.main()
    except SystemExit as ending:
        assert not ending.code
    print(end="\\0", flush=True)
"""
