"""Problems, solutions and outputs in files: one module per format, imported on demand,
with one line in `formats`."""
