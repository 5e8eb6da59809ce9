"""What a problem is, as far as it can be found out without solving it, and which methods must therefore work."""
