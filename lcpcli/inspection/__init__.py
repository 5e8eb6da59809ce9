"""Diagnosis of a problem without solving it: the classes of M, how difficult it is, which methods are guaranteed."""
