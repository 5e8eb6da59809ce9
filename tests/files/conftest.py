"""The fixture of the commands that compares sessions."""

from ..cli.conftest import session as session
from ..cli.conftest import still as still
