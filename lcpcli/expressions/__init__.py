"""Functions that are given as graphs of operations: values, derivatives and enclosures.
It uses no other room."""
