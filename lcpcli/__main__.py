"""Entry point of python -m lcpcli, the same as the command lcp."""

from lcpcli.cli.main import main

main()
