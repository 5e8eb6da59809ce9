"""The published methods, one per module, and `auto`. `registry` declares them with their options."""
