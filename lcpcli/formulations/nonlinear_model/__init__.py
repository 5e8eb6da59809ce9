"""Models of AMPL: .nl files, nonlinear or not, as complementarity problems or programs,
their solutions in .sol files, and lcp in the place of a solver that AMPL calls."""
