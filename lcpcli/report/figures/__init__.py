"""Figures: pure functions from data to the bytes of a picture, by matplotlib."""
