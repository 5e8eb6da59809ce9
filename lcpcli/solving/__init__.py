"""Runs of a method on a problem: the common loop, its limits and clock, the result, and
the conclusions from it."""
