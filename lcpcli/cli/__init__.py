"""The command lcp. Its commands are one a module, imported when they are asked for."""
