"""Which conditions of a problem conflict, what would help, and how far an answer
holds."""
