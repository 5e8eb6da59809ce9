"""Other problems reduced to LCPs: the data needed to map a solution back, one module per kind."""
