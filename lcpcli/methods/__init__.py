"""The published methods, one per module. `registry` declares them with their
options."""
