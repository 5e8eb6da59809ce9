"""The fixtures of the commands that compare sessions."""

from ..cli.conftest import session as session
from ..cli.conftest import still as still
