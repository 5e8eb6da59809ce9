"""python -m lcpcli is the command lcp."""

from lcpcli.cli.main import main

main()
