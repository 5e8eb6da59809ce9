"""Figures: pure functions from data to the bytes of a picture (matplotlib) or to text for a terminal (plotext)."""
