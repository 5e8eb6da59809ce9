"""Methods at work, taken apart: their iterates and how they ended; and scripts in the
place of methods."""

from lcpcli.methods.stages import Finished, Iterate, advance


def through(stage):
    """All iterates of a stage, and how it ended."""
    iterates = []
    while isinstance(step := advance(stage), Iterate):
        iterates.append(step)
    return iterates, step


def scripted(iterates, ending=None):
    """A method that yields these iterates and then ends, by default as one that has
    finished."""
    yield from iterates
    return ending or Finished()
