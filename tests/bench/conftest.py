"""The fixtures of the commands that repeat few runs and compare sessions."""

from ..cli.conftest import few_repetitions as few_repetitions
from ..cli.conftest import session as session
from ..cli.conftest import still as still
