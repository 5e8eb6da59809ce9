"""Exact arithmetic: rational numbers as text, elimination, linear systems,
complementary bases."""
