"""Diagnosis of a problem without solving it: the classes of M, its difficulty, and the
methods guaranteed to work."""
