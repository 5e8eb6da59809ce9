"""Models of AMPL: .nl files, nonlinear or not, read as complementarity problems or
programs; their solutions in .sol files; and lcp as a solver that AMPL calls.
"""
