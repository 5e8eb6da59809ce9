"""The fixtures of the commands that compare sessions."""
