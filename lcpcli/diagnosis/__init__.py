"""Diagnosis of a problem without solving it, and which methods are therefore guaranteed to work."""
