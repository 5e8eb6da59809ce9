"""Exact arithmetic: rational numbers and their texts, elimination, linear systems, complementary bases."""
