"""Bounds for the distance of any z from the solution, which hold for the data as floats, rounding included."""
