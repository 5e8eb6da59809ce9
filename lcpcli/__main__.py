"""python -m lcpcli is the command lcp."""

from lcpcli.cli import main

main()
