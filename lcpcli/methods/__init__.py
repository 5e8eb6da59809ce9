"""The published methods, one a module, and `auto`. `registry` declares them with their options."""
