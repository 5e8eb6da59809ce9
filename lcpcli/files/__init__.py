"""Problems, answers and outputs in files. One format, one module, imported when it is met, one line in `formats`."""
