"""Rigorous bounds on the distance of any z from the solution, for the data as floats, rounding included."""
