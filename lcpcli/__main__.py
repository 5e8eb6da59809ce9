"""The entry point of python -m lcpcli, which is the command lcp."""

from lcpcli.cli.main import main

if __name__ == "__main__":  # processes that it starts import it too
    main()
