"""Problems, solutions and outputs in files: one module per format, imported on demand, and one line in `formats`."""
