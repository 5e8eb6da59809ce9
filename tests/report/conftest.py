"""The fixtures of the commands that repeat few runs and compare sessions."""

from ..cli.conftest import few_repetitions as few_repetitions
