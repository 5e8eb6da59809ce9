"""Entry point of python -m lcpcli, the same as the command lcp."""

from lcpcli.cli.main import main

if __name__ == "__main__":  # processes that it starts import it too
    main()
