"""What is typed in a document prints what the document shows: a document a command and
format, and one for each way in which files are read."""

import pytest

from .documents import FOLDER


@pytest.mark.parametrize("name", sorted(path.stem for path in FOLDER.glob("*.txt")))
def test_commands_print_what_the_document_shows(name, document):
    pytest.importorskip("flint")
    document(name)
